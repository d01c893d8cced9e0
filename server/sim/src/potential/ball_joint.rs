//! Ball joint: two points held together by a penalty whose stiffness the engine chooses.

use glam::{DMat3, DVec3};

use super::hold::{Hold, Joint, Memory, Scale, TOLERANCE, require_tolerance};
use super::spring::Line;
use super::{Anchor, End, FrameIndex, PairBlocks, Term, Wrench, geometric_stiffness};
use crate::autodiff::Scalar;
use crate::dof::{Frame, Twist};
use crate::error::{SimError, require_vector};

slotmap::new_key_type! {
    /// Handle of a ball joint.
    pub struct BallJointId;
}

/// A ball joint to be added. Its two bodies do not collide with each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallJointDesc {
    /// Point of the first body.
    pub a: Anchor,
    /// Point of the second body.
    pub b: Anchor,
    /// How far the points may be apart at the end of a tick, m.
    pub tolerance: f64,
}

impl BallJointDesc {
    /// A ball joint that is held closed to a millimetre.
    pub fn new(a: Anchor, b: Anchor) -> Self {
        Self { a, b, tolerance: TOLERANCE }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require_tolerance(self.tolerance)
    }
}

/// A ball joint in an island: energy ½ k |gap|².
#[derive(Clone, Debug)]
pub(crate) struct BallJointTerm {
    ends: [End; 2],
    hold: Hold,
    /// Gradient on b that the geometric stiffness is made of: what the linear model predicts, last tick's at first, N.
    /// The force at the candidate itself is stiffness × an unconverged gap, wrong by orders of magnitude.
    force: DVec3,
    arms: [DVec3; 2],
    /// At the last linearisation, m.
    gap: DVec3,
}

impl BallJointTerm {
    pub fn new(ends: [End; 2], tolerance: f64, scale: Scale, memory: Memory) -> Self {
        let hold = Hold::new(scale, tolerance, memory.stiffening);
        Self { ends, hold, force: memory.force, arms: [DVec3::ZERO; 2], gap: DVec3::ZERO }
    }
}

impl Joint for BallJointTerm {
    fn gap(&self, at: [&Frame<f64>; 2]) -> f64 {
        Line::new(&self.ends, at).vector.length()
    }

    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool {
        self.hold.is_open(self.gap(at))
    }

    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory {
        Memory { force: self.force, stiffening: self.hold.remember(self.gap(at)), ..Memory::default() }
    }
}

impl Term for BallJointTerm {
    const BENDS: bool = true;

    fn frames(&self) -> [FrameIndex; 2] {
        self.ends.map(|end| end.frame)
    }

    fn evaluate<S: Scalar>(&self, _dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let Line { arms, vector: gap } = Line::new(&self.ends, at);
        let force = gap * self.hold.stiffness;
        (force.dot(gap) * 0.5, [Wrench::at(-force, arms[0]), Wrench::at(force, arms[1])])
    }

    fn hessian(&self, _dt: f64, _at: [&Frame<f64>; 2]) -> PairBlocks {
        let arms = self.arms;
        let mut blocks =
            PairBlocks::of_points(DMat3::from_diagonal(DVec3::splat(self.hold.stiffness)), arms[0], arms[1]);
        blocks.add_rotation_a(geometric_stiffness(-self.force, arms[0]));
        blocks.add_rotation_b(geometric_stiffness(self.force, arms[1]));
        blocks
    }

    fn relinearise(&mut self, _dt: f64, at: [&Frame<f64>; 2]) {
        let line = Line::new(&self.ends, at);
        (self.arms, self.gap) = (line.arms.map(DVec3::from), line.vector.into());
    }

    fn propose(&mut self, [a, b]: [Twist; 2]) {
        let moved = b.at(self.arms[1]) - a.at(self.arms[0]);
        self.force = (self.gap + moved) * self.hold.stiffness;
    }

    fn stiffen(&mut self, _dt: f64, at: [&Frame<f64>; 2]) -> bool {
        let gap = self.gap(at);
        self.hold.stiffen(gap)
    }
}
