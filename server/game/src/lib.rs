//! PITA's game: arenas and actors on the engine, and the pipeline that runs them.
//!
//! Owns: the five stages of a tick ([`pipeline`]), arenas and their files ([`arena`], [`arena_file`]), what acts in them
//! ([`actor`], [`step`], [`kinds`], [`part`], [`vehicle`], [`prop`], [`sheep`], [`tornado`], [`driver`], [`combat`]), and the
//! controls that players send ([`controls`]). It may touch the
//! engine, `pita-sim`, and nothing else: no clock, no disk, no network, no randomness. What a tick needs from outside
//! comes in through [`Ports`].
//!
//! Axes: x forward, y up, z to the right; SI units; angles in radians, in arena files in degrees.
//! Everything is ordered by id, slot or place in the file, so that the same file and the same commands give the same
//! world, bit by bit.

pub mod actor;
pub mod arena;
pub mod arena_file;
pub mod assembly;
pub mod breakable;
pub mod combat;
pub mod controls;
pub mod driver;
pub mod free_form;
pub mod kinds;
pub mod part;
pub mod particles;
pub mod pipeline;
pub mod prop;
pub mod rehearsal;
pub mod scene;
pub mod scheduler;
pub mod sheep;
pub mod spawn;
pub mod step;
pub mod tornado;
pub mod vehicle;

pub use actor::{Actor, ActorInfo, Contact, ContactSide, Partner, Response, WhenLost};
pub use arena::{Arena, ArenaEvent, ArenaSettings, Command, Reload, ReloadError, StaticInfo, Supplies};
pub use arena_file::ArenaError;
pub use controls::Controls;
pub use kinds::{ActorKind, ActorKinds, Site};
pub use part::{PartInfo, PartMount};
pub use pipeline::{Ports, Stage};
pub use rehearsal::{BodyState, CarState, Memory, Rehearsal};
pub use spawn::Pose;
pub use step::{Effect, KindLogic, LogicReport, Message, Other, Step};
