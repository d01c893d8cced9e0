//! What elements that share nodes have in common: their mass matrix, and where their stiffness goes in it.
//!
//! Shared by finite elements and lattices; knows neither.

use std::collections::BTreeMap;

use glam::DMat3;

use super::interface::PointMasses;

/// A mass matrix that is being summed up. Nodes from its size on are fixed, and no part of it.
pub(super) struct SharedMass {
    diagonal: Vec<f64>,
    off_diagonal: BTreeMap<(u32, u32), f64>,
}

impl SharedMass {
    /// Over `points` nodes that move.
    pub fn new(points: usize) -> Self {
        Self { diagonal: vec![0.0; points], off_diagonal: BTreeMap::new() }
    }

    /// Adds an element's, kg. What a node shares with a fixed one is its own: its weight stays what it was.
    pub fn add<const N: usize>(&mut self, nodes: [u32; N], m: &[[f64; N]; N]) {
        let moves = |node: u32| (node as usize) < self.diagonal.len();
        let moving = nodes.map(moves);
        for (i, &a) in nodes.iter().enumerate().filter(|&(i, _)| moving[i]) {
            for (j, &b) in nodes.iter().enumerate() {
                if i == j || !moving[j] {
                    self.diagonal[a as usize] += m[i][j];
                } else if a > b {
                    *self.off_diagonal.entry((a, b)).or_default() += m[i][j];
                }
            }
        }
    }

    /// The sum.
    pub fn finish(self) -> PointMasses {
        let off_diagonal = self.off_diagonal.into_iter().map(|((i, j), m)| (i, j, m)).collect();
        PointMasses { diagonal: self.diagonal, off_diagonal }
    }
}

/// Where the stiffness between two nodes goes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Slot {
    /// Nowhere: a node is fixed.
    Nowhere,
    /// A node with itself.
    Own(u32),
    /// A pair of the mass matrix, in its order.
    Pair(u32),
    /// A pair that the mass matrix has the other way round.
    Transposed(u32),
}

impl Slot {
    /// Of the block at row `a`, column `b`.
    pub fn between(masses: &PointMasses, a: u32, b: u32) -> Self {
        if a.max(b) as usize >= masses.diagonal.len() {
            return Self::Nowhere;
        }
        if a == b {
            return Self::Own(a);
        }
        let pair = (a.max(b), a.min(b));
        match masses.off_diagonal.binary_search_by_key(&pair, |&(i, j, _)| (i, j)) {
            Ok(k) if a > b => Self::Pair(k as u32),
            Ok(k) => Self::Transposed(k as u32),
            Err(_) => Self::Nowhere,
        }
    }

    /// Adds a block there.
    pub fn add(self, block: DMat3, own: &mut [DMat3], pairs: &mut [DMat3]) {
        match self {
            Self::Nowhere => {}
            Self::Own(i) => own[i as usize] += block,
            Self::Pair(k) => pairs[k as usize] += block,
            Self::Transposed(k) => pairs[k as usize] += block.transpose(),
        }
    }
}
