//! Where an arena comes from: compiled in by name, or a file with what lies beside it.
//!
//! Owns all that reads arenas from the disk: of meshes only those in the folder of the arena's file or below.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use pita_game::arena_file::{self, ArenaFile, FILE_MAX};
use pita_game::{ActorKinds, Arena, ArenaError, ArenaSettings, Reload, ReloadError, Supplies};
use pita_protocol::message::{ArenaSource, SOURCE_FILES_BYTES_MAX, SOURCE_FILES_MAX, SourceFile};
use pita_sim::geometry::FILE_MAX as GEOMETRY_MAX;

use crate::config::steps_per_m_max;
use crate::files;

/// Names and texts of the compiled-in arenas; the first is the default.
pub const BUILT_IN: [(&str, &str); 4] = [
    ("proving-ground", Arena::DEFAULT),
    ("desert-town", include_str!("../../configs/arenas/desert-town.toml")),
    ("sheep-pasture", include_str!("../../configs/arenas/sheep-pasture.toml")),
    ("stress", include_str!("../../configs/arenas/stress.toml")),
];

/// Why there is no arena.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// Neither a name nor a file.
    #[error("arena {source_name:?} is neither built in ({}) nor a readable file: {reason}", names())]
    Unreadable {
        /// What was asked for.
        source_name: String,
        /// Why it is no file.
        reason: io::Error,
    },
    /// The file is no arena.
    #[error("{file}: {reason}")]
    Invalid {
        /// The file.
        file: String,
        /// Key, value and allowed range.
        reason: ArenaError,
    },
    /// The file cannot take the place of what runs.
    #[error("{file}: {reason}")]
    Unchangeable {
        /// The file.
        file: String,
        /// What is wrong with it, or what cannot change.
        reason: ReloadError,
    },
}

/// Text of an arena, and where it is from.
#[derive(Clone, Debug)]
pub struct ArenaText {
    /// What errors call it.
    label: String,
    /// TOML.
    pub text: String,
    /// Where its meshes are; those of what is compiled in are so too.
    folder: Option<PathBuf>,
}

impl ArenaText {
    /// The arena called `source`: a built-in name, else a path; with `given` in place of the defaults of its parameters.
    ///
    /// # Errors
    /// [`SourceError`].
    pub fn find(source: &str, given: &BTreeMap<String, i64>) -> Result<Self, SourceError> {
        let found = match BUILT_IN.iter().find(|(name, _)| *name == source) {
            Some(&(name, text)) => Self::built_in(name, text),
            None => {
                let unreadable = |reason| SourceError::Unreadable { source_name: source.to_owned(), reason };
                let text = files::read_text(Path::new(source), FILE_MAX).map_err(unreadable)?;
                Self::of_file(Path::new(source), text)
            }
        };
        found.with(given)
    }

    /// The same with `given` in place of the defaults of its parameters.
    ///
    /// # Errors
    /// [`SourceError::Invalid`].
    pub fn with(&self, given: &BTreeMap<String, i64>) -> Result<Self, SourceError> {
        let text = arena_file::with_parameters(&self.text, given).map_err(|reason| self.invalid(reason))?;
        Ok(Self { text, ..self.clone() })
    }

    /// The farthest that its parameters may be chosen: [`arena_file::extremes`].
    ///
    /// # Errors
    /// [`SourceError::Invalid`].
    pub fn extremes(&self) -> Result<Vec<BTreeMap<String, i64>>, SourceError> {
        arena_file::extremes(&self.text).map_err(|reason| self.invalid(reason))
    }

    /// An arena that is compiled in.
    pub fn built_in(name: &str, text: &str) -> Self {
        Self { label: format!("built-in arena {name}"), text: text.to_owned(), folder: None }
    }

