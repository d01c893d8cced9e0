//! DOF kinds: what a slice of Q means.
//!
//! A kind is Kinematics (how the slice moves over a tick), Inertia (its mass as the integrator sees it) and Potentials
//! (what pushes it; those live in [`potential`](crate::potential)). One file a kind.

pub mod articulated;
mod embedding;
mod figure;
pub mod finite_elements;
mod frame;
mod interface;
pub mod lattice;
mod mount;
pub mod natural;
mod nodal;
pub(crate) mod particle;
mod polar;
pub(crate) mod rigid_body;

use glam::{DMat3, DQuat, DVec3};

pub(crate) use figure::{FigureBody, motion};
pub use figure::{FigureDesc, PartCollider};
pub use frame::Frame;
pub use interface::{
    BLOCK_RATES_MAX, BlockSize, Columns, Dof, Inertia, LocalState, PartInertia, PartLoad, PartPoint, PointMasses,
    PointRod, RateBlock,
};
pub use mount::{Mount, MountJoint, MountNode};

use crate::collide::Collider;
use crate::error::{LARGEST, SimError, require, require_rotation, require_vector};
use crate::potential::gravity::Gravity;
use crate::sleep::Rest;
use crate::state::{Slice, State};

slotmap::new_key_type! {
    /// Handle of a body; goes stale when the body is removed.
    pub struct BodyId;
}

/// Kinds of DOF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DofKind {
    /// Q = position; 3 linear, 0 angular.
    Particle,
    /// Q = centre of mass and unit quaternion x y z w; Q' = velocity and angular velocity.
    RigidBody,
    /// Q = a root and joint coordinates; 15 numbers for a sheep.
    Articulated,
    /// Q = points in space (natural Cartesian coordinates), three numbers each.
    Natural,
    /// Q = nodes of a mesh of tetrahedra, three numbers each.
    FiniteElements,
    /// Q = nodes of a free-form lattice, three numbers each.
    Lattice,
    /// A game's own kind, by its name.
    Own(&'static str),
}

/// A rigid body to be added.
#[derive(Clone, Debug)]
pub struct RigidBodyDesc {
    /// Centre of mass, m.
    pub position: DVec3,
    /// Principal axes to world.
    pub rotation: DQuat,
    /// Of the centre of mass, m/s.
    pub velocity: DVec3,
    /// In world axes, rad/s.
    pub angular_velocity: DVec3,
    /// kg, above 0.
    pub mass: f64,
    /// Principal moments of inertia, kg m², above 0.
    pub inertia: DVec3,
    /// What it collides with; `None` passes through everything.
    pub collider: Option<Collider>,
}

impl RigidBodyDesc {
    /// A body at rest without a collider.
    pub fn new(position: DVec3, mass: f64, inertia: DVec3) -> Self {
        let (rotation, rest) = (DQuat::IDENTITY, DVec3::ZERO);
        Self { position, rotation, velocity: rest, angular_velocity: rest, mass, inertia, collider: None }
    }
}

/// A particle to be added.
#[derive(Clone, Debug)]
pub struct ParticleDesc {
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// kg, above 0.
    pub mass: f64,
    /// What it collides with; a ball as a rule.
    pub collider: Option<Collider>,
}

/// A body: its slice and what does not change from tick to tick.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub kind: DofKind,
    pub slice: Slice,
    /// Counts up with every body of the world; never used twice.
    pub serial: u32,
    /// kg.
    pub mass: f64,
    /// Principal moments, kg m²; zero for a particle.
    pub inertia: DVec3,
    /// What it collides with, by the indices of [`Placed`]; a figure has its own.
    pub colliders: Vec<Collider>,
    /// What a body of a general kind is.
    pub figure: Option<FigureBody>,
    /// Force and torque about the centre of mass asked for by code, for the coming tick, N and N m; a figure has its own.
    pub force: DVec3,
    pub torque: DVec3,
    /// What potentials did to its twist in the last tick.
    pub impulse: Twist,
    /// Contact points that acted on it in the last tick in which it was awake; see `integrate/rest.rs`.
    pub touching: u32,
    /// Velocity that the coming tick is expected to add to its own, m/s: detection looks so much farther ahead.
    pub surge: DVec3,
    /// Its index among the bodies that take part in this tick; [`ABSENT`] where it does not.
    pub index: u32,
    /// Unit vector of the body about which it spins in this tick, where what turns that axis is an axle or a hinge.
    pub wheel_axis: Option<DVec3>,
    /// How that axis is going to turn in this tick, by what carries and steers it: a scaled axis in the world, rad.
    pub wheel_turn: DVec3,
    /// Its state became non-finite: it stays where it last was sane, outside dynamics and collision.
    pub quarantined: bool,
    /// How still it has been.
    pub rest: Rest,
    /// The group that it sleeps with.
    pub asleep: Option<u32>,
}

