//! The ranges of an arena file, and that its names refer to something.

use super::{ArenaError, ArenaFile, BoundsFile, Key, ShapeFile, material, meshes};

/// Most statics and spawn points each, copies and grids counted.
const THINGS_MAX: usize = 4_096;
/// Most actors of an arena, whoever adds them.
pub const ACTORS_MAX: usize = 16_384;
/// Most corners of a route.
const CORNERS_MAX: usize = 1_024;
/// Farthest from the origin, m: beyond, single-precision positions on the wire lose a millimetre.
const WORLD_MAX: f64 = 5_000.0;

impl ArenaFile {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first value that is not allowed.
    pub(super) fn check(&self) -> Result<(), ArenaError> {
        let in_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
        let named = (1..=32).contains(&self.name.len()) && self.name.chars().all(in_name);
        Key::new("name").require(named, &self.name, "1 to 32 of a-z 0-9 - _")?;
        check_text(&Key::new("title"), &self.title, 64)?;
        Key::new("max_players").count(self.max_players.into(), 1, 1_024, "players")?;
        Key::new("gravity").number(self.gravity, 0.0, 100.0, "m/s^2")?;
        self.check_bounds()?;
        self.precision.check()?;
        material::check(&self.materials, &self.material_pairs)?;
        self.vehicle.check(&Key::new("vehicle"))?;
        self.combat.as_ref().map_or(Ok(()), |combat| combat.check(&Key::new("combat")))?;
        self.check_statics()?;
        self.check_spawns()?;
        self.check_actors()?;
        self.check_routes()
    }

    fn check_bounds(&self) -> Result<(), ArenaError> {
        let key = Key::new("bounds");
        key.at("min").vector(self.bounds.min, WORLD_MAX)?;
        for axis in 0..3 {
            key.at("max").index(axis).number(self.bounds.max[axis], self.bounds.min[axis], WORLD_MAX, "m")?;
        }
        Ok(())
    }

    /// What is put back must not be lost where it is put.
    ///
    /// # Errors
    /// [`ArenaError::OutOfRange`] unless `point`, m, is within the bounds.
    pub fn check_inside(&self, key: &Key, point: [f64; 3]) -> Result<(), ArenaError> {
        (0..3).try_for_each(|axis| {
            key.index(axis).number(point[axis], self.bounds.min[axis], self.bounds.max[axis], "m, the bounds")
        })
    }

    /// What starts outside is lost at once, and put back to where it started.
    fn check_car_inside(&self, key: &Key, point: [f64; 3]) -> Result<(), ArenaError> {
        let ([aside, above], BoundsFile { min, max }) = (self.vehicle.reach(), self.bounds);
        let [below, above] = [[aside, 0.0, aside], [aside, above, aside]];
        (0..3).try_for_each(|axis| {
            let (least, most) = (min[axis] + below[axis], max[axis] - above[axis]);
            key.index(axis).number(point[axis], least, most, "m: a whole car is within the bounds there")
        })
    }

    fn check_statics(&self) -> Result<(), ArenaError> {
        let statics = Key::new("statics");
        let mut pieces = 0;
        for (i, file) in self.statics.iter().enumerate() {
            let key = statics.index(i);
            match (&file.shape, &file.mesh) {
                (Some(shape), None) => shape.check(&key.at("shape"))?,
                (None, Some(name)) => meshes::check_name(&key.at("mesh"), name)?,
                _ => key.require(false, "without a shape, or with two", "either shape or mesh")?,
            }
            if let Some(warp) = &file.warp {
                let key = key.at("warp");
                let has_corners = matches!(file.shape, None | Some(ShapeFile::Box { .. }));
                key.require(has_corners, "of what has no corners", "of a mesh or a box")?;
                warp.check(&key)?;
            }
            self.check_material(&key.at("material"), &file.material)?;
            key.at("position").vector(file.position, WORLD_MAX)?;
            file.angles().check(&key)?;
            let block = file.block();
            block.check(&key)?;
            key.at("last copy").vector(block.last(), WORLD_MAX)?;
            pieces += block.count();
            key.at("copies").count(pieces, 0, THINGS_MAX, "statics in all")?;
        }
        Ok(())
    }

