//! The numbers of a car: a small all-wheel-drive car of 1200 kg unless the arena's file says otherwise.

use serde::{Deserialize, Serialize};

use super::rig::Wheel;
use crate::arena_file::{ArenaError, Key};

/// Standard acceleration of gravity, m/s²; the static sag of the suspension is taken at it.
const STANDARD_GRAVITY: f64 = 9.81;

/// Parameters of a vehicle; `[vehicle]` of an arena file.
///
/// Handling of the default car on flat asphalt (µ = 1), one step a tick, as `tests/game/handling.rs` holds it:
///
/// | | 30 Hz | 25 Hz | 480 Hz | closed form |
/// |-|-|-|-|-|
/// | 0 to 100 km/h, s | 5.27 | 5.28 | 5.27 | 5.21 + the pedal's 0.06: engine torque, then power |
/// | braking from 20 m/s, m | 23.3 | 23.2 | 23.6 | 20.4 = v²/2µg; brakes stay 6 % below friction, the pedal takes 1.2 m |
/// | turning radius at full lock, 3.5 m/s, m | 3.95 | 3.95 | 3.94 | 3.93: the wheels' geometry |
/// | sideways at full lock from 15 m/s, m/s² | 7.53 | 7.53 | 7.52 | 7.5: [`steer_acceleration`](Self::steer_acceleration) |
/// | after 25 s of full throttle, m/s | 50 | 50 | 50 | 50: [`top_speed`](Self::top_speed) |
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VehicleParameters {
    /// Half extents of the chassis, forward, up, right, m. The centre of mass is its centre.
    pub chassis_half: [f64; 3],
    /// Mass without the wheels, kg.
    pub chassis_mass: f64,
    /// Coefficient of friction of the chassis.
    pub chassis_friction: f64,
    /// Distance between the axles, m.
    pub wheelbase: f64,
    /// Distance between the middles of a left and a right wheel, m.
    pub track: f64,
    /// Height of the unloaded hubs above the centre of mass, m.
    pub hub_height: f64,
    /// Mass of a wheel, kg.
    pub wheel_mass: f64,
    /// Radius of a wheel, m.
    pub wheel_radius: f64,
    /// Half the width of a wheel, m.
    pub wheel_half_width: f64,
    /// Radius of a wheel's rounded edges, m.
    pub wheel_rounding: f64,
    /// Coefficient of friction of a tyre.
    pub tyre_friction: f64,
    /// Spring of one wheel, N/m.
    pub suspension_stiffness: f64,
    /// Damper of one wheel, N s/m.
    pub suspension_damping: f64,
    /// Which wheels the engine drives.
    pub drive: Drive,
    /// Torque of the engine at full throttle, summed over the driven wheels, N m.
    pub engine_torque: f64,
    /// Power of the engine, W.
    pub engine_power: f64,
    /// Torque of the engine brake with the throttle released, summed over the driven wheels, N m.
    pub coast_torque: f64,
    /// Speed that the engine strives for, m/s.
    pub top_speed: f64,
    /// The same backwards, m/s.
    pub reverse_speed: f64,
    /// Driven wheels run at most so much faster than the car, m/s at the tyre.
    pub launch_slip: f64,
    /// Brake of one front wheel at full pedal, N m.
    pub brake_torque_front: f64,
    /// Brake of one rear wheel at full pedal, N m.
    pub brake_torque_rear: f64,
    /// Hand brake of one rear wheel, N m.
    pub handbrake_torque: f64,
    /// Time constant of the pedals, s.
    pub pedal_time: f64,
    /// Largest steering angle, deg.
    pub steer_max_deg: f64,
    /// Rate of the steering, deg/s.
    pub steer_rate_deg: f64,
    /// Steering is limited so that a car that follows its wheels is accelerated sideways at most so much, m/s².
    pub steer_acceleration: f64,
}

impl Default for VehicleParameters {
    fn default() -> Self {
        Self {
            chassis_half: [1.9, 0.3, 0.85],
            chassis_mass: 1100.0,
            chassis_friction: 0.3,
            wheelbase: 2.6,
            track: 1.6,
            hub_height: -0.25,
            wheel_mass: 25.0,
            wheel_radius: 0.35,
            wheel_half_width: 0.12,
            wheel_rounding: 0.04,
            tyre_friction: 1.0,
            suspension_stiffness: 40_000.0,
            suspension_damping: 4_000.0,
            drive: Drive::All,
            engine_torque: 2_400.0,
            engine_power: 150_000.0,
            coast_torque: 150.0,
            top_speed: 50.0,
            reverse_speed: 8.0,
            launch_slip: 2.0,
            brake_torque_front: 1_400.0,
            brake_torque_rear: 550.0,
            handbrake_torque: 2_500.0,
            pedal_time: 0.06,
            steer_max_deg: 35.0,
            steer_rate_deg: 120.0,
            steer_acceleration: 7.5,
        }
    }
}

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

    /// How many wheels it drives.
    pub fn wheels(self) -> f64 {
        if self == Self::All { 4.0 } else { 2.0 }
    }
}

impl VehicleParameters {
    /// Mass of the whole car, kg.
    pub fn mass(&self) -> f64 {
        self.chassis_mass + 4.0 * self.wheel_mass
    }

