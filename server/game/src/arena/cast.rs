//! The arena's own cars: those that a file names, and those that fill empty places and give way to players.

use pita_sim::SimError;

use super::Arena;
use crate::arena_file::{AiFile, ArenaFile};
use crate::driver::{AiDriver, Driver};
use crate::spawn::Pose;
use crate::vehicle::{Identity, Vehicle};

/// What those who fill places are called.
const NAMES: [&str; 12] =
    ["Ada", "Emmy", "Sofia", "Mary", "Lise", "Grace", "Hedy", "Rosalind", "Maryam", "Barbara", "Katherine", "Vera"];

/// Those who fill empty places.
pub(super) struct Cast {
    ai: AiFile,
    /// Corners in x and z, m.
    route: Vec<[f64; 2]>,
    /// Who is there, in the order in which they came.
    actors: Vec<u32>,
    /// How many ever came; the next one's name, behaviour and corner.
    count: usize,
}

impl Cast {
    /// Of a file whose route is checked to exist.
    pub fn new(file: &ArenaFile) -> Option<Self> {
        let ai = file.ai.clone()?;
        let route = file.routes.get(&ai.route)?.corners.clone();
        Some(Self { ai, route, actors: Vec::new(), count: 0 })
    }
}

impl Arena {
    /// As many of the arena's cars come or go as players leave places empty or take them: the last who came goes first.
    ///
    /// # Errors
    /// What the engine says where it refuses a car.
    pub(super) fn fill_places(&mut self) -> Result<(), SimError> {
        let Some(mut cast) = self.cast.take() else { return Ok(()) };
        // Another actor may have taken one away.
        cast.actors.retain(|id| self.actors.contains_key(id));
        let wanted = cast.ai.drivers.saturating_sub(self.slots.len());
        while cast.actors.len() > wanted {
            cast.actors.pop().into_iter().for_each(|id| self.remove(id));
        }
        let mut filled = Ok(());
        while cast.actors.len() < wanted && filled.is_ok() {
            filled = self.add_filler(&mut cast);
        }
        self.cast = Some(cast);
        filled
    }

    /// Those who fill places go; others, as `file` has them, come in their place before the tick is over.
    pub(super) fn recast(&mut self, file: &ArenaFile) {
        let old = self.cast.take();
        old.iter().flat_map(|cast| &cast.actors).for_each(|&id| self.remove(id));
        self.cast = Cast::new(file);
    }

    fn add_filler(&mut self, cast: &mut Cast) -> Result<(), SimError> {
        let id = self.new_id();
        let pose = self.free_spawn(id);
        let number = cast.count;
        let behaviour = cast.ai.behaviours.get(number % cast.ai.behaviours.len().max(1)).copied().unwrap_or_default();
        let driver = AiDriver::new(behaviour, cast.route.clone(), number % cast.route.len(), cast.ai.speed);
        self.add_own_car(id, NAMES[number % NAMES.len()].to_owned(), driver, pose)?;
        cast.count += 1;
        cast.actors.push(id);
        Ok(())
    }

    /// Adds a car that the arena drives.
    pub(super) fn add_own_car(&mut self, id: u32, name: String, driver: AiDriver, pose: Pose) -> Result<(), SimError> {
        let (identity, driver) = (Identity { id, name, slot: None }, Driver::Own(driver));
        let vehicle = Vehicle::add(&mut self.world, identity, self.vehicle.clone(), driver, pose)?;
        let vehicle = self.armed(vehicle);
        self.add(Box::new(vehicle));
        Ok(())
    }
}
