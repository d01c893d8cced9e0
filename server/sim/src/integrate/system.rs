//! The linear system of a Newton iteration: a symmetric block-sparse matrix, and its incomplete factorisation.
//!
//! Stored is the lower triangle, row by row, columns ascending. The factorisation IC(0) keeps that pattern; in the
//! elimination order that [`island`](crate::island) gives it is exact on trees and towers.

use super::block::{
    Block, Entry, backward_substitute, cholesky, dot, forward_substitute, multiply_add, multiply_sub, product_sub,
    transposed_multiply_add, transposed_multiply_sub, zero,
};
use super::problem::{Problem, Visitor};
use crate::potential::{Candidate, FIXED, NodeIndex, PairBlocks, Term};

/// Pivots below this fraction of the diagonal are a breakdown of the incomplete factorisation.
const PIVOT_FLOOR: f64 = 1e-10;

/// Marks a term without an off-diagonal block.
const NONE: u32 = u32::MAX;

/// A symmetric positive definite block matrix with its preconditioner.
#[derive(Default)]
pub(super) struct System<const D: usize> {
    /// `columns[rows[i]..rows[i + 1]]` are the columns of row i, all below i.
    rows: Vec<u32>,
    columns: Vec<u32>,
    diagonal: Vec<Block<D>>,
    lower: Vec<Block<D>>,
    factor_diagonal: Vec<Block<D>>,
    factor_lower: Vec<Block<D>>,
    /// Off-diagonal block of each term, in the order of visits.
    slots: Vec<u32>,
    pairs: Vec<(u32, u32)>,
}

impl<const D: usize> System<D> {
    /// Finds the sparsity pattern of `problem`.
    pub fn analyse(&mut self, problem: &mut Problem) {
        let n = problem.nodes.len();
        self.pairs.clear();
        problem.terms.visit(&mut Pairs { pairs: &mut self.pairs });
        self.pairs.sort_unstable();
        self.pairs.dedup();
        self.rows.clear();
        self.rows.resize(n + 1, 0);
        self.columns.clear();
        for &(row, column) in &self.pairs {
            self.rows[row as usize + 1] += 1;
            self.columns.push(column);
        }
        for i in 0..n {
            self.rows[i + 1] += self.rows[i];
        }
        self.slots.clear();
        problem.terms.visit(&mut Slots { rows: &self.rows, columns: &self.columns, slots: &mut self.slots });
        self.diagonal.resize(n, zero());
        self.lower.resize(self.columns.len(), zero());
        self.factor_diagonal.resize(n, zero());
        self.factor_lower.resize(self.columns.len(), zero());
    }

    /// Sums up M + dt² ∂²Φ at the problem's trial and factorises it.
    pub fn assemble(&mut self, problem: &mut Problem) {
        for (block, node) in self.diagonal.iter_mut().zip(&problem.nodes) {
            *block = zero();
            for (i, row) in block.iter_mut().enumerate() {
                if i < 3 {
                    row[i] = node.mass;
                } else {
                    // The inertia is symmetric: its columns are its rows.
                    row[3..].copy_from_slice(&node.inertia.col(i - 3).to_array());
                }
            }
        }
        self.lower.fill(zero());
        let candidate = Candidate { dt: problem.dt, trial: &problem.trial };
        problem.terms.visit(&mut Assemble {
            candidate,
            diagonal: &mut self.diagonal,
            lower: &mut self.lower,
            slots: self.slots.iter(),
        });
        self.factorise();
    }

    /// y = A x.
    pub fn multiply(&self, x: &[Entry<D>], y: &mut [Entry<D>]) {
        for i in 0..y.len() {
            y[i] = [0.0; D];
            multiply_add(&self.diagonal[i], &x[i], &mut y[i]);
            for k in self.row(i) {
                let j = self.columns[k] as usize;
                multiply_add(&self.lower[k], &x[j], &mut y[i]);
                transposed_multiply_add(&self.lower[k], &x[i], &mut y[j]);
            }
        }
    }

    /// x ← (L Lᵀ)⁻¹ x, the preconditioner.
    pub fn precondition(&self, x: &mut [Entry<D>]) {
        for i in 0..x.len() {
            let mut entry = x[i];
            for k in self.row(i) {
                multiply_sub(&self.factor_lower[k], &x[self.columns[k] as usize], &mut entry);
            }
            forward_substitute(&self.factor_diagonal[i], &mut entry);
            x[i] = entry;
        }
        for i in (0..x.len()).rev() {
            backward_substitute(&self.factor_diagonal[i], &mut x[i]);
            let entry = x[i];
            for k in self.row(i) {
                transposed_multiply_sub(&self.factor_lower[k], &entry, &mut x[self.columns[k] as usize]);
            }
        }
    }

    fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.rows[i] as usize..self.rows[i + 1] as usize
    }

    /// Block IC(0): L has the pattern of A's lower triangle.
    fn factorise(&mut self) {
        for i in 0..self.diagonal.len() {
            let mut diagonal = self.diagonal[i];
            for k in self.row(i) {
                let j = self.columns[k] as usize;
                let mut block = self.lower[k];
                self.subtract_common(i, j, k, &mut block);
                // L_ij = A_ij L_jj⁻ᵀ: each row of it solves L_jj x = row.
                for row in &mut block {
                    forward_substitute(&self.factor_diagonal[j], row);
                }
                product_sub(&block, &block, &mut diagonal);
                self.factor_lower[k] = block;
            }
            self.factor_diagonal[i] = cholesky(&diagonal, PIVOT_FLOOR)
                .or_else(|| cholesky(&self.diagonal[i], 0.0))
                .unwrap_or_else(|| unit_scaled(&self.diagonal[i]));
        }
    }

    /// block −= Σ_m L_im L_jmᵀ over the columns m that rows i (before place `end`) and j share.
    fn subtract_common(&self, i: usize, j: usize, end: usize, block: &mut Block<D>) {
        let (mut p, mut q) = (self.row(i).start, self.row(j).start);
        let q_end = self.row(j).end;
        while p < end && q < q_end {
            match self.columns[p].cmp(&self.columns[q]) {
                std::cmp::Ordering::Less => p += 1,
                std::cmp::Ordering::Greater => q += 1,
                std::cmp::Ordering::Equal => {
                    product_sub(&self.factor_lower[p], &self.factor_lower[q], block);
                    p += 1;
                    q += 1;
                }
            }
        }
    }
}

/// Last resort for a diagonal block that rounding has made indefinite: the root of its diagonal.
fn unit_scaled<const D: usize>(a: &Block<D>) -> Block<D> {
    let mut l = zero();
    for i in 0..D {
        l[i][i] = a[i][i].abs().max(f64::MIN_POSITIVE).sqrt();
    }
    l
}

/// Row and column of the lower-triangle block between two bodies.
fn place([a, b]: [NodeIndex; 2]) -> Option<(u32, u32)> {
    (a != FIXED && b != FIXED).then(|| (a.max(b), a.min(b)))
}

struct Pairs<'a> {
    pairs: &'a mut Vec<(u32, u32)>,
}

impl Visitor for Pairs<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        self.pairs.extend(terms.iter().filter_map(|term| place(term.nodes())));
    }
}

struct Slots<'a> {
    rows: &'a [u32],
    columns: &'a [u32],
    slots: &'a mut Vec<u32>,
}

impl Visitor for Slots<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let slot = place(term.nodes()).and_then(|(row, column)| {
                let (start, end) = (self.rows[row as usize], self.rows[row as usize + 1]);
                let found = self.columns[start as usize..end as usize].binary_search(&column);
                found.ok().map(|k| start + k as u32)
            });
            self.slots.push(slot.unwrap_or(NONE));
        }
    }
}

struct Assemble<'a, const D: usize> {
    candidate: Candidate<'a>,
    diagonal: &'a mut [Block<D>],
    lower: &'a mut [Block<D>],
    slots: std::slice::Iter<'a, u32>,
}

impl<const D: usize> Visitor for Assemble<'_, D> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        let factor = self.candidate.dt * self.candidate.dt;
        for (term, &slot) in terms.iter().zip(&mut self.slots) {
            let PairBlocks { aa, ab, bb } = term.hessian(&self.candidate);
            let [a, b] = term.nodes();
            if a != FIXED {
                add_scaled(&mut self.diagonal[a as usize], &aa, factor, false);
            }
            if b != FIXED {
                add_scaled(&mut self.diagonal[b as usize], &bb, factor, false);
            }
            if slot != NONE {
                add_scaled(&mut self.lower[slot as usize], &ab, factor, a < b);
            }
        }
    }
}

/// target += factor source, or its transpose; the leading D×D part of it.
fn add_scaled<const D: usize>(target: &mut Block<D>, source: &Block<6>, factor: f64, transposed: bool) {
    for i in 0..D {
        for j in 0..D {
            target[i][j] += factor * if transposed { source[j][i] } else { source[i][j] };
        }
    }
}

