//! Universal joint: two points held together, and an axis of each body at right angles to one of the other. The turns
//! about both axes are free.

use glam::DVec3;

use super::alignment::TILT;
use super::ball_joint::BallJointTerm;
use super::hinge::HingeDesc;
use super::hold::{Hold, Joint, Memory, Scale, TOLERANCE};
use super::{Anchor, FrameIndex, PairBlocks, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::{Frame, Twist};
use crate::error::SimError;

slotmap::new_key_type! {
    /// Handle of a universal joint.
    pub struct UniversalJointId;
}

/// A universal joint to be added. Its two bodies do not collide with each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniversalJointDesc {
    /// Point of the first body.
    pub a: Anchor,
    /// Point of the second body.
    pub b: Anchor,
    /// Axis about which the cross turns in the first part's frame (the world's where there is no body), of any length.
    pub axis_a: DVec3,
    /// The other axis, in the second part's frame. The two are held at right angles.
    pub axis_b: DVec3,
    /// How far the points may be apart at the end of a tick, m.
    pub tolerance: f64,
    /// How far the axes may be off the right angle at the end of a tick, rad.
    pub tilt: f64,
}

impl UniversalJointDesc {
    /// A joint that is held to a millimetre and a milliradian.
    pub fn new(a: Anchor, b: Anchor, axis_a: DVec3, axis_b: DVec3) -> Self {
        Self { a, b, axis_a, axis_b, tolerance: TOLERANCE, tilt: TILT }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        // The numbers are a hinge's, within the same ranges.
        let Self { a, b, axis_a, axis_b, tolerance, tilt } = *self;
        HingeDesc { a, b, axis_a, axis_b, tolerance, tilt }.validate()
    }
}

/// A universal joint in an island: a ball joint, and energy ½ k (a · b)².
#[derive(Clone, Debug)]
pub(crate) struct UniversalJointTerm {
    place: BallJointTerm,
    /// Unit vectors in the first and in the second frame.
    axes: [DVec3; 2],
    hold: Hold,
}

impl UniversalJointTerm {
    /// `axes` are unit vectors; `tilt` is the tolerance, rad.
    pub fn new(place: BallJointTerm, axes: [DVec3; 2], tilt: f64, scale: Scale, memory: Memory) -> Self {
        Self { place, axes, hold: Hold::new(scale, tilt, memory.turn_stiffening) }
    }

    /// Cosine of the angle between the axes, and its derivative with respect to turns of the second frame.
    fn cosine<S: Scalar>(&self, [a, b]: [&Frame<S>; 2]) -> (S, Vec3<S>) {
        let (a, b) = (a.arm(self.axes[0]), b.arm(self.axes[1]));
        (a.dot(b), b.cross(a))
    }
}

impl Joint for UniversalJointTerm {
    fn gap(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.place.gap(at)
    }

    fn tilt(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.cosine(at).0.abs().min(1.0).asin()
    }

    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool {
        self.place.is_open(at) || self.hold.is_open(self.tilt(at))
    }

    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory {
        Memory { turn_stiffening: self.hold.remember(self.tilt(at)), ..self.place.remember(at) }
    }
}

impl Term for UniversalJointTerm {
    const BENDS: bool = BallJointTerm::BENDS;

    fn frames(&self) -> [FrameIndex; 2] {
        self.place.frames()
    }

    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (energy, [a, b]) = self.place.evaluate(dt, at);
        let (cosine, slope) = self.cosine(at);
        let pull = cosine * self.hold.stiffness;
        let torque = slope.scale(pull);
        let wrenches = [Wrench { torque: a.torque - torque, ..a }, Wrench { torque: b.torque + torque, ..b }];
        (energy + cosine * pull * 0.5, wrenches)
    }

    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let mut blocks = self.place.hessian(dt, at);
        let slope = DVec3::from(self.cosine(at).1);
        blocks.add_rotation(outer(slope, slope) * self.hold.stiffness);
        blocks
    }

    fn relinearise(&mut self, dt: f64, at: [&Frame<f64>; 2]) {
        self.place.relinearise(dt, at);
    }

    fn propose(&mut self, step: [Twist; 2]) {
        self.place.propose(step);
    }

    fn stiffen(&mut self, at: [&Frame<f64>; 2]) -> bool {
        let tilt = self.tilt(at);
        // Both, whatever the first answers.
        self.place.stiffen(at) | self.hold.stiffen(tilt)
    }
}
