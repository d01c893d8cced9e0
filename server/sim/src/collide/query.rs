//! Questions of logic and AI to the three trees: what a ray hits, what is in a volume, what is nearest.
//!
//! They see the world as the last detection saw it: what was added or put elsewhere since is not there yet. Whatever the
//! shape, a question is answered by the distance between convex shapes that contacts are made of.

use glam::{DMat3, DVec3};

use super::fine_phase::FinePhase;
use super::hull::{self, Bodies};
use super::shape::{Collider, Shape};
use super::trees::Found;
use super::{CollisionObject, Detector, Groups};
use crate::dof::{BodyId, Pose};

/// A ray has arrived where it is this close, m.
const ARRIVED: f64 = 1e-6;

/// Most steps of a ray towards a shape. It takes one for each face whose plane it has to pass, and about five where it is
/// round; what grazes it longer is missed.
const STEPS_MAX: usize = 64;

/// Radius of the ball that stands for a point, m.
const POINT: f64 = 1e-9;

/// What a question is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueryFilter {
    /// What the question is to the groups of colliders.
    pub groups: Groups,
    /// Whether it is about sensors, too.
    pub sensors: bool,
    /// A body that it is not about: who asks, as a rule.
    pub except: Option<BodyId>,
}

impl QueryFilter {
    /// About everything but sensors.
    pub const ALL: Self = Self { groups: Groups::ALL, sensors: false, except: None };

    fn allows(&self, object: CollisionObject, collider: &Collider) -> bool {
        let is_excepted = self.except.is_some_and(|body| object == CollisionObject::Body(body));
        !is_excepted && self.groups.meet(collider.groups()) && (self.sensors || !collider.is_sensor())
    }
}

/// What a ray hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// What was hit.
    pub object: CollisionObject,
    /// From the origin, m; 0 where it starts inside.
    pub distance: f64,
    /// Where, m.
    pub point: DVec3,
    /// Unit vector out of the surface there.
    pub normal: DVec3,
}

/// What is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// What it is.
    pub object: CollisionObject,
    /// To its surface, m; negative inside.
    pub distance: f64,
    /// The point of its surface, m.
    pub point: DVec3,
}

/// Whether it is static, and its serial: bodies come first.
type Order = (bool, u32);

/// A collider that a question comes to.
struct Candidate<'a> {
    order: Order,
    object: CollisionObject,
    collider: &'a Collider,
    pose: Pose,
}

impl Detector {
    /// The first thing that a ray from `origin` along the unit vector `direction` hits within `length`. Of several at the
    /// same distance the one that was added first, bodies before static geometry.
    pub fn ray_cast(
        &self,
        bodies: Bodies,
        [origin, direction]: [DVec3; 2],
        length: f64,
        filter: &QueryFilter,
    ) -> Option<RayHit> {
        let mut probe = Probe::new(origin);
        let mut best: Option<(Order, RayHit)> = None;
        let mut meet = |candidate: Option<Candidate>| {
            let limit = best.map_or(length, |(_, hit)| hit.distance);
            let hit = candidate.and_then(|candidate| {
                let (distance, normal) = probe.ray(&candidate, direction, limit)?;
                let point = origin + direction * distance;
                Some((candidate.order, RayHit { object: candidate.object, distance, point, normal }))
            });
            let nearer =
                |new: &(Order, RayHit)| best.is_none_or(|old| (new.1.distance, new.0) < (old.1.distance, old.0));
            best = hit.filter(nearer).or(best);
            best.map_or(length, |(_, hit)| hit.distance)
        };
        for &id in &self.unbounded {
            meet(self.candidate(bodies, Found::Piece(id), filter));
        }
        self.trees.cast(origin, direction, length, |found| meet(self.candidate(bodies, found, filter)));
        best.map(|(_, hit)| hit)
    }

    /// Everything that overlaps `collider` at `pose`: bodies, each once, then static geometry, both by serial.
    pub fn overlap(
        &self,
        bodies: Bodies,
        (collider, pose): (&Collider, Pose),
        filter: &QueryFilter,
    ) -> Vec<CollisionObject> {
        let mut fine_phase = FinePhase::default();
        let mut all: Vec<(Order, CollisionObject)> = Vec::new();
        let mut meet = |candidate: Option<Candidate>| {
            let touching = candidate.filter(|candidate| overlaps(&mut fine_phase, candidate, (collider, pose)));
            all.extend(touching.map(|candidate| (candidate.order, candidate.object)));
        };
        for &id in &self.unbounded {
            meet(self.candidate(bodies, Found::Piece(id), filter));
        }
        let bounds = hull::bounds(collider.shape(), pose);
        self.trees.overlapping(&bounds, |found| meet(self.candidate(bodies, found, filter)));
        all.sort_unstable_by_key(|&(order, _)| order);
        all.dedup_by_key(|&mut (order, _)| order);
        all.into_iter().map(|(_, object)| object).collect()
    }

    /// Whether a collider at `pose` would overlap static geometry. Allocates nothing once warm.
    pub fn meets_static(&mut self, bodies: Bodies, collider: &Collider, pose: Pose) -> bool {
        let mut fine_phase = std::mem::take(self.narrow_phase.workspaces().own());
        let filter = QueryFilter { groups: collider.groups(), ..QueryFilter::ALL };
        let mut meet = |found: Found| {
            let candidate = self.candidate(bodies, found, &filter);
            candidate.is_some_and(|candidate| overlaps(&mut fine_phase, &candidate, (collider, pose)))
        };
        let mut met = self.unbounded.iter().any(|&id| meet(Found::Piece(id)));
        if !met {
            let bounds = hull::bounds(collider.shape(), pose);
            self.trees.overlapping_fixed(&bounds, |found| met = met || meet(found));
        }
        *self.narrow_phase.workspaces().own() = fine_phase;
        met
    }

