//! A running arena takes another text: what can be changed under its players is changed, the rest is refused.
//!
//! What clients were told when they joined cannot change, nor what the engine was made with. Tables of actors and drivers
//! that stay as they are keep what they placed, with all that happened to it since.

use std::collections::BTreeSet;

use super::placing::Placed;
use super::{Arena, ArenaSettings, Supplies, build};
use crate::arena_file::{ArenaError, ArenaFile, with_parameters};
use crate::kinds::Recipe;

/// Keys of a file that may change while the arena runs.
const SAFE: [&str; 9] =
    ["actors", "ai", "drivers", "routes", "vehicle", "spawns", "spawn_grids", "bounds", "parameters"];

/// Why a text cannot take the place of another; nothing was changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReloadError {
    /// It is no arena.
    #[error(transparent)]
    Arena(#[from] ArenaError),
    /// It changes what clients were told when they joined, or what the engine was made with.
    #[error("{} cannot change while the arena runs: take the change back, or start the server anew", .0.join(", "))]
    NeedsRestart(Vec<String>),
}

/// A checked change of a running arena.
pub struct Reload {
    file: ArenaFile,
    recipes: Vec<Recipe>,
    changed: Vec<String>,
    /// For each table of the new file the equal one of the old that it takes over.
    actors: Vec<Option<usize>>,
    drivers: Vec<Option<usize>>,
    /// Those who fill empty places come anew.
    recasts: bool,
}

impl Reload {
    /// What takes an arena of the text `old` to `new`. The new arena is built once, to see that it can be.
    ///
    /// # Errors
    /// [`ReloadError`].
    pub fn between(old: &str, new: &str, settings: &ArenaSettings, supplies: &Supplies) -> Result<Self, ReloadError> {
        Arena::from_toml_with(new, settings, supplies)?;
        let file = ArenaFile::parse(new)?;
        let recipes = build::recipes(&file, supplies.kinds)?;
        let [old, new] = [table(old)?, table(new)?];
        let keys: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
        let changed: Vec<&str> = keys.into_iter().filter(|key| old.get(*key) != new.get(*key)).map(|k| &**k).collect();
        let unsafe_keys: Vec<_> = changed.iter().filter(|key| !SAFE.contains(key)).map(|&key| key.to_owned()).collect();
        if !unsafe_keys.is_empty() {
            return Err(ReloadError::NeedsRestart(unsafe_keys));
        }
        // An actor may have looked at any table when it was built.
        let changes = |key| changed.contains(&key);
        let keep_actors = !changes("routes") && !changes("bounds");
        let recasts = changes("ai") || changes("routes");
        let keep_drivers = !changes("routes") && !changes("vehicle");
        let actors = matches(&old, &new, "actors", keep_actors);
        let drivers = matches(&old, &new, "drivers", keep_drivers);
        let changed = changed.into_iter().map(str::to_owned).collect();
        Ok(Self { file, recipes, changed, actors, drivers, recasts })
    }

    /// What changes, for people; empty where nothing does.
    pub fn changes(&self) -> Vec<String> {
        let count = |matches: &[Option<usize>]| {
            let kept = matches.iter().flatten().count();
            format!("{kept} tables as they were, {} built anew", matches.len() - kept)
        };
        let line = |key: &String| match key.as_str() {
            "actors" => format!("actors: {}", count(&self.actors)),
            "drivers" => format!("drivers: {}", count(&self.drivers)),
            "vehicle" => "vehicle: for cars that come from now on, the arena's own among them".to_owned(),
            key => format!("{key}: as the file has it now"),
        };
        self.changed.iter().map(line).collect()
    }
}

impl Arena {
    /// From the coming tick on the arena is as `reload` has it. What is scheduled before that is done first: a reload is
    /// between the text that those before it left and the next.
    pub fn schedule(&mut self, reload: Reload) {
        self.reloads.push(reload);
    }

    /// Stage 1, before commands: does what was scheduled.
    pub(super) fn do_reloads(&mut self) {
        std::mem::take(&mut self.reloads).into_iter().for_each(|reload| self.do_reload(reload));
    }

    fn do_reload(&mut self, Reload { file, recipes, actors, drivers, recasts, .. }: Reload) {
        let old = std::mem::take(&mut self.placed);
        self.remove_unless_kept(&old.actors, &actors);
        self.remove_unless_kept(&old.drivers, &drivers);
        self.bounds = file.bounds;
        self.vehicle = file.vehicle.clone();
        self.spawns = build::spawn_points(&file);
        let take = |of: &[Vec<u32>], kept: Option<usize>| kept.and_then(|old| of.get(old)).cloned();
        let mut placed = Placed::default();
        for (i, &kept) in actors.iter().enumerate() {
            let ids = take(&old.actors, kept).unwrap_or_else(|| {
                let mut ids = Vec::new();
                // Built before, in `Reload::between`: refused only where players' cars leave no room for all.
                let _refused = self.place_actors(&file, i, &recipes[i], &mut ids);
                ids
            });
            placed.actors.push(ids);
        }
        for (i, &kept) in drivers.iter().enumerate() {
            let ids = take(&old.drivers, kept).map_or_else(|| self.place_driver(&file, i), Ok);
            placed.drivers.push(ids.unwrap_or_default());
        }
        self.placed = placed;
        if recasts {
            self.recast(&file);
        }
    }

    fn remove_unless_kept(&mut self, old: &[Vec<u32>], matches: &[Option<usize>]) {
        for (i, ids) in old.iter().enumerate() {
            if !matches.contains(&Some(i)) {
                ids.iter().for_each(|&id| self.remove(id));
            }
        }
    }
}

/// The text as tables, its parameters put in.
fn table(text: &str) -> Result<toml::Table, ArenaError> {
    let text = with_parameters(text, &Default::default())?;
    // It was read as an arena before.
    Ok(text.parse().unwrap_or_default())
}

/// For each table of the list `key` of `new` an equal one of `old`, each of which is taken once.
fn matches(old: &toml::Table, new: &toml::Table, key: &str, may_keep: bool) -> Vec<Option<usize>> {
    let list = |table: &toml::Table| table.get(key).and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let (old, new) = (list(old), list(new));
    let mut free: Vec<bool> = vec![may_keep; old.len()];
    let take = |table: &toml::Value| {
        let found = (0..old.len()).find(|&i| free[i] && old[i] == *table)?;
        free[found] = false;
        Some(found)
    };
    new.iter().map(take).collect()
}
