//! Potentials: everything that pushes on DOF. One file each.
//!
//! The tick copies every potential of an island into a term of the island's problem. A term sees its two bodies at a
//! candidate state and answers energy, gradient and a positive semidefinite Hessian with respect to displacements:
//! translations in m, rotations as small world-axis turns in rad. Gradients are minus the force and torque, N and N m.

pub(crate) mod axle;
pub(crate) mod ball_joint;
pub(crate) mod contact;
pub(crate) mod pd;
pub(crate) mod spring;

use glam::{DMat3, DVec3};
use slotmap::SlotMap;

pub use axle::{AxleControl, AxleDesc, AxleId, Motor};
pub use ball_joint::{BallJointDesc, BallJointId};
pub(crate) use pd::PdGains;
pub use pd::{PdControl, PdDesc, PdId};
pub use spring::{SpringDesc, SpringId};

use crate::dof::{BodyId, Node, Pose, Twist};
use crate::integrate::block::Block;

/// A point of a body, or of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// The body; `None` is the world.
    pub body: Option<BodyId>,
    /// In the body's frame, or in the world's, m.
    pub point: DVec3,
}

impl Anchor {
    /// A point of a body.
    pub fn body(body: BodyId, point: DVec3) -> Self {
        Self { body: Some(body), point }
    }

    /// A point of the world.
    pub fn world(point: DVec3) -> Self {
        Self { body: None, point }
    }
}

/// The world's potentials, apart from contacts, which live for one tick.
#[derive(Default)]
pub(crate) struct Potentials {
    pub springs: SlotMap<SpringId, SpringDesc>,
    pub ball_joints: SlotMap<BallJointId, BallJoint>,
    pub axles: SlotMap<AxleId, AxleDesc>,
    pub pds: SlotMap<PdId, (PdDesc, PdGains)>,
}

/// A ball joint and what it remembers.
pub(crate) struct BallJoint {
    pub desc: BallJointDesc,
    /// Force of the last tick, N.
    pub force: DVec3,
}

impl Potentials {
    /// Bodies of every potential; `None` is the world.
    pub fn pairs(&self) -> impl Iterator<Item = [Option<BodyId>; 2]> + '_ {
        let springs = self.springs.values().map(|s| [s.a.body, s.b.body]);
        let ball_joints = self.ball_joints.values().map(|j| [j.desc.a.body, j.desc.b.body]);
        let axles = self.axles.values().map(|a| [Some(a.chassis), Some(a.wheel)]);
        let pds = self.pds.values().map(|(pd, _)| [Some(pd.body), None]);
        springs.chain(ball_joints).chain(axles).chain(pds)
    }

    /// Removes every potential of a body.
    pub fn remove_body(&mut self, body: BodyId) {
        let stays = |ends: [Option<BodyId>; 2]| !ends.contains(&Some(body));
        self.springs.retain(|_, s| stays([s.a.body, s.b.body]));
        self.ball_joints.retain(|_, j| stays([j.desc.a.body, j.desc.b.body]));
        self.axles.retain(|_, a| stays([Some(a.chassis), Some(a.wheel)]));
        self.pds.retain(|_, (pd, _)| pd.body != body);
    }
}

/// Index of a term's body in its island; [`FIXED`] is the world.
pub(crate) type NodeIndex = u32;

/// What does not move.
pub(crate) const FIXED: NodeIndex = u32::MAX;

/// A body at a candidate state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    pub pose: Pose,
    pub twist: Twist,
}

/// An island's bodies at a candidate end of the tick.
#[derive(Clone, Copy)]
pub(crate) struct Candidate<'a> {
    pub dt: f64,
    pub trial: &'a [Trial],
}

impl Candidate<'_> {
    /// Pose of a body at the candidate state; the world's is the identity.
    pub fn pose(&self, node: NodeIndex) -> Pose {
        if node == FIXED { Pose::IDENTITY } else { self.trial[node as usize].pose }
    }

    /// Twist of a body at the candidate state.
    pub fn twist(&self, node: NodeIndex) -> Twist {
        if node == FIXED { Twist::default() } else { self.trial[node as usize].twist }
    }
}

/// A gradient with respect to one body's displacement: minus force and torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Wrench {
    pub force: DVec3,
    pub torque: DVec3,
}

impl Wrench {
    /// `force` at `arm` from the centre of mass.
    pub fn at(force: DVec3, arm: DVec3) -> Self {
        Self { force, torque: arm.cross(force) }
    }
}

/// Hessian of a term with respect to the displacements of its two bodies: translation first, rotation second.
#[derive(Clone, Debug)]
pub(crate) struct PairBlocks {
    pub aa: Block<6>,
    pub ab: Block<6>,
    pub bb: Block<6>,
}

