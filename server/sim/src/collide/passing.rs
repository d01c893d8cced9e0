//! Passing: whether two colliders that go on as they do meet in this tick at all.
//!
//! A contact's normal is that of the start of the tick. What flies past a post at 60 m/s would be stopped by the plane
//! between the two, half a metre beside the post. So pairs that are apart, and that their points would stop, are followed
//! along their motion by conservative advancement (Mirtich, "Impulse-based Dynamic Simulation", 1996): the plane between
//! them tells how far both may go without meeting, and there is another plane.

use glam::{DQuat, DVec3};
use parry3d_f64::math::Pose as ParryPose;

use super::collision::Meeting;
use super::convex::{Convex, Finder};
use super::manifold::{Manifold, ManifoldPoint};
use super::shape::Shape;
use super::{Moving, Surface};
use crate::dof::Twist;
use crate::settings::Settings;

/// What comes nearer than this meets, m: forces of the tick bend its way a little.
const NEAR: f64 = 2e-3;

/// Most planes that are looked at. What takes more meets.
const PLANES_MAX: u32 = 32;

/// What a collider may pass.
#[derive(Clone, Copy)]
pub(super) enum Beside<'a> {
    Moving(&'a Moving<'a>),
    Still(Convex<'a>),
}

impl<'a> Beside<'a> {
    fn moving(self) -> Option<&'a Moving<'a>> {
        match self {
            Self::Moving(body) => Some(body),
            Self::Still(_) => None,
        }
    }
}

/// Whether a body passes a surface of triangles: asked of all triangles together, because the one that it comes to may be
/// the neighbour of the one whose points would stop it, and have no points of its own.
pub(super) struct Flyby<'a> {
    pub body: &'a Moving<'a>,
    pub settings: &'a Settings,
    pub scratch: &'a mut Manifold,
}

impl Flyby<'_> {
    /// Whether the points of a triangle would stop it, as [`stops`].
    pub fn stops(&self, triangle: Convex, points: &mut Manifold) -> bool {
        stops(self.body, Beside::Still(triangle), points, self.settings)
    }

    /// Whether it comes to a triangle that faces along `outward` from its front.
    pub fn comes_to(&mut self, triangle: Convex, outward: DVec3, finder: &mut Finder) -> bool {
        let Self { body, settings, scratch } = self;
        let reach = body.collider.bounding_radius() * spin_across(body).length();
        let closing = reach - body.twist.linear.dot(outward);
        closing * settings.dt > NEAR && meets(body, Beside::Still(triangle), finder, scratch, settings)
    }
}

/// A convex shape in flight.
#[derive(Clone, Copy)]
struct Flight<'a> {
    convex: Convex<'a>,
    /// What it goes round, m, and how that moves.
    pivot: DVec3,
    twist: Twist,
    /// Angular velocity that moves its surface, rad/s.
    across: DVec3,
    /// Whether that goes round with it.
    is_round: bool,
    /// How far its surface reaches from the pivot, m.
    reach: f64,
}

impl<'a> Flight<'a> {
    fn of(body: &'a Moving, fall: DVec3) -> Option<Self> {
        let Moving { collider, pose, twist, pivot, .. } = *body;
        // What goes round something else takes its surface along.
        let turns = pivot == DVec3::ZERO;
        let across = if turns { spin_across(body) } else { twist.angular };
        let is_round = turns && collider.shape().revolution_axis().is_some();
        let reach = pivot.length() + collider.bounding_radius();
        let linear = twist.at(pivot) + fall;
        let (convex, pivot) = (collider.convex(pose)?, pose.position + pivot);
        Some(Self { convex, pivot, twist: Twist { linear, ..twist }, across, is_round, reach })
    }

    fn still(convex: Convex<'a>) -> Self {
        let (pivot, across) = (convex.pose.translation, DVec3::ZERO);
        Self { convex, pivot, twist: Twist::REST, across, is_round: false, reach: 0.0 }
    }

    /// Fastest that turning moves a point of its surface along a unit vector, m/s.
    fn turning(&self, normal: DVec3) -> f64 {
        let across = if self.is_round { self.across } else { self.across.cross(normal) };
        across.length() * self.reach
    }

    fn at(&self, time: f64) -> Convex<'a> {
        let turn = DQuat::from_scaled_axis(self.twist.angular * time);
        let ParryPose { translation, rotation } = self.convex.pose;
        let place = self.pivot + self.twist.linear * time + turn * (translation - self.pivot);
        Convex { pose: ParryPose::from_parts(place, (turn * rotation).normalize()), ..self.convex }
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

/// Whether a convex collider passes another, though the points of `manifold` would stop it.
pub(super) fn passes(
    a: &Moving,
    b: Beside,
    manifold: &mut Manifold,
    finder: &mut Finder,
    scratch: &mut Manifold,
    settings: &Settings,
) -> bool {
    stops(a, b, manifold, settings) && !meets(a, b, finder, scratch, settings)
}

/// Whether two that are apart, and go on as they do, would be stopped by the points of `manifold`.
pub(super) fn stops(a: &Moving, b: Beside, manifold: &mut Manifold, settings: &Settings) -> bool {
    if !(a.flies && b.moving().is_none_or(|b| b.flies)) {
        return false;
    }
    let near = near(a, b, settings);
    let meeting = Meeting { a, b: b.moving(), surface: Surface::default() };
    let normal = manifold.normal;
    let stops = |point: &ManifoldPoint| meeting.closes(point.position, normal, settings) > point.gap;
    let points = manifold.reduced();
    points.iter().all(|point| point.gap > near) && points.iter().any(stops)
}

/// Whether two that go on as they do meet in this tick. `scratch` is overwritten.
pub(super) fn meets(a: &Moving, b: Beside, finder: &mut Finder, scratch: &mut Manifold, settings: &Settings) -> bool {
    // Both fall, or one does.
    let flights = match b {
        Beside::Moving(b) => [Flight::of(a, DVec3::ZERO), Flight::of(b, DVec3::ZERO)],
        Beside::Still(convex) => [Flight::of(a, settings.gravity * settings.dt), Some(Flight::still(convex))],
    };
    match flights {
        [Some(of_a), Some(of_b)] => meet([of_a, of_b], near(a, b, settings), finder, scratch, settings.dt),
        _ => true,
    }
}

/// What comes nearer than this meets, m.
fn near(a: &Moving, b: Beside, settings: &Settings) -> f64 {
    NEAR + settings.dt * (a.bend + b.moving().map_or(0.0, |b| b.bend))
}

/// Whether two in flight come nearer than `near` within `dt`. `scratch` is overwritten.
fn meet([a, b]: [Flight; 2], near: f64, finder: &mut Finder, scratch: &mut Manifold, dt: f64) -> bool {
    let mut time = 0.0;
    for _ in 0..PLANES_MAX {
        scratch.clear();
        finder.contacts(a.at(time), b.at(time), f64::MAX, None, scratch);
        let normal = scratch.normal;
        let gap = scratch.reduced().iter().map(|point| point.gap).fold(f64::INFINITY, f64::min);
        if gap < near || !gap.is_finite() {
            return true;
        }
        let closing = normal.dot(a.twist.linear - b.twist.linear) + a.turning(normal) + b.turning(normal);
        if closing <= 0.0 {
            return false;
        }
        time += (gap - near / 2.0) / closing;
        if time >= dt {
            return false;
        }
    }
    true
}
