//! The numbers of a sheep, as an arena file has them.

use serde::Deserialize;

use super::rig::Form;
use crate::arena_file::{ArenaError, ArenaFile, Key};

/// A sheep of an arena file.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SheepParameters {
    /// What its DOF are.
    pub form: Form,
    /// Name of its material.
    pub material: String,
    /// m/s.
    pub walk_speed: f64,
    /// m/s.
    pub flee_speed: f64,
    /// It flees moving cars and tornadoes that are closer, m.
    pub fear_radius: f64,
    /// It walks back when it is farther from its place, m.
    pub pasture_radius: f64,
    /// Makes other sheep of the same file.
    pub seed: u64,
}

impl Default for SheepParameters {
    fn default() -> Self {
        Self {
            form: Form::default(),
            material: "wool".to_owned(),
            walk_speed: 1.2,
            flee_speed: 5.0,
            fear_radius: 14.0,
            pasture_radius: 30.0,
            seed: 0,
        }
    }
}

impl SheepParameters {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first value that is not allowed; `key` is where the table is.
    pub fn check(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        file.check_material(&key.at("material"), &self.material)?;
        let number = |name: &str, value, min, max, unit| key.at(name).number(value, min, max, unit);
        number("walk_speed", self.walk_speed, 0.1, 5.0, "m/s")?;
        number("flee_speed", self.flee_speed, 0.1, 10.0, "m/s")?;
        number("fear_radius", self.fear_radius, 0.0, 100.0, "m")?;
        number("pasture_radius", self.pasture_radius, 1.0, 5_000.0, "m")
    }
}
