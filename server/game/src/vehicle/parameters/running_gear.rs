//! What a car stands on, stops with and is steered by: numbers and ranges.

use serde::{Deserialize, Serialize};

use crate::arena_file::{ArenaError, Key};

/// `[vehicle.suspension]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SuspensionParameters {
    /// Spring of one wheel, N/m.
    pub stiffness: f64,
    /// Damper of one wheel, N s/m.
    pub damping: f64,
    /// Anti-roll bar of the front axle: force at each wheel over the difference of their travels, N/m; 0 for none.
    pub anti_roll_front: f64,
    /// The same of the rear axle, N/m.
    pub anti_roll_rear: f64,
}

impl Default for SuspensionParameters {
    fn default() -> Self {
        Self { stiffness: 40_000.0, damping: 4_000.0, anti_roll_front: 12_000.0, anti_roll_rear: 6_000.0 }
    }
}

impl SuspensionParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("stiffness").number(self.stiffness, 1e3, 1e7, "N/m")?;
        key.at("damping").number(self.damping, 0.0, 1e6, "N s/m")?;
        key.at("anti_roll_front").number(self.anti_roll_front, 0.0, 1e6, "N/m")?;
        key.at("anti_roll_rear").number(self.anti_roll_rear, 0.0, 1e6, "N/m")
    }
}

/// `[vehicle.brakes]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BrakeParameters {
    /// At full pedal, summed over the wheels, N m.
    pub torque: f64,
    /// Share of it that the front wheels have.
    pub front_share: f64,
    /// A wheel is not braked to less than the speed of the ground minus this share of it; 1 is a brake without anti-lock.
    pub anti_lock_slip: f64,
    /// Hand brake of one rear wheel, N m; without anti-lock.
    pub handbrake: f64,
}

impl Default for BrakeParameters {
    fn default() -> Self {
        Self { torque: 6_000.0, front_share: 0.65, anti_lock_slip: 0.05, handbrake: 2_500.0 }
    }
}

impl BrakeParameters {
    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("torque").number(self.torque, 0.0, 1e6, "N m")?;
        key.at("front_share").number(self.front_share, 0.0, 1.0, "")?;
        key.at("anti_lock_slip").number(self.anti_lock_slip, 0.005, 1.0, "")?;
        key.at("handbrake").number(self.handbrake, 0.0, 1e6, "N m")
    }
}

/// `[vehicle.steering]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SteeringParameters {
    /// Largest angle, deg.
    pub max_deg: f64,
    /// Rate, deg/s.
    pub rate_deg: f64,
    /// The angle is limited so that a car that follows its wheels is accelerated sideways at most so much, m/s².
    pub acceleration: f64,
    /// 1: all wheels turn about one point; 0: front wheels stay parallel.
    pub ackermann: f64,
    /// Time constant of the pedals, s.
    pub pedal_time: f64,
}

impl Default for SteeringParameters {
    fn default() -> Self {
        Self { max_deg: 35.0, rate_deg: 120.0, acceleration: 7.5, ackermann: 1.0, pedal_time: 0.04 }
    }
}

impl SteeringParameters {
    pub(super) fn check(&self, key: &Key, max_deg: f64) -> Result<(), ArenaError> {
        key.at("max_deg").number(self.max_deg, 0.0, max_deg, "deg")?;
        key.at("rate_deg").number(self.rate_deg, 1.0, 3_600.0, "deg/s")?;
        key.at("acceleration").number(self.acceleration, 0.1, 100.0, "m/s^2")?;
        key.at("ackermann").number(self.ackermann, 0.0, 1.0, "")?;
        key.at("pedal_time").number(self.pedal_time, 0.0, 5.0, "s")
    }
}
