//! Ball joint: two points held together by a penalty whose stiffness the engine chooses.

use glam::{DMat3, DVec3};

use super::{Anchor, Candidate, NodeIndex, PairBlocks, Term, Wrench, geometric_stiffness};
use crate::dof::Twist;
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
}

impl BallJointDesc {
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")
    }
}

/// A ball joint in an island: energy ½ k |gap|².
#[derive(Clone, Debug)]
pub(crate) struct BallJointTerm {
    pub nodes: [NodeIndex; 2],
    pub points: [DVec3; 2],
    /// N/m.
    pub stiffness: f64,
    /// Gradient on b that the geometric stiffness is made of: what the linear model predicts, last tick's at first, N.
    /// The force at the candidate itself is stiffness × an unconverged gap, wrong by orders of magnitude.
    pub force: DVec3,
    linearisation: Linearisation,
}

#[derive(Clone, Copy, Debug, Default)]
struct Linearisation {
    arms: [DVec3; 2],
    gap: DVec3,
}

impl BallJointTerm {
    pub fn new(nodes: [NodeIndex; 2], points: [DVec3; 2], stiffness: f64, force: DVec3) -> Self {
        Self { nodes, points, stiffness, force, linearisation: Linearisation::default() }
    }

    fn linearise(&self, at: &Candidate) -> Linearisation {
        let (a, b) = (at.pose(self.nodes[0]), at.pose(self.nodes[1]));
        let arms = [a.rotation * self.points[0], b.rotation * self.points[1]];
        Linearisation { arms, gap: b.position + arms[1] - a.position - arms[0] }
    }

    /// Distance of the two points, m.
    pub fn gap(&self, at: &Candidate) -> f64 {
        self.linearise(at).gap.length()
    }
}

impl Term for BallJointTerm {
    fn nodes(&self) -> [NodeIndex; 2] {
        self.nodes
    }

    fn evaluate(&self, at: &Candidate) -> (f64, [Wrench; 2]) {
        let Linearisation { arms, gap } = self.linearise(at);
        let force = gap * self.stiffness;
        (0.5 * force.dot(gap), [Wrench::at(-force, arms[0]), Wrench::at(force, arms[1])])
    }

    fn hessian(&self, _at: &Candidate) -> PairBlocks {
        let arms = self.linearisation.arms;
        let mut blocks = PairBlocks::of_points(DMat3::from_diagonal(DVec3::splat(self.stiffness)), arms[0], arms[1]);
        blocks.add_rotation_a(geometric_stiffness(-self.force, arms[0]));
        blocks.add_rotation_b(geometric_stiffness(self.force, arms[1]));
        blocks
    }

    fn relinearise(&mut self, at: &Candidate) {
        self.linearisation = self.linearise(at);
    }

    fn propose(&mut self, [a, b]: [Twist; 2]) {
        let Linearisation { arms, gap } = self.linearisation;
        let moved = b.at(arms[1]) - a.at(arms[0]);
        self.force = (gap + moved) * self.stiffness;
    }
}
