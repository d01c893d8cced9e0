//! The fine phase: contact points of two colliders that may touch.
//!
//! Half-spaces are in closed form; everything else is GJK on cores with extrusion radius, EPA for cores that overlap, and
//! clipped faces (`convex`). What is remembered of a pair from tick to tick is the pair's; a `FinePhase` has nothing but
//! room to work in, so that every thread has its own.

use glam::DVec3;

use super::collision::{Closest, Meeting};
use super::convex::{Finder, NAMELESS};
use super::half_space;
use super::manifold::{Manifold, ManifoldPoint};
use super::narrow_phase::{Key, Pair};
use super::passing::{Beside, Flyby, passes, spin_across};
use super::patches::Patches;
use super::proximity::Proximity;
use super::shape::{Collider, Shape};
use super::still::Still;
use super::triangle_mesh::TriangleMesh;
use super::{ContactPoint, Moving, Partner, Surface};
use crate::dof::Pose;
use crate::settings::Settings;

/// A point without a name of its own is found again where it lies within this of its place last tick, m.
const SAME_POINT: f64 = 0.02;

/// Room to work in.
#[derive(Default)]
pub(super) struct FinePhase {
    finder: Finder,
    manifold: Manifold,
    passing: Manifold,
    patches: Patches,
    /// Points of a pair that overlaps, with their normals.
    overlapping: Vec<(DVec3, ManifoldPoint)>,
    /// Points of a pair's last tick that this tick has not taken over.
    old: Vec<ContactPoint>,
}

impl FinePhase {
    /// Contacts of two bodies. Answers whether there are any that push within this tick.
    pub fn bodies(&mut self, pair: &mut Pair, [a, b]: [&Moving; 2], surface: Surface, settings: &Settings) -> bool {
        let margin =
            margin((a.twist.linear - b.twist.linear).length(), reach(a, settings) + reach(b, settings), settings);
        self.manifold.clear();
        let deforms = a.spread > 0.0 || b.spread > 0.0;
        self.convex(pair, (a.collider, a.pose), (b.collider, b.pose), margin, deforms);
        self.let_pass(a, Beside::Moving(b), settings);
        let meeting = Meeting { a, b: Some(b), surface };
        self.update((a.serial, Partner::Body(b.serial)), pair, &meeting, settings);
        // What turns may be nearer at the end of the tick than its points say.
        let near = settings.contact.margin + reach(a, settings) + reach(b, settings);
        let closes = |point: &ContactPoint| meeting.closes(point.position, point.normal, settings);
        !pair.is_sensor && pair.points.iter().any(|point| point.gap - closes(point) < near)
    }

    /// Contacts of a body with a piece of static geometry.
    pub fn with_static(
        &mut self,
        pair: &mut Pair,
        a: &Moving,
        (serial, piece, pose): (u32, &Collider, Pose),
        surface: Surface,
        settings: &Settings,
    ) {
        let meeting = Meeting { a, b: None, surface };
        let key = (a.serial, Partner::Static(serial));
        self.manifold.clear();
        match piece.shape() {
            Shape::HalfSpace { normal } => {
                let normal = pose.rotation * *normal;
                let margin = margin_above(a, normal, settings);
                half_space::contacts(a.collider.shape(), a.pose, pose.position, normal, margin, &mut self.manifold);
                self.update(key, pair, &meeting, settings);
            }
            Shape::Mesh(mesh) => {
                let margin = margin(a.twist.linear.length(), reach(a, settings), settings);
                self.surface(key, pair, (mesh, pose), margin, &meeting, settings);
            }
            _ => {
                let margin = margin(a.twist.linear.length(), reach(a, settings), settings);
                self.convex(pair, (a.collider, a.pose), (piece, pose), margin, a.spread > 0.0);
                if let Some(piece) = piece.convex(pose) {
                    self.let_pass(a, Beside::Still(piece), settings);
                }
                self.update(key, pair, &meeting, settings);
            }
        }
    }

