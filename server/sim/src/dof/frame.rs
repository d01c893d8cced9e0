//! Frame: where a point of a body is, how the body is turned there, and how both move. The one thing that potentials see
//! of any kind of DOF.

use glam::{DMat3, DQuat, DVec3};

use super::{Pose, Twist};
use crate::autodiff::{Dual, Mat3, Scalar, Vec3};

/// A frame at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<S> {
    /// Of the origin, m.
    pub position: Vec3<S>,
    /// Frame to world.
    pub rotation: Mat3<S>,
    /// Of the origin, m/s.
    pub linear: Vec3<S>,
    /// In world axes, rad/s.
    pub angular: Vec3<S>,
}

impl<S: Scalar> Frame<S> {
    /// The world itself.
    pub const WORLD: Self =
        Self { position: Vec3::ZERO, rotation: Mat3::IDENTITY, linear: Vec3::ZERO, angular: Vec3::ZERO };

    /// Vector from the origin to `local`, in world axes, m.
    pub fn arm(&self, local: DVec3) -> Vec3<S> {
        self.rotation.apply(local)
    }

    /// Velocity of the point at `arm`, a constant vector in world axes, m/s.
    pub fn velocity_at(&self, arm: DVec3) -> Vec3<S> {
        self.linear + self.angular.cross(Vec3::constant(arm))
    }
}

impl Frame<f64> {
    /// A frame of glam's types.
    pub fn new(position: DVec3, rotation: DMat3, linear: DVec3, angular: DVec3) -> Self {
        let rotation = Mat3::constant(rotation);
        Self { position: position.into(), rotation, linear: linear.into(), angular: angular.into() }
    }

    /// A point that moves and does not turn.
    pub fn point(position: DVec3, velocity: DVec3) -> Self {
        Self { position: position.into(), linear: velocity.into(), ..Self::WORLD }
    }

    /// World position of a point of the frame, m.
    pub fn place(&self, local: DVec3) -> DVec3 {
        (self.position + self.arm(local)).into()
    }

    /// Where it is, and how it is turned.
    pub(crate) fn pose(&self) -> Pose {
        Pose { position: self.position.into(), rotation: DQuat::from_mat3(&self.rotation.value()).normalize() }
    }

    /// Velocity and angular velocity.
    pub(crate) fn twist(&self) -> Twist {
        Twist { linear: self.linear.into(), angular: self.angular.into() }
    }

    /// The frame with N derivatives: along the `i`th of `displacements`, m and rad, over a tick of `dt`.
    pub(crate) fn along<const N: usize>(&self, displacements: [Twist; N], dt: f64) -> Frame<Dual<N>> {
        let vary = |v: Vec3<f64>, d: [DVec3; N]| Vec3 {
            x: Dual { value: v.x, tangent: d.map(|d| d.x) },
            y: Dual { value: v.y, tangent: d.map(|d| d.y) },
            z: Dual { value: v.z, tangent: d.map(|d| d.z) },
        };
        let turned = |c: Vec3<f64>| vary(c, displacements.map(|d| d.angular.cross(c.into())));
        Frame {
            position: vary(self.position, displacements.map(|d| d.linear)),
            rotation: Mat3 { columns: self.rotation.columns.map(turned) },
            linear: vary(self.linear, displacements.map(|d| d.linear / dt)),
            angular: vary(self.angular, displacements.map(|d| d.angular / dt)),
        }
    }
}
