//! Symmetric successive over-relaxation: a sweep of SOR forwards and one backwards, in blocks.

use super::super::block::{Entry, multiply_add, transposed_multiply_sub};
use super::super::matrix::Matrix;
use super::super::solver::work::block;
use super::ApproximateInverse;
use super::block_jacobi::BlockJacobi;

/// P = ω (2 − ω) (B + ω L)⁻ᵀ B (B + ω L)⁻¹, with A = L + B + Lᵀ and ω the relaxation.
pub(super) struct Ssor<const D: usize> {
    blocks: BlockJacobi<D>,
    /// ω, above 0 and below 2; 1 is symmetric Gauss-Seidel.
    pub relaxation: f64,
}

impl<const D: usize> Default for Ssor<D> {
    fn default() -> Self {
        Self { blocks: BlockJacobi::default(), relaxation: 1.0 }
    }
}

impl<const D: usize> ApproximateInverse<D> for Ssor<D> {
    fn prepare(&mut self, a: &Matrix<D>) -> u64 {
        self.blocks.prepare(a)
    }

    fn apply(&self, a: &Matrix<D>, x: &mut [Entry<D>]) {
        let omega = self.relaxation;
        for i in 0..x.len() {
            let mut sum = [0.0; D];
            for k in a.row(i) {
                multiply_add(&a.lower[k], &x[a.columns[k] as usize], &mut sum);
            }
            let mut entry = std::array::from_fn(|d| x[i][d] - omega * sum[d]);
            self.blocks.solve_body(i, &mut entry);
            x[i] = entry;
        }
        let scale = omega * (2.0 - omega);
        for (x, b) in x.iter_mut().zip(&a.diagonal) {
            let mut product = [0.0; D];
            multiply_add(b, x, &mut product);
            *x = product.map(|v| scale * v);
        }
        for i in (0..x.len()).rev() {
            self.blocks.solve_body(i, &mut x[i]);
            let scaled = x[i].map(|v| omega * v);
            for k in a.row(i) {
                transposed_multiply_sub(&a.lower[k], &scaled, &mut x[a.columns[k] as usize]);
            }
        }
    }

    fn apply_work(&self, a: &Matrix<D>) -> u64 {
        (3 * a.diagonal.len() + 2 * a.lower.len()) as u64 * block(D)
    }
}
