//! Passing: whether two bodies that will fly on as they do meet in this tick at all.
//!
//! A contact's normal is that of the start of the tick. What flies past a post at 60 m/s would be stopped by the plane
//! between the two, half a metre beside the post. So pairs that are apart, and that their points would stop, are followed
//! along their motion by conservative advancement (Mirtich, "Impulse-based Dynamic Simulation", 1996): the plane between
//! them tells how far both may go without meeting, and there is another plane.

use glam::{DQuat, DVec3};

use super::collision::Meeting;
use super::convex::Finder;
use super::manifold::{Manifold, ManifoldPoint};
use super::shape::{Collider, Shape};
use super::{Moving, Surface};
use crate::dof::{Pose, Twist};
use crate::settings::Settings;

/// What comes nearer than this meets, m: forces of the tick bend its way a little.
const NEAR: f64 = 2e-3;

/// Most planes that are looked at. What takes more meets.
const PLANES_MAX: u32 = 32;

/// A collider in flight.
#[derive(Clone, Copy)]
struct Flight<'a> {
    collider: &'a Collider,
    pose: Pose,
    twist: Twist,
    /// Angular velocity that moves its surface, rad/s.
    across: DVec3,
    /// Whether that goes round with it.
    is_round: bool,
}

impl<'a> Flight<'a> {
    fn of(body: &Moving<'a>, fall: DVec3) -> Self {
        let Moving { collider, pose, twist, .. } = *body;
        let (across, is_round) = (spin_across(body), collider.shape().revolution_axis().is_some());
        Self { collider, pose, twist: Twist { linear: twist.linear + fall, ..twist }, across, is_round }
    }

    fn still(collider: &'a Collider, pose: Pose) -> Self {
        Self { collider, pose, twist: Twist::REST, across: DVec3::ZERO, is_round: false }
    }

    /// Fastest that turning moves a point of its surface along a unit vector, m/s.
    fn turning(&self, normal: DVec3) -> f64 {
        let across = if self.is_round { self.across } else { self.across.cross(normal) };
        across.length() * self.collider.bounding_radius()
    }

    fn at(&self, time: f64) -> Pose {
        let Pose { position, rotation } = self.pose;
        let turn = DQuat::from_scaled_axis(self.twist.angular * time);
        Pose { position: position + self.twist.linear * time, rotation: (turn * rotation).normalize() }
    }
}

/// Angular velocity without what leaves the surface in its place: a body of revolution may spin about its axis, rad/s.
pub(super) fn spin_across(body: &Moving) -> DVec3 {
    let spin = body.twist.angular;
    match (body.collider.shape(), body.collider.shape().revolution_axis()) {
        (Shape::Ball { .. }, _) => DVec3::ZERO,
        (_, Some(axis)) => spin.reject_from_normalized(body.pose.rotation * axis),
        _ => spin,
    }
}

/// Whether two convex colliders pass each other, though the points of `manifold` would stop them. `Err` is what does
/// not move.
pub(super) fn passes(
    a: &Moving,
    b: Result<&Moving, (&Collider, Pose)>,
    manifold: &mut Manifold,
    finder: &mut Finder,
    scratch: &mut Manifold,
    settings: &Settings,
) -> bool {
    if !(a.flies && b.map_or(true, |b| b.flies)) {
        return false;
    }
    let meeting = Meeting { a, b: b.ok(), surface: Surface::default() };
    let normal = manifold.normal;
    let apart = |point: &ManifoldPoint| point.gap > NEAR;
    let stops = |point: &ManifoldPoint| meeting.closes(point.position, normal, settings) > point.gap;
    let points = manifold.reduced();
    if !points.iter().all(apart) || !points.iter().any(stops) {
        return false;
    }
    // Both fall, or one does.
    let fall = settings.gravity * settings.dt;
    let flights = match b {
        Ok(b) => [Flight::of(a, DVec3::ZERO), Flight::of(b, DVec3::ZERO)],
        Err((collider, pose)) => [Flight::of(a, fall), Flight::still(collider, pose)],
    };
    !meet(flights, finder, scratch, settings.dt)
}

/// Whether two in flight come near within `dt`. `scratch` is overwritten.
fn meet([a, b]: [Flight; 2], finder: &mut Finder, scratch: &mut Manifold, dt: f64) -> bool {
    let mut time = 0.0;
    for _ in 0..PLANES_MAX {
        scratch.clear();
        let (Some(core_a), Some(core_b)) = (a.collider.convex(a.at(time)), b.collider.convex(b.at(time))) else {
            return true;
        };
        finder.contacts(core_a, core_b, f64::MAX, None, scratch);
        let normal = scratch.normal;
        let gap = scratch.reduced().iter().map(|point| point.gap).fold(f64::INFINITY, f64::min);
        if gap < NEAR || !gap.is_finite() {
            return true;
        }
        let closing = normal.dot(a.twist.linear - b.twist.linear) + a.turning(normal) + b.turning(normal);
        if closing <= 0.0 {
            return false;
        }
        time += (gap - NEAR / 2.0) / closing;
        if time >= dt {
            return false;
        }
    }
    true
}