/// Scalar product of two vectors.
pub(super) fn inner<const D: usize>(a: &[Entry<D>], b: &[Entry<D>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(a, b)).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::conjugate_gradient::ConjugateGradient;
    use super::*;

    const D: usize = 3;

    /// A positive definite system with blocks below the diagonal at `pairs`, sorted by row, and the same one dense.
    fn system(n: usize, pairs: &[(u32, u32)], numbers: &[f64]) -> (System<D>, Vec<Vec<f64>>) {
        let mut numbers = numbers.iter().copied().cycle();
        let mut system = System::<D> { pairs: pairs.to_vec(), ..System::default() };
        system.rows = vec![0; n + 1];
        for &(row, column) in pairs {
            system.columns.push(column);
            (row as usize + 1..=n).for_each(|i| system.rows[i] += 1);
        }
        let mut dense = vec![vec![0.0; D * n]; D * n];
        for &(row, column) in pairs {
            let block: Block<D> = std::array::from_fn(|_| std::array::from_fn(|_| numbers.next().unwrap()));
            for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                let (p, q) = (D * row as usize + i, D * column as usize + j);
                (dense[p][q], dense[q][p]) = (block[i][j], block[i][j]);
            }
            system.lower.push(block);
        }
        for (i, row) in dense.iter_mut().enumerate() {
            // Diagonally dominant, so positive definite.
            row[i] = 0.1 + row.iter().map(|x| x.abs()).sum::<f64>();
        }
        let diagonal = |i: usize| std::array::from_fn(|p| std::array::from_fn(|q| dense[D * i + p][D * i + q]));
        system.diagonal = (0..n).map(diagonal).collect();
        system.factor_diagonal = vec![zero(); n];
        system.factor_lower = vec![zero(); pairs.len()];
        system.factorise();
        (system, dense)
    }

    fn entries(n: usize) -> Vec<Entry<D>> {
        (0..n).map(|i| std::array::from_fn(|j| 1.0 + (i * D + j) as f64 * 0.37)).collect()
    }

    fn dense_product(dense: &[Vec<f64>], x: &[Entry<D>]) -> Vec<f64> {
        dense.iter().map(|row| row.iter().zip(x.as_flattened()).map(|(a, x)| a * x).sum()).collect()
    }

    fn largest_difference(a: &[Entry<D>], b: &[f64]) -> f64 {
        a.as_flattened().iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    proptest! {
        /// On a tree whose children come before their parents the factorisation is exact.
        #[test]
        fn incomplete_factorisation_solves_trees(
            parents in prop::collection::vec(any::<prop::sample::Index>(), 1..12),
            numbers in prop::collection::vec(-1.0..1.0f64, 30),
        ) {
            let n = parents.len() + 1;
            let parent = |(child, index): (usize, &prop::sample::Index)| ((child + 1 + index.index(n - child - 1)) as u32, child as u32);
            let mut pairs: Vec<_> = parents.iter().enumerate().map(parent).collect();
            pairs.sort_unstable();
            let (system, dense) = system(n, &pairs, &numbers);
            let x = entries(n);
            let mut solved: Vec<Entry<D>> = dense_product(&dense, &x).chunks(D).map(|c| [c[0], c[1], c[2]]).collect();
            system.precondition(&mut solved);
            prop_assert!(largest_difference(&solved, x.as_flattened()) < 1e-9);
            let g: Vec<Entry<D>> = x.iter().map(|e| e.map(|v| -v)).collect();
            prop_assert_eq!(ConjugateGradient::default().solve(&system, &g, 0.1, &mut Vec::new()), 1);
        }

        /// The sparse product is the dense one, and conjugate gradients solve what the factorisation only approximates.
        #[test]
        fn conjugate_gradients_solve_any_pattern(
            wanted in prop::collection::btree_set((1u32..8, 0u32..7), 0..20),
            numbers in prop::collection::vec(-1.0..1.0f64, 40),
        ) {
            let n = 8;
            let pairs: Vec<_> = wanted.into_iter().filter(|(row, column)| column < row).collect();
            let (system, dense) = system(n, &pairs, &numbers);
            let x = entries(n);
            let mut product = vec![[0.0; D]; n];
            system.multiply(&x, &mut product);
            prop_assert!(largest_difference(&product, &dense_product(&dense, &x)) < 1e-12);
            let g: Vec<Entry<D>> = product.iter().map(|e| e.map(|v| -v)).collect();
            let mut solved = Vec::new();
            let iterations = ConjugateGradient::default().solve(&system, &g, 1e-9, &mut solved);
            prop_assert!(iterations <= 6 + (2.0 * 24f64.sqrt()) as usize);
            prop_assert!(largest_difference(&solved, x.as_flattened()) < 1e-4);
        }
    }
}
