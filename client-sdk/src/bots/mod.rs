//! Bots: sessions that drive themselves, many in one process.
//!
//! A bot is a [`Session`](crate::Session), a [`Script`] and a schedule. A [`BotFleet`] owns any number of them and adds
//! up what they count; the load test drives one in its own process, and `pita-bots` is a command line around one.
//! Bots know what the wire tells any client, and nothing of the engine.

pub mod cli;
mod driver;
mod fleet;
mod progress;
mod recovery;
mod report;
pub mod scripts;
mod tally;
mod view;
mod watcher;

pub use fleet::{BotFleet, FleetSettings};
pub use report::Report;
pub use scripts::{Script, ScriptKind};
pub use tally::{BotTally, FleetTally};
pub use view::{Body, View};
