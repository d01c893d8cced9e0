//! From a checked file to a running world.

use std::collections::BTreeMap;

use glam::DVec3;
use pita_sim::{Collider, Material, Settings, Shape, SimError, StaticDesc, World};

use super::{Arena, ArenaSettings, StaticInfo};
use crate::arena_file::{ActorFile, ArenaError, ArenaFile, DriverFile, Key, Materials};
use crate::driver::{Driver, RouteDriver};
use crate::kinds::{ActorKinds, Recipe, Site};
use crate::spawn::Pose;
use crate::step::LogicReport;
use crate::vehicle::{Identity, Vehicle};

impl Arena {
    /// Builds the arena that `text`, TOML, describes.
    ///
    /// # Errors
    /// Any [`ArenaError`]; it names the key, its value and what is allowed.
    pub fn from_toml(text: &str, settings: &ArenaSettings) -> Result<Self, ArenaError> {
        Self::from_toml_with(text, settings, &ActorKinds::built_in())
    }

    /// The same with the kinds of actors that `kinds` knows, a game's own among them.
    ///
    /// # Errors
    /// Any [`ArenaError`].
    pub fn from_toml_with(text: &str, settings: &ArenaSettings, kinds: &ActorKinds) -> Result<Self, ArenaError> {
        Self::from_file(&ArenaFile::parse(text)?, settings, kinds)
    }

    pub(super) fn from_file(
        file: &ArenaFile,
        settings: &ArenaSettings,
        kinds: &ActorKinds,
    ) -> Result<Self, ArenaError> {
        let recipes = file.actors.iter().enumerate().map(|(i, actor)| kinds.recipe(i, actor, file));
        let recipes = recipes.collect::<Result<Vec<_>, _>>()?;
        Key::new("tick_hz").count(settings.tick_hz.into(), 1, 1_000, "Hz")?;
        let dt = 1.0 / f64::from(settings.tick_hz);
        let gravity = DVec3::NEG_Y * file.gravity;
        let solver = file.solver.settings();
        let world = World::new(Settings { gravity, solver, threads: settings.threads, ..Settings::at(dt) })
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
            materials: Materials::new(&file.materials),
            owners: BTreeMap::new(),
            collisions: Vec::new(),
            vehicle: file.vehicle.clone(),
            spawns: spawn_points(file),
            actors: BTreeMap::new(),
            next_actor: 0,
            slots: BTreeMap::new(),
            events: Vec::new(),
            commands: Vec::new(),
            lost: Vec::new(),
            others: Vec::new(),
            requests: Vec::new(),
            logic: LogicReport::default(),
        };
        arena.set_material_pairs(file)?;
        arena.add_statics(file)?;
        arena.add_actors(file, &recipes)?;
        arena.add_drivers(file)?;
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
            let shape = Shape::from(&piece.shape);
            let (position, rotation) = (DVec3::from_array(piece.position), piece.angles().rotation());
            let collider = Collider::new(shape.clone(), material(&self.materials, &piece.material));
            self.world
                .add_static(StaticDesc { collider, position, rotation })
                .map_err(refused(&Key::new("statics").index(i)))?;
            self.statics.push(StaticInfo { shape, position, rotation });
        }
        Ok(())
    }

    /// Adds what `recipes` make of each of the file's actors.
    fn add_actors(&mut self, file: &ArenaFile, recipes: &[Recipe]) -> Result<(), ArenaError> {
        for (i, (actor, recipe)) in file.actors.iter().zip(recipes).enumerate() {
            for pose in places(actor) {
                let id = self.new_id();
                let (world, materials, name) = (&mut self.world, &self.materials, actor.name());
                let mut site = Site { world, id, name, pose, file, materials };
                let added = recipe(&mut site).map_err(refused(&Key::new("actors").index(i)))?;
                self.add(added);
            }
        }
        Ok(())
    }

    fn add_drivers(&mut self, file: &ArenaFile) -> Result<(), ArenaError> {
        for (i, driver) in file.drivers.iter().enumerate() {
            let (route, pose) = start_of(file, driver);
            let identity = Identity { id: self.new_id(), name: driver.name.clone(), slot: None };
            let driver = Driver::Route(RouteDriver::new(route, driver.start + 1, driver.speed));
            let vehicle = Vehicle::add(&mut self.world, identity, self.vehicle.clone(), driver, pose)
                .map_err(refused(&Key::new("drivers").index(i)))?;
            self.add(Box::new(vehicle));
        }
        Ok(())
    }
}

fn refused(key: &Key) -> impl FnOnce(SimError) -> ArenaError + use<> {
    let key = key.to_string();
    move |source| ArenaError::Engine { key, source }
}

/// Materials are checked to exist when the file is read.
fn material(materials: &Materials, name: &str) -> Material {
    materials.get(name).copied().unwrap_or_default()
}

fn spawn_points(file: &ArenaFile) -> Vec<Pose> {
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

/// Place of each copy, lowest layer first.
fn places(actor: &ActorFile) -> impl Iterator<Item = Pose> {
    let [nx, ny, nz] = actor.copies;
    let first = DVec3::from_array(actor.position);
    let spacing = DVec3::from_array(actor.spacing);
    let yaw = actor.yaw.to_radians();
    let cells = (0..ny).flat_map(move |iy| (0..nx).flat_map(move |ix| (0..nz).map(move |iz| [ix, iy, iz])));
    cells.map(move |[ix, iy, iz]| {
        let cell = DVec3::new(ix as f64, iy as f64, iz as f64);
        Pose { position: first + cell * spacing, yaw }
    })
}

/// Corners of a driver's route and his place at the first of them, facing the next. The route is checked to exist when
/// the file is read.
fn start_of(file: &ArenaFile, driver: &DriverFile) -> (Vec<[f64; 2]>, Pose) {
    let corners = file.routes[&driver.route].corners.clone();
    let [x, z] = corners[driver.start];
    let [next_x, next_z] = corners[(driver.start + 1) % corners.len()];
    let pose = Pose { position: DVec3::new(x, 0.0, z), yaw: f64::atan2(z - next_z, next_x - x) };
    (corners, pose)
}
