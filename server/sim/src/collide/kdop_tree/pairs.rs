//! Pairs: two trees, or one with itself, descended together.

use super::{KdopTree, NONE, Node};

/// A search for pairs; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct PairSearch {
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
                self.step([tree, tree], [a, b], &mut found);
            } else if let Node { changed: true, children: [left, right], .. } = tree.nodes[a as usize]
                && left != NONE
            {
                self.stack.extend([[left, left], [right, right], [left, right]]);
            }
        }
    }

    /// As [`PairSearch::within`], for pairs of a leaf of `a` and one of `b`.
    pub fn between<const H: usize>(&mut self, a: &KdopTree<H>, b: &KdopTree<H>, mut found: impl FnMut(u32, u32)) {
        self.stack.clear();
        self.stack.extend(Some([a.root, b.root]).filter(|roots| !roots.contains(&NONE)));
        while let Some(pair) = self.stack.pop() {
            self.step([a, b], pair, &mut found);
        }
    }

    /// Two different nodes: apart, a pair, or the larger one is opened.
    #[inline]
    fn step<const H: usize>(&mut self, [a, b]: [&KdopTree<H>; 2], pair: [u32; 2], found: &mut impl FnMut(u32, u32)) {
        let [i, j] = pair.map(|node| node as usize);
        let (first, second) = (&a.nodes[i], &b.nodes[j]);
        if !(first.changed | second.changed) || !a.bounds[i].overlaps(&b.bounds[j]) {
            return;
        }
        match (first.is_leaf(), second.is_leaf()) {
            (true, true) => found(first.item, second.item),
            (open, other) if other || (!open && first.surface > second.surface) => {
                self.stack.extend(first.children.map(|child| [child, pair[1]]));
            }
            _ => self.stack.extend(second.children.map(|child| [pair[0], child])),
        }
    }
}