/// A collider on a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Counts up with every body and every further collider of a body; never used twice.
    pub serial: u32,
    pub body: BodyId,
    /// The collider's origin.
    pub at: PartPoint,
    /// The collider's axes to the part's.
    pub rotation: DQuat,
    /// Among the body's colliders, or the figure's; its embedded hulls come after those.
    pub index: u32,
    /// What detection calls it.
    pub hull: u32,
}

impl Placed {
    /// Where the collider is on a rigid body, and how it moves.
    pub fn carried(&self, pose: Pose, twist: Twist) -> (Pose, Twist) {
        if self.at.point == DVec3::ZERO && self.rotation == DQuat::IDENTITY {
            return (pose, twist);
        }
        let arm = pose.rotation * self.at.point;
        let rotation = (pose.rotation * self.rotation).normalize();
        (Pose { position: pose.position + arm, rotation }, Twist { linear: twist.at(arm), ..twist })
    }
}

/// Index of a body that does not take part.
pub(crate) const ABSENT: u32 = u32::MAX;

/// Velocity and angular velocity of a body, m/s and rad/s in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Twist {
    pub linear: DVec3,
    pub angular: DVec3,
}

impl Twist {
    pub const REST: Self = Self { linear: DVec3::ZERO, angular: DVec3::ZERO };

    /// Velocity of the point at `arm` from the centre of mass.
    pub fn at(self, arm: DVec3) -> DVec3 {
        self.linear + self.angular.cross(arm)
    }
}

/// Position of the centre of mass and rotation of the principal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    pub position: DVec3,
    pub rotation: DQuat,
}

impl Pose {
    pub const IDENTITY: Self = Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// World position of a point of the body.
    pub fn point(self, local: DVec3) -> DVec3 {
        self.position + self.rotation * local
    }

    /// The frame of a body that is there and moves with `twist`.
    pub fn frame(self, twist: Twist) -> Frame<f64> {
        Frame::new(self.position, DMat3::from_quat(self.rotation), twist.linear, twist.angular)
    }

    /// Writes a slice of Q; of a particle's, the position alone.
    pub fn write(self, q: &mut [f64]) {
        q[..3].copy_from_slice(&self.position.to_array());
        if let Some(rotation) = q.get_mut(3..7) {
            rotation.copy_from_slice(&self.rotation.to_array());
        }
    }
}

/// A body as the integrator sees it during one tick.
///
/// The unknown is the body's twist u at the end of the tick. Rotation is predicted: R* is where the body would be
/// without any torque, and only the rest of the rotation is unknown, R1 = exp(dt (u_angular − free_spin)) R*. With the
/// inertia frozen at R* the residual is the gradient of a convex kinetic term, angular momentum is exact and free spin
/// loses no energy (DESIGN, section 3).
///
/// A wheel's axis is held by its axle, so the free motion of that axis, a nutation of up to 2 rad a tick, is a wrong
/// guess from which Newton does not come back. There R* is R0 with the axis turned to where what carries and steers it will
/// have it, and R1 = exp(dt (u − spin − free_spin)) exp(dt spin) R* with spin the part of u along the axis: the axis is a
/// smooth function of what turns it, however fast the wheel spins up. It rolls along where it is headed at the end of the
/// tick: where that was its heading at the start, a car answered its steering a tick and a half late.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// Pose at the start of the tick.
    pub start: Pose,
    /// Rotation after the tick without torque; of a wheel, that at its start with the axis turned.
    pub free_rotation: DQuat,
    /// Angular velocity that leads to `free_rotation`, rad/s.
    pub free_spin: DVec3,
    /// Twist at the end of the tick under gravity and outer forces alone.
    pub target: Twist,
    /// Twist at the start of the tick.
    pub before: Twist,
    /// What potentials did to the twist in the last tick.
    pub impulse: Twist,
    pub mass: f64,
    /// World inertia at `free_rotation`, kg m²; identity where the body does not rotate.
    pub inertia: DMat3,
    /// Its inverse.
    pub inverse_inertia: DMat3,
    pub rotates: bool,
    /// Axis of a wheel at `free_rotation`.
    pub wheel_axis: Option<DVec3>,
    /// Angular velocity with which Newton starts, where that of the guess would be a bad one, rad/s.
    pub guessed_spin: Option<DVec3>,
}

impl Node {
    /// A guess of the twist at the end of the tick, corrected by what is known better.
    pub fn start_from(&self, guess: Twist) -> Twist {
        Twist { angular: self.guessed_spin.unwrap_or(guess.angular), ..guess }
    }

