//! Potentials: everything that pushes on DOF. One file each.
//!
//! The tick copies every potential of an island into a term of the island's problem. A term sees two frames, whatever
//! kinds of DOF move them, at a candidate state and answers energy, gradient and a positive semidefinite Hessian with respect to displacements:
//! translations in m, rotations as small world-axis turns in rad. Gradients are minus the force and torque, N and N m.

pub(crate) mod alignment;
pub(crate) mod anti_roll_bar;
pub(crate) mod axle;
pub(crate) mod ball_joint;
pub(crate) mod contact;
pub mod elasticity;
pub(crate) mod fixed_joint;
pub(crate) mod gravity;
pub(crate) mod hinge;
pub(crate) mod hold;
pub(crate) mod limit;
pub(crate) mod motor;
mod pair_blocks;
pub(crate) mod pd;
mod pool;
pub(crate) mod restitution;
pub(crate) mod rod;
pub(crate) mod rolling;
pub(crate) mod slider;
pub(crate) mod spring;
#[cfg(test)]
mod tests;
pub(crate) mod universal_joint;

use std::ops::AddAssign;

use glam::{DMat3, DVec3};

use alignment::Captured;
pub use anti_roll_bar::{AntiRollBarDesc, AntiRollBarId};
pub use axle::{AxleControl, AxleDesc, AxleId, Motor};
pub use ball_joint::{BallJointDesc, BallJointId};
pub use fixed_joint::{FixedJointDesc, FixedJointId};
pub use hinge::{HingeDesc, HingeId};
use hold::Held;
pub use limit::{AngleLimitDesc, AngleLimitId, DistanceLimitDesc, DistanceLimitId};
pub use motor::{Driven, MotorDesc, MotorId};
pub(crate) use pair_blocks::{BetweenFrames, PairBlocks, PointSum};
pub use pd::{PdControl, PdDesc, PdGains, PdId};
use pool::Pool;
pub use rod::{RodDesc, RodId};
pub use slider::{SliderDesc, SliderId};
pub use spring::{SpringDesc, SpringId};
pub use universal_joint::{UniversalJointDesc, UniversalJointId};

use crate::autodiff::{Dual, Scalar, Vec3};
use crate::dof::{BodyId, Frame, Twist};

/// A point of a body, or of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// The body; `None` is the world.
    pub body: Option<BodyId>,
    /// Which of its parts; 0 for particles, rigid bodies and the world.
    pub part: u32,
    /// In the part's frame, or in the world's, m.
    pub point: DVec3,
}

impl Anchor {
    /// A point of a body of one part.
    pub fn body(body: BodyId, point: DVec3) -> Self {
        Self::part(body, 0, point)
    }

    /// A point of one of a body's parts.
    pub fn part(body: BodyId, part: u32, point: DVec3) -> Self {
        Self { body: Some(body), part, point }
    }

    /// A point of the world.
    pub fn world(point: DVec3) -> Self {
        Self { body: None, part: 0, point }
    }
}

/// Handle of a potential of any type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PotentialId {
    Spring(SpringId),
    Rod(RodId),
    BallJoint(BallJointId),
    Hinge(HingeId),
    UniversalJoint(UniversalJointId),
    FixedJoint(FixedJointId),
    Slider(SliderId),
    DistanceLimit(DistanceLimitId),
    AngleLimit(AngleLimitId),
    Motor(MotorId),
    Axle(AxleId),
    AntiRollBar(AntiRollBarId),
    Pd(PdId),
}