    /// The nearest points of two shapes; nothing is remembered of them.
    pub fn proximity(&mut self, a: (&Collider, Pose), b: (&Collider, Pose), margin: f64) -> Option<Proximity> {
        if let (Shape::Mesh(mesh), Some(convex)) = (b.0.shape(), a.0.convex(a.1)) {
            self.patches.find((a.0.shape(), convex, a.1), (mesh, b.1), margin, &mut self.finder, None);
            return self.patches.found().iter_mut().filter_map(nearest_of).min_by(|p, q| p.gap.total_cmp(&q.gap));
        }
        self.look(a, b, margin);
        nearest_of(&mut self.manifold)
    }

    /// Where two colliders overlap: points with the normals from the first to the second; nothing is remembered of it.
    /// `margin` says by how much more than is known what is in a crack may be, m.
    pub fn overlap(&mut self, a: (&Collider, Pose), b: (&Collider, Pose), margin: f64) -> &[(DVec3, ManifoldPoint)] {
        self.overlapping.clear();
        if let (Shape::Mesh(mesh), Some(convex)) = (b.0.shape(), a.0.convex(a.1)) {
            let Self { finder, patches, overlapping, .. } = self;
            patches.find((a.0.shape(), convex, a.1), (mesh, b.1), margin, finder, None);
            for patch in patches.found() {
                let normal = patch.normal;
                let deep = patch.reduced().iter().filter(|point| point.gap < 0.0);
                overlapping.extend(deep.map(|&point| (normal, point)));
            }
        } else {
            self.look(a, b, 0.0);
            let normal = self.manifold.normal;
            self.overlapping.extend(self.manifold.reduced().iter().map(|&point| (normal, point)));
        }
        &self.overlapping
    }

    /// Finds the manifold of two colliders within `margin` of one another; nothing else is remembered of it. There is none
    /// of surfaces of triangles.
    fn look(&mut self, a: (&Collider, Pose), b: (&Collider, Pose), margin: f64) {
        let Self { finder, manifold, .. } = self;
        manifold.clear();
        if let Shape::HalfSpace { normal } = b.0.shape() {
            let normal = b.1.rotation * *normal;
            half_space::contacts(a.0.shape(), a.1, b.1.position, normal, margin, manifold);
        } else if let (Some(a), Some(b)) = (a.0.convex(a.1), b.0.convex(b.1)) {
            finder.contacts(a, b, margin, None, manifold);
        }
    }

    /// Finds the manifold of two convex shapes, unless they kept still; `deforms` says that one has not kept its shape.
    fn convex(&mut self, pair: &mut Pair, a: (&Collider, Pose), b: (&Collider, Pose), margin: f64, deforms: bool) {
        let Self { finder, manifold, .. } = self;
        let (Pair { normal, still, .. }, poses) = (pair, [a.1, b.1]);
        if deforms {
            *still = None;
        }
        if still.as_ref().is_some_and(|still| still.carry(poses, margin, manifold)) {
            return;
        }
        if let (Some(a), Some(b)) = (a.0.convex(a.1), b.0.convex(b.1)) {
            *normal = finder.contacts(a, b, margin, *normal, manifold);
            *still = Some(Still::keep(manifold, poses, margin));
        }
    }

    /// Drops the points of what only passes.
    fn let_pass(&mut self, a: &Moving, b: Beside, settings: &Settings) {
        let Self { manifold, finder, passing, .. } = self;
        if !manifold.reduced().is_empty() && passes(a, b, manifold, finder, passing, settings) {
            manifold.clear();
        }
    }