    /// The twist at the end of the tick if potentials do what they did in the last one.
    pub fn repeated(&self) -> Twist {
        let linear = self.target.linear + self.impulse.linear;
        Twist { linear, angular: self.target.angular + self.impulse.angular }
    }

    /// Angular velocity of a wheel whose `axis`, at the start of the tick, gets to `wanted` within it while the wheel spins
    /// on about where it is headed, rad/s.
    pub fn following(&self, axis: DVec3, wanted: DVec3, dt: f64) -> DVec3 {
        self.wheel_axis.unwrap_or(axis) * axis.dot(self.before.angular) + axis.cross(wanted) / dt
    }

    /// The twist of a momentum.
    pub fn divide_by_mass(&self, momentum: Twist) -> Twist {
        let angular = if self.rotates { self.inverse_inertia * momentum.angular } else { DVec3::ZERO };
        Twist { linear: momentum.linear / self.mass, angular }
    }

    /// Frame at the start of the tick.
    pub fn start_frame(&self) -> Frame<f64> {
        self.start.frame(self.before)
    }

    /// Pose after a tick of `dt` with twist `u`.
    pub fn pose(&self, u: Twist, dt: f64) -> Pose {
        let position = self.start.position + dt * u.linear;
        if !self.rotates {
            return Pose { position, rotation: DQuat::IDENTITY };
        }
        let turn = match self.wheel_axis {
            None => DQuat::from_scaled_axis(dt * (u.angular - self.free_spin)),
            Some(axis) => {
                let spin = axis * axis.dot(u.angular);
                let turn = DQuat::from_scaled_axis(dt * (u.angular - spin - self.free_spin));
                turn * DQuat::from_scaled_axis(dt * spin)
            }
        };
        Pose { position, rotation: (turn * self.free_rotation).normalize() }
    }
}

impl Body {
    /// The start of a tick of a particle or rigid body.
    pub fn node(&self, state: &State, dt: f64, gravity: Gravity) -> Node {
        let (q, v) = (state.q(self.slice), state.v(self.slice));
        match self.kind {
            DofKind::Particle => particle::node(self, q, v, dt, gravity),
            _ => rigid_body::node(self, q, v, dt, gravity),
        }
    }

    /// Writes the state of a particle or rigid body after a tick with twist `u` at its end, which brought it to `pose`.
    pub fn advance(&self, node: &Node, u: Twist, pose: Pose, state: &mut State) {
        pose.write(state.q_mut(self.slice));
        let angular = self.spin_after(node, u, pose);
        self.set_twist(Twist { linear: u.linear, angular }, state);
    }

    /// Angular velocity at the end of a tick with twist `u` that ended with `pose`, rad/s.
    fn spin_after(&self, node: &Node, u: Twist, pose: Pose) -> DVec3 {
        match self.kind {
            DofKind::Particle => DVec3::ZERO,
            _ => rigid_body::spin_after(self, node, u, pose.rotation),
        }
    }

    /// Writes the twist `u` at the end of a tick, for a particle or rigid body that has been moved already.
    pub fn keep_twist(&mut self, node: &Node, u: Twist, state: &mut State) {
        let angular = self.spin_after(node, u, self.pose(state));
        self.set_twist(Twist { linear: u.linear, angular }, state);
        self.remember_impulse(node, u);
    }

    /// Remembers what potentials did to the twist of a tick that ended with `u`.
    pub fn remember_impulse(&mut self, node: &Node, u: Twist) {
        let Twist { linear, angular } = node.target;
        self.impulse = Twist { linear: u.linear - linear, angular: u.angular - angular };
    }

    /// Writes the rates of a figure at the end of a tick, that has been moved already.
    pub fn set_figure_rates(&self, v1: impl Iterator<Item = f64>, state: &mut State) {
        state.v_mut(self.slice).iter_mut().zip(v1).for_each(|(rate, v1)| *rate = v1);
    }

    /// Writes the state of a figure at the end of a tick.
    pub fn advance_figure(&mut self, q1: &[f64], v1: &[f64], state: &mut State) {
        let Some(figure) = &mut self.figure else { return };
        for ((change, v1), v0) in figure.change.iter_mut().zip(v1).zip(state.v(self.slice)) {
            *change = v1 - v0;
        }
        state.q_mut(self.slice).copy_from_slice(q1);
        state.v_mut(self.slice).copy_from_slice(v1);
    }

    /// Forgets what code asked for: forces are for one tick, whether the body takes part in it or not.
    pub fn forget_forces(&mut self) {
        (self.force, self.torque) = Default::default();
        if let Some(figure) = &mut self.figure {
            figure.force.fill(0.0);
        }
    }

