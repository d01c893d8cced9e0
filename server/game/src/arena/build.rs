//! From a checked file to a running world.

use std::collections::BTreeMap;

use glam::DVec3;
use pita_sim::{Collider, Material, Settings, Shape, SimError, StaticDesc, World};

use super::{Arena, ArenaSettings, StaticInfo};
use crate::arena_file::{ArenaError, ArenaFile, DriverFile, Key, Materials, PropFile};
use crate::driver::{Driver, RouteDriver};
use crate::prop::{Prop, PropDesc};
use crate::spawn::Pose;
use crate::vehicle::{Identity, Vehicle};

impl Arena {
    /// Builds the arena that `text`, TOML, describes.
    ///
    /// # Errors
    /// Any [`ArenaError`]; it names the key, its value and what is allowed.
    pub fn from_toml(text: &str, settings: &ArenaSettings) -> Result<Self, ArenaError> {
        Self::from_file(&ArenaFile::parse(text)?, settings)
    }

    pub(super) fn from_file(file: &ArenaFile, settings: &ArenaSettings) -> Result<Self, ArenaError> {
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
            acting: Vec::new(),
        };
        arena.set_material_pairs(file)?;
        arena.add_statics(file)?;
        arena.add_props(file)?;
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

    fn add_props(&mut self, file: &ArenaFile) -> Result<(), ArenaError> {
        for (i, prop) in file.props.iter().enumerate() {
            for home in homes(prop) {
                let desc = PropDesc {
                    name: prop.name.clone(),
                    shape: Shape::from(&prop.shape),
                    mass: prop.mass,
                    material: material(&self.materials, &prop.material),
                    home,
                };
                let id = self.new_id();
                let added = Prop::add(&mut self.world, id, desc).map_err(refused(&Key::new("props").index(i)))?;
                self.add(Box::new(added));
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
fn homes(prop: &PropFile) -> impl Iterator<Item = Pose> {
    let [nx, ny, nz] = prop.copies;
    let first = DVec3::from_array(prop.position);
    let spacing = DVec3::from_array(prop.spacing);
    let yaw = prop.yaw.to_radians();
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