/// The world's potentials, apart from contacts, which live for one tick.
#[derive(Default)]
pub(crate) struct Potentials {
    pub springs: Pool<SpringId, SpringDesc>,
    pub rods: Pool<RodId, Held<RodDesc>>,
    pub ball_joints: Pool<BallJointId, Held<BallJointDesc>>,
    /// With the axis and the direction of angle 0.
    pub hinges: Pool<HingeId, Held<Captured<HingeDesc, 2>>>,
    pub universal_joints: Pool<UniversalJointId, Held<UniversalJointDesc>>,
    pub fixed_joints: Pool<FixedJointId, Held<Captured<FixedJointDesc, 3>>>,
    pub sliders: Pool<SliderId, Held<Captured<SliderDesc, 3>>>,
    pub distance_limits: Pool<DistanceLimitId, Held<DistanceLimitDesc>>,
    pub angle_limits: Pool<AngleLimitId, Held<AngleLimitDesc>>,
    pub motors: Pool<MotorId, MotorDesc>,
    pub axles: Pool<AxleId, AxleDesc>,
    pub anti_roll_bars: Pool<AntiRollBarId, AntiRollBarDesc>,
    pub pds: Pool<PdId, (PdDesc, PdGains)>,
}

impl Potentials {
    /// Every potential that takes part, with the two ends that it acts between; angle limits, motors and anti-roll bars
    /// share those of their joints.
    pub fn awake(&self) -> impl Iterator<Item = (PotentialId, [Anchor; 2])> + '_ {
        use PotentialId as Id;
        let of_axle = |axle: &AxleDesc| [axle.chassis, axle.wheel].map(|id| Anchor::body(id, DVec3::ZERO));
        let springs = self.springs.awake().map(|(id, s)| (Id::Spring(id), [s.a, s.b]));
        let rods = self.rods.awake().map(|(id, r)| (Id::Rod(id), [r.desc.a, r.desc.b]));
        let ball_joints = self.ball_joints.awake().map(|(id, j)| (Id::BallJoint(id), [j.desc.a, j.desc.b]));
        let hinges = self.hinges.awake().map(|(id, h)| (Id::Hinge(id), [h.desc.desc.a, h.desc.desc.b]));
        let universal = self.universal_joints.awake().map(|(id, j)| (Id::UniversalJoint(id), [j.desc.a, j.desc.b]));
        let fixed = self.fixed_joints.awake().map(|(id, j)| (Id::FixedJoint(id), [j.desc.desc.a, j.desc.desc.b]));
        let sliders = self.sliders.awake().map(|(id, s)| (Id::Slider(id), [s.desc.desc.a, s.desc.desc.b]));
        let distances = self.distance_limits.awake().map(|(id, l)| (Id::DistanceLimit(id), [l.desc.a, l.desc.b]));
        let angles = self.angle_limits.awake().filter_map(|(id, limit)| {
            let hinge = &self.hinges.get(limit.desc.hinge)?.desc.desc;
            Some((Id::AngleLimit(id), [hinge.a, hinge.b]))
        });
        let motors = self.motors.awake().filter_map(|(id, m)| Some((Id::Motor(id), self.ends_of(m.joint)?)));
        let axles = self.axles.awake().map(move |(id, axle)| (Id::Axle(id), of_axle(axle)));
        let bars = self.anti_roll_bars.awake();
        let bars =
            bars.filter_map(move |(id, bar)| Some((Id::AntiRollBar(id), of_axle(self.axles.get(bar.axles[0])?))));
        let pds = self.pds.awake().map(|(id, (pd, _))| (Id::Pd(id), [pd.at, Anchor::world(DVec3::ZERO)]));
        let joints = ball_joints.chain(hinges).chain(universal).chain(fixed).chain(sliders);
        springs
            .chain(rods)
            .chain(joints)
            .chain(distances)
            .chain(angles)
            .chain(motors)
            .chain(axles)
            .chain(bars)
            .chain(pds)
    }

    /// From now on those take part of which a body is awake.
    pub fn sort(&mut self, is_awake: impl Fn(BodyId) -> bool) {
        let any = |a: Anchor, b: Anchor| [a, b].into_iter().filter_map(|end| end.body).any(&is_awake);
        self.springs.sort(|s| any(s.a, s.b));
        self.rods.sort(|r| any(r.desc.a, r.desc.b));
        self.ball_joints.sort(|j| any(j.desc.a, j.desc.b));
        self.hinges.sort(|h| any(h.desc.desc.a, h.desc.desc.b));
        self.universal_joints.sort(|j| any(j.desc.a, j.desc.b));
        self.fixed_joints.sort(|j| any(j.desc.desc.a, j.desc.desc.b));
        self.sliders.sort(|s| any(s.desc.desc.a, s.desc.desc.b));
        self.distance_limits.sort(|l| any(l.desc.a, l.desc.b));
        self.axles.sort(|a| is_awake(a.chassis) || is_awake(a.wheel));
        self.pds.sort(|(pd, _)| any(pd.at, pd.at));
        let Self { hinges, sliders, axles, angle_limits, motors, anti_roll_bars, .. } = self;
        let any_wheel = |pair: [AxleId; 2]| pair.iter().filter_map(|&id| axles.get(id)).any(|a| is_awake(a.wheel));
        anti_roll_bars.sort(|bar| any_wheel(bar.axles));
        angle_limits.sort(|l| hinges.get(l.desc.hinge).is_some_and(|h| any(h.desc.desc.a, h.desc.desc.b)));
        motors.sort(|m| match m.joint {
            Driven::Hinge(id) => hinges.get(id).is_some_and(|h| any(h.desc.desc.a, h.desc.desc.b)),
            Driven::Slider(id) => sliders.get(id).is_some_and(|s| any(s.desc.desc.a, s.desc.desc.b)),
            Driven::Wheels(pair) => any_wheel(pair),
        });
    }

    /// Both ends of what a motor drives.
    pub fn ends_of(&self, joint: Driven) -> Option<[Anchor; 2]> {
        match joint {
            Driven::Hinge(id) => self.hinges.get(id).map(|h| [h.desc.desc.a, h.desc.desc.b]),
            Driven::Slider(id) => self.sliders.get(id).map(|s| [s.desc.desc.a, s.desc.desc.b]),
            Driven::Wheels(pair) => self.wheels_of(pair).map(|wheels| wheels.map(|id| Anchor::body(id, DVec3::ZERO))),
        }
    }

    /// The wheels of two axles of one chassis; `None` where they are not of one.
    pub fn wheels_of(&self, pair: [AxleId; 2]) -> Option<[BodyId; 2]> {
        let [a, b] = pair.map(|id| self.axles.get(id));
        let (a, b) = (a?, b?);
        (a.chassis == b.chassis && a.wheel != b.wheel).then_some([a.wheel, b.wheel])
    }

    /// Removes every potential of a body.
    pub fn remove_body(&mut self, body: BodyId) {
        let stays = |ends: [Option<BodyId>; 2]| !ends.contains(&Some(body));
        self.springs.retain(|_, s| stays([s.a.body, s.b.body]));
        self.rods.retain(|_, r| stays([r.desc.a.body, r.desc.b.body]));
        self.ball_joints.retain(|_, j| stays([j.desc.a.body, j.desc.b.body]));
        self.hinges.retain(|_, h| stays([h.desc.desc.a.body, h.desc.desc.b.body]));
        self.universal_joints.retain(|_, j| stays([j.desc.a.body, j.desc.b.body]));
        self.fixed_joints.retain(|_, j| stays([j.desc.desc.a.body, j.desc.desc.b.body]));
        self.sliders.retain(|_, s| stays([s.desc.desc.a.body, s.desc.desc.b.body]));
        self.distance_limits.retain(|_, l| stays([l.desc.a.body, l.desc.b.body]));
        self.axles.retain(|_, a| stays([Some(a.chassis), Some(a.wheel)]));
        self.remove_orphans();
        self.pds.retain(|_, (pd, _)| pd.at.body != Some(body));
    }

    /// Removes what drives, limits or couples joints that are gone.
    pub fn remove_orphans(&mut self) {
        let Self { hinges, sliders, axles, angle_limits, motors, anti_roll_bars, .. } = self;
        let has_both = |pair: [AxleId; 2]| pair.iter().all(|&id| axles.contains_key(id));
        anti_roll_bars.retain(|_, bar| has_both(bar.axles));
        angle_limits.retain(|_, limit| hinges.contains_key(limit.desc.hinge));
        motors.retain(|_, motor| match motor.joint {
            Driven::Hinge(hinge) => hinges.contains_key(hinge),
            Driven::Slider(slider) => sliders.contains_key(slider),
            Driven::Wheels(pair) => has_both(pair),
        });
    }
}

