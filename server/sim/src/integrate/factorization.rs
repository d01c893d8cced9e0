//! Block Cholesky factorisation A ≈ L Lᵀ of the sparse matrix, in the order in which its rows are.
//!
//! With complete fill it is exact. Without fill it is IC(0): L has the pattern of A's lower triangle, and products that
//! fall outside are dropped. In the elimination order that [`island`](crate::island) gives, trees and towers have no
//! fill, so the two are one there.

use super::block::{
    Block, Entry, backward_substitute, cholesky, forward_substitute, forward_substitute_rows, multiply_sub,
    product_sub, transposed_multiply_sub, zero,
};
use super::matrix::Matrix;
use super::solver::work::{block, block_product};

/// Pivots below this fraction of the diagonal are a breakdown; the matrix' own diagonal block then takes their place,
/// which keeps L Lᵀ positive definite.
const PIVOT_FLOOR: f64 = 1e-10;

/// No parent in the elimination tree.
const ROOT: u32 = u32::MAX;

/// Which entries L has besides those of A.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fill {
    /// None.
    Nothing,
    /// All that elimination makes.
    Complete,
}

/// What a factorisation took.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factorised {
    pub multiply_adds: u64,
    /// Pivots that were not positive definite.
    pub breakdowns: usize,
}

/// A factor with its pattern and memory.
#[derive(Default)]
pub(super) struct Factorization<const D: usize> {
    /// `columns[rows[i]..rows[i + 1]]` are the columns of row i of L, all below i, ascending.
    rows: Vec<u32>,
    columns: Vec<u32>,
    /// Cholesky factors of the pivots, as [`cholesky`] has them.
    diagonal: Vec<Block<D>>,
    /// Blocks below the diagonal, as `columns` has them.
    lower: Vec<Block<D>>,
    /// Elimination tree: the first row below each column that it touches.
    parent: Vec<u32>,
    /// The last row that reached each column.
    reached: Vec<u32>,
}

impl<const D: usize> Factorization<D> {
    /// Finds the pattern of L from that of `a`.
    pub fn analyse(&mut self, a: &Matrix<D>, fill: Fill) {
        self.analyse_within(a, fill, usize::MAX);
    }

    /// As [`analyse`](Self::analyse), unless L would have more than `blocks` below its diagonal. Answers whether it has
    /// not.
    pub fn analyse_within(&mut self, a: &Matrix<D>, fill: Fill, blocks: usize) -> bool {
        let fits = match fill {
            Fill::Nothing => {
                self.rows.clone_from(&a.rows);
                self.columns.clone_from(&a.columns);
                self.columns.len() <= blocks
            }
            Fill::Complete => self.fill_in(a, blocks),
        };
        if fits {
            self.diagonal.resize(a.diagonal.len(), zero());
            self.lower.resize(self.columns.len(), zero());
        }
        fits
    }

    /// Row by row: what a row of A touches, and the ancestors of that in the elimination tree (Liu, 1986).
    fn fill_in(&mut self, a: &Matrix<D>, blocks: usize) -> bool {
        let n = a.diagonal.len();
        for vector in [&mut self.parent, &mut self.reached] {
            vector.clear();
            vector.resize(n, ROOT);
        }
        self.rows.clear();
        self.rows.push(0);
        self.columns.clear();
        for i in 0..n {
            self.reached[i] = i as u32;
            for k in a.row(i) {
                let mut j = a.columns[k] as usize;
                while self.reached[j] != i as u32 {
                    self.reached[j] = i as u32;
                    self.columns.push(j as u32);
                    if self.parent[j] == ROOT {
                        self.parent[j] = i as u32;
                    }
                    j = self.parent[j] as usize;
                }
            }
            self.columns[self.rows[i] as usize..].sort_unstable();
            self.rows.push(self.columns.len() as u32);
            if self.columns.len() > blocks {
                return false;
            }
        }
        true
    }

    /// Multiply-adds of a factorisation whose fill is complete: each pair of blocks in a column is multiplied, a block
    /// with itself by half.
    pub fn complete_work(&mut self) -> u64 {
        let n = self.diagonal.len();
        let in_column = &mut self.reached;
        in_column.clear();
        in_column.resize(n, 0);
        let mut products = 0;
        for &column in &self.columns {
            let blocks = &mut in_column[column as usize];
            *blocks += 1;
            products += u64::from(*blocks);
        }
        products * block_product(D) + n as u64 * block_product(D) / 6
    }

    /// Multiply-adds of a solution with both triangles.
    pub fn solve_work(&self) -> u64 {
        (self.diagonal.len() + 2 * self.columns.len()) as u64 * block(D)
    }

