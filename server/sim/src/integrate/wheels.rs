//! Wheels: bodies that something carries by the axis about which they spin. Their free flight, a nutation, is one that never
//! happens, and Newton does not come back from it: see [`Node`](crate::dof::Node).

use glam::{DMat3, DQuat, DVec3};

use super::problem::Unknown;
use super::step::{Scene, Solve};
use crate::dof::{Body, DofKind};
use crate::potential::{Anchor, End};
use crate::state::State;

/// How much the moments of inertia across the axis of a wheel may differ, and how far its centre may be off the axis, as a
/// share. What is less round than this really nutates.
const ROUND: f64 = 0.01;

/// Finds the wheels of this tick.
pub(super) fn find(scene: &mut Scene) {
    for &id in scene.order {
        (scene.bodies[id].wheel_axis, scene.bodies[id].wheel_turn) = (None, DVec3::ZERO);
    }
    let mut carrier = None;
    for (_, axle) in scene.potentials.axles.awake() {
        let Some(chassis) = scene.bodies.get(axle.chassis).filter(|chassis| !chassis.quarantined) else { continue };
        let turned = match carrier {
            Some((id, turned)) if id == axle.chassis => turned,
            // Most chassis carry several wheels, one after the other.
            _ => {
                let turn = DQuat::from_scaled_axis(scene.settings.dt * chassis.twist(scene.state).angular);
                carrier.insert((axle.chassis, turn * chassis.pose(scene.state).rotation)).1
            }
        };
        let headed = turned * axle.control.axis();
        let wheel = &mut scene.bodies[axle.wheel];
        wheel.wheel_turn = turn_between(wheel.pose(scene.state).rotation * DVec3::Z, headed);
        wheel.wheel_axis = Some(DVec3::Z);
    }
    for (_, hinge) in scene.potentials.hinges.awake() {
        let ([axes, _], ends) = (hinge.desc.axes, [hinge.desc.desc.a, hinge.desc.desc.b]);
        let takes_part = |end: Anchor| end.body.is_none_or(|id| scene.bodies.get(id).is_some_and(|b| !b.quarantined));
        if !ends.into_iter().all(takes_part) {
            continue;
        }
        // However slow: a motor may spin it up within the tick.
        let speed = |end: usize| {
            let body = scene.bodies.get(ends[end].body?)?;
            let is_wheel = body.wheel_axis.is_none() && is_round(body, ends[end].point, axes[end]);
            is_wheel.then(|| speed_about(body, axes[end], scene.state))
        };
        let wheel = if speed(1) >= speed(0) { 1 } else { 0 };
        if let (Some(id), Some(_)) = (ends[wheel].body, speed(wheel)) {
            scene.bodies[id].wheel_axis = Some(axes[wheel]);
        }
    }
}

/// The shortest turn from one unit vector to another, as a scaled axis, rad; none where they face away from each other,
/// which an axle that holds never comes to.
fn turn_between(from: DVec3, to: DVec3) -> DVec3 {
    let (across, along) = (from.cross(to), from.dot(to));
    let sine = across.length();
    if along <= 0.0 || sine == 0.0 { DVec3::ZERO } else { across * (sine.atan2(along) / sine) }
}

/// Whether a rigid body is one of revolution, near enough, about the line through `point` along `axis`.
fn is_round(body: &Body, point: DVec3, axis: DVec3) -> bool {
    if body.kind != DofKind::RigidBody {
        return false;
    }
    let inertia = DMat3::from_diagonal(body.inertia);
    let (x, y) = axis.any_orthonormal_pair();
    let (most, off) = (body.inertia.max_element(), point.reject_from_normalized(axis));
    let tilted = x.dot(inertia * axis).abs().max(y.dot(inertia * axis).abs());
    let oval = (x.dot(inertia * x) - y.dot(inertia * y)).abs().max(2.0 * x.dot(inertia * y).abs());
    tilted.max(oval) <= ROUND * most && body.mass * off.length_squared() <= ROUND * ROUND * most
}

/// Speed about an axis of the body, rad/s.
fn speed_about(body: &Body, axis: DVec3, state: &State) -> f64 {
    body.twist(state).angular.dot(body.pose(state).rotation * axis).abs()
}

impl Solve {
    /// Newton starts with a wheel on an axle that gets to where it is headed within the tick, and spins on.
    pub(super) fn head_wheel(&mut self, end: End) {
        if let Some(Unknown::Body(node)) = self.problem.unknowns.get_mut(end.frame as usize)
            && let Some(headed) = node.wheel_axis
        {
            node.guessed_spin = Some(node.following(node.start.rotation * DVec3::Z, headed, self.problem.dt));
        }
    }

    /// Where one of two ends that share a direction, given in both frames, is a wheel about it: the axis about which it
    /// spins in the tick. Newton then starts with a wheel whose axis follows what carries it, as that turned in the last tick; the
    /// wheel's own momentum says something else, it resists any turn of its axis.
    pub(super) fn carry_wheel(&mut self, ends: [End; 2], axes: [DVec3; 2]) -> Option<DVec3> {
        let is_wheel = |i: usize| {
            let node = self.node(ends[i].frame)?;
            let axis = node.free_rotation * axes[i];
            (node.wheel_axis?.cross(axis).length() < ROUND).then_some((i, axis, node.start.rotation * axes[i]))
        };
        let (wheel, axis, before) = is_wheel(1).or_else(|| is_wheel(0))?;
        let dt = self.problem.dt;
        let carrier = self.start(ends[1 - wheel]);
        let turned = DQuat::from_scaled_axis(dt * DVec3::from(carrier.angular));
        let wanted = turned * DVec3::from(carrier.arm(axes[1 - wheel]));
        if let Unknown::Body(node) = &mut self.problem.unknowns[ends[wheel].frame as usize] {
            node.guessed_spin = Some(node.following(before, wanted, dt));
        }
        Some(axis)
    }
}
