//! The three trees of the talk: dynamic, static and sleeping hulls, and the pairs that they find.
//!
//! Owns the bounds of all hulls and pieces of static geometry. A pair is known for as long as neither side leaves the
//! somewhat wider bounds that its tree keeps, so that what rests is not searched for again. Which pairs come out, and in
//! which order, depends on bounds and serials alone.
//!
//! What wakes during a detection comes in rounds: each finds the pairs of those that have arrived with it.

use glam::DVec3;
use slab::Slab;

use super::hull::{Bodies, Hull, Stride};
use super::kdop_tree::{KdopTree, Leaf, PairSearch};
use super::{Bound, SLABS, StaticId};
use crate::dof::{BodyId, Placed};
use crate::settings::Settings;

type Tree = KdopTree<SLABS>;

/// Two hulls, or a hull and a piece of static geometry, by their keys.
pub(super) type Pair = [u32; 2];

/// Two that may touch.
#[derive(Clone, Copy)]
struct Near {
    /// The serials of both, the first one's above: what comes out is in this order.
    order: u64,
    pair: Pair,
}

impl Near {
    fn new(pair: Pair, serials: [u32; 2]) -> Self {
        Self { order: u64::from(serials[0]) << 32 | u64::from(serials[1]), pair }
    }
}

/// Where a hull is kept.
#[derive(Clone, Copy)]
enum Place {
    /// Nowhere yet: in the dynamic tree from its next detection on.
    New,
    Dynamic(Leaf),
    Sleeping(Leaf),
}

/// A hull and its place.
struct Entry {
    hull: Hull,
    place: Place,
    /// In which round of this detection it arrived.
    round: u32,
    /// Its tree has other bounds of it than when pairs were searched last.
    has_changed: bool,
}

impl Entry {
    fn sleeps(&self) -> bool {
        matches!(self.place, Place::Sleeping(_))
    }
}

/// A piece of static geometry and its place.
struct Piece {
    id: StaticId,
    serial: u32,
    bounds: Bound,
    leaf: Leaf,
}

/// What a question finds.
#[derive(Clone, Copy)]
pub(super) enum Found<'a> {
    Hull(&'a Hull),
    Piece(StaticId),
}

/// The trees.
#[derive(Default)]
pub(super) struct Trees {
    entries: Slab<Entry>,
    pieces: Slab<Piece>,
    /// Hulls that do not sleep, in order of serial.
    awake: Vec<u32>,
    /// Those of them that arrived in this round.
    arrivals: Vec<u32>,
    /// Those of them that will in the next: they woke.
    woken: Vec<u32>,
    /// Those, asleep or not, that have changed.
    changed: Vec<u32>,
    round: u32,
    dynamic: Tree,
    fixed: Tree,
    sleeping: Tree,
    /// Pairs of hulls that may touch, the smaller serial first.
    near: Vec<Near>,
    /// Hulls and pieces that may touch.
    near_fixed: Vec<Near>,
    /// Hulls and sleepers that may touch.
    near_sleeping: Vec<Near>,
    search: PairSearch,
}

impl Trees {
    /// Takes a hull in. Answers its key. The serials of hulls rise from call to call.
    pub fn add(&mut self, placed: Placed, owner: u32) -> u32 {
        let hull = Hull::new(placed, owner);
        let key = self.entries.insert(Entry { hull, place: Place::New, round: 0, has_changed: false }) as u32;
        self.awake.push(key);
        key
    }

    /// Forgets a hull.
    pub fn remove(&mut self, key: u32) {
        self.take_out(key);
        self.entries.remove(key as usize);
        self.awake.retain(|&other| other != key);
        for pairs in [&mut self.near, &mut self.near_sleeping] {
            pairs.retain(|near| !near.pair.contains(&key));
        }
        self.near_fixed.retain(|near| near.pair[0] != key);
    }

    /// Takes a hull out of its tree.
    fn take_out(&mut self, key: u32) {
        match self.entries[key as usize].place {
            Place::New => {}
            Place::Dynamic(leaf) => self.dynamic.remove(leaf),
            Place::Sleeping(leaf) => self.sleeping.remove(leaf),
        }
    }

    /// Puts a hull, at rest from now on, into the sleeping tree. [`Trees::sort_awake`] follows.
    pub fn sleep(&mut self, key: u32, bodies: Bodies, settings: &Settings) {
        self.take_out(key);
        let entry = &mut self.entries[key as usize];
        entry.hull.follow(bodies, settings);
        // What it did in the tick in which it fell asleep no detection saw.
        entry.hull.was_at_rest = false;
        entry.place = Place::Sleeping(self.sleeping.insert(key, entry.hull.bounds));
        entry.has_changed = true;
        self.changed.push(key);
    }

    /// Takes a hull out of the sleeping tree. [`Trees::sort_awake`] follows.
    pub fn wake(&mut self, key: u32) {
        self.take_out(key);
        let entry = &mut self.entries[key as usize];
        entry.place = Place::Dynamic(self.dynamic.insert(key, entry.hull.bounds));
        entry.has_changed = true;
        self.changed.push(key);
        self.awake.push(key);
        self.woken.push(key);
    }

