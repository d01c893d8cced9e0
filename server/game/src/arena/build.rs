//! From a checked file to a running world.

use std::collections::BTreeMap;

use glam::DVec3;
use pita_sim::{Collider, Material, QueryFilter, Settings, Shape, SimError, StaticDesc, World};

use super::cast::Cast;
use super::placing::Placed;
use super::rounds::Rounds;
use super::{Arena, ArenaSettings, StaticInfo};
use crate::arena_file::{ArenaError, ArenaFile, Key, Materials, shipped_file};
use crate::kinds::{ActorKinds, Recipe};
use crate::spawn::Pose;
use crate::step::LogicReport;

/// Parts of a car that are not farther within what stands in its place may be there at the start, m.
const SPAWN_TOLERANCE: f64 = 0.02;

/// What an arena may need beside its text.
#[derive(Clone, Copy)]
pub struct Supplies<'a> {
    /// The kinds of actors that it may place.
    pub kinds: &'a ActorKinds,
    /// Answers the bytes of a file in the arena's folder, by its path from there, or why there are none.
    pub read: &'a dyn Fn(&str) -> Result<Vec<u8>, String>,
}

impl Arena {
    /// Builds the arena that `text`, TOML, describes, of what comes with the game: its kinds of actors, and its meshes.
    ///
    /// # Errors
    /// Any [`ArenaError`]; it names the key, its value and what is allowed.
    pub fn from_toml(text: &str, settings: &ArenaSettings) -> Result<Self, ArenaError> {
        let supplies = Supplies { kinds: &ActorKinds::built_in(), read: &shipped_file };
        Self::from_toml_with(text, settings, &supplies)
    }

    /// The same with what `supplies` has: kinds of actors of a game's own, and files of the arena's folder.
    ///
    /// # Errors
    /// Any [`ArenaError`].
    pub fn from_toml_with(text: &str, settings: &ArenaSettings, supplies: &Supplies) -> Result<Self, ArenaError> {
        let mut file = ArenaFile::parse(text)?;
        file.read_meshes(supplies.read)?;
        Self::from_file(&file, settings, supplies.kinds)
    }

    pub(super) fn from_file(
        file: &ArenaFile,
        settings: &ArenaSettings,
        kinds: &ActorKinds,
    ) -> Result<Self, ArenaError> {
        let recipes = recipes(file, kinds)?;
        Key::new("tick_hz").count(settings.tick_hz.into(), 1, 1_000, "Hz")?;
        let dt = 1.0 / f64::from(settings.tick_hz);
        let gravity = DVec3::NEG_Y * file.gravity;
        let (solver, sleep, threads) = (file.solver.settings(), file.sleep.settings(), settings.threads);
        let world = World::new(Settings { gravity, solver, sleep, threads, ..Settings::at(dt) })
            .map_err(refused(&Key::new("settings")))?;
        let mut arena = Self {
            name: file.name.clone(),
            title: file.title.clone(),
            max_players: file.max_players,
            dt,
            ticks: 0,
            world,
            statics: Vec::with_capacity(file.statics.len()),
            bounds: file.bounds,
            precision: file.precision,
            materials: Materials::new(&file.materials),
            owners: BTreeMap::new(),
            collisions: Vec::new(),
            vehicle: file.vehicle.clone(),
            combat: file.combat.clone(),
            rounds: file.combat.as_ref().map(|combat| Rounds::new(combat.round.clone())),
            cast: Cast::new(file),
            spawns: spawn_points(file),
            actors: BTreeMap::new(),
            next_actor: 0,
            slots: BTreeMap::new(),
            events: Vec::new(),
            told: 0,
            commands: Vec::new(),
            lost: Vec::new(),
            others: Vec::new(),
            requests: Vec::new(),
            arrivals: Vec::new(),
            logic: LogicReport::default(),
            logic_by_kind: BTreeMap::new(),
            placed: Placed::default(),
            reloads: Vec::new(),
        };
        arena.set_material_pairs(file)?;
        arena.add_statics(file)?;
        arena.check_spawns(file)?;
        arena.place_all(file, &recipes)?;
        // What was there from the start is in the description, it did not happen.
        arena.events.clear();
        Ok(arena)
    }

    fn set_material_pairs(&mut self, file: &ArenaFile) -> Result<(), ArenaError> {
        for (i, pair) in file.material_pairs.iter().enumerate() {
            let [a, b] = [0, 1].map(|side| self.materials.id(&pair.between[side]).unwrap_or_default());
            let surface = pair.contact.into();
            self.world.set_material_pair(a, b, surface).map_err(refused(&Key::new("material_pairs").index(i)))?;
        }
        Ok(())
    }

