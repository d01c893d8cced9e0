//! Fine detection: contact points of pairs that may touch, found again from tick to tick.
//!
//! Half-spaces are in closed form; everything else is GJK on cores with extrusion radius, EPA for cores that overlap, and
//! clipped faces (`convex`).

use std::collections::BTreeMap;

use arrayvec::ArrayVec;
use glam::DVec3;

use super::collision::{Closest, Meeting, Phase, Touch};
use super::convex::{Finder, NAMELESS};
use super::half_space;
use super::manifold::{Manifold, ManifoldPoint, POINTS_MAX};
use super::passing::{Beside, Flyby, passes, spin_across};
use super::patches::{PATCHES_MAX, Patches};
use super::proximity::Proximity;
use super::shape::{Collider, Shape};
use super::still::Still;
use super::triangle_mesh::TriangleMesh;
use super::{ContactPoint, Moving, Partner, Surface};
use crate::dof::Pose;
use crate::settings::Settings;

/// A point without a name of its own is found again where it lies within this of its place last tick, m.
const SAME_POINT: f64 = 0.02;

/// What is kept of a pair from tick to tick.
struct Pair {
    points: ArrayVec<ContactPoint, POINTS_MAX>,
    /// Last normal in the axes of the first shape's core.
    normal: Option<DVec3>,
    /// What was found of it when it was last looked at.
    still: Option<Still>,
    /// That it sees only: its points are no contacts.
    is_sensor: bool,
    /// Where it touches in this tick, and where it did in the last.
    touch: Option<Closest>,
    last_touch: Option<Closest>,
    /// Of the last tick, N s.
    impulse: f64,
}

impl Pair {
    /// Nothing is known of it.
    fn new() -> Self {
        let (touch, last_touch, normal, still) = Default::default();
        Self { points: ArrayVec::new(), normal, still, is_sensor: false, touch, last_touch, impulse: 0.0 }
    }

    /// Starts a tick.
    fn begin(&mut self, settings: &Settings) {
        self.last_touch = self.touch.take();
        self.impulse = settings.dt * self.points.iter().map(|point| point.normal_force).sum::<f64>();
    }

    /// What there is to tell of it, after [`Pair::begin`].
    fn tell(&self, key: Key) -> Option<Touch> {
        let (phase, closest) = match (self.last_touch, self.touch) {
            (None, None) => return None,
            (None, Some(now)) => (Phase::Begin, now),
            (Some(_), Some(now)) => (Phase::Stay, now),
            (Some(last), None) => (Phase::End, last),
        };
        Some(Touch { key, phase, closest, impulse: self.impulse, is_cancelled: false })
    }
}

/// Serial of the first body, and its partner.
pub(crate) type Key = (u32, Partner);

/// A pair of a tick and its place in memory, which the next tick takes over.
#[derive(Clone, Copy)]
struct Known {
    key: Key,
    /// Which of the pair's patches: a surface of triangles may have several, everything else has the first alone.
    patch: u8,
    place: Option<u32>,
}

impl Known {
    fn key(&self) -> (Key, u8) {
        (self.key, self.patch)
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
    /// Places of pairs that sleep.
    asleep: BTreeMap<(Key, u8), u32>,
    /// Places of pairs that ended, to be used again.
    spare: Vec<u32>,
    finder: Finder,
    manifold: Manifold,
    passing: Manifold,
    patches: Patches,
    /// Points of a pair that overlaps, with their normals.
    overlapping: Vec<(DVec3, ManifoldPoint)>,
    /// Points of a pair's last tick that this tick has not taken over.
    old: Vec<ContactPoint>,
}

impl NarrowPhase {
    /// Starts a tick.
    pub fn begin(&mut self) {
        std::mem::swap(&mut self.last, &mut self.pairs);
        // What woke since.
        self.last.append(&mut self.pairs);
        self.last.sort_unstable_by_key(Known::key);
    }

    /// Pairs of the tick.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Sets aside what is known of pairs between colliders of which `sleeps` says so, and between them and static
    /// geometry.
    pub fn sleep(&mut self, sleeps: impl Fn(u32) -> bool) {
        let Self { pairs, asleep, .. } = self;
        pairs.retain(|&Known { key: (a, b), patch, place }| {
            let partner_sleeps = match b {
                Partner::Body(b) => sleeps(b),
                Partner::Static(_) => true,
            };
            let both = partner_sleeps && sleeps(a);
            asleep.extend(place.filter(|_| both).map(|place| (((a, b), patch), place)));
            !both
        });
    }