    /// By how much the chassis presses the suspension at rest, m.
    pub fn static_sag(&self) -> f64 {
        self.chassis_mass * STANDARD_GRAVITY / (4.0 * self.suspension_stiffness)
    }

    /// Height of the chassis's centre above flat ground at rest, m.
    pub fn ride_height(&self) -> f64 {
        self.wheel_radius - self.hub_height - self.static_sag()
    }

    /// Largest steering angle at a forward speed in m/s, rad: v² tan δ / wheelbase is the acceleration sideways.
    pub fn steer_limit(&self, speed: f64) -> f64 {
        let by_speed = (self.wheelbase * self.steer_acceleration / (speed * speed)).atan();
        by_speed.min(self.steer_max_deg.to_radians())
    }

    /// Angle of a front wheel at `z` m to the right of the middle, for the angle `steer` in the middle, rad (Ackermann:
    /// all wheels turn about one point on the line of the rear axle).
    pub fn wheel_angle(&self, steer: f64, z: f64) -> f64 {
        let tan = steer.tan();
        (self.wheelbase * tan / (self.wheelbase + z * tan)).atan()
    }

    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first number that is not finite or out of range, below `key`.
    pub fn check(&self, key: &Key) -> Result<(), ArenaError> {
        let number =
            |name: &str, value: f64, min: f64, max: f64, unit: &str| key.at(name).number(value, min, max, unit);
        for (i, half) in self.chassis_half.iter().enumerate() {
            key.at("chassis_half").index(i).number(*half, 0.1, 10.0, "m")?;
        }
        number("chassis_mass", self.chassis_mass, 50.0, 50_000.0, "kg")?;
        number("chassis_friction", self.chassis_friction, 0.0, 5.0, "")?;
        number("wheelbase", self.wheelbase, 0.5, 10.0, "m")?;
        number("track", self.track, 0.3, 5.0, "m")?;
        number("hub_height", self.hub_height, -5.0, 5.0, "m")?;
        number("wheel_mass", self.wheel_mass, 1.0, 2_000.0, "kg")?;
        number("wheel_radius", self.wheel_radius, 0.1, 2.0, "m")?;
        number("wheel_half_width", self.wheel_half_width, 0.02, 1.0, "m")?;
        // The engine's wheels have some tread between their edges.
        let rounding_max = 0.9 * self.wheel_half_width.min(self.wheel_radius);
        number("wheel_rounding", self.wheel_rounding, 0.0, rounding_max, "m")?;
        number("tyre_friction", self.tyre_friction, 0.0, 5.0, "")?;
        number("suspension_stiffness", self.suspension_stiffness, 1e3, 1e7, "N/m")?;
        number("suspension_damping", self.suspension_damping, 0.0, 1e6, "N s/m")?;
        self.check_controls(key)
    }

    fn check_controls(&self, key: &Key) -> Result<(), ArenaError> {
        let number =
            |name: &str, value: f64, min: f64, max: f64, unit: &str| key.at(name).number(value, min, max, unit);
        number("engine_torque", self.engine_torque, 0.0, 1e6, "N m")?;
        number("engine_power", self.engine_power, 0.0, 1e8, "W")?;
        number("coast_torque", self.coast_torque, 0.0, 1e6, "N m")?;
        number("top_speed", self.top_speed, 0.0, 100.0, "m/s")?;
        number("reverse_speed", self.reverse_speed, 0.0, 100.0, "m/s")?;
        number("launch_slip", self.launch_slip, 0.1, 100.0, "m/s")?;
        number("brake_torque_front", self.brake_torque_front, 0.0, 1e6, "N m")?;
        number("brake_torque_rear", self.brake_torque_rear, 0.0, 1e6, "N m")?;
        number("handbrake_torque", self.handbrake_torque, 0.0, 1e6, "N m")?;
        number("pedal_time", self.pedal_time, 0.0, 5.0, "s")?;
        // Ackermann's inner wheel stays well below a right angle.
        let steer_max = (1.8 * self.wheelbase / self.track).atan().to_degrees().min(60.0).floor();
        number("steer_max_deg", self.steer_max_deg, 0.0, steer_max, "deg")?;
        number("steer_rate_deg", self.steer_rate_deg, 1.0, 3_600.0, "deg/s")?;
        number("steer_acceleration", self.steer_acceleration, 0.1, 100.0, "m/s^2")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steering_is_limited_by_speed() {
        let p = VehicleParameters::default();
        assert_eq!(p.steer_limit(0.0), p.steer_max_deg.to_radians());
        let (speed, limit) = (30.0, p.steer_limit(30.0));
        let sideways = speed * speed * limit.tan() / p.wheelbase;
        assert!((sideways - p.steer_acceleration).abs() < 1e-9, "{sideways}");
    }

    #[test]
    fn front_wheels_turn_about_one_point() {
        let p = VehicleParameters::default();
        for steer in [0.5f64, -0.3, 0.01] {
            let radius = p.wheelbase / steer.tan();
            for z in [-0.8, 0.8] {
                // The centre of the turn is at z = −radius.
                let own_radius = p.wheelbase / p.wheel_angle(steer, z).tan();
                assert!((own_radius - (radius + z)).abs() < 1e-9, "{steer} {z}");
            }
        }
        assert_eq!(p.wheel_angle(0.0, 0.8), 0.0);
    }
}
