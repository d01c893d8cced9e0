//! PITA's engine: degrees of freedom, potentials, implicit Euler, collision.
//!
//! The whole world is one vector of degrees of freedom Q and its rate Q'. Everything that pushes is a potential. A
//! tick finds the Q' at its end for which the residual
//!
//! ```text
//! R(Q1') = M1 Q1' − M0 Q0' − F(Q1, Q1') dt
//! ```
//!
//! is zero and moves every DOF there: Q1 = Q0 + Q1' dt (the talk's axioms 2 to 4).
//!
//! Owns: the state ([`World`]), DOF kinds ([`dof`]), potentials ([`potential`]), the integrator ([`integrate`]),
//! collision detection ([`collide`]). It is pure: no clock, no I/O, no randomness, no wire types; the same calls in the
//! same order give the same bits, whatever the number of threads.
//!
//! Conventions: SI units, f64, right-handed, y up; quaternions turn body axes into world axes; angular velocities are in
//! world axes; a half-space's normal points out of the ground.

pub mod autodiff;
pub mod collide;
pub mod dof;
mod eigen;
mod elimination;
mod error;
pub mod geometry;
pub mod integrate;
mod island;
pub mod mass;
pub mod mesh;
pub mod potential;
mod settings;
mod sleep;
mod state;
mod threads;
mod world;

pub use collide::{
    Collider, Collision, CollisionId, CollisionObject, CollisionSide, Compound, ContactView, EmbeddedHull, Groups,
    Material, MaterialId, Nearest, Phase, Piece, QueryFilter, RayHit, Shape, StaticDesc, StaticId, Surface,
};
pub use dof::articulated::{
    Articulated, JointDesc, JointDrive, JointKind, JointLimit, JointMotor, JointSpring, LimitRange, PartDesc,
};
pub use dof::finite_elements::FiniteElements;
pub use dof::lattice::{Lattice, LatticeDesc, RestShape};
pub use dof::natural::{Natural, NaturalDesc, NaturalPart};
pub use dof::{
    BlockSize, BodyId, Dof, DofKind, FigureDesc, Frame, Mount, MountJoint, MountNode, PartCollider, PartPoint,
    ParticleDesc, RigidBodyDesc,
};
pub use error::SimError;
pub use glam::{DMat3, DQuat, DVec3};
pub use integrate::{Method, Preconditioner, StepReport, StoppedBecause};
pub use potential::{
    Anchor, AngleLimitDesc, AngleLimitId, AntiRollBarDesc, AntiRollBarId, AxleControl, AxleDesc, AxleId, BallJointDesc,
    BallJointId, DistanceLimitDesc, DistanceLimitId, Driven, FixedJointDesc, FixedJointId, HingeDesc, HingeId, Motor,
    MotorDesc, MotorId, PdControl, PdDesc, PdGains, PdId, RodDesc, RodId, SliderDesc, SliderId, SpringDesc, SpringId,
    UniversalJointDesc, UniversalJointId,
};
pub use settings::{ContactSettings, Settings, SleepSettings, SolverSettings};
pub use world::{Energy, JointId, Momentum, SliceView, World};
