//! Islands: bodies that potentials couple this tick, the unit of solving.
//!
//! Every island lists its bodies in elimination order: repeatedly the body with the fewest neighbours left. On trees and
//! towers a factorisation in this order has no fill.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The islands of a tick.
#[derive(Default)]
pub(crate) struct Islands {
    /// Number of bodies.
    bodies: usize,
    /// What potentials couple, in the order in which it was told; a body and itself where one acts on that alone.
    told: Vec<(u32, u32)>,
    /// Both when the islands were sorted last: most ticks couple what the last one did.
    sorted: (usize, Vec<(u32, u32)>),
    /// Union-find forest over bodies.
    parent: Vec<u32>,
    coupled: Vec<bool>,
    couplings: Vec<(u32, u32)>,
    starts: Vec<u32>,
    members: Vec<u32>,
    /// Island of each body, or [`Islands::FREE`].
    island_of: Vec<u32>,
    scratch: Scratch,
}

#[derive(Default)]
struct Scratch {
    neighbour_starts: Vec<u32>,
    neighbours: Vec<u32>,
    degree: Vec<u32>,
    heap: BinaryHeap<Reverse<(u32, u32)>>,
    elimination: Vec<u32>,
    island_of_root: Vec<u32>,
}

impl Islands {
    /// Island of what is in none.
    pub const FREE: u32 = u32::MAX;

    /// Starts a tick with `bodies` bodies.
    pub fn begin(&mut self, bodies: usize) {
        self.bodies = bodies;
        self.told.clear();
    }

    /// A potential acts on `a` alone.
    pub fn touch(&mut self, a: u32) {
        self.told.push((a, a));
    }

    /// A potential acts between `a` and `b`.
    pub fn couple(&mut self, a: u32, b: u32) {
        self.told.push((a.min(b), a.max(b)));
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The smaller root wins, so that islands are numbered by their first block.
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Sorts bodies into islands.
    pub fn finish(&mut self) {
        let (bodies, told) = &mut self.sorted;
        if self.starts.is_empty() || *bodies != self.bodies || *told != self.told {
            *bodies = self.bodies;
            told.clone_from(&self.told);
            self.sort();
        }
    }

    fn sort(&mut self) {
        self.parent.clear();
        self.parent.extend(0..self.bodies as u32);
        self.coupled.clear();
        self.coupled.resize(self.bodies, false);
        self.couplings.clear();
        for i in 0..self.told.len() {
            let (a, b) = self.told[i];
            (self.coupled[a as usize], self.coupled[b as usize]) = (true, true);
            if a != b {
                self.couplings.push((a, b));
                self.unite(a, b);
            }
        }
        self.couplings.sort_unstable();
        self.couplings.dedup();
        self.order_elimination();
        self.number_islands();
    }

    /// Number of islands.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Bodies of an island, in elimination order.
    pub fn members(&self, island: usize) -> &[u32] {
        &self.members[self.starts[island] as usize..self.starts[island + 1] as usize]
    }

    /// Island of a body; [`Islands::FREE`] where nothing acts on it.
    pub fn island_of(&self, body: u32) -> u32 {
        self.island_of[body as usize]
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let grandparent = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = grandparent;
            i = grandparent;
        }
        i
    }

    fn order_elimination(&mut self) {
        let s = &mut self.scratch;
        let n = self.parent.len();
        s.degree.clear();
        s.degree.resize(n, 0);
        for &(a, b) in &self.couplings {
            s.degree[a as usize] += 1;
            s.degree[b as usize] += 1;
        }
        s.neighbour_starts.clear();
        s.neighbour_starts.push(0);
        let mut sum = 0;
        for &degree in &s.degree {
            sum += degree;
            s.neighbour_starts.push(sum);
        }
        s.neighbours.clear();
        s.neighbours.resize(sum as usize, 0);
        // Fill from the back of each share; the starts end where they began.
        let mut ends = std::mem::take(&mut s.elimination);
        ends.clear();
        ends.extend_from_slice(&s.neighbour_starts[1..]);
        for &(a, b) in self.couplings.iter().rev() {
            for (from, to) in [(a, b), (b, a)] {
                ends[from as usize] -= 1;
                s.neighbours[ends[from as usize] as usize] = to;
            }
        }
        s.heap.clear();
        s.heap.extend((0..n as u32).filter(|&i| self.coupled[i as usize]).map(|i| Reverse((s.degree[i as usize], i))));
        ends.clear();
        s.elimination = ends;
        const DONE: u32 = u32::MAX;
        while let Some(Reverse((degree, i))) = s.heap.pop() {
            // An entry whose degree has changed since is stale: a newer one is in the heap.
            if s.degree[i as usize] != degree {
                continue;
            }
            s.degree[i as usize] = DONE;
            s.elimination.push(i);
            let (start, end) = (s.neighbour_starts[i as usize], s.neighbour_starts[i as usize + 1]);
            for &j in &s.neighbours[start as usize..end as usize] {
                let degree = &mut s.degree[j as usize];
                if *degree != DONE {
                    *degree -= 1;
                    s.heap.push(Reverse((*degree, j)));
                }
            }
        }
    }

    fn number_islands(&mut self) {
        let n = self.parent.len();
        self.island_of.clear();
        self.island_of.resize(n, Self::FREE);
        self.starts.clear();
        self.starts.push(0);
        let mut island_of_root = std::mem::take(&mut self.scratch.island_of_root);
        island_of_root.clear();
        island_of_root.resize(n, 0);
        for i in 0..n as u32 {
            if !self.coupled[i as usize] {
                continue;
            }
            let root = self.root(i);
            if root == i {
                island_of_root[i as usize] = self.len() as u32;
                self.starts.push(0);
            }
            let island = island_of_root[root as usize];
            self.island_of[i as usize] = island;
            self.starts[island as usize + 1] += 1;
        }
        for island in 0..self.len() {
            self.starts[island + 1] += self.starts[island];
        }
        self.members.clear();
        self.members.resize(self.scratch.elimination.len(), 0);
        let counts = &mut island_of_root;
        counts.clear();
        counts.resize(self.starts.len(), 0);
        for &i in &self.scratch.elimination {
            let island = self.island_of[i as usize] as usize;
            let count = &mut counts[island];
            self.members[(self.starts[island] + *count) as usize] = i;
            *count += 1;
        }
        self.scratch.island_of_root = island_of_root;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_is_eliminated_from_its_leaves() {
        let mut islands = Islands::default();
        for _ in 0..2 {
            islands.begin(8);
            islands.touch(7);
            for leaf in [0, 2, 3, 4] {
                islands.couple(leaf, 1);
            }
            islands.finish();
            assert_eq!(islands.len(), 2);
            let members = islands.members(0);
            assert_eq!(members.len(), 5);
            assert!(members.iter().position(|&m| m == 1).unwrap() >= 3, "{members:?}");
            assert_eq!(islands.members(1), [7]);
            assert_eq!((islands.island_of(5), islands.island_of(7)), (Islands::FREE, 1));
        }
    }
}
