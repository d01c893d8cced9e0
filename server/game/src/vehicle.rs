//! A car: a chassis and four wheels, all of them rigid bodies, held together and driven by potentials.
//!
//! Owns the vehicle's logic in stage 3: from the controls of its driver to steering angles, drive torques and brakes.
//! The bodies are [`rig`]'s, the smoothing of the controls is [`response`]'s, the numbers are [`parameters`]'.
//! The vehicle pushes on the world only through the controls of its four axles.

pub mod parameters;
pub mod response;
pub mod rig;

use glam::DVec3;
use pita_sim::{AxleControl, BodyId, Motor, SimError, World};

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::driver::{Driver, Motion};
use crate::rehearsal::Memory;
use crate::step::Step;
use crate::{Controls, Pose};
pub use parameters::{Drive, VehicleParameters};
use response::Response;
use rig::{Rig, WHEELS, Wheel};

/// Height of the wheels above the underside of the car that was, after a reset, m: clears the ground where an overturned
/// car is reset on a slope.
const RESET_LIFT: f64 = 0.3;

/// Speed above which a car cannot be reset, m/s.
const RESET_SPEED_MAX: f64 = 3.0;

/// Time between two resets of a car, s.
const RESET_REST: f64 = 2.0;

/// Slip at which a driven wheel's torque passes from none to full, rad/s. A motor that switches within a smaller band is
/// stiff against the wheel's inertia and costs Newton iterations; a wider one leaves top speed short.
const MOTOR_BAND: f64 = 4.0;

/// A car with its driver.
pub struct Vehicle {
    info: ActorInfo,
    parameters: VehicleParameters,
    rig: Rig,
    driver: Driver,
    controls: Controls,
    response: Response,
    reset_was_held: bool,
    /// Time until the reset button works again, s.
    reset_rest: f64,
}

impl Vehicle {
    /// Adds the vehicle to `world` on the ground at `pose`, at rest.
    ///
    /// # Errors
    /// What the engine says where it refuses a body or an axle; nothing stays behind then.
    pub fn add(
        world: &mut World,
        identity: Identity,
        parameters: VehicleParameters,
        driver: Driver,
        pose: Pose,
    ) -> Result<Self, SimError> {
        let rig = Rig::add(world, &parameters, pose)?;
        let Identity { id, name, slot } = identity;
        let info = ActorInfo { id, kind: "vehicle", name, slot, parts: rig.parts(world) };
        let (controls, response) = (Controls::default(), Response::default());
        Ok(Self { info, parameters, rig, driver, controls, response, reset_was_held: false, reset_rest: 0.0 })
    }

    /// Puts the car back on its wheels where it is, when the button goes down. Not while it still moves fast, nor again
    /// at once: it would be a brake, and a ladder.
    fn reset_if_asked(&mut self, step: &mut Step, motion: &Motion) -> Result<(), SimError> {
        let asked = self.controls.reset && !self.reset_was_held;
        self.reset_was_held = self.controls.reset;
        self.reset_rest = (self.reset_rest - step.dt).max(0.0);
        let speed = motion.velocity.length();
        if !asked || self.reset_rest > 0.0 || speed > RESET_SPEED_MAX {
            return Ok(());
        }
        self.reset_rest = RESET_REST;
        let lift = RESET_LIFT - self.parameters.chassis_half[1];
        let pose = Pose { position: motion.position + DVec3::Y * lift, yaw: motion.yaw() };
        self.place(step.world, pose)
    }

    /// What the axle of `wheel` is told, at the forward speed `speed` in m/s.
    fn axle_control(&self, wheel: Wheel, speed: f64) -> AxleControl {
        let p = &self.parameters;
        AxleControl {
            steer: if wheel.is_front() { p.wheel_angle(self.response.steer(), wheel.z(p)) } else { 0.0 },
            drive: if p.drive.drives(wheel) { self.motor(speed) } else { Motor::default() },
            brake: self.brake(wheel),
        }
    }

    /// The engine's share of one driven wheel.
    ///
    /// It asks for the speed that the car can have and gives what torque the throttle and the power allow. The
    /// asked-for speed is kept near the car's own, so that wheels do not spin away and lose their side force.
    fn motor(&self, speed: f64) -> Motor {
        let p = &self.parameters;
        let wheels = p.drive.wheels();
        let throttle = self.response.throttle();
        let (direction, top) = if self.controls.reverse { (-1.0, p.reverse_speed) } else { (1.0, p.top_speed) };
        if throttle <= 0.0 {
            // The engine turns with the wheels and brakes them.
            return motor(0.0, p.coast_torque / wheels);
        }
        let wanted = (speed * direction).max(0.0) + p.launch_slip;
        let by_power = p.engine_power / (speed.abs().max(1.0) / p.wheel_radius);
        let torque = throttle * p.engine_torque.min(by_power) / wheels;
        // A wheel that rolls towards +x turns about −z.
        motor(-direction * wanted.min(top) / p.wheel_radius, torque)
    }

    fn brake(&self, wheel: Wheel) -> f64 {
        let p = &self.parameters;
        let pedal = self.response.brake() * if wheel.is_front() { p.brake_torque_front } else { p.brake_torque_rear };
        let by_hand = self.controls.handbrake && !wheel.is_front();
        if by_hand { pedal.max(p.handbrake_torque) } else { pedal }
    }
}

/// Full torque at a slip of [`MOTOR_BAND`], nothing at the target.
fn motor(target_speed: f64, max_torque: f64) -> Motor {
    Motor { target_speed, gain: max_torque / MOTOR_BAND, max_torque }
}

/// Who a vehicle is.
#[derive(Clone, Debug)]
pub struct Identity {
    /// [`ActorInfo::id`].
    pub id: u32,
    /// [`ActorInfo::name`].
    pub name: String,
    /// [`ActorInfo::slot`].
    pub slot: Option<u16>,
}

impl Actor for Vehicle {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.rig.bodies()
    }

    /// Throttle, brake, steering, whether reset was held, time until it works again.
    fn memory(&self) -> Memory {
        let [throttle, brake, steer] = self.response.to_array();
        [throttle, brake, steer, f64::from(u8::from(self.reset_was_held)), self.reset_rest, 0.0, 0.0, 0.0]
    }

    fn recall(&mut self, memory: &Memory) {
        let [throttle, brake, steer, held, rest, ..] = *memory;
        self.response = Response::from_array([throttle, brake, steer]);
        (self.reset_was_held, self.reset_rest) = (held != 0.0, rest);
    }

    fn control(&mut self, controls: Controls) {
        self.controls = controls.in_range();
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        let chassis = self.bodies()[0];
        let motion = Motion::of(step.world, chassis).ok_or(SimError::Gone { what: "the chassis" })?;
        if let Some(controls) = self.driver.decide(&motion, step.dt) {
            self.controls = controls;
        }
        self.reset_if_asked(step, &motion)?;
        let speed = motion.forward_speed();
        self.response.follow(&self.controls, &self.parameters, speed, step.dt);
        for wheel in WHEELS {
            let control = self.axle_control(wheel, speed);
            step.world.set_axle(self.rig.axle(wheel), control)?;
        }
        Ok(())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Spawn
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.response = Response::default();
        self.rig.place(world, pose)
    }
}
