//! The shape of a tree: leaves linked in where that costs least, bounds refitted, subtrees built anew where their cost
//! has risen.

use super::{DEGRADED, FEW, Kdop, KdopTree, NONE, Node};

/// Bins along the split direction.
const BINS: usize = 8;

/// Memory that is kept from tick to tick.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// Nodes from the root down.
    order: Vec<u32>,
    leaves: Vec<u32>,
    tasks: Vec<Task>,
    stack: Vec<u32>,
    spare: Vec<u32>,
}

/// A range of leaves that is to become a child.
#[derive(Clone, Copy, Debug)]
struct Task {
    from: usize,
    to: usize,
    parent: u32,
    side: usize,
}

impl<const H: usize> KdopTree<H> {
    pub(super) fn link_pending(&mut self) {
        if self.pending.len() > FEW + self.leaves / 4 {
            self.build_all();
            return;
        }
        for i in 0..self.pending.len() {
            self.link(self.pending[i]);
        }
        self.leaves += self.pending.len();
        self.pending.clear();
    }

    /// Links a leaf in where the surfaces of all nodes together grow least.
    fn link(&mut self, leaf: u32) {
        if self.root == NONE {
            self.root = leaf;
            self.nodes[leaf as usize].parent = NONE;
            return self.mark(leaf);
        }
        let sibling = self.cheapest_sibling(leaf);
        let above = self.nodes[sibling as usize].parent;
        let parent = self.allocate(Node::leaf(NONE), Kdop::EMPTY);
        self.replace_child(above, sibling, parent);
        self.nodes[parent as usize].children = [sibling, leaf];
        // Not known before the refit: no reason to build it anew.
        self.nodes[parent as usize].built = f64::INFINITY;
        self.nodes[sibling as usize].parent = parent;
        self.nodes[leaf as usize].parent = parent;
        self.measure(leaf);
        self.fit(parent);
        // The leaf may have been marked while nothing was above it.
        self.mark(leaf);
        self.mark(parent);
    }

    /// The node beside which `leaf` costs least; bounds on the way down are widened to hold it.
    fn cheapest_sibling(&mut self, leaf: u32) -> u32 {
        let bounds = self.bounds[leaf as usize];
        let mut node = self.root;
        while !self.nodes[node as usize].is_leaf() {
            let children = self.nodes[node as usize].children;
            let union = self.bounds[node as usize].union(&bounds);
            let beside = union.cost();
            // What every node below inherits.
            let growth = beside - self.bounds[node as usize].cost();
            let below = children.map(|child| {
                let kept = &self.bounds[child as usize];
                let grown = kept.union(&bounds).cost();
                growth + if self.nodes[child as usize].is_leaf() { grown } else { grown - kept.cost() }
            });
            if beside <= below[0].min(below[1]) {
                break;
            }
            self.bounds[node as usize] = union;
            node = children[usize::from(below[1] < below[0])];
        }
        node
    }

    /// Bounds and cost of what has changed, from the leaves up; what has gone bad is built anew.
    pub(super) fn refit_changed(&mut self) {
        let mut order = std::mem::take(&mut self.scratch.order);
        let mut stack = std::mem::take(&mut self.scratch.stack);
        order.clear();
        stack.extend(Some(self.root).filter(|&root| root != NONE));
        while let Some(node) = stack.pop() {
            let Node { changed, children, .. } = self.nodes[node as usize];
            if changed {
                order.push(node);
                stack.extend(children.into_iter().filter(|&child| child != NONE));
            }
        }
        self.scratch.stack = stack;
        for &node in order.iter().rev() {
            if self.nodes[node as usize].is_leaf() {
                self.measure(node);
                continue;
            }
            self.fit(node);
            let Node { built, children, .. } = self.nodes[node as usize];
            let ratio = self.nodes[node as usize].ratio();
            let is_pair = children.iter().all(|&child| self.nodes[child as usize].is_leaf());
            if built == f64::INFINITY || is_pair {
                self.nodes[node as usize].built = ratio;
            } else if ratio > DEGRADED * built {
                self.rebuild(node);
            }
        }
        self.scratch.order = order;
    }

    /// Cost of a leaf.
    fn measure(&mut self, leaf: u32) {
        let surface = self.bounds[leaf as usize].cost();
        let leaf = &mut self.nodes[leaf as usize];
        (leaf.surface, leaf.cost) = (surface, surface);
    }

    /// Bounds and cost of an inner node.
    fn fit(&mut self, node: u32) {
        let [a, b] = self.nodes[node as usize].children.map(|child| child as usize);
        let bounds = self.bounds[a].union(&self.bounds[b]);
        let below = self.nodes[a].cost + self.nodes[b].cost;
        self.bounds[node as usize] = bounds;
        let node = &mut self.nodes[node as usize];
        node.surface = bounds.cost();
        node.cost = node.surface + below;
    }

    /// Everything anew, with what is pending.
    fn build_all(&mut self) {
        self.take_apart(self.root);
        let mut leaves = std::mem::take(&mut self.scratch.leaves);
        leaves.extend_from_slice(&self.pending);
        self.leaves = leaves.len();
        self.root = NONE;
        for i in 0..self.pending.len() {
            let leaf = self.pending[i];
            self.nodes[leaf as usize].parent = NONE;
            self.measure(leaf);
            self.mark(leaf);
        }
        self.pending.clear();
        self.build(&mut leaves, Task { from: 0, to: self.leaves, parent: NONE, side: 0 });
        self.scratch.leaves = leaves;
    }

