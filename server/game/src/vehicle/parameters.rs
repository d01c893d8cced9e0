//! The numbers of a car: a small all-wheel-drive car of 1200 kg unless the arena's file says otherwise.
//!
//! Owns the keys of `[vehicle]` and their ranges: the body here, what it stands on in [`running_gear`], what drives it in
//! [`drive_train`], what a cartoon car does besides in [`stunts`]. Numbers alone: what they do is the modules' of the
//! vehicle.

pub mod drive_train;
pub mod running_gear;
pub mod stunts;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::arena_file::{ArenaError, Key};
use drive_train::{DifferentialParameters, Drive, EngineParameters, GearboxParameters};
use running_gear::{BrakeParameters, SteeringParameters, SuspensionParameters};
use stunts::{AirControlParameters, BoostParameters, JumpParameters, SelfRightingParameters, SquashParameters};

/// Standard acceleration of gravity, m/s²: what the static sag of the suspension and the grip of tyres are taken at.
pub const STANDARD_GRAVITY: f64 = 9.81;

/// Parameters of a vehicle; `[vehicle]` of an arena file. How the default car handles is in `docs/VEHICLE.md`.
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
    /// Force of the air over the speed squared, N s²/m².
    pub drag: f64,
    /// Driven wheels.
    pub drive: Drive,
    /// Speed that the engine strives for, m/s.
    pub top_speed: f64,
    /// The same backwards, m/s.
    pub reverse_speed: f64,
    /// Springs, dampers and anti-roll bars.
    pub suspension: SuspensionParameters,
    /// What the throttle gives.
    pub engine: EngineParameters,
    /// Gears.
    pub gearbox: GearboxParameters,
    /// What shares the torque between wheels.
    pub differential: DifferentialParameters,
    /// Brakes.
    pub brakes: BrakeParameters,
    /// Steering.
    pub steering: SteeringParameters,
    /// A push from behind.
    pub boost: BoostParameters,
    /// A jump from the wheels.
    pub jump: JumpParameters,
    /// Turning in the air.
    pub air_control: AirControlParameters,
    /// Getting up again.
    pub self_righting: SelfRightingParameters,
    /// A body that gives way to what it feels.
    pub squash: SquashParameters,
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
            drag: 0.4,
            drive: Drive::All,
            top_speed: 50.0,
            reverse_speed: 8.0,
            suspension: SuspensionParameters::default(),
            engine: EngineParameters::default(),
            gearbox: GearboxParameters::default(),
            differential: DifferentialParameters::default(),
            brakes: BrakeParameters::default(),
            steering: SteeringParameters::default(),
            boost: BoostParameters::default(),
            jump: JumpParameters::default(),
            air_control: AirControlParameters::default(),
            self_righting: SelfRightingParameters::default(),
            squash: SquashParameters::default(),
        }
    }
}

impl VehicleParameters {
    /// Mass of the whole car, kg.
    pub fn mass(&self) -> f64 {
        self.chassis_mass + 4.0 * self.wheel_mass
    }

    /// Moments of inertia of the whole car about its own axes, its wheels being points at their hubs, kg m².
    pub fn inertia(&self) -> DVec3 {
        let of_box = |a: f64, b: f64| self.chassis_mass / 3.0 * (a * a + b * b);
        let of_wheels = |a: f64, b: f64| 4.0 * self.wheel_mass * (a * a + b * b);
        let [x, y, z] = self.chassis_half;
        let (hub_x, hub_y, hub_z) = (0.5 * self.wheelbase, self.hub_height, 0.5 * self.track);
        DVec3::new(
            of_box(y, z) + of_wheels(hub_y, hub_z),
            of_box(z, x) + of_wheels(hub_z, hub_x),
            of_box(x, y) + of_wheels(hub_x, hub_y),
        )
    }

    /// Moment of inertia of a wheel about its axle, kg m²; that of a cylinder.
    pub fn wheel_inertia(&self) -> f64 {
        0.5 * self.wheel_mass * self.wheel_radius * self.wheel_radius
    }

