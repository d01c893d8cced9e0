//! Rigid body: centre of mass and rotation. Momentum is differenced in world space; free spin is integrated exactly
//! enough by itself, so that implicit Euler does not eat it (DESIGN, section 3).

use glam::{DMat3, DQuat, DVec3};

use super::{Body, Node, Pose, Twist};
use crate::potential::gravity::Gravity;

/// Numbers in Q and in Q'.
pub(crate) const SIZE: (u32, u32) = (7, 6);

/// Largest turn of one sub-step of the torque-free flow, rad: RK4 then keeps the energy of the `spin` scene to 1e-6.
const FLOW_STEP: f64 = 0.1;

/// Most sub-steps of the torque-free flow, so that a wild spin cannot hang a tick.
const FLOW_STEPS_MAX: f64 = 64.0;

pub(super) fn pose(q: &[f64]) -> Pose {
    Pose { position: DVec3::from_slice(q), rotation: DQuat::from_slice(&q[3..]) }
}

pub(super) fn twist(v: &[f64]) -> Twist {
    Twist { linear: DVec3::from_slice(v), angular: DVec3::from_slice(&v[3..]) }
}

pub(super) fn node(body: &Body, q: &[f64], v: &[f64], dt: f64, gravity: Gravity) -> Node {
    let (start, before) = (pose(q), twist(v));
    let free_rotation = match body.wheel_axis {
        Some(_) => (DQuat::from_scaled_axis(body.wheel_turn) * start.rotation).normalize(),
        None => torque_free_flow(start.rotation, before.angular, body.inertia, dt),
    };
    let wheel_axis = body.wheel_axis.map(|axis| free_rotation * axis);
    let axes = DMat3::from_quat(free_rotation);
    let inertia = turned_out(axes, body.inertia);
    let inverse_inertia = turned_out(axes, body.inertia.recip());
    let momentum = world_product(start.rotation, body.inertia, before.angular);
    let carried_spin = inverse_inertia * momentum;
    let target = Twist {
        linear: before.linear + gravity.fall(dt) + dt * (body.force / body.mass),
        angular: carried_spin + dt * (inverse_inertia * body.torque),
    };
    let free_spin = if body.wheel_axis.is_some() { body.wheel_turn / dt } else { carried_spin };
    let mass = body.mass;
    let (rotates, guessed_spin) = (true, None);
    Node {
        start,
        free_rotation,
        free_spin,
        target,
        before,
        impulse: body.impulse,
        mass,
        inertia,
        inverse_inertia,
        rotates,
        wheel_axis,
        guessed_spin,
    }
}

/// Angular velocity at the end of a tick with twist `u` that ends with `rotation`: of the momentum that the body had, plus
/// what the torques gave.
pub(super) fn spin_after(body: &Body, node: &Node, u: Twist, rotation: DQuat) -> DVec3 {
    world_product(rotation, body.inertia.recip(), node.inertia * u.angular)
}

/// R diag(principal) Rᵀ.
fn turned_out(r: DMat3, principal: DVec3) -> DMat3 {
    DMat3::from_cols(r.x_axis * principal.x, r.y_axis * principal.y, r.z_axis * principal.z) * r.transpose()
}

/// R diag(principal) Rᵀ v.
fn world_product(rotation: DQuat, principal: DVec3, v: DVec3) -> DVec3 {
    rotation * (principal * (rotation.inverse() * v))
}

/// Rotation after `dt` without torque: RK4 on the quaternion with constant angular momentum.
fn torque_free_flow(rotation: DQuat, spin: DVec3, principal: DVec3, dt: f64) -> DQuat {
    if principal.x == principal.y && principal.y == principal.z {
        return (DQuat::from_scaled_axis(dt * spin) * rotation).normalize();
    }
    let momentum = world_product(rotation, principal, spin);
    let inverse = principal.recip();
    let rate = |r: DQuat| {
        // The stages of RK4 are no unit quaternions; what they lack in length must not scale the spin.
        let unit = r.normalize();
        let w = unit * (inverse * (unit.inverse() * momentum));
        DQuat::from_xyzw(w.x, w.y, w.z, 0.0) * r * 0.5
    };
    let steps = (spin.length() * dt / FLOW_STEP).ceil().clamp(1.0, FLOW_STEPS_MAX);
    let h = dt / steps;
    let mut r = rotation;
    for _ in 0..steps as usize {
        let k1 = rate(r);
        let k2 = rate(r + k1 * (h / 2.0));
        let k3 = rate(r + k2 * (h / 2.0));
        let k4 = rate(r + k3 * h);
        r = (r + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0)).normalize();
    }
    r
}