/// A potential between two bodies of an island.
pub(crate) trait Term {
    /// The bodies; the second may be [`FIXED`], and so may the first.
    fn nodes(&self) -> [NodeIndex; 2];

    /// Energy, J, and its gradient on both bodies.
    fn evaluate(&self, at: &Candidate) -> (f64, [Wrench; 2]);

    /// Positive semidefinite Hessian at the candidate.
    fn hessian(&self, at: &Candidate) -> PairBlocks;

    /// Takes what is held fixed during a Newton iteration from the candidate at its start.
    fn relinearise(&mut self, _at: &Candidate) {}

    /// Hears of the Newton step that the linear model proposes, as displacements of both bodies, m and rad.
    fn propose(&mut self, _step: [Twist; 2]) {}
}

/// Reduced mass of two bodies, kg; of the one that moves where the other is fixed.
pub(crate) fn reduced_mass(nodes: &[Node], [a, b]: [NodeIndex; 2]) -> f64 {
    let inverse = |node: NodeIndex| if node == FIXED { 0.0 } else { nodes[node as usize].mass.recip() };
    (inverse(a) + inverse(b)).recip()
}

/// [r]×, the matrix of the cross product.
pub(crate) fn cross_matrix(r: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, r.z, -r.y), DVec3::new(-r.z, 0.0, r.x), DVec3::new(r.y, -r.x, 0.0))
}

impl PairBlocks {
    /// Hessian of ½ dᵀ K d, d the displacement of the point at `arm_b` of b against the one at `arm_a` of a.
    pub fn of_points(k: DMat3, arm_a: DVec3, arm_b: DVec3) -> Self {
        let (sa, sb) = (cross_matrix(arm_a), cross_matrix(arm_b));
        let (ka, kb) = (k * sa, k * sb);
        let mut blocks = Self { aa: [[0.0; 6]; 6], ab: [[0.0; 6]; 6], bb: [[0.0; 6]; 6] };
        // J = [I, −[r]×] and K symmetric: Jᵀ K J' = [K, −K S'; S K, −S K S'].
        place(&mut blocks.aa, k, -ka, -ka.transpose(), -(sa * ka));
        place(&mut blocks.bb, k, -kb, -kb.transpose(), -(sb * kb));
        place(&mut blocks.ab, -k, kb, ka.transpose(), sa * kb);
        blocks
    }

    /// Adds the Hessian of ½ tᵀ K t, t the turn of b against a.
    pub fn add_rotation(&mut self, k: DMat3) {
        self.add_rotation_a(k);
        self.add_rotation_b(k);
        add_to(&mut self.ab, 3, 3, -k);
    }

    /// Adds to the rotation block of a alone.
    pub fn add_rotation_a(&mut self, k: DMat3) {
        add_to(&mut self.aa, 3, 3, k);
    }

    /// Adds to the rotation block of b alone.
    pub fn add_rotation_b(&mut self, k: DMat3) {
        add_to(&mut self.bb, 3, 3, k);
    }
}

fn place(block: &mut Block<6>, ll: DMat3, la: DMat3, al: DMat3, aa: DMat3) {
    add_to(block, 0, 0, ll);
    add_to(block, 0, 3, la);
    add_to(block, 3, 0, al);
    add_to(block, 3, 3, aa);
}

fn add_to(block: &mut Block<6>, row: usize, column: usize, m: DMat3) {
    for j in 0..3 {
        let c = m.col(j).to_array();
        for i in 0..3 {
            block[row + i][column + j] += c[i];
        }
    }
}

/// Positive part of the geometric stiffness of a gradient `force` that acts at `arm`, with respect to turns of the body.
///
/// The second derivative of `force`·(R r) is sym(f rᵀ) − (f·r) I with eigenvalues (|f||r| − f·r)/2 along f̂ + r̂,
/// −(|f||r| + f·r)/2 along f̂ − r̂ and −f·r along f̂ × r̂. Without it a chain under load explodes; with its negative part
/// the system is no longer definite.
pub(crate) fn geometric_stiffness(force: DVec3, arm: DVec3) -> DMat3 {
    let (f, r) = (force.length(), arm.length());
    if f * r <= f64::MIN_POSITIVE {
        return DMat3::ZERO;
    }
    let along = force.dot(arm);
    if along >= 0.0 {
        let e = (force / f + arm / r).normalize();
        return outer(e, e) * ((f * r - along) / 2.0);
    }
    let e = (force / f - arm / r).normalize();
    let symmetric = (outer(force, arm) + outer(arm, force)) * 0.5 - DMat3::from_diagonal(DVec3::splat(along));
    symmetric + outer(e, e) * ((f * r + along) / 2.0)
}

/// a bᵀ.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
