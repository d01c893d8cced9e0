//! What drives a car: numbers and ranges of engine, gears and differentials.

use serde::{Deserialize, Serialize};

use crate::arena_file::{ArenaError, Key};
use crate::vehicle::rig::Wheel;

/// rad/s in a revolution a minute.
pub const RPM: f64 = std::f64::consts::TAU / 60.0;

/// Most points of a torque curve, and most gears.
const POINTS_MAX: usize = 32;
const GEARS_MAX: usize = 12;

/// Driven wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// Front wheels.
    Front,
    /// Rear wheels.
    Rear,
    /// All four.
    All,
}

impl Drive {
    /// Whether it drives `wheel`.
    pub fn drives(self, wheel: Wheel) -> bool {
        match self {
            Self::Front => wheel.is_front(),
            Self::Rear => !wheel.is_front(),
            Self::All => true,
        }
    }

    /// Share of all torque that each wheel of the front, or the rear, axle gets.
    pub fn wheel_share(self, front: bool, front_share: f64) -> f64 {
        match self {
            Self::Front => 0.5 * f64::from(u8::from(front)),
            Self::Rear => 0.5 * f64::from(u8::from(!front)),
            Self::All => 0.5 * if front { front_share } else { 1.0 - front_share },
        }
    }
}

/// `[vehicle.engine]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EngineParameters {
    /// Torque at full throttle over speed: pairs of rpm and N m, in between linear, beyond the ends constant.
    pub torque: Vec<[f64; 2]>,
    /// Speed below which the clutch slips under throttle, rpm.
    pub clutch_rpm: f64,
    /// Speed at which it is cut off, rpm.
    pub limit_rpm: f64,
    /// Torque with the throttle released, N m.
    pub brake_torque: f64,
    /// Driven wheels run at most so much faster than the ground, m/s at the tyre.
    pub traction_slip: f64,
}

impl Default for EngineParameters {
    fn default() -> Self {
        let torque = [[1_000.0, 170.0], [3_000.0, 240.0], [5_500.0, 240.0], [7_000.0, 190.0]];
        Self {
            torque: torque.to_vec(),
            clutch_rpm: 2_500.0,
            limit_rpm: 7_000.0,
            brake_torque: 30.0,
            traction_slip: 2.0,
        }
    }
}

impl EngineParameters {
    /// Torque at full throttle at a speed in rpm, N m.
    pub fn torque_at(&self, rpm: f64) -> f64 {
        let above = self.torque.partition_point(|point| point[0] <= rpm);
        match (above.checked_sub(1).map(|below| self.torque[below]), self.torque.get(above)) {
            (Some([from, low]), Some(&[to, high])) => low + (high - low) * (rpm - from) / (to - from),
            (Some([_, end]), None) | (None, Some(&[_, end])) => end,
            (None, None) => 0.0,
        }
    }

    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        let points = key.at("torque");
        points.count(self.torque.len(), 1, POINTS_MAX, "points")?;
        let mut least = 0.0;
        for (i, [rpm, torque]) in self.torque.iter().enumerate() {
            points.index(i).index(0).number(*rpm, least, 1e5, "rpm, one more than the point before")?;
            points.index(i).index(1).number(*torque, 0.0, 1e5, "N m")?;
            least = rpm + 1.0;
        }
        key.at("clutch_rpm").number(self.clutch_rpm, 0.0, 1e5, "rpm")?;
        key.at("limit_rpm").number(self.limit_rpm, 100.0, 1e5, "rpm")?;
        key.at("brake_torque").number(self.brake_torque, 0.0, 1e4, "N m")?;
        key.at("traction_slip").number(self.traction_slip, 0.1, 100.0, "m/s")
    }
}

/// `[vehicle.gearbox]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GearboxParameters {
    /// Ratios of the forward gears, first to last, falling.
    pub ratios: Vec<f64>,
    /// Ratio of the reverse gear.
    pub reverse_ratio: f64,
    /// Ratio of the final drive, by which all others are multiplied.
    pub final_ratio: f64,
    /// Speed of the engine above which it shifts up, rpm.
    pub up_rpm: f64,
    /// Speed of the engine below which it shifts down, rpm.
    pub down_rpm: f64,
    /// Time without torque while it shifts, s.
    pub shift_time: f64,
}

