//! Incomplete Cholesky factorisation IC(0): exact on trees and towers, a good guess on piles.

use super::super::block::Entry;
use super::super::factorization::{Factorization, Fill};
use super::super::matrix::Matrix;
use super::ApproximateInverse;

/// P = (L Lᵀ)⁻¹, L with the pattern of A's lower triangle.
#[derive(Default)]
pub(super) struct IncompleteFactorization<const D: usize> {
    factorization: Factorization<D>,
}

impl<const D: usize> ApproximateInverse<D> for IncompleteFactorization<D> {
    fn analyse(&mut self, a: &Matrix<D>) {
        self.factorization.analyse(a, Fill::Nothing);
    }

    fn prepare(&mut self, a: &Matrix<D>) -> u64 {
        self.factorization.factorise(a).multiply_adds
    }

    fn apply(&self, _a: &Matrix<D>, x: &mut [Entry<D>]) {
        self.factorization.solve(x);
    }

    fn apply_work(&self, _a: &Matrix<D>) -> u64 {
        self.factorization.solve_work()
    }
}
