//! Particle: 3 linear DOF, 0 angular. Linear kinematics and constant mass, so the talk's formula as it stands.

use glam::{DMat3, DQuat, DVec3};

use super::{Body, Node, Pose, Twist};
use crate::potential::gravity::Gravity;

/// Numbers in Q and in Q'.
pub(crate) const SIZE: (u32, u32) = (3, 3);

pub(super) fn position(q: &[f64]) -> DVec3 {
    DVec3::from_slice(q)
}

pub(super) fn velocity(v: &[f64]) -> DVec3 {
    DVec3::from_slice(v)
}

pub(super) fn node(body: &Body, q: &[f64], v: &[f64], dt: f64, gravity: Gravity) -> Node {
    let linear = velocity(v);
    Node {
        start: Pose { position: position(q), rotation: DQuat::IDENTITY },
        free_rotation: DQuat::IDENTITY,
        free_spin: DVec3::ZERO,
        target: Twist { linear: linear + gravity.fall(dt) + dt * (body.force / body.mass), angular: DVec3::ZERO },
        before: Twist { linear, angular: DVec3::ZERO },
        impulse: body.impulse,
        mass: body.mass,
        inertia: DMat3::IDENTITY,
        inverse_inertia: DMat3::IDENTITY,
        rotates: false,
        wheel_axis: None,
        guessed_spin: None,
    }
}