    /// Takes the body out of dynamics and collision: at rest, where `place` puts it.
    pub fn quarantine(&mut self, state: &mut State, place: impl FnOnce(&mut [f64])) {
        self.quarantined = true;
        place(state.q_mut(self.slice));
        state.v_mut(self.slice).fill(0.0);
        self.impulse = Twist::REST;
        if let Some(figure) = &mut self.figure {
            figure.change.fill(0.0);
        }
    }

    /// Pose; of a figure's first part.
    pub fn pose(&self, state: &State) -> Pose {
        let q = state.q(self.slice);
        match (&self.figure, self.kind) {
            (Some(figure), _) => {
                figure.dof.frame(PartPoint { part: 0, point: DVec3::ZERO }, q, state.v(self.slice)).pose()
            }
            (None, DofKind::Particle) => Pose { position: particle::position(q), ..Pose::IDENTITY },
            (None, _) => rigid_body::pose(q),
        }
    }

    /// Twist; of a figure's first part.
    pub fn twist(&self, state: &State) -> Twist {
        let v = state.v(self.slice);
        match (&self.figure, self.kind) {
            (Some(figure), _) => {
                figure.dof.frame(PartPoint { part: 0, point: DVec3::ZERO }, state.q(self.slice), v).twist()
            }
            (None, DofKind::Particle) => Twist { linear: particle::velocity(v), angular: DVec3::ZERO },
            (None, _) => rigid_body::twist(v),
        }
    }

    /// The frame at a material point.
    pub fn frame(&self, at: PartPoint, state: &State) -> Frame<f64> {
        let (q, v) = (state.q(self.slice), state.v(self.slice));
        if let Some(figure) = &self.figure {
            return figure.dof.frame(at, q, v);
        }
        let (Pose { position, rotation }, twist) = (self.pose(state), self.twist(state));
        let arm = rotation * at.point;
        Frame::new(position + arm, DMat3::from_quat(rotation), twist.at(arm), twist.angular)
    }

    /// Moves a particle or rigid body.
    pub fn set_pose(&self, pose: Pose, state: &mut State) {
        pose.write(state.q_mut(self.slice));
    }

    /// Sets the velocities of a particle or rigid body.
    pub fn set_twist(&self, twist: Twist, state: &mut State) {
        let v = state.v_mut(self.slice);
        v[..3].copy_from_slice(&twist.linear.to_array());
        if self.kind == DofKind::RigidBody {
            v[3..].copy_from_slice(&twist.angular.to_array());
        }
    }

    /// Whether every number of the state is one that the setters would take.
    pub fn is_sane(&self, state: &State) -> bool {
        state.q(self.slice).iter().chain(state.v(self.slice)).all(|x| x.abs() < LARGEST)
    }

    /// Momentum, angular momentum about the origin, and kinetic energy.
    pub fn motion(&self, state: &State) -> Motion {
        if let Some(figure) = &self.figure {
            return figure.motion(state.q(self.slice), state.v(self.slice));
        }
        let (Pose { position, rotation }, Twist { linear, angular }) = (self.pose(state), self.twist(state));
        let momentum = self.mass * linear;
        let spin = match self.kind {
            DofKind::Particle => DVec3::ZERO,
            _ => rotation * (self.inertia * (rotation.inverse() * angular)),
        };
        let energy = 0.5 * (momentum.dot(linear) + spin.dot(angular));
        Motion { momentum, angular_momentum: position.cross(momentum) + spin, energy, moment: self.mass * position }
    }
}

/// How a body moves as a whole.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    /// kg m/s.
    pub momentum: DVec3,
    /// About the origin, kg m²/s.
    pub angular_momentum: DVec3,
    /// Of motion and spin, J.
    pub energy: f64,
    /// Mass times centre of mass, kg m.
    pub moment: DVec3,
}

fn validate_mass(mass: f64) -> Result<(), SimError> {
    require((1e-6..LARGEST).contains(&mass), "mass", mass, "1e-6 to below 1e9 kg")
}

pub(crate) fn validate_rigid_body(desc: &RigidBodyDesc) -> Result<(), SimError> {
    require_vector(desc.position, "position")?;
    require_rotation(desc.rotation, "rotation")?;
    require_vector(desc.velocity, "velocity")?;
    require_vector(desc.angular_velocity, "angular_velocity")?;
    validate_mass(desc.mass)?;
    require_vector(desc.inertia, "inertia")?;
    let least = desc.inertia.min_element();
    require(least >= 1e-12, "inertia", least, "1e-12 to below 1e9 kg m²")?;
    desc.collider.as_ref().map_or(Ok(()), Collider::validate_moving)
}

pub(crate) fn validate_particle(desc: &ParticleDesc) -> Result<(), SimError> {
    require_vector(desc.position, "position")?;
    require_vector(desc.velocity, "velocity")?;
    validate_mass(desc.mass)?;
    desc.collider.as_ref().map_or(Ok(()), Collider::validate_moving)
}
