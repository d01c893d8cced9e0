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

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use proptest::prelude::*;

    use super::axle::AxleTerm;
    use super::ball_joint::BallJointTerm;
    use super::contact::ContactTerm;
    use super::spring::SpringTerm;
    use super::*;
    use crate::collide::ContactPoint;
    use crate::settings::ContactSettings;

    const DT: f64 = 1.0 / 30.0;

    fn moved(trial: &[Trial; 2], coordinate: usize, h: f64) -> [Trial; 2] {
        let mut trial = *trial;
        let (body, axis) = (&mut trial[coordinate / 6], DVec3::AXES[coordinate % 3]);
        if coordinate % 6 < 3 {
            body.pose.position += axis * h;
            body.twist.linear += axis * (h / DT);
        } else {
            body.pose.rotation = DQuat::from_scaled_axis(axis * h) * body.pose.rotation;
            body.twist.angular += axis * (h / DT);
        }
        trial
    }

    fn flat(wrenches: [Wrench; 2]) -> [f64; 12] {
        let mut flat = [0.0; 12];
        for (body, wrench) in wrenches.into_iter().enumerate() {
            flat[6 * body..6 * body + 3].copy_from_slice(&wrench.force.to_array());
            flat[6 * body + 3..6 * body + 6].copy_from_slice(&wrench.torque.to_array());
        }
        flat
    }

    /// The gradient is the energy's, by central differences.
    fn check_gradient(term: &impl Term, trial: &[Trial; 2]) {
        let gradient = flat(term.evaluate(&Candidate { dt: DT, trial }).1);
        let size = gradient.iter().fold(1e-9, |size: f64, g| size.max(g.abs()));
        for (coordinate, expected) in gradient.into_iter().enumerate() {
            let h = 1e-6;
            let energy = |h| term.evaluate(&Candidate { dt: DT, trial: &moved(trial, coordinate, h) }).0;
            let difference = (energy(h) - energy(-h)) / (2.0 * h);
            assert!((difference - expected).abs() < 1e-4 * size, "coordinate {coordinate}: {difference} {expected}");
        }
    }

    /// The Hessian is the gradient's derivative, by central differences, to a fraction of its largest entry.
    fn check_hessian(term: &impl Term, trial: &[Trial; 2], accuracy: f64) {
        let PairBlocks { aa, ab, bb } = term.hessian(&Candidate { dt: DT, trial });
        let entry = |i: usize, j: usize| match (i / 6, j / 6) {
            (0, 0) => aa[i][j],
            (0, _) => ab[i][j - 6],
            (_, 0) => ab[j][i - 6],
            _ => bb[i - 6][j - 6],
        };
        let size = (0..12).map(|i| entry(i, i)).fold(1e-9, f64::max);
        for j in 0..12 {
            let h = 1e-7;
            let gradient = |h| flat(term.evaluate(&Candidate { dt: DT, trial: &moved(trial, j, h) }).1);
            let (above, below) = (gradient(h), gradient(-h));
            for i in 0..12 {
                let difference = (above[i] - below[i]) / (2.0 * h);
                let expected = entry(i, j);
                assert!(
                    (difference - expected).abs() < accuracy * size,
                    "({i}, {j}): {difference} {expected} of {size}"
                );
            }
        }
    }

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
    }

    fn trial() -> impl Strategy<Value = Trial> {
        (vector(), vector(), vector(), vector()).prop_map(|(position, turn, linear, angular)| Trial {
            pose: Pose { position: position * 3.0, rotation: DQuat::from_scaled_axis(turn * 2.0) },
            twist: Twist { linear, angular },
        })
    }

    fn node(mass: f64, inertia: DVec3, start: Pose) -> Node {
        Node {
            start,
            free_rotation: start.rotation,
            free_spin: DVec3::ZERO,
            target: Twist::REST,
            before: Twist::REST,
            impulse: Twist::REST,
            mass,
            inertia: DMat3::from_diagonal(inertia),
            inverse_inertia: DMat3::from_diagonal(inertia.recip()),
            rotates: true,
            wheel_axis: None,
            guessed_spin: None,
        }
    }

    fn spring(a: DVec3, b: DVec3, rest_length: f64, start: [Pose; 2]) -> SpringTerm {
        // The anchors' bodies do not matter to the term.
        let (a, b) = (Anchor::world(a), Anchor::world(b));
        SpringTerm::new([0, 1], SpringDesc { a, b, rest_length, stiffness: 300.0, damping: 7.0 }, start)
    }

    fn contact(normal: DVec3, gap: f64, anchor: DVec3, arms: [DVec3; 2], normal_force: f64) -> ContactTerm {
        let mut point = ContactPoint::at(DVec3::ZERO, normal, gap, 0.7);
        (point.anchor, point.normal_force) = (anchor - normal * normal.dot(anchor), normal_force);
        ContactTerm::new([0, 1], &point, arms, 2.0, 0.0, &ContactSettings::default(), DT)
    }

    proptest! {
        #[test]
        fn spring_derives(a in vector(), b in vector(), rest in 0.0..2.0, s in trial(), t in trial(), u in trial()) {
            let term = spring(a, b, rest, [s.pose, t.pose]);
            check_gradient(&term, &[t, u]);
        }

        #[test]
        fn spring_between_centres_has_the_exact_hessian_in_tension(t in trial(), u in trial()) {
            prop_assume!((t.pose.position - u.pose.position).length() > 0.1);
            let desc = SpringDesc { damping: 0.0, ..spring(DVec3::ZERO, DVec3::ZERO, 0.0, [t.pose, u.pose]).desc };
            check_hessian(&SpringTerm::new([0, 1], desc, [t.pose, u.pose]), &[t, u], 1e-5);
        }

        #[test]
        fn ball_joint_derives(a in vector(), b in vector(), t in trial(), u in trial()) {
            check_gradient(&BallJointTerm::new([0, 1], [a, b], 1e3, DVec3::ZERO), &[t, u]);
        }

        #[test]
        fn closed_ball_joint_has_the_exact_hessian(a in vector(), b in vector(), t in trial(), mut u in trial()) {
            u.pose.position = t.pose.point(a) - u.pose.rotation * b;
            let mut term = BallJointTerm::new([0, 1], [a, b], 1e3, DVec3::ZERO);
            let trial = [t, u];
            term.relinearise(&Candidate { dt: DT, trial: &trial });
            check_hessian(&term, &trial, 1e-5);
        }

        #[test]
        fn axle_derives(t in trial(), u in trial(), hub in vector(), steer in -1.0..1.0, target in -3.0..3.0, brake in 0.0..200.0) {
            let control = AxleControl { steer, drive: Motor { target_speed: target, gain: 60.0, max_torque: 90.0 }, brake };
            let (chassis, wheel) = (BodyId::default(), BodyId::default());
            let desc = AxleDesc { chassis, wheel, hub, stiffness: 400.0, damping: 30.0, control };
            let nodes = [node(10.0, DVec3::new(1.0, 2.0, 2.5), t.pose), node(1.0, DVec3::new(0.1, 0.1, 0.2), u.pose)];
            let term = AxleTerm::new([0, 1], &desc, &nodes, 3.0, DT);
            check_gradient(&term, &[t, u]);
        }

        #[test]
        fn contact_derives(
            n in vector(), gap in -0.05..0.02, anchor in vector(), a in vector(), b in vector(), force in 0.0..1e4,
            t in trial(), u in trial(),
        ) {
            prop_assume!(n.length() > 0.1);
            let slow = |t: Trial| Trial { twist: Twist { linear: t.twist.linear * 0.3, angular: t.twist.angular * 0.3 }, ..t };
            let term = contact(n.normalize(), gap, anchor * 0.01, [a, b], force);
            check_gradient(&term, &[slow(t), slow(u)]);
        }

        #[test]
        fn frictionless_contact_has_the_exact_hessian(n in vector(), a in vector(), b in vector(), t in trial(), u in trial()) {
            prop_assume!(n.length() > 0.1);
            check_hessian(&contact(n.normalize(), -0.1, DVec3::ZERO, [a, b], 0.0), &[t, u], 1e-4);
        }

        #[test]
        fn geometric_stiffness_is_the_positive_part(f in vector(), r in vector()) {
            let along = f.dot(r);
            let whole = (outer(f, r) + outer(r, f)) * 0.5 - DMat3::from_diagonal(DVec3::splat(along));
            let positive = geometric_stiffness(f, r);
            let negative = positive - whole;
            // Both parts are semidefinite, and they are orthogonal to each other.
            for part in [positive, negative] {
                for x in [DVec3::X, DVec3::Y, DVec3::Z, f, r, f + r, f - r, f.cross(r)] {
                    prop_assert!(x.dot(part * x) > -1e-9, "{part}");
                }
            }
            let product = positive * negative;
            prop_assert!(product.x_axis.length() + product.y_axis.length() + product.z_axis.length() < 1e-6);
        }
    }
}