impl Default for GearboxParameters {
    fn default() -> Self {
        Self {
            ratios: vec![3.2, 2.1, 1.5, 1.15, 0.9],
            reverse_ratio: 3.2,
            final_ratio: 3.9,
            up_rpm: 6_500.0,
            down_rpm: 3_500.0,
            shift_time: 0.12,
        }
    }
}

impl GearboxParameters {
    /// Turns of the engine over those of the wheels in `gear`, 1 to the last; 0 is the reverse gear.
    pub fn ratio(&self, gear: usize) -> f64 {
        let own = gear.checked_sub(1).map_or(self.reverse_ratio, |i| self.ratios[i.min(self.ratios.len() - 1)]);
        own * self.final_ratio
    }

    pub(super) fn check(&self, key: &Key, engine: &EngineParameters) -> Result<(), ArenaError> {
        let ratios = key.at("ratios");
        ratios.count(self.ratios.len(), 1, GEARS_MAX, "gears")?;
        let mut most = 20.0;
        for (i, &ratio) in self.ratios.iter().enumerate() {
            ratios.index(i).number(ratio, 0.05, most, "and less than the gear before")?;
            most = ratio - 0.01;
        }
        key.at("reverse_ratio").number(self.reverse_ratio, 0.05, 20.0, "")?;
        key.at("final_ratio").number(self.final_ratio, 0.05, 20.0, "")?;
        key.at("up_rpm").number(self.up_rpm, 100.0, engine.limit_rpm, "rpm, engine.limit_rpm")?;
        // A gear that shifted up must not shift down at once.
        let steps = self.ratios.windows(2).map(|pair| pair[1] / pair[0]);
        let down_max = (0.98 * self.up_rpm * steps.fold(1.0, f64::min)).floor();
        key.at("down_rpm").number(self.down_rpm, 0.0, down_max, "rpm, what shifting up at up_rpm leaves")?;
        key.at("shift_time").number(self.shift_time, 0.0, 5.0, "s")
    }
}

/// How a differential shares torque between the wheels of an axle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Differential {
    /// Equally, at any difference of speeds.
    Open,
    /// As an open one, with a clutch between the wheels.
    Limited,
    /// Both wheels turn together.
    Locked,
}

/// `[vehicle.differential]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DifferentialParameters {
    /// Share of the torque that the front axle gets where all wheels are driven.
    pub front_share: f64,
    /// Between the front wheels.
    pub front: Differential,
    /// Between the rear wheels.
    pub rear: Differential,
    /// Torque of a limited one's clutch without drive, N m.
    pub preload: f64,
    /// What the clutch gains by drive, as a share of the axle's torque.
    pub locking: f64,
}

impl Default for DifferentialParameters {
    fn default() -> Self {
        Self { front_share: 0.5, front: Differential::Open, rear: Differential::Limited, preload: 30.0, locking: 0.3 }
    }
}

impl DifferentialParameters {
    /// Most torque that passes from wheel to wheel of an axle that gets `torque`, N m.
    pub fn clutch(&self, front: bool, torque: f64) -> f64 {
        match if front { self.front } else { self.rear } {
            Differential::Open => 0.0,
            Differential::Limited => self.preload + self.locking * torque.abs(),
            Differential::Locked => LOCKED,
        }
    }

    pub(super) fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("front_share").number(self.front_share, 0.0, 1.0, "")?;
        key.at("preload").number(self.preload, 0.0, 1e5, "N m")?;
        key.at("locking").number(self.locking, 0.0, 1.0, "")
    }
}

/// Torque of a locked differential, N m: more than any tyre takes.
const LOCKED: f64 = 1e8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_torque_curve_is_linear_between_its_points_and_constant_beyond() {
        let engine = EngineParameters { torque: vec![[1_000.0, 100.0], [3_000.0, 200.0]], ..Default::default() };
        let at = |rpm| engine.torque_at(rpm);
        assert_eq!([0.0, 1_000.0, 2_000.0, 3_000.0, 9_000.0].map(at), [100.0, 100.0, 150.0, 200.0, 200.0]);
    }

    #[test]
    fn all_torque_reaches_wheels() {
        for drive in [Drive::Front, Drive::Rear, Drive::All] {
            let sum: f64 = [true, false].map(|front| 2.0 * drive.wheel_share(front, 0.3)).iter().sum();
            assert!((sum - 1.0).abs() < 1e-12, "{drive:?}");
        }
    }
}
