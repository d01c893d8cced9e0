//! What a cartoon car does beside driving: numbers and ranges.

use serde::{Deserialize, Serialize};

use crate::arena_file::{ArenaError, Key};

/// `[vehicle.boost]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BoostParameters {
    /// Push along the car's own x, N; 0 for no boost.
    pub force: f64,
    /// What a full tank lasts, s.
    pub lasts: f64,
    /// From empty to full, s.
    pub refill: f64,
}

impl Default for BoostParameters {
    fn default() -> Self {
        Self { force: 9_000.0, lasts: 2.5, refill: 10.0 }
    }
}

impl BoostParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("force").number(self.force, 0.0, 1e6, "N")?;
        key.at("lasts").number(self.lasts, 0.0, 1e3, "s")?;
        key.at("refill").number(self.refill, 0.1, 1e4, "s")
    }
}

/// `[vehicle.jump]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JumpParameters {
    /// Speed that it gives along the car's own up, m/s; 0 for no jumps.
    pub speed: f64,
    /// Time between two jumps, s.
    pub rest: f64,
}

impl Default for JumpParameters {
    fn default() -> Self {
        Self { speed: 4.5, rest: 0.5 }
    }
}

impl JumpParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("speed").number(self.speed, 0.0, 50.0, "m/s")?;
        key.at("rest").number(self.rest, 0.0, 1e3, "s")
    }
}

/// `[vehicle.air_control]`: while no wheel touches anything the car levels itself and turns with the steering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AirControlParameters {
    /// Largest rate at which it levels itself, and at which it turns at full steering, rad/s; 0 for none.
    pub rate: f64,
    /// Time in which it gets to that rate, s.
    pub time: f64,
}

impl Default for AirControlParameters {
    fn default() -> Self {
        Self { rate: 1.2, time: 0.4 }
    }
}

impl AirControlParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("rate").number(self.rate, 0.0, 20.0, "rad/s")?;
        key.at("time").number(self.time, 0.02, 100.0, "s")
    }
}

/// `[vehicle.self_righting]`: a car that lies on its side or roof hops and turns over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SelfRightingParameters {
    /// How long it lies there first, s.
    pub after: f64,
    /// Speed of the hop, m/s; 0 for a car that stays where it lies.
    pub hop: f64,
    /// Largest rate at which it turns over, rad/s.
    pub rate: f64,
}

impl Default for SelfRightingParameters {
    fn default() -> Self {
        Self { after: 1.0, hop: 5.0, rate: 5.0 }
    }
}

impl SelfRightingParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("after").number(self.after, 0.0, 1e3, "s")?;
        key.at("hop").number(self.hop, 0.0, 50.0, "m/s")?;
        key.at("rate").number(self.rate, 0.1, 20.0, "rad/s")
    }
}

/// `[vehicle.squash]`: the body gives way to what it feels, and swings back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SquashParameters {
    /// How much, as a share of what a spring of the frequency would give way; 0 for a body that keeps its shape.
    pub strength: f64,
    /// With which it swings back, Hz.
    pub frequency: f64,
    /// Its damping; 1 does not swing.
    pub damping_ratio: f64,
    /// Share of its height by which it is squashed or stretched, or leans, under the hardest lasting push.
    pub limit: f64,
}

impl Default for SquashParameters {
    fn default() -> Self {
        Self { strength: 0.0, frequency: 2.5, damping_ratio: 0.35, limit: 0.35 }
    }
}

impl SquashParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("strength").number(self.strength, 0.0, 10.0, "")?;
        // What ticks of 25 Hz can show.
        key.at("frequency").number(self.frequency, 0.2, 2.5, "Hz")?;
        key.at("damping_ratio").number(self.damping_ratio, 0.35, 4.0, "")?;
        key.at("limit").number(self.limit, 0.0, 0.5, "of the height")
    }
}
