//! The `[precision]` table: how fine the state of this arena is sent. What is left out is as the server's configuration
//! has it.

use serde::Deserialize;

use super::{ArenaError, Key};

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
    /// [`ArenaError::OutOfRange`]. Whether what is sent reaches as far as the arena's bounds is for who sends it to check.
    pub(super) fn check(&self) -> Result<(), ArenaError> {
        let Self { steps_per_m, rotation_steps, joint_steps } = *self;
        let check = |name, steps: Option<u32>, min, max, what: &str| match steps {
            Some(steps) => Key::new("precision").at(name).count(steps as usize, min, max, what),
            None => Ok(()),
        };
        check("steps_per_m", steps_per_m, 10, 65_536, "steps a metre")?;
        check("rotation_steps", rotation_steps, 64, 8_192, "steps")?;
        check("joint_steps", joint_steps, 10, 65_536, "steps a metre or radian")
    }
}