    /// Brings the list of those that are awake, and the trees, up to date.
    pub fn sort_awake(&mut self) {
        let Self { entries, awake, .. } = self;
        awake.retain(|&key| !entries[key as usize].sleeps());
        awake.sort_by_key(|&key| entries[key as usize].hull.placed.serial);
        self.dynamic.refit();
        self.sleeping.refit();
    }

    /// Takes a piece of static geometry in. Answers its key.
    pub fn add_fixed(&mut self, id: StaticId, serial: u32, bounds: Bound) -> u32 {
        let place = self.pieces.vacant_entry();
        let key = place.key() as u32;
        place.insert(Piece { id, serial, bounds, leaf: self.fixed.insert(key, bounds) });
        key
    }

    /// Forgets a piece of static geometry.
    pub fn remove_fixed(&mut self, key: u32) {
        let piece = self.pieces.remove(key as usize);
        self.fixed.remove(piece.leaf);
        self.near_fixed.retain(|near| near.pair[1] != key);
    }

    /// Bodies that sleep within the bounds of a piece of static geometry.
    pub fn sleepers_around(&self, key: u32) -> Vec<BodyId> {
        let mut bodies = Vec::new();
        let bounds = &self.pieces[key as usize].bounds;
        self.sleeping.overlapping(bounds, |key| bodies.push(self.hull(key).placed.body));
        bodies
    }

    /// Starts a detection: everything that is awake arrives.
    pub fn begin(&mut self) {
        self.round = 0;
        self.woken.clone_from(&self.awake);
    }

    /// Brings the bounds of what arrived up to date and finds the pairs of this round.
    pub fn update(&mut self, bodies: Bodies, settings: &Settings) {
        self.round += 1;
        std::mem::swap(&mut self.arrivals, &mut self.woken);
        self.woken.clear();
        for &key in &self.arrivals {
            let Entry { hull, place, round, has_changed } = &mut self.entries[key as usize];
            hull.follow(bodies, settings);
            *round = self.round;
            let changes = match *place {
                Place::New => {
                    *place = Place::Dynamic(self.dynamic.insert(key, hull.bounds));
                    true
                }
                // What takes no part keeps its place and touches nothing.
                Place::Dynamic(leaf) => hull.bounds != Bound::EMPTY && self.dynamic.update(leaf, &hull.bounds),
                Place::Sleeping(_) => false,
            };
            if changes {
                *has_changed = true;
                self.changed.push(key);
            }
        }
        let trees = [&mut self.dynamic, &mut self.fixed, &mut self.sleeping];
        if trees.into_iter().fold(false, |any, tree| {
            tree.refit();
            any | tree.has_changed()
        }) {
            self.search();
        }
    }

    /// Finds the pairs anew of what has changed.
    fn search(&mut self) {
        let Self { entries, pieces, dynamic, fixed, sleeping, near, near_fixed, near_sleeping, search, .. } = self;
        let entry = |key: u32| &entries[key as usize];
        let serial = |key: u32| entry(key).hull.placed.serial;
        let strangers = |a: u32, b: u32| entry(a).hull.owner != entry(b).hull.owner;
        near.retain(|near| !near.pair.iter().any(|&key| entry(key).has_changed));
        search.within(dynamic, |a, b| {
            if strangers(a, b) {
                let pair = if serial(a) < serial(b) { [a, b] } else { [b, a] };
                near.push(Near::new(pair, pair.map(serial)));
            }
        });
        near_fixed.retain(|near| !entry(near.pair[0]).has_changed);
        search.between(dynamic, fixed, |hull, piece| {
            near_fixed.push(Near::new([hull, piece], [serial(hull), pieces[piece as usize].serial]));
        });
        near_sleeping.retain(|near| !near.pair.iter().any(|&key| entry(key).has_changed));
        search.between(dynamic, sleeping, |hull, sleeper| {
            if strangers(hull, sleeper) {
                near_sleeping.push(Near::new([hull, sleeper], [hull, sleeper].map(serial)));
            }
        });
        for pairs in [near, near_fixed, near_sleeping] {
            pairs.sort_unstable_by_key(|near| near.order);
        }
        for tree in [dynamic, fixed, sleeping] {
            tree.settle();
        }
        for key in self.changed.drain(..) {
            // What is gone has taken its pairs with it.
            if let Some(entry) = self.entries.get_mut(key as usize) {
                entry.has_changed = false;
            }
        }
    }

    /// A hull.
    pub fn hull(&self, key: u32) -> &Hull {
        &self.entries[key as usize].hull
    }

    /// Hulls that arrived in this round.
    pub fn arrivals(&self) -> impl Iterator<Item = u32> {
        self.arrivals.iter().copied()
    }

    /// All hulls that are awake.
    pub fn awake(&self) -> impl Iterator<Item = u32> {
        self.awake.iter().copied()
    }

