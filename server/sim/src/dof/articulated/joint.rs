//! One joint: its coordinates, and how they carry a part.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};

use super::limit::JointLimit;
use super::motor::{JointMotor, JointSpring};
use crate::dof::{BlockSize, Columns, MountJoint, Twist};

/// How a part may move against its parent, or against the world. Axes are those at rest, in the parent's axes; they need
/// not be of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// Welded: no coordinate.
    Fixed,
    /// Turns about an axis. Q: the angle, rad.
    Hinge {
        /// Fixed in both parts.
        axis: DVec3,
    },
    /// Turns about two axes (Cardan). Q: both angles, rad. It has no singularity: the axes keep the angle between them.
    Universal {
        /// The first is fixed in the parent, the second in the part.
        axes: [DVec3; 2],
    },
    /// Turns in any way. Q: unit quaternion x y z w; Q': angular velocity in the parent's axes, rad/s.
    Ball,
    /// Slides along an axis. Q: the distance, m.
    Slider {
        /// Fixed in both parts.
        axis: DVec3,
    },
    /// Moves in any way. Q: position, m, and unit quaternion; Q': velocity and angular velocity, in the parent's axes.
    Free,
}

impl JointKind {
    /// Numbers in Q and Q'; `None` for a fixed joint, which has no block.
    pub(super) fn size(self) -> Option<BlockSize> {
        let (positions, rates) = match self {
            Self::Fixed => return None,
            Self::Hinge { .. } | Self::Slider { .. } => (1, 1),
            Self::Universal { .. } => (2, 2),
            Self::Ball => (4, 3),
            Self::Free => (7, 6),
        };
        Some(BlockSize { positions, rates })
    }

    /// Where its unit quaternion starts among its positions, and the rate of that among its rates.
    pub(super) fn quaternion(self) -> Option<usize> {
        match self {
            Self::Ball => Some(0),
            Self::Free => Some(3),
            _ => None,
        }
    }

    /// Coordinates at rest.
    pub(super) fn rest(self, q: &mut [f64]) {
        q.fill(0.0);
        if let Some(start) = self.quaternion() {
            q[start + 3] = 1.0;
        }
    }

    /// Coordinates after `dt` at rates `v`.
    pub(super) fn step(self, q0: &[f64], v: &[f64], dt: f64, q1: &mut [f64]) {
        for ((q1, q0), v) in q1.iter_mut().zip(q0).zip(v) {
            *q1 = q0 + dt * v;
        }
        if let Some(start) = self.quaternion() {
            let turn = DQuat::from_scaled_axis(dt * DVec3::from_slice(&v[start..]));
            let turned = (turn * DQuat::from_slice(&q0[start..])).normalize();
            q1[start..start + 4].copy_from_slice(&turned.to_array());
        }
    }

    /// Turn against the rest, in the parent's axes.
    fn turn(self, q: &[f64]) -> DMat3 {
        match self {
            Self::Fixed | Self::Slider { .. } => DMat3::IDENTITY,
            Self::Hinge { axis } => DMat3::from_axis_angle(axis, q[0]),
            Self::Universal { axes: [a, b] } => DMat3::from_axis_angle(a, q[0]) * DMat3::from_axis_angle(b, q[1]),
            Self::Ball => DMat3::from_quat(DQuat::from_slice(q)),
            Self::Free => DMat3::from_quat(DQuat::from_slice(&q[3..])),
        }
    }

    /// Way from the parent's point of the joint to the part's, in the parent's axes, m.
    fn shift(self, q: &[f64]) -> DVec3 {
        match self {
            Self::Slider { axis } => axis * q[0],
            Self::Free => DVec3::from_slice(q),
            _ => DVec3::ZERO,
        }
    }

    /// Velocity and angular velocity against the parent, in the parent's axes.
    fn twist(self, q: &[f64], v: &[f64]) -> Twist {
        let (linear, angular) = match self {
            Self::Fixed => (DVec3::ZERO, DVec3::ZERO),
            Self::Hinge { axis } => (DVec3::ZERO, axis * v[0]),
            Self::Universal { axes: [a, b] } => (DVec3::ZERO, a * v[0] + DQuat::from_axis_angle(a, q[0]) * b * v[1]),
            Self::Ball => (DVec3::ZERO, DVec3::from_slice(v)),
            Self::Slider { axis } => (axis * v[0], DVec3::ZERO),
            Self::Free => (DVec3::from_slice(v), DVec3::from_slice(&v[3..])),
        };
        Twist { linear, angular }
    }
}

