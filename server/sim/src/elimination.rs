//! The order in which a body's blocks are eliminated: minimum degree, fill included (Tinney and Walker, 1967).
//!
//! It is found once, when the body is made, because what couples its blocks never changes. A beam of 200 tetrahedra is
//! factorised with a quarter of the work that the order of [`island`](crate::island), which looks at no fill, would take.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Most blocks for which fill is looked at. Larger bodies are not factorised with it, and finding it takes long.
const BLOCKS_MAX: usize = 4000;

/// The place of each of `blocks` blocks in the order of elimination. `couplings` may come in any order, and twice.
pub(crate) fn minimum_degree(blocks: usize, couplings: &[(u32, u32)]) -> Vec<u32> {
    let mut neighbours = vec![Vec::new(); blocks];
    for &(a, b) in couplings.iter().filter(|(a, b)| a != b) {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    let mut queue: BinaryHeap<_> = (0u32..).zip(&neighbours).map(|(i, list)| Reverse((list.len(), i))).collect();
    let mut ranks = vec![u32::MAX; blocks];
    let mut next = 0;
    let mut merged = Vec::new();
    while let Some(Reverse((degree, block))) = queue.pop() {
        // An entry whose degree has changed since is stale: a newer one is in the queue.
        if ranks[block as usize] != u32::MAX || neighbours[block as usize].len() != degree {
            continue;
        }
        ranks[block as usize] = next;
        next += 1;
        let left = std::mem::take(&mut neighbours[block as usize]);
        for &i in &left {
            let list = &mut neighbours[i as usize];
            list.retain(|&j| j != block);
            if blocks <= BLOCKS_MAX {
                // Elimination couples all that is left.
                merged.clear();
                merged.extend(list.iter().chain(&left).copied().filter(|&j| j != i));
                merged.sort_unstable();
                merged.dedup();
                std::mem::swap(list, &mut merged);
            }
            queue.push(Reverse((list.len(), i)));
        }
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TetrahedralMesh;
    use glam::DVec3;

    /// Blocks of the factor in an order.
    fn fill(ranks: &[u32], couplings: &[(u32, u32)]) -> usize {
        let mut order: Vec<_> = (0..ranks.len()).collect();
        order.sort_by_key(|&i| ranks[i]);
        let mut coupled = vec![std::collections::BTreeSet::new(); ranks.len()];
        for &(a, b) in couplings {
            coupled[a as usize].insert(b);
            coupled[b as usize].insert(a);
        }
        let mut blocks = 0;
        for block in order {
            let left = std::mem::take(&mut coupled[block]);
            blocks += left.len();
            for &i in &left {
                coupled[i as usize].extend(left.iter().filter(|&&j| j != i));
                coupled[i as usize].remove(&(block as u32));
            }
        }
        blocks
    }

    #[test]
    fn a_tree_has_no_fill_and_a_beam_little() {
        let tree: Vec<_> = (1..30).map(|i| (i, i / 3)).collect();
        let ranks = minimum_degree(30, &tree);
        assert_eq!(fill(&ranks, &tree), 29);
        let mut sorted = ranks;
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..30));
        let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [10, 2, 2]).unwrap();
        let pairs = |e: &[u32; 4]| [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(i, j)| (e[i], e[j]));
        let beam: Vec<_> = mesh.elements().iter().flat_map(pairs).collect();
        let blocks = fill(&minimum_degree(99, &beam), &beam);
        assert!(blocks < 700, "{blocks}");
    }
}