/// Index of a frame in its island: bodies first, then the material points of bodies with several parts. [`FIXED`] is the
/// world.
pub(crate) type FrameIndex = u32;

/// What does not move.
pub(crate) const FIXED: FrameIndex = u32::MAX;

/// A frame of an island and a point of it: what becomes of an [`Anchor`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct End {
    pub frame: FrameIndex,
    /// In the frame, m.
    pub point: DVec3,
}

/// A gradient with respect to one frame's displacement: minus force and torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wrench<S = f64> {
    pub force: Vec3<S>,
    pub torque: Vec3<S>,
}

impl<S: Scalar> Wrench<S> {
    pub const ZERO: Self = Self { force: Vec3::ZERO, torque: Vec3::ZERO };

    /// `force` at `arm` from the frame's origin.
    pub fn at(force: Vec3<S>, arm: Vec3<S>) -> Self {
        Self { force, torque: arm.cross(force) }
    }

    /// `force` at an arm that is held fixed.
    pub fn at_fixed(force: Vec3<S>, arm: DVec3) -> Self {
        Self::at(force, Vec3::constant(arm))
    }
}

impl Wrench {
    /// Force, then torque.
    pub fn numbers(&self) -> [f64; 6] {
        let Self { force: f, torque: t } = self;
        [f.x, f.y, f.z, t.x, t.y, t.z]
    }
}

