//! What the tables of a file place: actors, and the arena's own cars.

use pita_sim::{DVec3, DofKind, SimError, World};

use super::Arena;
use super::logic::{is_inside, whole_or_nothing};
use crate::actor::Actor;
use crate::arena_file::{ArenaFile, DriverFile};
use crate::driver::AiDriver;
use crate::kinds::{Recipe, Site};
use crate::spawn::Pose;

/// Most bodies that the actors of a file may have: kinds multiply copies by bodies of their own.
const BODIES_MAX: usize = 65_536;

/// Most coordinates that the figures of a file may have, those of one that is more than particles and rigid bodies: sixty
/// of the largest jellies, or 1,600 sheep. Each takes work when it is built that grows faster than their number.
const FIGURE_RATES_MAX: usize = 65_536;

/// Why what would be lost at once is not placed.
const OUTSIDE: SimError = SimError::Unusable { what: "a part of it is outside the arena's bounds" };

const TOO_LARGE: SimError = SimError::Unusable {
    what: "jellies, sheep and other figures of an arena have at most 65536 coordinates in all: \
           give it fewer copies, or jellies fewer cells",
};

/// Ids of what each table of the file placed.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub actors: Vec<Vec<u32>>,
    pub drivers: Vec<Vec<u32>>,
    /// Coordinates of all figures that were placed together.
    pub figure_rates: usize,
}

impl Arena {
    /// Adds what `recipe` makes of the file's `index`-th actor and its copies, up to the first that is refused; their ids
    /// go to the end of `ids`.
    pub(super) fn place_actors(
        &mut self,
        file: &ArenaFile,
        index: usize,
        recipe: &Recipe,
        ids: &mut Vec<u32>,
    ) -> Result<(), SimError> {
        let actor = &file.actors[index];
        for position in actor.block().places() {
            if self.world.body_count() >= BODIES_MAX {
                return Err(SimError::Unusable { what: "the actors of an arena have at most 65536 bodies in all" });
            }
            let (id, pose) = (self.new_id(), Pose { position, yaw: actor.yaw.to_radians() });
            let (materials, name) = (&self.materials, actor.name());
            let added = whole_or_nothing(&mut self.world, |world| {
                let added = recipe(&mut Site { world, id, name, pose, file, materials })?;
                if is_inside(world, &file.bounds, &*added) { Ok(added) } else { Err(OUTSIDE) }
            })?;
            self.placed.figure_rates += figure_rates(&self.world, &*added);
            self.add(added);
            ids.push(id);
            if self.placed.figure_rates > FIGURE_RATES_MAX {
                return Err(TOO_LARGE);
            }
        }
        Ok(())
    }

    /// Adds the file's `index`-th car; answers its id.
    pub(super) fn place_driver(&mut self, file: &ArenaFile, index: usize) -> Result<Vec<u32>, SimError> {
        let driver = &file.drivers[index];
        let (route, pose) = start_of(file, driver);
        let ai = AiDriver::new(driver.behaviour, route, driver.start + 1, driver.speed);
        let id = self.new_id();
        self.add_own_car(id, driver.name.clone(), ai, pose)?;
        Ok(vec![id])
    }
}

fn figure_rates(world: &World, actor: &dyn Actor) -> usize {
    let slices = actor.bodies().iter().filter_map(|&body| world.slice(body));
    let figures = slices.filter(|slice| !matches!(slice.kind, DofKind::Particle | DofKind::RigidBody));
    figures.map(|slice| slice.v.len()).sum()
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
