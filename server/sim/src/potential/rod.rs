//! Rod: two points held at a distance (talk, "Constraints"): ½ k (|q1 − q0| − L)², "K is very large". A distance limit is
//! a rod of any length within a range.
//!
//! The slide's force repels a stretched rod; a rod pulls it together.

use glam::{DMat3, DVec3};

use super::hold::{Hold, Joint, Memory, Scale, TOLERANCE, require_tolerance};
use super::limit::excess;
use super::spring::Line;
use super::{Anchor, End, FrameIndex, PairBlocks, Term, Wrench};
use crate::autodiff::Scalar;
use crate::dof::{Frame, Twist};
use crate::error::{SimError, require, require_vector};

slotmap::new_key_type! {
    /// Handle of a rod.
    pub struct RodId;
}

/// A rod to be added: a distance that is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodDesc {
    /// One end.
    pub a: Anchor,
    /// Other end.
    pub b: Anchor,
    /// m, above 0.
    pub length: f64,
    /// How far the length may be off at the end of a tick, m.
    pub tolerance: f64,
}

impl RodDesc {
    /// A rod that holds its length to a millimetre.
    pub fn new(a: Anchor, b: Anchor, length: f64) -> Self {
        Self { a, b, length, tolerance: TOLERANCE }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require((1e-6..1e9).contains(&self.length), "length", self.length, "1e-6 to below 1e9 m")?;
        require_tolerance(self.tolerance)
    }
}

/// A rod in an island: energy ½ k (l − L)², L the nearest length that it may have.
#[derive(Clone, Debug)]
pub(crate) struct RodTerm {
    ends: [End; 2],
    /// Least and largest length, m.
    range: [f64; 2],
    hold: Hold,
    /// Gradient on b that the geometric stiffness is made of: what the linear model predicts, last tick's at first, N.
    /// What the candidate itself says is stiffness × an unconverged stretch.
    force: DVec3,
    /// At the last linearisation: arms, direction, and what the rod is too long, m; too short is negative.
    arms: [DVec3; 2],
    direction: DVec3,
    stretch: f64,
    slack: bool,
}

impl RodTerm {
    pub fn new(ends: [End; 2], range: [f64; 2], tolerance: f64, scale: Scale, memory: Memory) -> Self {
        let hold = Hold::new(scale, tolerance, memory.stiffening);
        let (arms, direction) = ([DVec3::ZERO; 2], DVec3::ZERO);
        Self { ends, range, hold, force: memory.force, arms, direction, stretch: 0.0, slack: false }
    }

    /// Whether it does nothing at this length, m.
    fn is_slack(&self, length: f64) -> bool {
        self.range[0] < length && length < self.range[1]
    }
}

impl Joint for RodTerm {
    fn gap(&self, at: [&Frame<f64>; 2]) -> f64 {
        excess(Line::new(&self.ends, at).vector.length(), self.range).abs()
    }

    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool {
        self.hold.is_open(self.gap(at))
    }

    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory {
        Memory { force: self.force, stiffening: self.hold.remember(self.gap(at)), ..Memory::default() }
    }
}

impl Term for RodTerm {
    const BENDS: bool = true;

    fn frames(&self) -> [FrameIndex; 2] {
        self.ends.map(|end| end.frame)
    }

    fn evaluate<S: Scalar>(&self, _dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let line = Line::new(&self.ends, at);
        let stretch = excess(line.vector.length(), self.range);
        let tension = stretch * self.hold.stiffness;
        (stretch * tension * 0.5, line.pull(line.vector.normalize_or_zero(), tension))
    }

    fn hessian(&self, _dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let line = Line::new(&self.ends, at);
        if self.slack {
            return PairBlocks::of_points(DMat3::ZERO, DVec3::ZERO, DVec3::ZERO);
        }
        line.hessian(self.force.dot(self.direction), self.hold.stiffness)
    }

    fn relinearise(&mut self, _dt: f64, at: [&Frame<f64>; 2]) {
        let line = Line::new(&self.ends, at);
        self.arms = line.arms.map(DVec3::from);
        self.direction = DVec3::from(line.vector).normalize_or_zero();
        let length = line.vector.length();
        self.stretch = excess(length, self.range);
        self.slack = self.is_slack(length);
        if self.slack {
            self.force = DVec3::ZERO;
        }
    }

    fn propose(&mut self, [a, b]: [Twist; 2]) {
        let moved = b.at(self.arms[1]) - a.at(self.arms[0]);
        if !self.slack {
            let stretch = self.stretch + self.direction.dot(moved);
            self.force = self.direction * (stretch * self.hold.stiffness);
        }
    }

    fn stiffen(&mut self, _dt: f64, at: [&Frame<f64>; 2]) -> bool {
        let gap = self.gap(at);
        self.hold.stiffen(gap)
    }
}
