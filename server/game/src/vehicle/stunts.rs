//! What a cartoon car does beside driving: boost, jump, turning in the air, getting up again.
//!
//! All of it are forces and torques for one tick: nothing is put anywhere.

use glam::DVec3;
use pita_sim::{SimError, World};

use super::VehicleParameters;
use super::rig::Rig;
use crate::Controls;
use crate::driver::Motion;

/// A car whose own up is lower than this lies on its side or roof.
const OVERTURNED: f64 = 0.5;
/// A car whose own up is higher than this stands.
const UPRIGHT: f64 = 0.97;
/// Faster than this it still tumbles, m/s.
const TUMBLING_SPEED: f64 = 2.0;
/// It gets up for at most so long at a time, s.
const RIGHTING_TIME: f64 = 1.5;
/// Wheels that must stand for a jump.
const JUMP_WHEELS: usize = 2;
/// Time in which a turn towards upright slows down, s, and in which its rate is reached, s.
const EASING: f64 = 0.25;
const RIGHTING_EASE: f64 = 0.1;

/// What it knows from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct Stunts {
    /// What is left in the boost's tank, s.
    boost_left: f64,
    jump_was_held: bool,
    /// Time until it can jump again, s.
    jump_rest: f64,
    overturned_for: f64,
    /// Time that it still tries to get up, s.
    righting_left: f64,
}

/// Where the car stands in this tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Footing {
    /// Wheels that touch something.
    pub wheels: usize,
    /// The chassis touches something.
    pub chassis: bool,
}

/// What a tick's stunts are done with.
pub(super) struct Stage<'a> {
    pub world: &'a mut World,
    pub rig: &'a Rig,
    pub parameters: &'a VehicleParameters,
    pub controls: &'a Controls,
    pub motion: &'a Motion,
    pub footing: Footing,
    pub dt: f64,
}

impl Stunts {
    /// A full tank.
    pub fn new(p: &VehicleParameters) -> Self {
        let (boost_left, jump_was_held) = (p.boost.lasts, false);
        Self { boost_left, jump_was_held, jump_rest: 0.0, overturned_for: 0.0, righting_left: 0.0 }
    }

    /// Pushes the car for this tick.
    ///
    /// # Errors
    /// What the engine says.
    pub(super) fn act(&mut self, mut stage: Stage) -> Result<(), SimError> {
        self.boost(&mut stage)?;
        self.jump(&mut stage)?;
        self.get_up(&mut stage)?;
        let is_flying = stage.footing.wheels == 0 && !stage.footing.chassis;
        if is_flying && self.righting_left <= 0.0 { steer_in_air(&mut stage) } else { Ok(()) }
    }

    fn boost(&mut self, stage: &mut Stage) -> Result<(), SimError> {
        let p = &stage.parameters.boost;
        if !stage.controls.boost || self.boost_left <= 0.0 {
            self.boost_left = (self.boost_left + stage.dt * p.lasts / p.refill).min(p.lasts);
            return Ok(());
        }
        let part = (self.boost_left / stage.dt).min(1.0);
        self.boost_left -= part * stage.dt;
        let push = stage.motion.rotation * DVec3::X * (p.force * part);
        stage.world.apply_force(stage.rig.chassis(), push, stage.motion.position)
    }

    fn jump(&mut self, stage: &mut Stage) -> Result<(), SimError> {
        let p = &stage.parameters.jump;
        let asked = stage.controls.jump && !self.jump_was_held;
        self.jump_was_held = stage.controls.jump;
        self.jump_rest = (self.jump_rest - stage.dt).max(0.0);
        if !asked || self.jump_rest > 0.0 || stage.footing.wheels < JUMP_WHEELS {
            return Ok(());
        }
        self.jump_rest = p.rest;
        let up = stage.motion.rotation * DVec3::Y;
        stage.rig.kick(stage.world, up * p.speed, stage.dt)
    }

    fn get_up(&mut self, stage: &mut Stage) -> Result<(), SimError> {
        let p = &stage.parameters.self_righting;
        let upright = stage.motion.upright();
        if self.righting_left > 0.0 {
            self.righting_left = if upright > UPRIGHT { 0.0 } else { self.righting_left - stage.dt };
            let wanted = towards_upright(stage.motion, p.rate);
            return turn(stage, wanted, RIGHTING_EASE, f64::INFINITY);
        }
        let lies = upright < OVERTURNED && stage.motion.velocity.length() < TUMBLING_SPEED;
        self.overturned_for = if lies { self.overturned_for + stage.dt } else { 0.0 };
        if self.overturned_for <= p.after || p.hop <= 0.0 {
            return Ok(());
        }
        (self.overturned_for, self.righting_left) = (0.0, RIGHTING_TIME);
        stage.rig.kick(stage.world, DVec3::Y * p.hop, stage.dt)
    }

    /// Tank, jump button, time until it can jump, time that it lies, time that it gets up.
    pub fn to_array(self) -> [f64; 5] {
        let held = f64::from(u8::from(self.jump_was_held));
        [self.boost_left, held, self.jump_rest, self.overturned_for, self.righting_left]
    }

    /// What [`Self::to_array`] answered.
    pub fn from_array([boost_left, held, jump_rest, overturned_for, righting_left]: [f64; 5]) -> Self {
        Self { boost_left, jump_was_held: held != 0.0, jump_rest, overturned_for, righting_left }
    }
}

/// Levels the car and turns it as it is steered, as strongly as air control allows.
fn steer_in_air(stage: &mut Stage) -> Result<(), SimError> {
    let p = &stage.parameters.air_control;
    let level = towards_upright(stage.motion, p.rate);
    let wanted = level - DVec3::Y * (stage.controls.steer * p.rate);
    turn(stage, wanted, p.time, p.rate / p.time)
}

/// The angular velocity that turns the car upright, at most `rate` rad/s, and slower at the end.
fn towards_upright(motion: &Motion, rate: f64) -> DVec3 {
    let up = motion.rotation * DVec3::Y;
    let across = up.cross(DVec3::Y);
    let angle = across.length().atan2(up.y);
    // On its roof it rolls, to whichever side.
    let axis = across.try_normalize().unwrap_or(motion.rotation * DVec3::X);
    axis * (angle / EASING).min(rate)
}

/// A torque that brings the car to the angular velocity `wanted` with the time constant `ease` s, by an angular
/// acceleration of at most `most` rad/s². Implicit in the difference: stable at any tick.
fn turn(stage: &mut Stage, wanted: DVec3, ease: f64, most: f64) -> Result<(), SimError> {
    let chassis = stage.rig.chassis();
    let turns = stage.world.angular_velocity(chassis).unwrap_or_default();
    let acceleration = ((wanted - turns) / (ease + stage.dt)).clamp_length_max(most);
    let rotation = stage.motion.rotation;
    let torque = rotation * (stage.parameters.inertia() * (rotation.inverse() * acceleration));
    stage.world.apply_torque(chassis, torque)
}
