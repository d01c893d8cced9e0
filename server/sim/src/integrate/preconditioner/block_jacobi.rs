//! Block Jacobi: each body's own block, as if it were alone.

use super::super::block::{Block, Entry, backward_substitute, forward_substitute};
use super::super::factorization::own_factor;
use super::super::matrix::Matrix;
use super::super::solver::work::{block, block_product};
use super::ApproximateInverse;

/// P = B⁻¹, B the block diagonal of A.
#[derive(Default)]
pub(crate) struct BlockJacobi<const D: usize> {
    /// Cholesky factors of the diagonal blocks.
    factors: Vec<Block<D>>,
}

impl<const D: usize> BlockJacobi<D> {
    /// x ← A_ii⁻¹ x.
    pub fn solve_body(&self, i: usize, x: &mut Entry<D>) {
        forward_substitute(&self.factors[i], x);
        backward_substitute(&self.factors[i], x);
    }
}

impl<const D: usize> ApproximateInverse<D> for BlockJacobi<D> {
    fn prepare(&mut self, a: &Matrix<D>) -> u64 {
        self.factors.clear();
        self.factors.extend(a.diagonal.iter().map(own_factor));
        a.diagonal.len() as u64 * block_product(D) / 6
    }

    fn apply(&self, _a: &Matrix<D>, x: &mut [Entry<D>]) {
        for (i, x) in x.iter_mut().enumerate() {
            self.solve_body(i, x);
        }
    }

    fn apply_work(&self, a: &Matrix<D>) -> u64 {
        a.diagonal.len() as u64 * block(D)
    }
}