/// A joint of a tree with the part that it carries.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// Its axes have length 1.
    pub kind: JointKind,
    pub parent: Option<u32>,
    /// Point of the parent, m.
    pub in_parent: DVec3,
    /// Point of the part, m.
    pub in_part: DVec3,
    /// Rotation of the part's axes into the parent's at rest.
    pub rest: DMat3,
    /// Index of its block; `None` where it is fixed.
    pub block: Option<usize>,
    /// Where its share of Q and of Q' starts.
    pub starts: (usize, usize),
    pub limits: Vec<JointLimit>,
    pub spring: Option<JointSpring>,
    pub motor: Option<JointMotor>,
    /// Of the motor, among the figure's.
    pub controls: Range<usize>,
}

/// Origin of a part, and its axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub position: DVec3,
    pub rotation: DMat3,
}

impl Place {
    pub const WORLD: Self = Self { position: DVec3::ZERO, rotation: DMat3::IDENTITY };

    /// World position of a point of the part.
    pub fn point(&self, local: DVec3) -> DVec3 {
        self.position + self.rotation * local
    }
}

impl Joint {
    /// Where its coordinates are in the figure's Q.
    pub fn positions(&self) -> Range<usize> {
        let size = self.kind.size().map_or(0, |size| size.positions);
        self.starts.0..self.starts.0 + usize::from(size)
    }

    /// Where its rates are in the figure's Q'.
    pub fn rates(&self) -> Range<usize> {
        let size = self.kind.size().map_or(0, |size| size.rates);
        self.starts.1..self.starts.1 + usize::from(size)
    }

    /// For those who show the part.
    pub fn mount(&self) -> MountJoint {
        MountJoint {
            kind: self.kind,
            start: self.starts.0 as u32,
            in_parent: self.in_parent,
            in_part: self.in_part,
            rest: DQuat::from_mat3(&self.rest),
        }
    }

    /// Whether it has potentials of its own.
    pub fn acts(&self) -> bool {
        !self.limits.is_empty() || self.spring.is_some() || self.motor.is_some()
    }

    /// Its share of the figure's Q.
    pub fn q<'a>(&self, q: &'a [f64]) -> &'a [f64] {
        &q[self.positions()]
    }

    /// Its share of the figure's Q'.
    pub fn v<'a>(&self, v: &'a [f64]) -> &'a [f64] {
        &v[self.rates()]
    }

    /// From the parent's origin to the part's point of the joint, in the parent's axes, m.
    pub fn arm(&self, q: &[f64]) -> DVec3 {
        self.in_parent + self.kind.shift(self.q(q))
    }

    /// Where the part is, its parent being at `parent`.
    pub fn place(&self, parent: &Place, q: &[f64]) -> Place {
        let rotation = parent.rotation * (self.kind.turn(self.q(q)) * self.rest);
        Place { position: parent.point(self.arm(q)) - rotation * self.in_part, rotation }
    }

    /// How the part at `place` moves, of the origin.
    pub fn twist(&self, parent: (&Place, Twist), place: &Place, q: &[f64], v: &[f64]) -> Twist {
        let (at, moves) = parent;
        let own = self.kind.twist(self.q(q), self.v(v));
        let angular = moves.angular + at.rotation * own.angular;
        let linear = moves.at(at.rotation * self.arm(q)) + at.rotation * own.linear;
        Twist { linear: linear - angular.cross(place.rotation * self.in_part), angular }
    }

    /// Derivatives of the twist at the world point `x` with respect to its rates.
    pub fn columns(&self, parent: &Place, q: &[f64], x: DVec3) -> Columns {
        let mut columns = [[0.0; 6]; 6];
        let arm = x - parent.point(self.arm(q));
        let slide = |axis: DVec3| column(parent.rotation * axis, DVec3::ZERO);
        let turn = |axis: DVec3| {
            let axis = parent.rotation * axis;
            column(axis.cross(arm), axis)
        };
        match self.kind {
            JointKind::Fixed => {}
            JointKind::Hinge { axis } => columns[0] = turn(axis),
            JointKind::Universal { axes: [a, b] } => {
                columns[0] = turn(a);
                columns[1] = turn(DQuat::from_axis_angle(a, self.q(q)[0]) * b);
            }
            JointKind::Ball => (0..3).for_each(|i| columns[i] = turn(DVec3::AXES[i])),
            JointKind::Slider { axis } => columns[0] = slide(axis),
            JointKind::Free => (0..3).for_each(|i| {
                columns[i] = slide(DVec3::AXES[i]);
                columns[3 + i] = turn(DVec3::AXES[i]);
            }),
        }
        columns
    }
}

fn column(linear: DVec3, angular: DVec3) -> [f64; 6] {
    [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
}