    fn add_statics(&mut self, file: &ArenaFile) -> Result<(), ArenaError> {
        for (i, piece) in file.statics.iter().enumerate() {
            let Some(shape) = piece.collides() else {
                return Key::new("statics").index(i).require(false, "a mesh", "a shape: this arena has no folder");
            };
            let collider = Collider::new(shape.clone(), material(&self.materials, &piece.material));
            let rotation = piece.angles().rotation();
            for position in piece.block().places() {
                let desc = StaticDesc { collider: collider.clone(), position, rotation };
                self.world.add_static(desc).map_err(refused(&Key::new("statics").index(i)))?;
                self.statics.push(StaticInfo { shape: shape.clone(), position, rotation });
            }
        }
        Ok(())
    }

    /// Nobody starts within what never moves: he would be pushed out of it, to whichever side, or not come out.
    fn check_spawns(&mut self, file: &ArenaFile) -> Result<(), ArenaError> {
        // What was added is there for questions from now on.
        self.world.detect_collisions();
        let vehicle = &file.vehicle;
        let half = DVec3::from(vehicle.chassis_half) - SPAWN_TOLERANCE;
        let (shape, up) =
            (Shape::Box { half: half.max(DVec3::splat(SPAWN_TOLERANCE)) }, DVec3::Y * vehicle.ride_height());
        for (i, spawn) in self.spawns.iter().enumerate() {
            let key = spawn_key(file, i);
            let (at, rotation) = (spawn.position + up, spawn.rotation());
            let inside = self.world.overlap(&shape, at, rotation, &QueryFilter::ALL).map_err(refused(&key))?;
            let allowed = "a place where a car has room: a static is in the way";
            key.require(inside.is_empty(), spawn.position, allowed)?;
        }
        Ok(())
    }

    fn place_all(&mut self, file: &ArenaFile, recipes: &[Recipe]) -> Result<(), ArenaError> {
        for (i, recipe) in recipes.iter().enumerate() {
            let mut ids = Vec::new();
            self.place_actors(file, i, recipe, &mut ids).map_err(refused(&Key::new("actors").index(i)))?;
            self.placed.actors.push(ids);
        }
        for i in 0..file.drivers.len() {
            let ids = self.place_driver(file, i).map_err(refused(&Key::new("drivers").index(i)))?;
            self.placed.drivers.push(ids);
        }
        self.fill_places().map_err(refused(&Key::new("ai")))
    }
}

/// What each of the file's actors is built by, all of them checked.
pub(super) fn recipes(file: &ArenaFile, kinds: &ActorKinds) -> Result<Vec<Recipe>, ArenaError> {
    file.actors.iter().enumerate().map(|(i, actor)| kinds.recipe(i, actor, file)).collect()
}

fn refused(key: &Key) -> impl FnOnce(SimError) -> ArenaError + use<> {
    let key = key.to_string();
    move |source| ArenaError::Engine { key, source }
}

/// Materials are checked to exist when the file is read.
fn material(materials: &Materials, name: &str) -> Material {
    materials.get(name).copied().unwrap_or_default()
}

/// Where the file has the spawn point with this index among all.
fn spawn_key(file: &ArenaFile, index: usize) -> Key {
    let single = file.spawns.len();
    if index < single {
        return Key::new("spawns").index(index).at("position");
    }
    let (mut grid, mut left) = (0, index - single);
    while let Some(points) = file.spawn_grids.get(grid).map(|grid| grid.count[0] * grid.count[1])
        && left >= points
    {
        (grid, left) = (grid + 1, left - points);
    }
    Key::new("spawn_grids").index(grid).at("point").index(left)
}

pub(super) fn spawn_points(file: &ArenaFile) -> Vec<Pose> {
    let pose = |position, yaw: f64| Pose { position, yaw: yaw.to_radians() };
    let mut points: Vec<Pose> =
        file.spawns.iter().map(|spawn| pose(DVec3::from_array(spawn.position), spawn.yaw)).collect();
    for grid in &file.spawn_grids {
        let offset = |i: usize, axis: usize| (i as f64 - 0.5 * (grid.count[axis] - 1) as f64) * grid.spacing[axis];
        for ix in 0..grid.count[0] {
            for iz in 0..grid.count[1] {
                let at = DVec3::from_array(grid.center) + DVec3::new(offset(ix, 0), 0.0, offset(iz, 1));
                points.push(pose(at, grid.yaw));
            }
        }
    }
    points
}