    /// Computes L for a matrix of the pattern that was analysed.
    pub fn factorise(&mut self, a: &Matrix<D>) -> Factorised {
        let (mut products, mut breakdowns) = (0, 0);
        for i in 0..a.diagonal.len() {
            let mut diagonal = a.diagonal[i];
            let mut of_a = a.row(i).peekable();
            for k in self.row(i) {
                let j = self.columns[k];
                let given = of_a.next_if(|&k| a.columns[k] == j);
                let mut block = given.map_or_else(zero, |k| a.lower[k]);
                products += self.subtract_common(i, j as usize, k, &mut block);
                // L_ij = A_ij L_jj⁻ᵀ: each row of it solves L_jj x = row.
                forward_substitute_rows(&self.diagonal[j as usize], &mut block);
                product_sub(&block, &block, &mut diagonal);
                self.lower[k] = block;
            }
            self.diagonal[i] = cholesky(&diagonal, PIVOT_FLOOR).unwrap_or_else(|| {
                breakdowns += 1;
                own_factor(&a.diagonal[i])
            });
        }
        // Each block is solved for (half a product) and multiplied with itself (another half).
        let off_diagonal = (products + self.columns.len() as u64) * block_product(D);
        Factorised { multiply_adds: off_diagonal + self.diagonal.len() as u64 * block_product(D) / 6, breakdowns }
    }

    /// x ← (L Lᵀ)⁻¹ x.
    pub fn solve(&self, x: &mut [Entry<D>]) {
        for i in 0..x.len() {
            let mut entry = x[i];
            for k in self.row(i) {
                multiply_sub(&self.lower[k], &x[self.columns[k] as usize], &mut entry);
            }
            forward_substitute(&self.diagonal[i], &mut entry);
            x[i] = entry;
        }
        for i in (0..x.len()).rev() {
            backward_substitute(&self.diagonal[i], &mut x[i]);
            let entry = x[i];
            for k in self.row(i) {
                transposed_multiply_sub(&self.lower[k], &entry, &mut x[self.columns[k] as usize]);
            }
        }
    }

    fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.rows[i] as usize..self.rows[i + 1] as usize
    }

    /// block −= Σ_m L_im L_jmᵀ over the columns m that rows i (before place `end`) and j share. Answers their number.
    fn subtract_common(&self, i: usize, j: usize, end: usize, block: &mut Block<D>) -> u64 {
        let (mut p, mut q) = (self.row(i).start, self.row(j).start);
        let q_end = self.row(j).end;
        let mut products = 0;
        while p < end && q < q_end {
            match self.columns[p].cmp(&self.columns[q]) {
                std::cmp::Ordering::Less => p += 1,
                std::cmp::Ordering::Greater => q += 1,
                std::cmp::Ordering::Equal => {
                    product_sub(&self.lower[p], &self.lower[q], block);
                    products += 1;
                    p += 1;
                    q += 1;
                }
            }
        }
        products
    }
}

/// Cholesky factor of a diagonal block by itself, as [`cholesky`] has it; of its diagonal alone where rounding has made it
/// indefinite.
pub(super) fn own_factor<const D: usize>(a: &Block<D>) -> Block<D> {
    cholesky(a, 0.0).unwrap_or_else(|| {
        let mut l = zero();
        for i in 0..D {
            l[i][i] = a[i][i].abs().max(f64::MIN_POSITIVE).sqrt().recip();
        }
        l
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::matrix::tests::{D, dense_product, entries, largest_difference, matrix, pattern, tree};
    use super::*;

    /// Error of solving with the factorisation a system whose solution is known; and the blocks of L.
    fn error(n: usize, pairs: &[(u32, u32)], numbers: &[f64], fill: Fill) -> (f64, usize) {
        let (matrix, dense) = matrix(n, pairs, numbers);
        let mut factorization = Factorization::default();
        factorization.analyse(&matrix, fill);
        factorization.factorise(&matrix);
        let x = entries(n);
        let mut solved: Vec<Entry<D>> = dense_product(&dense, &x).chunks(D).map(|c| [c[0], c[1], c[2]]).collect();
        factorization.solve(&mut solved);
        (largest_difference(&solved, x.as_flattened()), factorization.columns.len())
    }

    proptest! {
        /// On a tree whose children come before their parents there is no fill.
        #[test]
        fn trees_are_factorised_exactly_without_fill(
            parents in prop::collection::vec(any::<prop::sample::Index>(), 1..12),
            numbers in prop::collection::vec(-1.0..1.0f64, 30),
        ) {
            let (n, pairs) = (parents.len() + 1, tree(&parents));
            for fill in [Fill::Nothing, Fill::Complete] {
                let (error, blocks) = error(n, &pairs, &numbers, fill);
                prop_assert!(error < 1e-9 && blocks == pairs.len(), "{} {}", error, blocks);
            }
        }

        #[test]
        fn complete_fill_is_exact(pairs in pattern(9), numbers in prop::collection::vec(-1.0..1.0f64, 40)) {
            let (error, blocks) = error(9, &pairs, &numbers, Fill::Complete);
            prop_assert!(error < 1e-9 && blocks >= pairs.len(), "{} {}", error, blocks);
        }
    }

    #[test]
    fn a_ring_without_fill_is_inexact() {
        let ring = [(1, 0), (2, 1), (3, 2), (4, 0), (4, 3)];
        assert!(error(5, &ring, &[0.3, -0.9, 0.5, 0.7], Fill::Nothing).0 > 1e-3);
        let (error, blocks) = error(5, &ring, &[0.3, -0.9, 0.5, 0.7], Fill::Complete);
        assert!(error < 1e-9 && blocks == 7, "{error} {blocks}");
    }
}