    /// The subtree of an inner node anew; the node stays its root.
    fn rebuild(&mut self, node: u32) {
        let parent = self.nodes[node as usize].parent;
        let side = self.nodes.get(parent as usize).map_or(0, |above| usize::from(above.children[1] == node));
        self.take_apart(node);
        let mut leaves = std::mem::take(&mut self.scratch.leaves);
        let to = leaves.len();
        self.build(&mut leaves, Task { from: 0, to, parent, side });
        self.scratch.leaves = leaves;
    }

    /// Lists the leaves below a node; the inner nodes, the node itself last, are to spare.
    fn take_apart(&mut self, node: u32) {
        let Self { scratch: Scratch { leaves, stack, spare, .. }, nodes, .. } = self;
        leaves.clear();
        spare.clear();
        stack.extend(Some(node).filter(|&node| node != NONE));
        while let Some(node) = stack.pop() {
            let below = &nodes[node as usize];
            if below.is_leaf() {
                leaves.push(node);
            } else {
                spare.push(node);
                stack.extend(below.children);
            }
        }
        spare.reverse();
    }

    /// Builds a tree over `leaves` from the root down, then fits it from the leaves up.
    fn build(&mut self, leaves: &mut [u32], whole: Task) {
        let mut tasks = std::mem::take(&mut self.scratch.tasks);
        let mut order = Vec::new();
        std::mem::swap(&mut order, &mut self.scratch.stack);
        tasks.push(whole);
        while let Some(Task { from, to, parent, side }) = tasks.pop() {
            let node = if to - from == 1 { leaves[from] } else { self.inner() };
            self.nodes[node as usize].parent = parent;
            match self.nodes.get_mut(parent as usize) {
                Some(parent) => parent.children[side] = node,
                None => self.root = node,
            }
            if to - from > 1 {
                order.push(node);
                let middle = from + self.split(&mut leaves[from..to]);
                tasks.push(Task { from, to: middle, parent: node, side: 0 });
                tasks.push(Task { from: middle, to, parent: node, side: 1 });
            }
        }
        for &node in order.iter().rev() {
            self.fit(node);
            if self.nodes[node as usize].children.iter().any(|&child| self.nodes[child as usize].changed) {
                self.nodes[node as usize].changed = true;
                self.changed.push(node);
            }
            self.nodes[node as usize].built = self.nodes[node as usize].ratio();
        }
        order.clear();
        self.scratch.stack = order;
        self.scratch.tasks = tasks;
    }

    /// An inner node without children: one that was taken apart, or a new one.
    fn inner(&mut self) -> u32 {
        match self.scratch.spare.pop() {
            Some(node) => {
                self.nodes[node as usize] = Node::leaf(NONE);
                node
            }
            None => self.allocate(Node::leaf(NONE), Kdop::EMPTY),
        }
    }

    /// Sorts leaves into two parts where the sum of number times surface is least, among cuts across the direction along
    /// which they are spread the most. Answers the size of the first, at least 1 and less than all.
    fn split(&self, leaves: &mut [u32]) -> usize {
        let centre = |leaf: u32, slab: usize| self.bounds[leaf as usize].doubled_centre(slab);
        let spread = |slab: usize| {
            let ends = leaves.iter().map(|&leaf| centre(leaf, slab));
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let spreads: [(f64, f64); H] = std::array::from_fn(spread);
        let widths = spreads.map(|(low, high)| high - low);
        let widest = (1..H).fold(0, |best, i| if widths[i] > widths[best] { i } else { best });
        let (low, width) = (spreads[widest].0, widths[widest]);
        let usable = width > 0.0 && width.is_finite();
        if leaves.len() == 2 || !usable {
            return leaves.len() / 2;
        }
        let bin = |leaf: u32| (((centre(leaf, widest) - low) / width * BINS as f64) as usize).min(BINS - 1);
        let cut = self.cut(leaves, bin);
        let mut first = 0;
        for i in 0..leaves.len() {
            if bin(leaves[i]) <= cut {
                leaves.swap(i, first);
                first += 1;
            }
        }
        first
    }

    /// The last bin of the first part. The first and the last bin have leaves: neither part is empty.
    fn cut(&self, leaves: &[u32], bin: impl Fn(u32) -> usize) -> usize {
        let mut bins = [(Kdop::<H>::EMPTY, 0.0); BINS];
        for &leaf in leaves {
            let (bounds, count) = &mut bins[bin(leaf)];
            *bounds = bounds.union(&self.bounds[leaf as usize]);
            *count += 1.0;
        }
        let mut second = [0.0; BINS];
        let (mut bounds, mut count) = (Kdop::EMPTY, 0.0);
        for i in (1..BINS).rev() {
            bounds = bounds.union(&bins[i].0);
            count += bins[i].1;
            second[i - 1] = bounds.cost() * count;
        }
        let (mut bounds, mut count) = (Kdop::EMPTY, 0.0);
        let mut best = (f64::INFINITY, 0);
        for i in 0..BINS - 1 {
            bounds = bounds.union(&bins[i].0);
            count += bins[i].1;
            let cost = bounds.cost() * count + second[i];
            if cost < best.0 {
                best = (cost, i);
            }
        }
        best.1
    }
}