impl Wrench<Dual<1>> {
    /// How it changes.
    pub fn tangent(&self) -> Wrench {
        let of = |v: Vec3<Dual<1>>| Vec3 { x: v.x.tangent[0], y: v.y.tangent[0], z: v.z.tangent[0] };
        Wrench { force: of(self.force), torque: of(self.torque) }
    }
}

impl AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }
}

/// A potential between two frames of an island.
pub(crate) trait Term {
    /// Whether it holds something on an arc by a stiffness, so that straight steps run into it.
    const BENDS: bool = false;

    /// Whether its Hessian is that of [`PairBlocks::of_points`] alone.
    const IS_OF_POINTS: bool = false;

    /// The frames; either may be [`FIXED`].
    fn frames(&self) -> [FrameIndex; 2];

    /// Energy, J, and its gradient on both frames. Written once over the scalar: with dual numbers it answers
    /// Hessian-vector products.
    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]);

    /// Positive semidefinite Hessian at the candidate.
    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks;

    /// Whether its Hessian at the candidate is zero, where that is cheaply told.
    fn is_idle(&self, _dt: f64, _at: [&Frame<f64>; 2]) -> bool {
        false
    }

    /// Takes what is held fixed during a Newton iteration from the candidate at its start.
    fn relinearise(&mut self, _dt: f64, _at: [&Frame<f64>; 2]) {}

    /// [`Term::relinearise`] and [`Term::evaluate`] in one.
    fn relinearise_and_evaluate(&mut self, dt: f64, at: [&Frame<f64>; 2]) -> (f64, [Wrench; 2]) {
        self.relinearise(dt, at);
        self.evaluate(dt, at)
    }

    /// Hears of the Newton step that the linear model proposes, as displacements of both frames, m and rad. Told are those
    /// that bend.
    fn propose(&mut self, _step: [Twist; 2]) {}

    /// Raises a stiffness that the engine chose, where the candidate, which is nearly the solution, leaves a gap above
    /// its tolerance. Answers whether it did.
    fn stiffen(&mut self, _dt: f64, _at: [&Frame<f64>; 2]) -> bool {
        false
    }
}

/// [r]×, the matrix of the cross product.
pub(crate) fn cross_matrix(r: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, r.z, -r.y), DVec3::new(-r.z, 0.0, r.x), DVec3::new(r.y, -r.x, 0.0))
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
