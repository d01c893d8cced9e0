//! Spring and damper between two points: the author's stiffness, integrated implicitly.

use glam::{DMat3, DVec3};

use super::{Anchor, End, FrameIndex, PairBlocks, Term, Wrench, geometric_stiffness, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::Frame;
use crate::error::{SimError, require, require_vector};

slotmap::new_key_type! {
    /// Handle of a spring.
    pub struct SpringId;
}

/// A spring to be added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringDesc {
    /// One end.
    pub a: Anchor,
    /// Other end.
    pub b: Anchor,
    /// Length without force, m.
    pub rest_length: f64,
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
}

impl SpringDesc {
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require((0.0..1e9).contains(&self.rest_length), "rest_length", self.rest_length, "0 to below 1e9 m")?;
        require((0.0..1e15).contains(&self.stiffness), "stiffness", self.stiffness, "0 to below 1e15 N/m")?;
        require((0.0..1e15).contains(&self.damping), "damping", self.damping, "0 to below 1e15 N s/m")
    }
}

/// A spring in an island.
///
/// Energy ½ k (l − l_rest)² + ½ (c/dt) (l − l0)²: the second part is the damper, whose force c (l − l0)/dt is that of the
/// rate over the tick. Both depend on the length alone, so the force is central and angular momentum is kept.
#[derive(Clone, Debug)]
pub(crate) struct SpringTerm {
    ends: [End; 2],
    rest_length: f64,
    stiffness: f64,
    damping: f64,
    /// Length at the start of the tick, m.
    start_length: f64,
}

/// A line between two points of frames.
pub(super) struct Line<S> {
    /// From the frames' origins to the points, m.
    pub arms: [Vec3<S>; 2],
    /// From the first point to the second.
    pub vector: Vec3<S>,
}

impl<S: Scalar> Line<S> {
    pub fn new(ends: &[End; 2], [a, b]: [&Frame<S>; 2]) -> Self {
        // The frames of figures are where the ends are.
        let arm =
            |end: &End, frame: &Frame<S>| if end.point == DVec3::ZERO { Vec3::ZERO } else { frame.arm(end.point) };
        let arms = [arm(&ends[0], a), arm(&ends[1], b)];
        Self { arms, vector: b.position + arms[1] - a.position - arms[0] }
    }

    /// Wrenches of a pull by `tension` (S per m of length) along the line.
    pub fn pull(&self, direction: Vec3<S>, tension: S) -> [Wrench<S>; 2] {
        let force = direction.scale(tension);
        [Wrench::at(-force, self.arms[0]), Wrench::at(force, self.arms[1])]
    }
}

impl Line<f64> {
    /// Hessian of an energy of the length with first derivative `tension` and second derivative `along`.
    pub fn hessian(&self, tension: f64, along: f64) -> PairBlocks {
        let (arms, line) = (self.arms.map(DVec3::from), DVec3::from(self.vector));
        let (length, direction) = (line.length(), line.normalize_or_zero());
        let across = if length > 0.0 { (tension / length).max(0.0) } else { 0.0 };
        let nn = outer(direction, direction);
        let mut blocks = PairBlocks::of_points(nn * along + (DMat3::IDENTITY - nn) * across, arms[0], arms[1]);
        blocks.add_rotation_a(geometric_stiffness(direction * -tension, arms[0]));
        blocks.add_rotation_b(geometric_stiffness(direction * tension, arms[1]));
        blocks
    }
}

impl SpringTerm {
    pub fn new(ends: [End; 2], desc: &SpringDesc, start_length: f64) -> Self {
        let SpringDesc { rest_length, stiffness, damping, .. } = *desc;
        Self { ends, rest_length, stiffness, damping, start_length }
    }

    /// Derivative of the energy with respect to the length, N.
    fn tension<S: Scalar>(&self, length: S, dt: f64) -> S {
        (length - self.rest_length) * self.stiffness + (length - self.start_length) * (self.damping / dt)
    }
}

impl Term for SpringTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        self.ends.map(|end| end.frame)
    }

    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let line = Line::new(&self.ends, at);
        let length = line.vector.length();
        let (stretch, motion) = (length - self.rest_length, length - self.start_length);
        let energy = stretch * stretch * (0.5 * self.stiffness) + motion * motion * (0.5 * self.damping / dt);
        (energy, line.pull(line.vector.normalize_or_zero(), self.tension(length, dt)))
    }

    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let line = Line::new(&self.ends, at);
        line.hessian(self.tension(line.vector.length(), dt), self.stiffness + self.damping / dt)
    }
}
