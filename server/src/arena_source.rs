//! Where an arena comes from: compiled in by name, or a file.

use std::path::Path;

use pita_game::{Arena, ArenaError, ArenaSettings};

/// Names and texts of the compiled-in arenas.
pub const BUILT_IN: [(&str, &str); 1] = [("proving-ground", Arena::DEFAULT)];

/// Why there is no arena.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// Neither a name nor a file.
    #[error("arena {source_name:?} is neither built in ({}) nor a readable file: {reason}", names())]
    Unreadable {
        /// What was asked for.
        source_name: String,
        /// Why it is no file.
        reason: std::io::Error,
    },
    /// The file is no arena.
    #[error("{file}: {reason}")]
    Invalid {
        /// The file.
        file: String,
        /// Key, value and allowed range.
        reason: ArenaError,
    },
}

/// Builds the arena called `source`: a built-in name, else a path. Answers its text too.
///
/// # Errors
/// [`SourceError`].
pub fn load(source: &str, settings: &ArenaSettings) -> Result<(Arena, String), SourceError> {
    match BUILT_IN.iter().find(|(name, _)| *name == source) {
        Some((name, text)) => Ok((parse(text, &format!("built-in arena {name}"), settings)?, (*text).to_owned())),
        None => {
            let unreadable = |reason| SourceError::Unreadable { source_name: source.to_owned(), reason };
            let text = std::fs::read_to_string(Path::new(source)).map_err(unreadable)?;
            Ok((parse(&text, source, settings)?, text))
        }
    }
}

/// Builds an arena from `text`; errors call it `file`.
///
/// # Errors
/// [`SourceError::Invalid`].
pub fn parse(text: &str, file: &str, settings: &ArenaSettings) -> Result<Arena, SourceError> {
    Arena::from_toml(text, settings).map_err(|reason| SourceError::Invalid { file: file.to_owned(), reason })
}

fn names() -> String {
    BUILT_IN.map(|(name, _)| name).join(", ")
}