    /// What was read from the file at `path`.
    pub fn of_file(path: &Path, text: String) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self { label: path.display().to_string(), text, folder: Some(folder.to_owned()) }
    }

    /// Builds the arena.
    ///
    /// # Errors
    /// [`SourceError::Invalid`], also where its own steps are too fine to be sent as far as its bounds are.
    pub fn build(&self, settings: &ArenaSettings) -> Result<Arena, SourceError> {
        let supplies = Supplies { kinds: &ActorKinds::built_in(), read: &|name| self.read(name) };
        self.check_steps().map_err(|reason| self.invalid(reason))?;
        Arena::from_toml_with(&self.text, settings, &supplies).map_err(|reason| self.invalid(reason))
    }

    /// What takes a running arena of the text `old` to this one.
    ///
    /// # Errors
    /// [`SourceError::Unchangeable`].
    pub fn change_from(&self, old: &str, settings: &ArenaSettings) -> Result<Reload, SourceError> {
        let supplies = Supplies { kinds: &ActorKinds::built_in(), read: &|name| self.read(name) };
        let steps = self.check_steps().map_err(ReloadError::from);
        steps
            .and_then(|()| Reload::between(old, &self.text, settings, &supplies))
            .map_err(|reason| SourceError::Unchangeable { file: self.label.clone(), reason })
    }

    /// Checks that its own steps, where it has any, reach as far as its bounds.
    fn check_steps(&self) -> Result<(), ArenaError> {
        let file = ArenaFile::parse(&self.text)?;
        let reach_m = file.bounds.reach_m();
        let most = steps_per_m_max(reach_m);
        match file.precision.steps_per_m.filter(|&steps| steps > most) {
            None => Ok(()),
            Some(steps) => Err(ArenaError::OutOfRange {
                key: "precision.steps_per_m".to_owned(),
                value: steps.to_string(),
                allowed: format!("10 to {most} steps a metre, for bounds {reach_m} m from the origin"),
            }),
        }
    }

    /// What clients need to predict their own cars: the text, and its meshes unless they are too much to send.
    pub fn source(&self) -> ArenaSource {
        let files = self.meshes().unwrap_or_else(|reason| {
            tracing::warn!("{}: clients cannot predict their cars: {reason}", self.label);
            Vec::new()
        });
        ArenaSource { toml: self.text.clone(), files }
    }

    fn meshes(&self) -> Result<Vec<SourceFile>, String> {
        let file = ArenaFile::parse(&self.text).map_err(|reason| reason.to_string())?;
        let names = file.mesh_names();
        let read = |name: &&str| Ok(SourceFile { name: (*name).to_owned(), content: self.read(name)? });
        let files = names.iter().map(read).collect::<Result<Vec<_>, String>>()?;
        let bytes: usize = files.iter().map(|file| file.content.len()).sum();
        match files.len() <= SOURCE_FILES_MAX && bytes <= SOURCE_FILES_BYTES_MAX {
            true => Ok(files),
            false => Err(format!(
                "{} meshes of {bytes} bytes in all, at most {SOURCE_FILES_MAX} of {SOURCE_FILES_BYTES_MAX} are sent",
                files.len()
            )),
        }
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        match &self.folder {
            Some(folder) => read_beside(folder, name).map_err(|reason| reason.to_string()),
            None => arena_file::shipped_file(name),
        }
    }

    fn invalid(&self, reason: ArenaError) -> SourceError {
        SourceError::Invalid { file: self.label.clone(), reason }
    }
}

/// The bytes of a file in `folder` or below it; a link does not lead out of it.
fn read_beside(folder: &Path, name: &str) -> io::Result<Vec<u8>> {
    let folder = folder.canonicalize()?;
    let path = folder.join(name).canonicalize()?;
    if !path.starts_with(&folder) {
        return Err(io::Error::other("it leads out of the arena's folder"));
    }
    files::read(&path, GEOMETRY_MAX)
}

fn names() -> String {
    BUILT_IN.map(|(name, _)| name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arena_s_own_steps_have_to_reach_its_bounds() {
        let settings = ArenaSettings { tick_hz: 30, threads: 1 };
        let text = |steps: u32, reach_m: u32| {
            let bounds = Arena::DEFAULT.replacen("max = [125.0", &format!("max = [{reach_m}.0"), 1);
            let text = bounds.replacen("[bounds]", &format!("[precision]\nsteps_per_m = {steps}\n[bounds]"), 1);
            ArenaText::built_in("a", &text)
        };
        let near = text(20_000, 125);
        assert!(near.build(&settings).is_ok() && text(13_421, 5000).build(&settings).is_ok());
        let allowed = "allowed: 10 to 13421 steps a metre, for bounds 5000 m from the origin";
        let expected = format!("built-in arena a: precision.steps_per_m is 20000, {allowed}");
        let far = text(20_000, 5000);
        let said = |result: Result<(), SourceError>| result.map_err(|error| error.to_string());
        assert_eq!(said(far.build(&settings).map(drop)), Err(expected.clone()));
        // Nor may bounds move away from under the steps.
        assert_eq!(said(far.change_from(&near.text, &settings).map(drop)), Err(expected));
    }
}
