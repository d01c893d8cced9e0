//! The three trees of the talk: dynamic, static and sleeping hulls, and the pairs that they find.
//!
//! Owns the bounds of all hulls and pieces of static geometry. A pair is known for as long as neither side leaves the
//! somewhat wider bounds that its tree keeps, so that what rests is not searched for again. Which pairs come out, and in
//! which order, depends on bounds and serials alone.

use slab::Slab;

use super::hull::{Bodies, Hull};
use super::kdop_tree::{KdopTree, Leaf, PairSearch};
use super::{Bound, SLABS, StaticId};
use crate::dof::Placed;
use crate::settings::Settings;

type Tree = KdopTree<SLABS>;

/// Two hulls, or a hull and a piece of static geometry, by their keys.
pub(super) type Pair = [u32; 2];

/// A hull and its place.
struct Entry {
    hull: Hull,
    /// In the dynamic tree; none before its first tick.
    leaf: Option<Leaf>,
    /// Its tree has other bounds of it than when pairs were searched last.
    has_changed: bool,
}

/// A piece of static geometry and its place.
struct Piece {
    id: StaticId,
    serial: u32,
    bounds: Bound,
    leaf: Leaf,
}

/// The trees.
#[derive(Default)]
pub(super) struct Trees {
    entries: Slab<Entry>,
    pieces: Slab<Piece>,
    /// Hulls that move, in order of serial.
    awake: Vec<u32>,
    dynamic: Tree,
    fixed: Tree,
    /// Pairs of hulls that may touch, the smaller serial first.
    near: Vec<Pair>,
    /// Hulls and pieces that may touch.
    near_fixed: Vec<Pair>,
    search: PairSearch,
}

impl Trees {
    /// Takes a hull in. Answers its key. The serials of hulls rise from call to call.
    pub fn add(&mut self, placed: Placed, owner: u32) -> u32 {
        let hull = Hull::new(placed, owner);
        let key = self.entries.insert(Entry { hull, leaf: None, has_changed: false }) as u32;
        self.awake.push(key);
        key
    }

    /// Forgets a hull.
    pub fn remove(&mut self, key: u32) {
        let entry = self.entries.remove(key as usize);
        if let Some(leaf) = entry.leaf {
            self.dynamic.remove(leaf);
        }
        self.awake.retain(|&other| other != key);
        self.near.retain(|pair| !pair.contains(&key));
        self.near_fixed.retain(|pair| pair[0] != key);
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
        self.near_fixed.retain(|pair| pair[1] != key);
    }

    /// Brings all bounds up to date and finds the pairs of the tick.
    pub fn update(&mut self, bodies: Bodies, settings: &Settings) {
        for &key in &self.awake {
            let Entry { hull, leaf, has_changed } = &mut self.entries[key as usize];
            hull.follow(bodies, settings);
            *has_changed = match *leaf {
                // What takes no part keeps its place and touches nothing.
                Some(leaf) => hull.bounds != Bound::EMPTY && self.dynamic.update(leaf, &hull.bounds),
                None => {
                    *leaf = Some(self.dynamic.insert(key, hull.bounds));
                    true
                }
            };
        }
        self.dynamic.refit();
        self.fixed.refit();
        if self.dynamic.has_changed() || self.fixed.has_changed() {
            self.search();
        }
    }

    /// Finds the pairs anew of what has changed.
    fn search(&mut self) {
        let Self { entries, pieces, dynamic, fixed, near, near_fixed, search, .. } = self;
        let entry = |key: u32| &entries[key as usize];
        let serial = |key: u32| entry(key).hull.placed.serial;
        near.retain(|pair| !pair.iter().any(|&key| entry(key).has_changed));
        search.within(dynamic, |a, b| {
            if entry(a).hull.owner != entry(b).hull.owner {
                near.push(if serial(a) < serial(b) { [a, b] } else { [b, a] });
            }
        });
        near.sort_unstable_by_key(|pair| pair.map(serial));
        near_fixed.retain(|&[hull, _]| !entry(hull).has_changed);
        search.between(dynamic, fixed, |hull, piece| near_fixed.push([hull, piece]));
        near_fixed.sort_unstable_by_key(|&[hull, piece]| (serial(hull), pieces[piece as usize].serial));
        dynamic.settle();
        fixed.settle();
    }

    /// A hull.
    pub fn hull(&self, key: u32) -> &Hull {
        &self.entries[key as usize].hull
    }

    /// All hulls that move, in order of serial.
    pub fn awake(&self) -> impl Iterator<Item = &Hull> {
        self.awake.iter().map(|&key| self.hull(key))
    }

    /// Pairs of hulls whose bounds overlap, in order of serials.
    pub fn pairs(&self) -> impl Iterator<Item = [&Hull; 2]> {
        self.near.iter().map(|pair| pair.map(|key| self.hull(key))).filter(|[a, b]| a.bounds.overlaps(&b.bounds))
    }

    /// Hulls and pieces of static geometry whose bounds overlap, in order of serials.
    pub fn pairs_with_fixed(&self) -> impl Iterator<Item = (&Hull, StaticId)> {
        let pairs = self.near_fixed.iter().map(|&[hull, piece]| (self.hull(hull), &self.pieces[piece as usize]));
        pairs.filter(|(hull, piece)| hull.bounds.overlaps(&piece.bounds)).map(|(hull, piece)| (hull, piece.id))
    }
}
