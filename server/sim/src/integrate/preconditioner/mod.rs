//! Preconditioners of conjugate gradients: symmetric positive definite approximations of a matrix' inverse. One file
//! each; `selected` is the one that the settings name.

mod block_jacobi;
mod incomplete_factorization;
mod jacobi;
mod selected;
mod ssor;

pub(super) use block_jacobi::BlockJacobi;
pub(super) use selected::Selected;

use super::block::Entry;
use super::matrix::Matrix;

/// Approximates a matrix' inverse.
pub(super) trait ApproximateInverse<const D: usize> {
    /// Takes what it needs from the pattern of `a`.
    fn analyse(&mut self, _a: &Matrix<D>) {}

    /// Takes what it needs from `a`, of the pattern that was analysed. Answers the multiply-adds.
    fn prepare(&mut self, a: &Matrix<D>) -> u64;

    /// x ← P x, P ≈ A⁻¹, for the matrix that it was prepared for.
    fn apply(&self, a: &Matrix<D>, x: &mut [Entry<D>]);

    /// Multiply-adds of [`apply`](Self::apply).
    fn apply_work(&self, a: &Matrix<D>) -> u64;
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::conjugate_gradient::ConjugateGradient;
    use super::super::matrix::tests::{D, entries, largest_difference, matrix, pattern};
    use super::super::solver::method::Preconditioner;
    use super::super::solver::work::Work;
    use super::super::vector::inner;
    use super::*;

    fn prepared(kind: Preconditioner, a: &Matrix<D>) -> Selected<D> {
        let mut selected = Selected::default();
        selected.select(kind, 1.3);
        selected.analyse(a);
        selected.prepare(a);
        selected
    }

    proptest! {
        #[test]
        fn they_are_symmetric_and_positive_definite(
            pairs in pattern(7),
            numbers in prop::collection::vec(-1.0..1.0f64, 40),
            x in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 7),
            y in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 7),
        ) {
            let (a, _) = matrix(7, &pairs, &numbers);
            for (name, kind) in Preconditioner::ALL {
                let selected = prepared(kind, &a);
                let (mut px, mut py) = (x.clone(), y.clone());
                selected.apply(&a, &mut px);
                selected.apply(&a, &mut py);
                let (xpy, ypx, xpx) = (inner(&x, &py), inner(&y, &px), inner(&x, &px));
                let size = (inner(&x, &x) * inner(&py, &py)).sqrt();
                prop_assert!((xpy - ypx).abs() <= 1e-12 * size, "{}: {} {}", name, xpy, ypx);
                prop_assert!(xpx > 0.0, "{}: {}", name, xpx);
            }
        }

        /// Conjugate gradients solve with each.
        #[test]
        fn conjugate_gradients_solve_with_each(pairs in pattern(7), numbers in prop::collection::vec(-1.0..1.0f64, 40)) {
            let (a, _) = matrix(7, &pairs, &numbers);
            let x = entries(7);
            let mut g = vec![[0.0; D]; x.len()];
            a.multiply(&x, &mut g);
            g.iter_mut().flatten().for_each(|g| *g = -*g);
            for (name, kind) in Preconditioner::ALL {
                let (mut solved, mut linear) = (Vec::new(), ConjugateGradient::default());
                for _ in 0..20 {
                    // Restarted, because the talk's cap is below what some of them need.
                    let mut rest = vec![[0.0; D]; x.len()];
                    solved.resize(x.len(), [0.0; D]);
                    a.multiply(&solved, &mut rest);
                    rest.iter_mut().flatten().zip(g.iter().flatten()).for_each(|(r, g)| *r += g);
                    let mut correction = Vec::new();
                    linear.solve(&mut &a, &prepared(kind, &a), &rest, 1e-9, &mut Work::unlimited(), &mut correction);
                    solved.iter_mut().flatten().zip(correction.iter().flatten()).for_each(|(s, c)| *s += c);
                }
                let error = largest_difference(&solved, x.as_flattened());
                prop_assert!(error < 1e-6, "{}: {}", name, error);
            }
        }
    }
}
