//! The numbers of a tornado, as an arena file has them.

use serde::Deserialize;

use super::life::Lifespan;
use crate::arena_file::{ArenaError, ArenaFile, Key, WarpKeyFile, check_warp};

/// Most legs of a path.
const LEGS_MAX: usize = 256;

/// A tornado of an arena file.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TornadoParameters {
    /// From foot to top, m.
    pub height: f64,
    /// Of the orbit at the foot, m.
    pub foot_radius: f64,
    /// Of the orbit at the top, and of the sphere that sees victims there, m.
    pub top_radius: f64,
    /// How far from the foot it sees victims and draws them in, m.
    pub reach: f64,
    /// At which its waist and top follow what is below them, Hz.
    pub sway_frequency: f64,
    /// Of that; 1 is critical.
    pub sway_damping: f64,
    /// Largest acceleration along the path, m/s².
    pub path_acceleration: f64,
    /// Of what goes around, m/s.
    pub swirl_speed: f64,
    /// Of what goes up, m/s.
    pub lift_speed: f64,
    /// After this time 1/e of the difference to the flow is left, s.
    pub grip: f64,
    /// Largest acceleration of a victim, m/s².
    pub max_acceleration: f64,
    /// Heaviest victim, kg.
    pub max_mass: f64,
    /// Most victims at a time.
    pub victims: usize,
    /// Longest that it holds a victim, s.
    pub hold_time: f64,
    /// How long it leaves in peace whom it dropped, s.
    pub peace_time: f64,
    /// It looks for victims every so many ticks.
    pub sense_period: u32,
    /// Of its mesh, rad/s.
    pub spin_speed: f64,
    /// Turn of its mesh about the axis with each metre up, rad/m.
    pub twist: f64,
    /// Of appearing, and of disappearing, s.
    pub fade_time: f64,
    /// Between them, s.
    pub stay_time: f64,
    /// Until it appears again, at the next end of a leg, s; 0 for never disappearing.
    pub away_time: f64,
    /// Most particles of dust.
    pub dust: usize,
    /// Of a particle, s.
    pub dust_life: f64,
    /// It sees to its dust every so many ticks.
    pub fx_period: u32,
    /// Its closed path.
    pub legs: Vec<LegFile>,
    /// Key-frames of its mesh, on top of what its motion does to it.
    pub warp: Vec<WarpKeyFile>,
    /// After which the key-frames begin again, s.
    pub warp_period: f64,
}

/// A leg of the path.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegFile {
    /// Point of the ground where it ends, m.
    pub to: [f64; 3],
    /// It is there after 1 / frequency, Hz.
    pub frequency: f64,
    /// 1 is critical, below it goes past and comes back.
    #[serde(default = "critical")]
    pub damping_ratio: f64,
    /// It stays there for so long, s.
    #[serde(default)]
    pub wait: f64,
}

fn critical() -> f64 {
    1.0
}

impl Default for TornadoParameters {
    fn default() -> Self {
        Self {
            height: 14.0,
            foot_radius: 3.0,
            top_radius: 6.0,
            reach: 7.0,
            sway_frequency: 0.5,
            sway_damping: 0.7,
            path_acceleration: 15.0,
            swirl_speed: 10.0,
            lift_speed: 5.0,
            grip: 0.25,
            max_acceleration: 60.0,
            max_mass: 5_000.0,
            victims: 64,
            hold_time: 6.0,
            peace_time: 4.0,
            sense_period: 3,
            spin_speed: 6.0,
            twist: 0.35,
            fade_time: 2.0,
            stay_time: 40.0,
            away_time: 8.0,
            dust: 32,
            dust_life: 1.5,
            fx_period: 4,
            legs: Vec::new(),
            warp: Vec::new(),
            warp_period: 0.0,
        }
    }
}

impl TornadoParameters {
    /// How long it appears, stays, disappears and is away.
    pub fn lifespan(&self) -> Lifespan {
        let Self { fade_time, stay_time, away_time, .. } = *self;
        Lifespan { fade_time, stay_time, away_time }
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first value that is not allowed; `key` is where the table is.
    pub fn check(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        let number = |name: &str, value, min, max, unit| key.at(name).number(value, min, max, unit);
        number("height", self.height, 2.0, 200.0, "m")?;
        number("foot_radius", self.foot_radius, 0.5, 50.0, "m")?;
        number("top_radius", self.top_radius, 0.5, 50.0, "m")?;
        number("reach", self.reach, self.foot_radius, 100.0, "m, and not less than foot_radius")?;
        number("sway_frequency", self.sway_frequency, 0.05, 2.0, "Hz")?;
        number("sway_damping", self.sway_damping, 0.3, 2.0, "")?;
        number("path_acceleration", self.path_acceleration, 0.1, 200.0, "m/s^2")?;
        number("swirl_speed", self.swirl_speed, 0.0, 40.0, "m/s")?;
        number("lift_speed", self.lift_speed, 0.0, 40.0, "m/s")?;
        number("grip", self.grip, 0.02, 5.0, "s")?;
        number("max_acceleration", self.max_acceleration, 0.1, 500.0, "m/s^2")?;
        number("max_mass", self.max_mass, 0.0, 1e6, "kg")?;
        key.at("victims").count(self.victims, 0, 256, "victims")?;
        number("hold_time", self.hold_time, 0.1, 600.0, "s")?;
        number("peace_time", self.peace_time, 0.0, 600.0, "s")?;
        key.at("sense_period").count(self.sense_period as usize, 1, 300, "ticks")?;
        number("spin_speed", self.spin_speed, -50.0, 50.0, "rad/s")?;
        number("twist", self.twist, -3.0, 3.0, "rad/m")?;
        number("fade_time", self.fade_time, 0.1, 60.0, "s")?;
        number("stay_time", self.stay_time, 0.0, 3_600.0, "s")?;
        number("away_time", self.away_time, 0.0, 3_600.0, "s")?;
        key.at("dust").count(self.dust, 0, 256, "particles")?;
        number("dust_life", self.dust_life, 0.1, 10.0, "s")?;
        key.at("fx_period").count(self.fx_period as usize, 1, 300, "ticks")?;
        self.check_legs(&key.at("legs"), file)?;
        check_warp(key, &self.warp, self.warp_period)
    }

    fn check_legs(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        key.count(self.legs.len(), 1, LEGS_MAX, "legs")?;
        for (i, leg) in self.legs.iter().enumerate() {
            let key = key.index(i);
            file.check_inside(&key.at("to"), leg.to)?;
            key.at("frequency").number(leg.frequency, 0.005, 2.0, "Hz")?;
            key.at("damping_ratio").number(leg.damping_ratio, 0.3, 5.0, "")?;
            key.at("wait").number(leg.wait, 0.0, 600.0, "s")?;
        }
        Ok(())
    }
}