    /// By how much the chassis presses the suspension at rest, m.
    pub fn static_sag(&self) -> f64 {
        self.chassis_mass * STANDARD_GRAVITY / (4.0 * self.suspension.stiffness)
    }

    /// Height of the chassis's centre above flat ground at rest, m.
    pub fn ride_height(&self) -> f64 {
        self.wheel_radius - self.hub_height - self.static_sag()
    }

    /// How far the centres of its bodies are from the ground point below it, while it rests: sideways and upwards, m.
    pub fn reach(&self) -> [f64; 2] {
        [0.5 * self.wheelbase.hypot(self.track), self.ride_height().max(self.wheel_radius)]
    }

    /// Largest steering angle at a forward speed in m/s, rad: v² tan δ / wheelbase is the acceleration sideways.
    pub fn steer_limit(&self, speed: f64) -> f64 {
        let by_speed = (self.wheelbase * self.steering.acceleration / (speed * speed)).atan();
        by_speed.min(self.steering.max_deg.to_radians())
    }

    /// Angle of a front wheel at `z` m to the right of the middle, for the angle `steer` in the middle, rad. At an Ackermann
    /// ratio of 1 all wheels turn about one point on the line of the rear axle, at 0 the front wheels stay parallel.
    pub fn wheel_angle(&self, steer: f64, z: f64) -> f64 {
        let tan = steer.tan();
        let about_one_point = (self.wheelbase * tan / (self.wheelbase + z * tan)).atan();
        steer + self.steering.ackermann * (about_one_point - steer)
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
        number("drag", self.drag, 0.0, 1e3, "N s^2/m^2")?;
        number("top_speed", self.top_speed, 0.0, 100.0, "m/s")?;
        number("reverse_speed", self.reverse_speed, 0.0, 100.0, "m/s")?;
        self.check_tables(key)
    }

    fn check_tables(&self, key: &Key) -> Result<(), ArenaError> {
        self.suspension.check(&key.at("suspension"))?;
        self.engine.check(&key.at("engine"))?;
        self.gearbox.check(&key.at("gearbox"), &self.engine)?;
        self.differential.check(&key.at("differential"))?;
        self.brakes.check(&key.at("brakes"))?;
        // Ackermann's inner wheel stays well below a right angle.
        let steer_max = (1.8 * self.wheelbase / self.track).atan().to_degrees().min(60.0).floor();
        self.steering.check(&key.at("steering"), steer_max)?;
        self.boost.check(&key.at("boost"))?;
        self.jump.check(&key.at("jump"))?;
        self.air_control.check(&key.at("air_control"))?;
        self.self_righting.check(&key.at("self_righting"))?;
        self.squash.check(&key.at("squash"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steering_is_limited_by_speed() {
        let p = VehicleParameters::default();
        assert_eq!(p.steer_limit(0.0), p.steering.max_deg.to_radians());
        let (speed, limit) = (30.0, p.steer_limit(30.0));
        let sideways = speed * speed * limit.tan() / p.wheelbase;
        assert!((sideways - p.steering.acceleration).abs() < 1e-9, "{sideways}");
    }

    #[test]
    fn front_wheels_turn_about_one_point() {
        let mut p = VehicleParameters::default();
        for steer in [0.5f64, -0.3, 0.01] {
            let radius = p.wheelbase / steer.tan();
            for z in [-0.8, 0.8] {
                // The centre of the turn is at z = −radius.
                let own_radius = p.wheelbase / p.wheel_angle(steer, z).tan();
                assert!((own_radius - (radius + z)).abs() < 1e-9, "{steer} {z}");
            }
        }
        assert_eq!(p.wheel_angle(0.0, 0.8), 0.0);
        p.steering.ackermann = 0.0;
        assert_eq!(p.wheel_angle(0.5, 0.8), 0.5);
    }
}
