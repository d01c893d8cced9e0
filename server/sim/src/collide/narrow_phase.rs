//! Fine detection: contact points of pairs that may touch, found again from tick to tick.
//!
//! Half-spaces are ours, in closed form; everything else is parry's (GJK on support maps with border radius, EPA for
//! what overlaps, feature clipping for the manifold).

use arrayvec::ArrayVec;
use glam::DVec3;
use parry3d_f64::math::Pose as ParryPose;
use parry3d_f64::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d_f64::shape::PackedFeatureId;

use super::half_space;
use super::manifold::{Manifold, ManifoldPoint, POINTS_MAX};
use super::shape::{Collider, Shape};
use super::{ContactPoint, Moving, Partner};
use crate::dof::Pose;
use crate::settings::Settings;

/// A point without a name of its own is found again where it lies within this of its place last tick, m.
const SAME_POINT: f64 = 0.02;

/// Name of a point whose features parry does not know.
const NAMELESS: u32 = u32::MAX;

/// What is kept of a pair from tick to tick.
struct Pair {
    points: ArrayVec<ContactPoint, POINTS_MAX>,
    /// Parry's own memory of the pair: the last separating direction.
    parry: ContactManifold<(), ()>,
}

/// Serial of the first body, and its partner.
type Key = (u32, Partner);

/// A pair of a tick and its place in memory, which the next tick takes over.
#[derive(Clone, Copy)]
struct Known {
    key: Key,
    place: Option<u32>,
}

impl Known {
    fn key(&self) -> Key {
        self.key
    }
}

/// The fine phase and its memory.
#[derive(Default)]
pub(super) struct NarrowPhase {
    /// What is known of pairs. They are large, and stay where they are from tick to tick.
    memory: Vec<Pair>,
    /// Pairs of the last tick, sorted by key; without a place where this tick has taken it over.
    last: Vec<Known>,
    /// Pairs of this tick, in the order in which they were asked for; sorted by key at its end.
    pairs: Vec<Known>,
    /// Places of pairs that ended, to be used again.
    spare: Vec<u32>,
    manifold: Manifold,
}

impl NarrowPhase {
    /// Starts a tick.
    pub fn begin(&mut self) {
        std::mem::swap(&mut self.last, &mut self.pairs);
        self.pairs.clear();
    }

    /// Contacts of two bodies.
    pub fn bodies(&mut self, a: &Moving, b: &Moving, settings: &Settings) {
        let margin =
            margin((a.twist.linear - b.twist.linear).length(), reach(a, settings) + reach(b, settings), settings);
        self.manifold.clear();
        let key = (a.serial, Partner::Body(b.serial));
        let pair = self.take(key);
        self.parry(pair, (a.collider, a.pose), (b.collider, b.pose), margin);
        self.update(key, pair, friction(a.collider, b.collider));
    }

    /// Contacts of a body with a piece of static geometry.
    pub fn with_static(&mut self, a: &Moving, serial: u32, piece: &Collider, pose: Pose, settings: &Settings) {
        let margin = margin(a.twist.linear.length(), reach(a, settings), settings);
        let key = (a.serial, Partner::Static(serial));
        self.manifold.clear();
        if let Shape::HalfSpace { normal } = piece.shape() {
            let normal = pose.rotation * *normal;
            if (a.pose.position - pose.position).dot(normal) > a.collider.bounding_radius() + margin {
                return;
            }
            half_space::contacts(a.collider.shape(), a.pose, pose.position, normal, margin, &mut self.manifold);
            if self.manifold.reduced().is_empty() {
                return;
            }
            let pair = self.take(key);
            self.update(key, pair, friction(a.collider, piece));
            return;
        }
        let pair = self.take(key);
        self.parry(pair, (a.collider, a.pose), (piece, pose), margin);
        self.update(key, pair, friction(a.collider, piece));
    }

    /// Ends a tick: writes all points, sorted by pair.
    pub fn finish(&mut self, contacts: &mut Vec<ContactPoint>) {
        self.spare.extend(self.last.drain(..).filter_map(|known| known.place));
        self.pairs.sort_unstable_by_key(Known::key);
        for place in self.pairs.iter().filter_map(|known| known.place) {
            contacts.extend_from_slice(&self.memory[place as usize].points);
        }
    }

    /// Takes over what the solver did to the points that [`NarrowPhase::finish`] wrote, in the same order.
    pub fn remember(&mut self, contacts: &[ContactPoint]) {
        let mut contacts = contacts.iter();
        for place in self.pairs.iter().filter_map(|known| known.place) {
            let points = &mut self.memory[place as usize].points;
            points.iter_mut().zip(&mut contacts).for_each(|(mine, theirs)| *mine = *theirs);
        }
    }

