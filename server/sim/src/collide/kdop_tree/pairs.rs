//! Pairs: two trees, or one with itself, descended together.

use super::{KdopTree, NONE, Node};

/// A search for pairs; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct PairSearch {
    /// Inner nodes, or an inner node and another, whose bounds overlap and below which something has changed; a node with
    /// itself.
    stack: Vec<[u32; 2]>,
}

impl PairSearch {
    /// Hands `found` the items of all pairs of leaves of `tree` whose bounds overlap and of which at least one changed
    /// since [`KdopTree::settle`]; in no order.
    pub fn within<const H: usize>(&mut self, tree: &KdopTree<H>, mut found: impl FnMut(u32, u32)) {
        self.stack.clear();
        self.stack.extend(Some([tree.root; 2]).filter(|_| tree.root != NONE));
        while let Some([a, b]) = self.stack.pop() {
            if a != b {
                self.open([tree, tree], [a, b], &mut found);
            } else if let Node { changed: true, children: [left, right], .. } = tree.nodes[a as usize]
                && left != NONE
            {
                self.stack.extend([[left, left], [right, right]]);
                self.meet([tree, tree], [left, right], &mut found);
            }
        }
    }

    /// As [`PairSearch::within`], for pairs of a leaf of `a` and one of `b`.
    pub fn between<const H: usize>(&mut self, a: &KdopTree<H>, b: &KdopTree<H>, mut found: impl FnMut(u32, u32)) {
        self.stack.clear();
        if ![a.root, b.root].contains(&NONE) {
            self.meet([a, b], [a.root, b.root], &mut found);
        }
        while let Some(pair) = self.stack.pop() {
            self.open([a, b], pair, &mut found);
        }
    }

    /// Two nodes that may be apart: what is not is a pair, or to be opened.
    #[inline]
    fn meet<const H: usize>(&mut self, [a, b]: [&KdopTree<H>; 2], pair: [u32; 2], found: &mut impl FnMut(u32, u32)) {
        let [i, j] = pair.map(|node| node as usize);
        let (first, second) = (&a.nodes[i], &b.nodes[j]);
        if !(first.changed | second.changed) || !a.bounds[i].overlaps(&b.bounds[j]) {
            return;
        }
        if first.is_leaf() && second.is_leaf() {
            found(first.item, second.item);
        } else {
            self.stack.push(pair);
        }
    }

    /// The children of the larger of two nodes meet the other one.
    #[inline]
    fn open<const H: usize>(&mut self, trees: [&KdopTree<H>; 2], pair: [u32; 2], found: &mut impl FnMut(u32, u32)) {
        let (first, second) = (&trees[0].nodes[pair[0] as usize], &trees[1].nodes[pair[1] as usize]);
        if second.is_leaf() || (!first.is_leaf() && first.surface > second.surface) {
            first.children.into_iter().for_each(|child| self.meet(trees, [child, pair[1]], found));
        } else {
            second.children.into_iter().for_each(|child| self.meet(trees, [pair[0], child], found));
        }
    }
}