    /// What is nearest to `point` and not farther than `within`; of several at the same distance, as with rays.
    pub fn nearest(&self, bodies: Bodies, point: DVec3, within: f64, filter: &QueryFilter) -> Option<Nearest> {
        let mut probe = Probe::new(point);
        let mut best: Option<(Order, Nearest)> = None;
        let mut meet = |candidate: Option<Candidate>| {
            let limit = best.map_or(within, |(_, nearest)| nearest.distance);
            let near = candidate.and_then(|candidate| {
                let (distance, normal) = probe.distance(&candidate, limit)?;
                let (object, point) = (candidate.object, point - normal * distance);
                Some((candidate.order, Nearest { object, distance, point }))
            });
            let nearer =
                |new: &(Order, Nearest)| best.is_none_or(|old| (new.1.distance, new.0) < (old.1.distance, old.0));
            best = near.filter(nearer).or(best);
            // Bounds that the point is in may hold something that it is deeper in.
            best.map_or(within, |(_, nearest)| nearest.distance.max(0.0))
        };
        for &id in &self.unbounded {
            meet(self.candidate(bodies, Found::Piece(id), filter));
        }
        self.trees.nearest(point, within, |found| meet(self.candidate(bodies, found, filter)));
        best.map(|(_, nearest)| nearest)
    }

    /// What was found, where the question is about it.
    fn candidate<'a>(&'a self, bodies: Bodies<'a>, found: Found<'a>, filter: &QueryFilter) -> Option<Candidate<'a>> {
        let candidate = match found {
            Found::Hull(hull) => {
                let object = CollisionObject::Body(hull.placed.body);
                let collider = hull.collider(bodies)?;
                Candidate { order: (false, hull.owner), object, collider, pose: hull.pose()? }
            }
            Found::Piece(id) => {
                let piece = &self.statics[id];
                let object = CollisionObject::Static(id);
                Candidate { order: (true, piece.serial), object, collider: &piece.collider, pose: piece.pose }
            }
        };
        filter.allows(candidate.object, candidate.collider).then_some(candidate)
    }
}

/// A point that asks.
struct Probe {
    at: DVec3,
    point: Collider,
    fine_phase: FinePhase,
}

impl Probe {
    fn new(at: DVec3) -> Self {
        let point = Collider::new(Shape::Ball { radius: POINT }, 0.0);
        Self { at, point, fine_phase: FinePhase::default() }
    }

    /// Distance from the point to a collider, negative inside, and the unit vector out of its surface; `None` beyond
    /// `within`.
    fn distance(&mut self, to: &Candidate, within: f64) -> Option<(f64, DVec3)> {
        let at = self.at;
        self.distance_at(at, to, within)
    }

    fn distance_at(&mut self, at: DVec3, to: &Candidate, within: f64) -> Option<(f64, DVec3)> {
        if let Shape::HalfSpace { normal } = to.collider.shape() {
            let normal = to.pose.rotation * *normal;
            let height = normal.dot(at - to.pose.position);
            return (height <= within).then_some((height, normal));
        }
        let here = (&self.point, Pose { position: at, ..Pose::IDENTITY });
        let found = self.fine_phase.proximity(here, (to.collider, to.pose), within + ARRIVED)?;
        Some((found.gap, -found.normal)).filter(|&(distance, _)| distance <= within)
    }

    /// How far a ray along the unit vector `direction` gets to a collider, and the normal of the surface there. Every step
    /// goes to the plane that tells the ray's end from the shape: never through the surface, and in a few steps to it.
    fn ray(&mut self, to: &Candidate, direction: DVec3, length: f64) -> Option<(f64, DVec3)> {
        if let Shape::Mesh(mesh) = to.collider.shape() {
            let to_mesh = to.pose.rotation.inverse();
            let (from, along) = (to_mesh * (self.at - to.pose.position), to_mesh * direction);
            let (way, normal) = mesh.ray(from, along, length)?;
            return Some((way, to.pose.rotation * normal));
        }
        let mut way = 0.0;
        for _ in 0..STEPS_MAX {
            let (distance, normal) = self.distance_at(self.at + direction * way, to, length - way + ARRIVED)?;
            if distance <= ARRIVED {
                return Some((way, normal));
            }
            let closing = -normal.dot(direction);
            way += distance / closing;
            if closing <= 0.0 || way > length {
                return None;
            }
        }
        None
    }
}

/// Whether a collider overlaps another one.
fn overlaps(fine_phase: &mut FinePhase, candidate: &Candidate, (collider, pose): (&Collider, Pose)) -> bool {
    match (candidate.collider.shape(), collider.shape()) {
        (_, Shape::HalfSpace { .. }) => false,
        (Shape::HalfSpace { normal }, shape) => {
            let normal = candidate.pose.rotation * *normal;
            let (low, _) = shape.interval(DMat3::from_quat(pose.rotation).transpose() * normal);
            normal.dot(pose.position - candidate.pose.position) + low <= 0.0
        }
        _ => {
            let other = (candidate.collider, candidate.pose);
            fine_phase.proximity((collider, pose), other, ARRIVED).is_some_and(|found| found.gap <= 0.0)
        }
    }
}