    /// Colliders wake: the next pairs of theirs are found again.
    pub fn wake(&mut self, serials: impl Iterator<Item = u32>) {
        for serial in serials {
            let first = ((serial, Partner::Body(0)), 0);
            while let Some((&(key, patch), _)) = self.asleep.range(first..).next().filter(|(key, _)| key.0.0 == serial)
            {
                let place = self.asleep.remove(&(key, patch));
                self.last.push(Known { key, patch, place });
            }
        }
        self.last.sort_unstable_by_key(Known::key);
    }

    /// Contacts of two bodies. Answers whether there are any that push within this tick.
    pub fn bodies(&mut self, a: &Moving, b: &Moving, surface: Surface, settings: &Settings) -> bool {
        let margin =
            margin((a.twist.linear - b.twist.linear).length(), reach(a, settings) + reach(b, settings), settings);
        self.manifold.clear();
        let key = (a.serial, Partner::Body(b.serial));
        let pair = self.take(key, 0, a.collider.is_sensor() || b.collider.is_sensor(), settings);
        let deforms = a.spread > 0.0 || b.spread > 0.0;
        self.convex(pair, (a.collider, a.pose), (b.collider, b.pose), margin, deforms);
        self.let_pass(a, Beside::Moving(b), settings);
        let meeting = Meeting { a, b: Some(b), surface };
        self.update(key, pair, &meeting, settings);
        // What turns may be nearer at the end of the tick than its points say.
        let near = settings.contact.margin + reach(a, settings) + reach(b, settings);
        let closes = |point: &ContactPoint| meeting.closes(point.position, point.normal, settings);
        let pair = &self.memory[pair];
        !pair.is_sensor && pair.points.iter().any(|point| point.gap - closes(point) < near)
    }

    /// Contacts of a body with a piece of static geometry.
    pub fn with_static(
        &mut self,
        a: &Moving,
        (serial, piece, pose): (u32, &Collider, Pose),
        surface: Surface,
        settings: &Settings,
    ) {
        let is_sensor = a.collider.is_sensor() || piece.is_sensor();
        let meeting = Meeting { a, b: None, surface };
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
            let pair = self.take(key, 0, is_sensor, settings);
            self.update(key, pair, &meeting, settings);
            return;
        }
        if let Shape::Mesh(mesh) = piece.shape() {
            return self.surface(key, is_sensor, (mesh, pose), margin, &meeting, settings);
        }
        let pair = self.take(key, 0, is_sensor, settings);
        self.convex(pair, (a.collider, a.pose), (piece, pose), margin, a.spread > 0.0);
        if let Some(piece) = piece.convex(pose) {
            self.let_pass(a, Beside::Still(piece), settings);
        }
        self.update(key, pair, &meeting, settings);
    }

    /// Ends a tick: writes the points of all pairs that push, and what there is to tell of pairs, sorted by pair.
    pub fn finish(&mut self, contacts: &mut Vec<ContactPoint>, touches: &mut Vec<Touch>, settings: &Settings) {
        let Self { memory, last, pairs, spare, .. } = self;
        for Known { key, place, .. } in last.drain(..) {
            let Some(place) = place else { continue };
            let pair = &mut memory[place as usize];
            pair.begin(settings);
            touches.extend(pair.tell(key));
            spare.push(place);
        }
        pairs.sort_unstable_by_key(Known::key);
        for &Known { key, place, .. } in pairs.iter() {
            let Some(pair) = place.map(|place| &memory[place as usize]) else { continue };
            touches.extend(pair.tell(key));
            if !pair.is_sensor {
                contacts.extend_from_slice(&pair.points);
            }
        }
        touches.sort_unstable_by_key(|touch| touch.key);
    }

    /// Takes over what the solver did to the points that [`NarrowPhase::finish`] wrote, in the same order.
    pub fn remember(&mut self, contacts: &[ContactPoint]) {
        let mut contacts = contacts.iter();
        for place in self.pairs.iter().filter_map(|known| known.place) {
            let Pair { points, is_sensor, .. } = &mut self.memory[place as usize];
            if *is_sensor {
                continue;
            }
            points.iter_mut().zip(&mut contacts).for_each(|(mine, theirs)| *mine = *theirs);
        }
    }

