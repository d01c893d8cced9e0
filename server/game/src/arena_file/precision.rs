//! The `[precision]` table: how fine the state of this arena is sent. What is left out is as the server's configuration
//! has it.

use serde::Deserialize;

use super::{ArenaError, Key};

/// Steps of a coordinate at most, in size: what the wire carries.
pub const STEPS_MAX: u32 = 1 << 26;

/// The table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrecisionFile {
    /// Steps of a metre of positions.
    pub steps_per_m: Option<u32>,
    /// Steps of 1 of quaternion components.
    pub rotation_steps: Option<u32>,
    /// Steps of a metre or radian of joint coordinates.
    pub joint_steps: Option<u32>,
}

impl PrecisionFile {
    /// # Errors
    /// [`ArenaError::OutOfRange`], also where steps do not cover coordinates up to `reach_m` from the origin, m.
    pub(super) fn check(&self, reach_m: f64) -> Result<(), ArenaError> {
        let Self { steps_per_m, rotation_steps, joint_steps } = *self;
        let check = |name, steps: Option<u32>, min, max, what: &str| match steps {
            Some(steps) => Key::new("precision").at(name).count(steps as usize, min, max, what),
            None => Ok(()),
        };
        let covering = (f64::from(STEPS_MAX) / reach_m.max(1.0)) as usize;
        let within = format!("steps a metre, for bounds {reach_m} m from the origin");
        check("steps_per_m", steps_per_m, 10, covering.min(65_536), &within)?;
        check("rotation_steps", rotation_steps, 64, 8_192, "steps")?;
        check("joint_steps", joint_steps, 10, 65_536, "steps a metre or radian")
    }
}
