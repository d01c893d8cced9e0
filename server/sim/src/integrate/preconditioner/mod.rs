//! Preconditioners of conjugate gradients: symmetric positive definite approximations of a matrix' inverse. One file
//! each.

mod incomplete_factorization;

pub(super) use incomplete_factorization::IncompleteFactorization;

use super::block::Entry;
use super::matrix::Matrix;

/// Approximates a matrix' inverse.
pub(super) trait Preconditioner<const D: usize> {
    /// Takes what it needs from `a`.
    fn prepare(&mut self, a: &Matrix<D>);

    /// x ← P x, P ≈ A⁻¹, for the matrix that it was prepared for.
    fn apply(&self, a: &Matrix<D>, x: &mut [Entry<D>]);
}
