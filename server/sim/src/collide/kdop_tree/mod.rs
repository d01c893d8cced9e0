//! Binary trees of k-DOPs: which of many bounds overlap.
//!
//! Owns nodes in one arena, their bounds and links; knows items by number alone. Leaves come, go and move;
//! [`KdopTree::refit`] brings the bounds above what changed up to date and builds anew what has gone bad; then the tree
//! may be asked, with itself, with another tree (`pairs`), by bounds, rays and points (`query`). What a search finds
//! depends on the bounds of the leaves alone, never on the shape of the tree. Once warm nothing allocates.

mod build;
mod pairs;
mod query;
#[cfg(test)]
mod tests;

pub use pairs::PairSearch;

use super::kdop::Kdop;

/// No node.
const NONE: u32 = u32::MAX;

/// How much wider than asked for a moving leaf's bounds are kept, m: for so long what rests or creeps changes nothing. Wider
/// ones let searches find more that is not there.
const FAT: f64 = 0.05;

/// A leaf whose bounds are so many times [`FAT`] too wide is taken in: it was fast and has stopped.
const LOOSE: f64 = 4.0;

/// A subtree is built anew when its cost has risen by this factor since it was built. 1.2 to 2 make no difference to piles;
/// 4 lets what drives through a crowd drag long bounds behind it.
const DEGRADED: f64 = 1.5;

/// Leaves are put into the tree one by one unless they are more than this plus a quarter of those that are there: then
/// everything is built anew.
const FEW: usize = 8;

/// A leaf of a tree; valid until it is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf(u32);

#[derive(Clone, Copy, Debug)]
struct Node {
    parent: u32,
    /// [`NONE`] for a leaf.
    children: [u32; 2],
    /// Of a leaf: what it stands for.
    item: u32,
    /// Of a leaf: whether it left its bounds when it was updated last.
    is_restless: bool,
    /// Whether a leaf below has changed since [`KdopTree::settle`]; then it is so all the way to the root.
    changed: bool,
    /// [`Kdop::cost`] of its bounds, m².
    surface: f64,
    /// `surface` summed over the subtree, m².
    cost: f64,
    /// `cost` over `surface` when the subtree was built.
    built: f64,
}

impl Node {
    const fn leaf(item: u32) -> Self {
        Self {
            parent: NONE,
            children: [NONE; 2],
            item,
            is_restless: false,
            changed: false,
            surface: 0.0,
            cost: 0.0,
            built: 1.0,
        }
    }

    fn is_leaf(&self) -> bool {
        self.children[0] == NONE
    }

    fn ratio(&self) -> f64 {
        if self.surface > 0.0 { self.cost / self.surface } else { 1.0 }
    }
}

/// A binary tree of k-DOPs with `H` = k/2 slabs.
#[derive(Clone, Debug)]
pub struct KdopTree<const H: usize> {
    bounds: Vec<Kdop<H>>,
    nodes: Vec<Node>,
    root: u32,
    /// Leaves that are linked in.
    leaves: usize,
    /// Leaves that the next refit links in.
    pending: Vec<u32>,
    /// Nodes to be used again.
    free: Vec<u32>,
    /// Every node that has changed, and some that have not.
    changed: Vec<u32>,
    scratch: build::Scratch,
}

impl<const H: usize> Default for KdopTree<H> {
    fn default() -> Self {
        Self {
            bounds: Vec::new(),
            nodes: Vec::new(),
            root: NONE,
            leaves: 0,
            pending: Vec::new(),
            free: Vec::new(),
            changed: Vec::new(),
            scratch: build::Scratch::default(),
        }
    }
}

impl<const H: usize> KdopTree<H> {
    /// Adds a leaf for `item`; it is found from the next [`KdopTree::refit`] on.
    pub fn insert(&mut self, item: u32, bounds: Kdop<H>) -> Leaf {
        let leaf = self.allocate(Node::leaf(item), bounds);
        self.pending.push(leaf);
        Leaf(leaf)
    }

    /// Removes a leaf.
    pub fn remove(&mut self, Leaf(leaf): Leaf) {
        if let Some(place) = self.pending.iter().position(|&other| other == leaf) {
            self.pending.swap_remove(place);
        } else {
            self.unlink(leaf);
            self.leaves -= 1;
        }
        self.free.push(leaf);
    }

    /// A leaf's bounds are now within `bounds`. Answers whether that changed the tree: the bounds that it keeps are a
    /// little wider, and as long as the leaf stays within nothing happens. Those of a leaf that leaves them each time would
    /// be wider for nothing.
    pub fn update(&mut self, Leaf(leaf): Leaf, bounds: &Kdop<H>) -> bool {
        let (node, kept) = (&mut self.nodes[leaf as usize], &mut self.bounds[leaf as usize]);
        let leaves = !(kept.contains(bounds) && bounds.grown(LOOSE * FAT).contains(kept));
        let was_restless = std::mem::replace(&mut node.is_restless, leaves);
        if leaves {
            *kept = if was_restless { *bounds } else { bounds.grown(FAT) };
            self.mark(leaf);
        }
        leaves
    }

    /// Brings everything above leaves that changed up to date: O(log n) for each.
    pub fn refit(&mut self) {
        self.link_pending();
        self.refit_changed();
    }

    /// Whether there is anything to search for: a leaf has come or changed since [`KdopTree::settle`].
    pub fn has_changed(&self) -> bool {
        !self.changed.is_empty()
    }

    /// From now on nothing counts as changed.
    pub fn settle(&mut self) {
        for node in self.changed.drain(..) {
            self.nodes[node as usize].changed = false;
        }
    }

    /// Number of leaves.
    pub fn len(&self) -> usize {
        self.leaves + self.pending.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn allocate(&mut self, node: Node, bounds: Kdop<H>) -> u32 {
        if let Some(place) = self.free.pop() {
            self.nodes[place as usize] = node;
            self.bounds[place as usize] = bounds;
            return place;
        }
        self.nodes.push(node);
        self.bounds.push(bounds);
        self.nodes.len() as u32 - 1
    }

    /// A node and all above it have changed.
    fn mark(&mut self, mut node: u32) {
        while node != NONE && !self.nodes[node as usize].changed {
            self.nodes[node as usize].changed = true;
            self.changed.push(node);
            node = self.nodes[node as usize].parent;
        }
    }

    /// Puts `new` in the place of `old` under `parent`.
    fn replace_child(&mut self, parent: u32, old: u32, new: u32) {
        self.nodes[new as usize].parent = parent;
        match self.nodes.get_mut(parent as usize) {
            Some(parent) => parent.children[usize::from(parent.children[1] == old)] = new,
            None => self.root = new,
        }
    }

    /// Takes a leaf out; its sibling takes their parent's place.
    fn unlink(&mut self, leaf: u32) {
        let parent = self.nodes[leaf as usize].parent;
        let Some(&Node { parent: grandparent, children: [a, b], .. }) = self.nodes.get(parent as usize) else {
            self.root = NONE;
            return;
        };
        self.replace_child(grandparent, parent, if a == leaf { b } else { a });
        self.free.push(parent);
        self.mark(grandparent);
    }
}
