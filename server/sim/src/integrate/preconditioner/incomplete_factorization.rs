//! Incomplete Cholesky factorisation IC(0): L has the pattern of the matrix' lower triangle.
//!
//! In the elimination order that [`island`](crate::island) gives it is exact on trees and towers.

use super::super::block::{
    Block, Entry, backward_substitute, cholesky, forward_substitute, multiply_sub, product_sub,
    transposed_multiply_sub, zero,
};
use super::super::matrix::Matrix;
use super::Preconditioner;

/// Pivots below this fraction of the diagonal are a breakdown; the matrix' own diagonal block then takes their place.
const PIVOT_FLOOR: f64 = 1e-10;

/// The factor L, A ≈ L Lᵀ.
#[derive(Default)]
pub(in super::super) struct IncompleteFactorization<const D: usize> {
    /// Cholesky factors of the pivots.
    diagonal: Vec<Block<D>>,
    /// Blocks below the diagonal, where the matrix has its own.
    lower: Vec<Block<D>>,
}

impl<const D: usize> Preconditioner<D> for IncompleteFactorization<D> {
    fn prepare(&mut self, a: &Matrix<D>) {
        self.diagonal.resize(a.diagonal.len(), zero());
        self.lower.resize(a.lower.len(), zero());
        for i in 0..a.diagonal.len() {
            let mut diagonal = a.diagonal[i];
            for k in a.row(i) {
                let j = a.columns[k] as usize;
                let mut block = a.lower[k];
                self.subtract_common(a, i, j, k, &mut block);
                // L_ij = A_ij L_jj⁻ᵀ: each row of it solves L_jj x = row.
                for row in &mut block {
                    forward_substitute(&self.diagonal[j], row);
                }
                product_sub(&block, &block, &mut diagonal);
                self.lower[k] = block;
            }
            self.diagonal[i] = cholesky(&diagonal, PIVOT_FLOOR)
                .or_else(|| cholesky(&a.diagonal[i], 0.0))
                .unwrap_or_else(|| unit_scaled(&a.diagonal[i]));
        }
    }

    fn apply(&self, a: &Matrix<D>, x: &mut [Entry<D>]) {
        for i in 0..x.len() {
            let mut entry = x[i];
            for k in a.row(i) {
                multiply_sub(&self.lower[k], &x[a.columns[k] as usize], &mut entry);
            }
            forward_substitute(&self.diagonal[i], &mut entry);
            x[i] = entry;
        }
        for i in (0..x.len()).rev() {
            backward_substitute(&self.diagonal[i], &mut x[i]);
            let entry = x[i];
            for k in a.row(i) {
                transposed_multiply_sub(&self.lower[k], &entry, &mut x[a.columns[k] as usize]);
            }
        }
    }
}

impl<const D: usize> IncompleteFactorization<D> {
    /// block −= Σ_m L_im L_jmᵀ over the columns m that rows i (before place `end`) and j share.
    fn subtract_common(&self, a: &Matrix<D>, i: usize, j: usize, end: usize, block: &mut Block<D>) {
        let (mut p, mut q) = (a.row(i).start, a.row(j).start);
        let q_end = a.row(j).end;
        while p < end && q < q_end {
            match a.columns[p].cmp(&a.columns[q]) {
                std::cmp::Ordering::Less => p += 1,
                std::cmp::Ordering::Greater => q += 1,
                std::cmp::Ordering::Equal => {
                    product_sub(&self.lower[p], &self.lower[q], block);
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::super::matrix::tests::{D, dense_product, entries, largest_difference, matrix, tree};
    use super::*;

    proptest! {
        /// On a tree whose children come before their parents the factorisation is exact.
        #[test]
        fn trees_are_factorized_exactly(
            parents in prop::collection::vec(any::<prop::sample::Index>(), 1..12),
            numbers in prop::collection::vec(-1.0..1.0f64, 30),
        ) {
            let n = parents.len() + 1;
            let (matrix, dense) = matrix(n, &tree(&parents), &numbers);
            let mut factorization = IncompleteFactorization::default();
            factorization.prepare(&matrix);
            let x = entries(n);
            let mut solved: Vec<Entry<D>> = dense_product(&dense, &x).chunks(D).map(|c| [c[0], c[1], c[2]]).collect();
            factorization.apply(&matrix, &mut solved);
            prop_assert!(largest_difference(&solved, x.as_flattened()) < 1e-9);
        }
    }
}
