//! Universal joint: two points held together, and an axis of each body at right angles to one of the other. The turns
//! about both axes are free.

use glam::{DMat3, DVec3};

use super::alignment::{Aligned, TILT, Turns};
use super::ball_joint::BallJointTerm;
use super::hinge::HingeDesc;
use super::hold::{Hold, Memory, Scale, TOLERANCE};
use super::{Anchor, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::Frame;
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

/// A universal joint in an island.
pub(crate) type UniversalJointTerm = Aligned<BallJointTerm, RightAngle>;

/// Two directions held at right angles: energy ½ k (a · b)².
#[derive(Clone, Debug)]
pub(crate) struct RightAngle {
    /// Unit vectors in the first and in the second frame.
    axes: [DVec3; 2],
    hold: Hold,
}

impl RightAngle {
    /// `axes` are unit vectors; `tilt` is the tolerance, rad.
    pub fn new(axes: [DVec3; 2], tilt: f64, scale: Scale, memory: Memory) -> Self {
        Self { axes, hold: Hold::new(scale, tilt, memory.turn_stiffening) }
    }

    /// Cosine of the angle between the axes, and its derivative with respect to turns of the second frame.
    fn cosine<S: Scalar>(&self, [a, b]: [&Frame<S>; 2]) -> (S, Vec3<S>) {
        let (a, b) = (a.arm(self.axes[0]), b.arm(self.axes[1]));
        (a.dot(b), b.cross(a))
    }
}

impl Turns for RightAngle {
    fn tilt(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.cosine(at).0.abs().min(1.0).asin()
    }

    fn evaluate<S: Scalar>(&self, at: [&Frame<S>; 2]) -> (S, Vec3<S>) {
        let (cosine, slope) = self.cosine(at);
        let pull = cosine * self.hold.stiffness;
        (cosine * pull * 0.5, slope.scale(pull))
    }

    fn stiffness(&self, at: [&Frame<f64>; 2]) -> DMat3 {
        let slope = DVec3::from(self.cosine(at).1);
        outer(slope, slope) * self.hold.stiffness
    }

    fn hold(&self) -> &Hold {
        &self.hold
    }

    fn hold_mut(&mut self) -> &mut Hold {
        &mut self.hold
    }
}
