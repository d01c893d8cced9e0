//! PITA's client: connect to a server, drive, and see what happens.
//!
//! A [`Session`] is one player or spectator over a Zenoh connection of its own. It keeps the newest
//! [snapshot](ReceivedSnapshot), the [roster](Roster) of actors and [counts](Statistics) up to date in the background,
//! and interpolates between snapshots on request. [`bots`] are sessions that drive themselves.
//!
//! Owns everything between the wire and a game's own code. It knows the protocol crate, and with the
//! feature `prediction`, which is on by default, the game, to step one's own vehicle. What arrives is
//! untrusted: it is checked, counted where it is of no use, and never takes more than bounded memory.
//!
//! ```no_run
#![doc = include_str!("../examples/drive.rs")]
//! ```

mod bodies;
pub mod bots;
mod builder;
mod cell_inbox;
mod conditioner;
mod datagrams;
mod error;
mod events;
mod inbox;
mod input_clock;
mod interpolation;
mod join;
mod keeper;
mod line;
mod lock;
mod looking;
mod mount;
mod outbox;
#[cfg(feature = "prediction")]
mod prediction;
mod roster;
mod session;
mod shared;
mod snapshot;
mod statistics;
mod tick_clock;
mod tick_ledger;
mod transport;
mod wire;

pub use builder::{ResumeTicket, SessionBuilder};
pub use conditioner::{ConditionerSettings, Conditions, ConditionsError, Freeze};
pub use error::{ClientError, SessionEnd};
pub use events::SessionEvent;
pub use interpolation::{Frame, InterpolationBuffer, InterpolationSettings};
pub use mount::{Pose, part_pose, part_vertices};
pub use roster::Roster;
pub use session::{Session, WorldState};
pub use snapshot::ReceivedSnapshot;
pub use statistics::{Durations, Statistics};

pub use pita_protocol::dof::Slice;
pub use pita_protocol::message::{
    ActorDescription, Controls, Description, Event, InputAck, InputFate, PartDescription, buttons,
};