    /// Drops every pair of a body.
    pub fn forget(&mut self, serial: u32) {
        let Self { pairs, spare, .. } = self;
        pairs.retain(|Known { key: (a, b), place }| {
            let gone = *a == serial || *b == Partner::Body(serial);
            spare.extend(place.filter(|_| gone));
            !gone
        });
    }

    /// Place in memory of a pair, with what the last tick left there where it has been one.
    fn take(&mut self, key: Key) -> usize {
        let known = self.last.binary_search_by_key(&key, Known::key).ok();
        let place = known.and_then(|i| self.last[i].place.take()).unwrap_or_else(|| self.blank());
        self.pairs.push(Known { key, place: Some(place) });
        place as usize
    }

    /// Place in memory of a pair of which nothing is known.
    fn blank(&mut self) -> u32 {
        if let Some(place) = self.spare.pop() {
            let Pair { points, parry } = &mut self.memory[place as usize];
            points.clear();
            parry.clear();
            return place;
        }
        self.memory.push(Pair { points: ArrayVec::new(), parry: ContactManifold::new() });
        self.memory.len() as u32 - 1
    }

    /// Asks parry for the manifold of two convex shapes.
    fn parry(&mut self, pair: usize, a: (&Collider, Pose), b: (&Collider, Pose), margin: f64) {
        let (Some((shape_a, pose_a)), Some((shape_b, pose_b))) = (a.0.placed(a.1), b.0.placed(b.1)) else {
            return;
        };
        let manifold = &mut self.memory[pair].parry;
        let relative: ParryPose = pose_a.inv_mul(&pose_b);
        // Parry clones the old points to carry its own data over; we have our own, and an empty clone is free.
        manifold.points.clear();
        let (shape_a, shape_b) = (&*shape_a.0, &*shape_b.0);
        let dispatcher = DefaultQueryDispatcher;
        if dispatcher.contact_manifold_convex_convex(&relative, shape_a, shape_b, None, None, margin, manifold).is_err()
        {
            return;
        }
        self.manifold.normal = pose_a.rotation * manifold.local_n1;
        for point in manifold.points.iter().filter(|p| p.dist < margin) {
            let on_a = pose_a * point.local_p1;
            let on_b = pose_b * point.local_p2;
            let feature = name(point.fid1, point.fid2);
            self.manifold.offer(ManifoldPoint { position: (on_a + on_b) / 2.0, gap: point.dist, feature });
        }
    }

    /// Makes contact points of the manifold's points, with the memory of those that were there last tick.
    fn update(&mut self, (a, b): Key, pair: usize, friction: f64) {
        let pair = &mut self.memory[pair];
        let mut old = std::mem::take(&mut pair.points);
        let single = self.manifold.reduced().len() == 1 && old.len() == 1;
        let normal = self.manifold.normal;
        for point in self.manifold.reduced() {
            let known = old.iter().position(|o| {
                let named = o.feature == point.feature && point.feature != NAMELESS;
                let near = (o.position - point.position).length() < SAME_POINT;
                single || named || (near && (o.feature == NAMELESS || point.feature == NAMELESS))
            });
            let (anchor, normal_force) = known.map_or((DVec3::ZERO, 0.0), |i| {
                let memory = old.swap_remove(i);
                (memory.anchor - normal * normal.dot(memory.anchor), memory.normal_force)
            });
            let ManifoldPoint { position, gap, feature } = *point;
            pair.points.push(ContactPoint { a, b, position, normal, gap, friction, anchor, normal_force, feature });
        }
    }
}

/// Widest gap that a tick may close, m, for bodies that close at `speed` and reach so much farther by turning.
fn margin(speed: f64, reach: f64, settings: &Settings) -> f64 {
    settings.contact.margin + settings.dt * (speed + settings.dt * settings.gravity.length()) + reach
}

/// How far a point of the body's surface may get in a tick by turning alone, m.
fn reach(body: &Moving, settings: &Settings) -> f64 {
    // A surface of revolution stays where it is however fast it spins about its axis.
    let spin = body.twist.angular;
    let across = match (body.collider.shape(), body.collider.shape().revolution_axis()) {
        (Shape::Ball { .. }, _) => DVec3::ZERO,
        (_, Some(axis)) => spin.reject_from_normalized(body.pose.rotation * axis),
        _ => spin,
    };
    (settings.dt * across.length()).min(2.0) * body.collider.bounding_radius()
}

fn friction(a: &Collider, b: &Collider) -> f64 {
    (a.friction() * b.friction()).sqrt()
}

fn name(a: PackedFeatureId, b: PackedFeatureId) -> u32 {
    if a == PackedFeatureId::UNKNOWN || b == PackedFeatureId::UNKNOWN {
        return NAMELESS;
    }
    // 28 bits of feature and two of kind each; folding keeps them apart well enough within one pair.
    a.0.rotate_left(16) ^ b.0
}
