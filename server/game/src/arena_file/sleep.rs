//! The `[sleep]` table: when what is still leaves the tick. What is left out is as the engine has it; the engine checks
//! the ranges.

use pita_sim::SleepSettings;
use serde::Deserialize;

/// The table.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SleepFile {
    /// Whether anything sleeps at all.
    pub enabled: bool,
    /// Still is what is slower than this, m/s,
    pub linear_speed: f64,
    /// and than this, rad/s,
    pub angular_speed: f64,
    /// for so long, s.
    pub time: f64,
}

impl Default for SleepFile {
    fn default() -> Self {
        let SleepSettings { linear_speed, angular_speed, time } = SleepSettings::default();
        Self { enabled: true, linear_speed, angular_speed, time }
    }
}

impl SleepFile {
    /// As the engine has it.
    pub fn settings(&self) -> Option<SleepSettings> {
        let Self { enabled, linear_speed, angular_speed, time } = *self;
        enabled.then_some(SleepSettings { linear_speed, angular_speed, time })
    }
}
