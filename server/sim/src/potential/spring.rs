//! Spring and damper between two points: the author's stiffness, integrated implicitly.

use glam::DMat3;

use super::{Anchor, Candidate, NodeIndex, PairBlocks, Term, Wrench, geometric_stiffness, outer};
use crate::dof::Pose;
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
        require(self.rest_length >= 0.0, "rest_length", self.rest_length, "0 m or more")?;
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
    pub nodes: [NodeIndex; 2],
    pub desc: SpringDesc,
    /// Length at the start of the tick, m.
    pub start_length: f64,
}

impl SpringTerm {
    pub fn new(nodes: [NodeIndex; 2], desc: SpringDesc, start: [Pose; 2]) -> Self {
        let start_length = (start[1].point(desc.b.point) - start[0].point(desc.a.point)).length();
        Self { nodes, desc, start_length }
    }

    /// Arms of both ends, vector from a to b, and its length.
    fn ends(&self, at: &Candidate) -> ([glam::DVec3; 2], glam::DVec3, f64) {
        let (a, b) = (at.pose(self.nodes[0]), at.pose(self.nodes[1]));
        let arms = [a.rotation * self.desc.a.point, b.rotation * self.desc.b.point];
        let line = b.position + arms[1] - a.position - arms[0];
        (arms, line, line.length())
    }

    /// Derivative of the energy with respect to the length, N.
    fn tension(&self, length: f64, dt: f64) -> f64 {
        let SpringDesc { rest_length, stiffness, damping, .. } = self.desc;
        stiffness * (length - rest_length) + damping / dt * (length - self.start_length)
    }
}

impl Term for SpringTerm {
    fn nodes(&self) -> [NodeIndex; 2] {
        self.nodes
    }

    fn evaluate(&self, at: &Candidate) -> (f64, [Wrench; 2]) {
        let (arms, line, length) = self.ends(at);
        let SpringDesc { rest_length, stiffness, damping, .. } = self.desc;
        let (stretch, motion) = (length - rest_length, length - self.start_length);
        let energy = 0.5 * stiffness * stretch * stretch + 0.5 * damping / at.dt * motion * motion;
        let force = line.normalize_or_zero() * self.tension(length, at.dt);
        (energy, [Wrench::at(-force, arms[0]), Wrench::at(force, arms[1])])
    }

    fn hessian(&self, at: &Candidate) -> PairBlocks {
        let (arms, line, length) = self.ends(at);
        let direction = line.normalize_or_zero();
        let tension = self.tension(length, at.dt);
        let across = if length > 0.0 { (tension / length).max(0.0) } else { 0.0 };
        let along = self.desc.stiffness + self.desc.damping / at.dt;
        let nn = outer(direction, direction);
        let mut blocks = PairBlocks::of_points(nn * along + (DMat3::IDENTITY - nn) * across, arms[0], arms[1]);
        blocks.add_rotation_a(geometric_stiffness(direction * -tension, arms[0]));
        blocks.add_rotation_b(geometric_stiffness(direction * tension, arms[1]));
        blocks
    }
}
