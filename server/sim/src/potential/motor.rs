//! Motor: a torque about a hinge's axis, between two wheels, or a force along a slider's, towards a velocity and never
//! above a limit.

use glam::{DMat3, DVec3};

use super::axle::{Motor, clamped};
use super::{AxleId, FrameIndex, HingeId, PairBlocks, SliderId, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::Frame;
use crate::error::{SimError, require};

slotmap::new_key_type! {
    /// Handle of a motor.
    pub struct MotorId;
}

/// A motor to be added. It goes when its joint goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorDesc {
    /// What it drives.
    pub joint: Driven,
    /// What it does at first; [`crate::World::set_motor`] changes that at any tick. At a slider speed is in m/s, gain in
    /// N s/m, and what is called torque a force in N.
    pub motor: Motor,
}

/// What a motor drives: the second end of a joint against its first, the second wheel against the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driven {
    /// About its axis.
    Hinge(HingeId),
    /// Along its axis.
    Slider(SliderId),
    /// The wheels of two axles of one chassis, about the mean of their axes. At a target of 0 it is the clutch of a limited
    /// or locked differential.
    Wheels([AxleId; 2]),
}

impl Motor {
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require(self.target_speed.abs() < 1e9, "target_speed", self.target_speed, "within 1e9 rad/s (or m/s)")?;
        require((0.0..1e15).contains(&self.gain), "gain", self.gain, "0 to below 1e15 N m s/rad (or N s/m)")?;
        require((0.0..1e9).contains(&self.max_torque), "max_torque", self.max_torque, "0 to below 1e9 N m (or N)")
    }
}

/// A motor in an island. Its axis and arms are those of the start of the tick, so that its energy is a function of the
/// twists alone.
#[derive(Clone, Debug)]
pub(crate) struct MotorTerm {
    frames: [FrameIndex; 2],
    motor: Motor,
    drive: Drive,
    /// Unit vector in world axes.
    axis: DVec3,
}

/// What a motor pushes.
#[derive(Clone, Copy, Debug)]
enum Drive {
    Turn,
    /// Both frames' arms to the driven point, m.
    Slide([DVec3; 2]),
}

impl MotorTerm {
    /// A motor about `axis`.
    pub fn turning(frames: [FrameIndex; 2], motor: Motor, axis: DVec3) -> Self {
        Self { frames, motor, drive: Drive::Turn, axis }
    }

    /// A motor along `axis`, at `arms` from both frames.
    pub fn sliding(frames: [FrameIndex; 2], motor: Motor, axis: DVec3, arms: [DVec3; 2]) -> Self {
        Self { frames, motor, drive: Drive::Slide(arms), axis }
    }

    /// How far the speed of the second frame against the first is above the target.
    fn error<S: Scalar>(&self, [a, b]: [&Frame<S>; 2]) -> S {
        let speed = match self.drive {
            Drive::Turn => b.angular - a.angular,
            Drive::Slide(arms) => b.velocity_at(arms[1]) - a.velocity_at(arms[0]),
        };
        speed.along(self.axis) - self.motor.target_speed
    }
}

impl Term for MotorTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        self.frames
    }

    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (energy, slope) = clamped(self.motor.gain, self.error(at), self.motor.max_torque);
        let push = Vec3::constant(self.axis).scale(slope);
        let wrenches = match self.drive {
            Drive::Turn => [-push, push].map(|torque| Wrench { torque, ..Wrench::ZERO }),
            Drive::Slide(arms) => [Wrench::at_fixed(-push, arms[0]), Wrench::at_fixed(push, arms[1])],
        };
        (energy * dt, wrenches)
    }

    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let Motor { gain, max_torque, .. } = self.motor;
        let is_free = gain * self.error(at).abs() < max_torque;
        let stiffness = outer(self.axis, self.axis) * if is_free { gain / dt } else { 0.0 };
        match self.drive {
            Drive::Slide(arms) => PairBlocks::of_points(stiffness, arms[0], arms[1]),
            Drive::Turn => {
                let mut blocks = PairBlocks::of_points(DMat3::ZERO, DVec3::ZERO, DVec3::ZERO);
                blocks.add_rotation(stiffness);
                blocks
            }
        }
    }
}