    /// Tells every hull that is awake how the tick moves it. Answers whether one moves far.
    pub fn set_strides(&mut self, stride: impl Fn(&mut Hull) -> Stride) -> bool {
        let mut any = false;
        for &key in &self.awake {
            let hull = &mut self.entries[key as usize].hull;
            hull.stride = stride(hull);
            any |= hull.stride.is_far;
        }
        any
    }

    /// All pairs of hulls that are awake and whose bounds overlap, whatever the round.
    pub fn pairs_awake(&self) -> impl Iterator<Item = Pair> {
        self.near.iter().map(|near| near.pair).filter(|&pair| self.overlap(pair))
    }

    /// All hulls that are awake and pieces of static geometry whose bounds overlap, whatever the round.
    pub fn pairs_awake_with_fixed(&self) -> impl Iterator<Item = (u32, StaticId)> {
        self.near_fixed.iter().filter_map(|near| self.overlap_with_fixed(near.pair))
    }

    /// Pairs of hulls of this round whose bounds overlap, the smaller serial first; and of such hulls with sleepers, whose
    /// body is told.
    pub fn pairs(&self) -> impl Iterator<Item = (Pair, Option<BodyId>)> {
        let near = self.near.iter().map(|near| near.pair);
        let near = near.filter(|pair| pair.iter().all(|&key| self.arrives(key))).map(|pair| (pair, None));
        let sleeping = self.near_sleeping.iter().map(|near| near.pair);
        let sleeping =
            sleeping.filter(|&[hull, sleeper]| self.arrives(hull) && self.entries[sleeper as usize].sleeps());
        let sleeping = sleeping.map(|[a, b]| {
            let [of_a, of_b] = [a, b].map(|key| self.hull(key).placed);
            (if of_a.serial < of_b.serial { [a, b] } else { [b, a] }, Some(of_b.body))
        });
        near.chain(sleeping).filter(|&(pair, _)| self.overlap(pair))
    }

    /// Hulls of this round and pieces of static geometry whose bounds overlap, in order of serials.
    pub fn pairs_with_fixed(&self) -> impl Iterator<Item = (u32, StaticId)> {
        let pairs = self.near_fixed.iter().map(|near| near.pair).filter(|pair| self.arrives(pair[0]));
        pairs.filter_map(|pair| self.overlap_with_fixed(pair))
    }

    fn arrives(&self, key: u32) -> bool {
        self.entries[key as usize].round == self.round
    }

    fn overlap(&self, pair: Pair) -> bool {
        let [a, b] = pair.map(|key| self.hull(key));
        a.bounds.overlaps(&b.bounds)
    }

    fn overlap_with_fixed(&self, [hull, piece]: Pair) -> Option<(u32, StaticId)> {
        let piece = &self.pieces[piece as usize];
        self.hull(hull).bounds.overlaps(&piece.bounds).then_some((hull, piece.id))
    }

    /// Hands `found` all whose bounds overlap `bounds`, in no order.
    pub fn overlapping<'a>(&'a self, bounds: &Bound, mut found: impl FnMut(Found<'a>)) {
        for tree in [&self.dynamic, &self.sleeping] {
            tree.overlapping(bounds, |key| found(Found::Hull(self.hull(key))));
        }
        self.overlapping_fixed(bounds, found);
    }

    /// Hands `found` all static geometry whose bounds overlap `bounds`, in no order.
    pub fn overlapping_fixed<'a>(&'a self, bounds: &Bound, mut found: impl FnMut(Found<'a>)) {
        self.fixed.overlapping(bounds, |key| found(self.piece(key)));
    }

    /// Hands `hit` all whose bounds a ray meets, as [`KdopTree::cast`].
    pub fn cast<'a>(&'a self, origin: DVec3, direction: DVec3, mut length: f64, mut hit: impl FnMut(Found<'a>) -> f64) {
        let mut meet = |length: &mut f64, found: Found<'a>| {
            *length = hit(found);
            *length
        };
        for tree in [&self.dynamic, &self.sleeping] {
            tree.cast(origin, direction, length, |key| meet(&mut length, Found::Hull(self.hull(key))));
        }
        self.fixed.cast(origin, direction, length, |key| meet(&mut length, self.piece(key)));
    }

    /// Hands `near` all that may be nearer to a point than `distance`, as [`KdopTree::nearest`].
    pub fn nearest<'a>(&'a self, point: DVec3, mut distance: f64, mut near: impl FnMut(Found<'a>) -> f64) {
        let mut meet = |distance: &mut f64, found: Found<'a>| {
            *distance = near(found);
            *distance
        };
        for tree in [&self.dynamic, &self.sleeping] {
            tree.nearest(point, distance, |key| meet(&mut distance, Found::Hull(self.hull(key))));
        }
        self.fixed.nearest(point, distance, |key| meet(&mut distance, self.piece(key)));
    }

    fn piece(&self, key: u32) -> Found<'_> {
        Found::Piece(self.pieces[key as usize].id)
    }
}
