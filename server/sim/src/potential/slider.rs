//! Slider: a point of the second body moves along an axis of the first; all turns are held.

use glam::{DMat3, DVec3};

use super::alignment::{Aligned, Alignment, TILT, require_tilt};
use super::hold::{Hold, Joint, Memory, Scale, TOLERANCE, require_tolerance};
use super::{Anchor, End, FrameIndex, PairBlocks, Term, Wrench, geometric_stiffness, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::{Frame, Twist};
use crate::error::{SimError, require_direction, require_vector};

slotmap::new_key_type! {
    /// Handle of a slider.
    pub struct SliderId;
}

/// A slider to be added: the turn of its bodies against each other stays what it is then. They do not collide with each
/// other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliderDesc {
    /// Point of the first body, on the line.
    pub a: Anchor,
    /// Point of the second body, which stays on the line.
    pub b: Anchor,
    /// Direction of the line in the first part's frame (the world's where there is no body), of any length.
    pub axis_a: DVec3,
    /// How far the point may be off the line at the end of a tick, m.
    pub tolerance: f64,
    /// How far the bodies may be turned against each other at the end of a tick, rad.
    pub tilt: f64,
}

impl SliderDesc {
    /// A slider that holds to a millimetre and a milliradian.
    pub fn new(a: Anchor, b: Anchor, axis_a: DVec3) -> Self {
        Self { a, b, axis_a, tolerance: TOLERANCE, tilt: TILT }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require_direction(self.axis_a, "axis_a")?;
        require_tolerance(self.tolerance)?;
        require_tilt(self.tilt)
    }
}

/// A slider in an island.
pub(crate) type SliderTerm = Aligned<LineTerm, Alignment<3>>;

/// A point held on a line: energy ½ k |what it is off the line|².
#[derive(Clone, Debug)]
pub(crate) struct LineTerm {
    ends: [End; 2],
    /// Unit vector in the first frame.
    axis: DVec3,
    hold: Hold,
    /// Gradient on b that the geometric stiffness is made of: what the linear model predicts, last tick's at first, N.
    force: DVec3,
    /// At the last linearisation: arms to the point on the line, projection across it, and how far off it is, m.
    arms: [DVec3; 2],
    across: DMat3,
    off: DVec3,
}

impl LineTerm {
    pub fn new(ends: [End; 2], axis: DVec3, tolerance: f64, scale: Scale, memory: Memory) -> Self {
        let hold = Hold::new(scale, tolerance, memory.stiffening);
        let (arms, across, off) = ([DVec3::ZERO; 2], DMat3::ZERO, DVec3::ZERO);
        Self { ends, axis, hold, force: memory.force, arms, across, off }
    }

    /// Arms of both frames to the second point, and what that is off the line. The first frame's arm ends there too:
    /// seen from it, that is where the line is.
    fn off<S: Scalar>(&self, [a, b]: [&Frame<S>; 2]) -> ([Vec3<S>; 2], Vec3<S>) {
        let arm = b.arm(self.ends[1].point);
        let reach = b.position + arm - a.position;
        let (axis, gap) = (a.arm(self.axis), reach - a.arm(self.ends[0].point));
        ([reach, arm], gap - axis.scale(axis.dot(gap)))
    }
}

impl Joint for LineTerm {
    fn gap(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.off(at).1.length()
    }

    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool {
        self.hold.is_open(self.gap(at))
    }

    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory {
        Memory { force: self.force, stiffening: self.hold.remember(self.gap(at)), ..Memory::default() }
    }
}

impl Term for LineTerm {
    const BENDS: bool = true;

    fn frames(&self) -> [FrameIndex; 2] {
        self.ends.map(|end| end.frame)
    }

    fn evaluate<S: Scalar>(&self, _dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (arms, off) = self.off(at);
        let force = off * self.hold.stiffness;
        (force.dot(off) * 0.5, [Wrench::at(-force, arms[0]), Wrench::at(force, arms[1])])
    }

    fn hessian(&self, _dt: f64, _at: [&Frame<f64>; 2]) -> PairBlocks {
        let arms = self.arms;
        let mut blocks = PairBlocks::of_points(self.across * self.hold.stiffness, arms[0], arms[1]);
        // Seen from the first frame the force turns with it, and so the far point seems to turn the other way.
        blocks.add_rotation_a(geometric_stiffness(self.force, arms[0]));
        blocks.add_rotation_b(geometric_stiffness(self.force, arms[1]));
        blocks
    }

    fn relinearise(&mut self, _dt: f64, at: [&Frame<f64>; 2]) {
        let (arms, off) = self.off(at);
        let axis = DVec3::from(at[0].arm(self.axis));
        (self.arms, self.off) = (arms.map(DVec3::from), off.into());
        self.across = DMat3::IDENTITY - outer(axis, axis);
    }

    fn propose(&mut self, [a, b]: [Twist; 2]) {
        let moved = b.at(self.arms[1]) - a.at(self.arms[0]);
        self.force = (self.off + self.across * moved) * self.hold.stiffness;
    }

    fn stiffen(&mut self, _dt: f64, at: [&Frame<f64>; 2]) -> bool {
        let gap = self.gap(at);
        self.hold.stiffen(gap)
    }
}