    fn check_spawns(&self) -> Result<(), ArenaError> {
        for (i, spawn) in self.spawns.iter().enumerate() {
            let key = Key::new("spawns").index(i);
            self.check_car_inside(&key.at("position"), spawn.position)?;
            key.at("yaw").number(spawn.yaw, -360.0, 360.0, "deg")?;
        }
        let mut points = self.spawns.len();
        for (i, grid) in self.spawn_grids.iter().enumerate() {
            let key = Key::new("spawn_grids").index(i);
            self.check_car_inside(&key.at("center"), grid.center)?;
            key.at("yaw").number(grid.yaw, -360.0, 360.0, "deg")?;
            for axis in 0..2 {
                key.at("count").index(axis).count(grid.count[axis], 1, THINGS_MAX, "points")?;
                key.at("spacing").index(axis).number(grid.spacing[axis], 0.0, 1_000.0, "m")?;
            }
            for sign in [-0.5, 0.5] {
                let half = |axis: usize| sign * (grid.count[axis] - 1) as f64 * grid.spacing[axis];
                let [x, y, z] = grid.center;
                self.check_car_inside(&key.at("corner"), [x + half(0), y, z + half(1)])?;
            }
            points += grid.count[0] * grid.count[1];
            key.at("count").count(points, 1, THINGS_MAX, "spawn points in all")?;
        }
        Key::new("spawns").count(points, 1, THINGS_MAX, "spawn points, those of spawn_grids included")
    }

    /// What all kinds of actors have in common; the kinds check the rest.
    fn check_actors(&self) -> Result<(), ArenaError> {
        let mut actors = 0;
        for (i, file) in self.actors.iter().enumerate() {
            let key = Key::new("actors").index(i);
            check_text(&key.at("name"), file.name(), 32)?;
            self.check_inside(&key.at("position"), file.position)?;
            key.at("yaw").number(file.yaw, -360.0, 360.0, "deg")?;
            let block = file.block();
            block.check(&key)?;
            self.check_inside(&key.at("last copy"), block.last())?;
            actors += block.count();
            key.at("copies").count(actors, 0, ACTORS_MAX, "actors in all")?;
        }
        Ok(())
    }

    fn check_routes(&self) -> Result<(), ArenaError> {
        for (name, route) in &self.routes {
            let key = Key::new("routes").at(name).at("corners");
            key.count(route.corners.len(), 2, CORNERS_MAX, "corners")?;
            for (i, corner) in route.corners.iter().enumerate() {
                let key = key.index(i);
                corner.iter().enumerate().try_for_each(|(j, &x)| key.index(j).number(x, -WORLD_MAX, WORLD_MAX, "m"))?;
            }
        }
        self.check_drivers()
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] unless `name` is one of the file's materials.
    pub fn check_material(&self, key: &Key, name: &str) -> Result<(), ArenaError> {
        let allowed = one_of("materials", self.materials.keys());
        key.require(self.materials.contains_key(name), name, &allowed)
    }
}

pub(super) fn check_text(key: &Key, text: &str, max: usize) -> Result<(), ArenaError> {
    let printable = !text.trim().is_empty() && !text.chars().any(char::is_control);
    let allowed = format!("1 to {max} bytes without control characters");
    key.require(printable && text.len() <= max, format_args!("{text:?}"), &allowed)
}

pub(super) fn one_of<'a>(table: &str, names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<&str> = names.map(String::as_str).collect();
    if names.is_empty() {
        format!("a name from [{table}], which is empty")
    } else {
        format!("one of {}", names.join(", "))
    }
}
