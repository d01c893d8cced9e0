//! Anti-roll bar: a spring against the difference of the travels of two wheels of one chassis.
//!
//! It couples three bodies, and a term sees two: each half pulls one wheel towards where the other one's travel will be if
//! that goes on as it does. It is off by the other wheel's acceleration times dt², of second order in the tick.

use glam::{DMat3, DVec3};

use super::{AxleDesc, AxleId, FrameIndex, PairBlocks, Term, Wrench};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::{Frame, Node};
use crate::error::{SimError, require};

slotmap::new_key_type! {
    /// Handle of an anti-roll bar.
    pub struct AntiRollBarId;
}

/// An anti-roll bar to be added. It goes when one of its axles goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntiRollBarDesc {
    /// Axles of one chassis.
    pub axles: [AxleId; 2],
    /// Force at each wheel over the difference of their travels, N/m.
    pub stiffness: f64,
}

impl AntiRollBarDesc {
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require((0.0..1e15).contains(&self.stiffness), "stiffness", self.stiffness, "0 to below 1e15 N/m")
    }
}

/// One half of a bar in an island.
#[derive(Clone, Debug)]
pub(crate) struct AntiRollTerm {
    /// Chassis, wheel.
    frames: [FrameIndex; 2],
    stiffness: f64,
    /// Height of the wheel's centre above that of the chassis, along its y axis, at which the bar is slack, m.
    slack: f64,
}

impl AntiRollTerm {
    /// Half of a bar of `stiffness` at the wheel of `axle`; the travel of the other wheel at the end of the tick is
    /// expected to be `other`, m.
    pub fn new(frames: [FrameIndex; 2], axle: &AxleDesc, stiffness: f64, other: f64) -> Self {
        Self { frames, stiffness, slack: axle.hub.y + other }
    }

    /// Travel of a wheel at the end of the tick if it goes on as it does, m.
    pub fn expected_travel(axle: &AxleDesc, [chassis, wheel]: [&Node; 2], dt: f64) -> f64 {
        let arm = wheel.start.position - chassis.start.position;
        let up = chassis.start.rotation * DVec3::Y;
        let rate = up.dot(wheel.before.linear - chassis.before.at(arm));
        up.dot(arm) - axle.hub.y + rate * dt
    }

    fn height<S: Scalar>(&self, [chassis, wheel]: [&Frame<S>; 2]) -> S {
        chassis.rotation.transposed_multiply(wheel.position - chassis.position).y
    }
}

impl Term for AntiRollTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        self.frames
    }

    fn evaluate<S: Scalar>(&self, _dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let [chassis, wheel] = at;
        let off = self.height(at) - self.slack;
        let local = Vec3 { x: S::ZERO, y: off * self.stiffness, z: S::ZERO };
        let force = chassis.rotation.multiply(local);
        let arm = wheel.position - chassis.position;
        (off * off * (0.5 * self.stiffness), [Wrench::at(-force, arm), Wrench { force, torque: Vec3::ZERO }])
    }

    fn hessian(&self, _dt: f64, [chassis, wheel]: [&Frame<f64>; 2]) -> PairBlocks {
        let up = DVec3::from(chassis.arm(DVec3::Y));
        let arm = DVec3::from(wheel.position - chassis.position);
        PairBlocks::of_points(DMat3::from_cols(up * up.x, up * up.y, up * up.z) * self.stiffness, arm, DVec3::ZERO)
    }
}