    /// Contacts with a surface of triangles: those of all its patches.
    fn surface(
        &mut self,
        key: Key,
        pair: &mut Pair,
        (mesh, pose): (&TriangleMesh, Pose),
        margin: f64,
        meeting: &Meeting,
        settings: &Settings,
    ) {
        let Self { finder, passing, patches, old, .. } = self;
        old.clear();
        old.append(&mut pair.points);
        let body = meeting.a;
        let Some(convex) = body.collider.convex(body.pose) else { return };
        let shape = (body.collider.shape(), convex, body.pose);
        let flyby = Flyby { body, settings, scratch: passing };
        patches.find(shape, (mesh, pose), margin, finder, Some(flyby));
        let touched = pair.last_touch.is_some();
        for patch in patches.found() {
            let first = pair.points.len();
            remember_points(key, patch, old, &mut pair.points, meeting.surface);
            let here = meeting.closest(&pair.points[first..], touched, settings);
            let gap = |closest: &Option<Closest>| closest.map_or(f64::INFINITY, |closest| closest.gap);
            if gap(&here) < gap(&pair.touch) {
                pair.touch = here;
            }
        }
    }

    /// Makes contact points of the manifold's points.
    fn update(&mut self, key: Key, pair: &mut Pair, meeting: &Meeting, settings: &Settings) {
        let Self { manifold, old, .. } = self;
        old.clear();
        old.append(&mut pair.points);
        remember_points(key, manifold, old, &mut pair.points, meeting.surface);
        pair.touch = meeting.closest(&pair.points, pair.last_touch.is_some(), settings);
    }
}

/// Whether a body may come to a half-space within the tick.
pub(super) fn may_reach(a: &Moving, (piece, pose): (&Collider, Pose), settings: &Settings) -> bool {
    let Shape::HalfSpace { normal } = piece.shape() else { return true };
    let normal = pose.rotation * *normal;
    let height = (a.pose.position - pose.position).dot(normal);
    height <= a.collider.bounding_radius() + margin_above(a, normal, settings)
}

/// Widest gap that a tick may close between a body and a half-space, m. What goes along the plane comes no nearer to it;
/// what the tick itself turns down is for the second look.
fn margin_above(a: &Moving, normal: DVec3, settings: &Settings) -> f64 {
    margin((-a.twist.linear.dot(normal)).max(0.0), reach(a, settings), settings)
}

/// The point of a manifold where the gap is least.
fn nearest_of(manifold: &mut Manifold) -> Option<Proximity> {
    let normal = manifold.normal;
    let nearest = manifold.reduced().iter().min_by(|a, b| a.gap.total_cmp(&b.gap))?;
    Some(Proximity { gap: nearest.gap, normal, point: nearest.position })
}

/// Makes contact points of a manifold's points, with the memory of those among the `old` that they are.
fn remember_points(
    key: Key,
    manifold: &mut Manifold,
    old: &mut Vec<ContactPoint>,
    points: &mut Vec<ContactPoint>,
    surface: Surface,
) {
    let single = manifold.reduced().len() == 1 && old.len() == 1;
    let normal = manifold.normal;
    // Points of a pair share it.
    let stiffening = old.iter().map(|point| point.stiffening).fold(0.0, f64::max);
    for point in manifold.reduced() {
        let known = old.iter().position(|o| {
            let named = o.feature == point.feature && point.feature != NAMELESS;
            let near = (o.position - point.position).length() < SAME_POINT;
            single || named || (near && (o.feature == NAMELESS || point.feature == NAMELESS))
        });
        let mut point = ContactPoint::fresh(key, normal, point, surface);
        point.stiffening = stiffening;
        if let Some(known) = known {
            point.inherit(&old.swap_remove(known));
        }
        points.push(point);
    }
}

/// Widest gap that a tick may close, m, for bodies that close at `speed` and reach so much farther by turning.
fn margin(speed: f64, reach: f64, settings: &Settings) -> f64 {
    settings.contact.margin + settings.dt * (speed + settings.dt * settings.gravity.length()) + reach
}

/// How far a point of the body's surface may get in a tick by turning and deforming, m.
fn reach(body: &Moving, settings: &Settings) -> f64 {
    let across = spin_across(body);
    (settings.dt * across.length()).min(2.0) * body.collider.bounding_radius() + settings.dt * body.spread
}
