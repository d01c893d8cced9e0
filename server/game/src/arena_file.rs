//! Arenas as files: the TOML that a designer writes, read and checked.
//!
//! Owns the grammar and the ranges; building the world from a checked file is [`arena`](crate::arena)'s. Text in, typed
//! numbers out, no disk: the caller reads the file and puts its name before the error.
//!
//! Every key is described, with unit and range, in `configs/arenas/proving-ground.toml`.

mod ai;
mod block;
mod checks;
mod key;
pub(crate) mod material;
mod meshes;
mod parameters;
mod precision;
mod shape;
mod shipped;
mod sleep;
mod solver;
mod tables;
mod warp;

use std::collections::BTreeMap;

use pita_sim::SimError;

pub use ai::{AiFile, DriverFile};
pub use block::Block;
pub use checks::ACTORS_MAX;
pub use key::Key;
pub use material::{MaterialFile, MaterialPairFile, Materials};
pub use parameters::{ParameterFile, extremes, with_parameters};
pub use precision::PrecisionFile;
pub use shape::{Angles, ShapeFile};
pub use shipped::shipped_file;
pub use sleep::SleepFile;
pub use solver::SolverFile;
pub use tables::{ActorFile, ArenaFile, BoundsFile, RouteFile, SpawnFile, SpawnGridFile, StaticFile};
pub use warp::{WarpFile, WarpKeyFile, check_warp, key_frames};

/// Longest arena file, bytes: a bound on what reading it can cost.
pub const FILE_MAX: usize = 1 << 20;

/// Why an arena was refused. The text is for the person who wrote the file and says where to look.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArenaError {
    /// Not TOML, a key that does not exist or is missing, or a value of another type.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What is wrong there.
        message: String,
    },
    /// A value that is not allowed.
    #[error("{key} is {value}, allowed: {allowed}")]
    OutOfRange {
        /// Path of the key.
        key: String,
        /// Its value.
        value: String,
        /// What it may be, with unit.
        allowed: String,
    },
    /// A key of an actor's own that does not exist or is missing, or a value of another type.
    #[error("{key}, of kind {kind}: {message}")]
    Parameters {
        /// Path of the actor's table.
        key: String,
        /// The actor's kind.
        kind: &'static str,
        /// What is wrong there.
        message: String,
    },
    /// The engine refused something that the file's own ranges allow.
    #[error("{key}: {source}")]
    Engine {
        /// Path of the key.
        key: String,
        /// What the engine says.
        source: SimError,
    },
}

impl ArenaFile {
    /// Reads and checks, with the defaults of parameters that are still in the text.
    ///
    /// # Errors
    /// [`ArenaError::Syntax`] and [`ArenaError::OutOfRange`].
    pub fn parse(text: &str) -> Result<Self, ArenaError> {
        let text = with_parameters(text, &BTreeMap::new())?;
        let file: Self = toml::from_str(&text).map_err(|e| syntax_error(&text, &e))?;
        file.check()?;
        Ok(file)
    }
}

fn syntax_error(text: &str, error: &toml::de::Error) -> ArenaError {
    let start = error.span().map_or(0, |span| span.start.min(text.len()));
    let before = text.get(..start).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    ArenaError::Syntax { line, column, message: error.message().trim().to_owned() }
}
