//! The arena's own cars: `[[drivers]]` one by one, `[ai]` for those who fill empty places.

use serde::Deserialize;

use super::checks::{check_text, one_of};
use super::{ArenaError, ArenaFile, Key};
use crate::driver::Behaviour;

/// Most cars of the arena's own, of each of the two kinds.
const DRIVERS_MAX: usize = 256;

/// Most entries of the list of behaviours.
const BEHAVIOURS_MAX: usize = 64;

/// A car that the arena drives.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriverFile {
    /// What a person calls it.
    pub name: String,
    /// Name of its route.
    pub route: String,
    /// Corner at which it starts; it heads for the next.
    #[serde(default)]
    pub start: usize,
    /// Wanted speed, m/s.
    pub speed: f64,
    /// What it is after.
    #[serde(default)]
    pub behaviour: Behaviour,
}

/// `[ai]`: cars that fill empty places and give way to players.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AiFile {
    /// So many, less one for every player.
    pub drivers: usize,
    /// Name of the route that they follow where nothing else is to be done.
    pub route: String,
    /// Wanted speed, m/s.
    pub speed: f64,
    /// What they are after, in turn.
    #[serde(default)]
    pub behaviours: Vec<Behaviour>,
}

impl ArenaFile {
    pub(super) fn check_drivers(&self) -> Result<(), ArenaError> {
        Key::new("drivers").count(self.drivers.len(), 0, DRIVERS_MAX, "entries")?;
        for (i, driver) in self.drivers.iter().enumerate() {
            let key = Key::new("drivers").index(i);
            check_text(&key.at("name"), &driver.name, 32)?;
            let corners = self.check_route(&key, &driver.route, driver.speed)?;
            key.at("start").count(driver.start, 0, corners - 1, "")?;
        }
        let Some(ai) = &self.ai else { return Ok(()) };
        let key = Key::new("ai");
        key.at("drivers").count(ai.drivers, 0, DRIVERS_MAX, "cars")?;
        key.at("behaviours").count(ai.behaviours.len(), 0, BEHAVIOURS_MAX, "entries")?;
        self.check_route(&key, &ai.route, ai.speed).map(|_| ())
    }

    /// What every driver has; answers how many corners its route has.
    fn check_route(&self, key: &Key, route: &str, speed: f64) -> Result<usize, ArenaError> {
        key.at("speed").number(speed, 1.0, 100.0, "m/s")?;
        match self.routes.get(route) {
            Some(found) => Ok(found.corners.len()),
            None => Err(key.at("route").refuse(route, &one_of("routes", self.routes.keys()))),
        }
    }
}
