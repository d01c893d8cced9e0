//! Jacobi: the diagonal. "A good way to pre-condition your system for the Conjugate Gradient Method" (talk, "Jacobi
//! Iterations").

use super::super::block::Entry;
use super::super::matrix::Matrix;
use super::ApproximateInverse;

/// P = diag(A)⁻¹.
#[derive(Default)]
pub(super) struct Jacobi<const D: usize> {
    inverse: Vec<Entry<D>>,
}

impl<const D: usize> ApproximateInverse<D> for Jacobi<D> {
    fn prepare(&mut self, a: &Matrix<D>) -> u64 {
        self.inverse.clear();
        let reciprocal = |x: f64| x.abs().max(f64::MIN_POSITIVE).recip().min(f64::MAX);
        self.inverse.extend(a.diagonal.iter().map(|block| std::array::from_fn(|i| reciprocal(block[i][i]))));
        self.apply_work(a)
    }

    fn apply(&self, _a: &Matrix<D>, x: &mut [Entry<D>]) {
        for (x, inverse) in x.iter_mut().flatten().zip(self.inverse.iter().flatten()) {
            *x *= inverse;
        }
    }

    fn apply_work(&self, a: &Matrix<D>) -> u64 {
        (a.diagonal.len() * D) as u64
    }
}