    /// Drops every pair of which `is_gone` says so.
    pub fn forget(&mut self, is_gone: impl Fn(Key) -> bool) {
        let Self { pairs, last, spare, .. } = self;
        for list in [pairs, last] {
            list.retain(|&Known { key, place, .. }| {
                let gone = is_gone(key);
                spare.extend(place.filter(|_| gone));
                !gone
            });
        }
    }

    /// Place in memory of a pair, with what the last tick left there where it has been one.
    fn take(&mut self, key: Key, patch: u8, is_sensor: bool, settings: &Settings) -> usize {
        let known = self.last.binary_search_by_key(&(key, patch), Known::key).ok();
        let place = known.and_then(|i| self.last[i].place.take()).unwrap_or_else(|| self.blank());
        self.pairs.push(Known { key, patch, place: Some(place) });
        let pair = &mut self.memory[place as usize];
        pair.begin(settings);
        pair.is_sensor = is_sensor;
        place as usize
    }

    /// Place in memory of a pair of which nothing is known.
    fn blank(&mut self) -> u32 {
        if let Some(place) = self.spare.pop() {
            self.memory[place as usize] = Pair::new();
            return place;
        }
        self.memory.push(Pair::new());
        self.memory.len() as u32 - 1
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
    fn convex(&mut self, pair: usize, a: (&Collider, Pose), b: (&Collider, Pose), margin: f64, deforms: bool) {
        let Self { memory, finder, manifold, .. } = self;
        let (Pair { normal, still, .. }, poses) = (&mut memory[pair], [a.1, b.1]);
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

    /// Contacts with a surface of triangles: a place in memory for every patch, and what is told of the pair at the first.
    fn surface(
        &mut self,
        key: Key,
        is_sensor: bool,
        (mesh, pose): (&TriangleMesh, Pose),
        margin: f64,
        meeting: &Meeting,
        settings: &Settings,
    ) {
        let first = self.take(key, 0, is_sensor, settings);
        let mut places = ArrayVec::<usize, PATCHES_MAX>::from_iter([first]);
        // A patch need not be in the place that it had: all of them remember together.
        for patch in 1..PATCHES_MAX as u8 {
            if self.last.binary_search_by_key(&(key, patch), Known::key).is_err() {
                break;
            }
            places.push(self.take(key, patch, is_sensor, settings));
        }
        self.old.clear();
        places.iter().for_each(|&place| self.old.extend(self.memory[place].points.drain(..)));
        let body = meeting.a;
        let Some(convex) = body.collider.convex(body.pose) else { return };
        let shape = (body.collider.shape(), convex, body.pose);
        let flyby = Flyby { body, settings, scratch: &mut self.passing };
        let count = self.patches.find(shape, (mesh, pose), margin, &mut self.finder, Some(flyby)).len();
        for patch in places.len()..count {
            places.push(self.take(key, patch as u8, is_sensor, settings));
        }
        let Self { memory, patches, old, .. } = self;
        let touched = memory[first].last_touch.is_some();
        let mut closest = None::<Closest>;
        for (patch, &place) in patches.found().iter_mut().zip(&places) {
            let points = &mut memory[place].points;
            remember_points(key, patch, old, points, meeting.surface);
            let here = meeting.closest(points, touched, settings);
            let gap = |closest: &Option<Closest>| closest.map_or(f64::INFINITY, |closest| closest.gap);
            if gap(&here) < gap(&closest) {
                closest = here;
            }
        }
        memory[first].touch = closest;
    }

    /// Makes contact points of the manifold's points.
    fn update(&mut self, key: Key, pair: usize, meeting: &Meeting, settings: &Settings) {
        let Self { memory, manifold, old, .. } = self;
        let pair = &mut memory[pair];
        old.clear();
        old.extend(pair.points.drain(..));
        remember_points(key, manifold, old, &mut pair.points, meeting.surface);
        pair.touch = meeting.closest(&pair.points, pair.last_touch.is_some(), settings);
    }
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
    points: &mut ArrayVec<ContactPoint, POINTS_MAX>,
    surface: Surface,
) {
    let single = manifold.reduced().len() == 1 && old.len() == 1;
    let normal = manifold.normal;
    // Points of a pair share it: each by itself would stiffen for the load that its stiffness draws to it.
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
