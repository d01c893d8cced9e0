//! Linear preconditioned conjugate gradients, truncated: "almost, but not quite" solves a Newton iteration (talk, "The
//! Cel Damage Solver": capped at 6 + 2 √N iterations).

use super::block::Entry;
use super::matrix::Matrix;
use super::preconditioner::Preconditioner;
use super::vector::{add_scaled, inner};

/// Vectors of the method, kept from call to call.
#[derive(Default)]
pub(super) struct ConjugateGradient<const D: usize> {
    residual: Vec<Entry<D>>,
    preconditioned: Vec<Entry<D>>,
    direction: Vec<Entry<D>>,
    product: Vec<Entry<D>>,
}

impl<const D: usize> ConjugateGradient<D> {
    /// Solves A x = −g, with a preconditioner that was prepared for A, until the preconditioned residual has shrunk to `forcing`, or to the cap. Answers the number of
    /// iterations. `x` is a direction of descent, or zero where A is not positive definite along the first direction.
    pub fn solve(
        &mut self,
        a: &Matrix<D>,
        preconditioner: &impl Preconditioner<D>,
        g: &[Entry<D>],
        forcing: f64,
        x: &mut Vec<Entry<D>>,
    ) -> usize {
        let cap = iteration_cap(D * g.len());
        x.clear();
        x.resize(g.len(), [0.0; D]);
        self.residual.clear();
        self.residual.extend(g.iter().map(|entry| entry.map(|v| -v)));
        self.preconditioned.clone_from(&self.residual);
        preconditioner.apply(a, &mut self.preconditioned);
        self.direction.clone_from(&self.preconditioned);
        self.product.resize(g.len(), [0.0; D]);
        let mut rho = inner(&self.residual, &self.preconditioned);
        let goal = forcing * forcing * rho;
        for iteration in 1..=cap {
            a.multiply(&self.direction, &mut self.product);
            let curvature = inner(&self.direction, &self.product);
            let convex = curvature > 0.0;
            if !convex {
                return iteration;
            }
            let alpha = rho / curvature;
            add_scaled(x, alpha, &self.direction);
            add_scaled(&mut self.residual, -alpha, &self.product);
            self.preconditioned.clone_from(&self.residual);
            preconditioner.apply(a, &mut self.preconditioned);
            let next = inner(&self.residual, &self.preconditioned);
            let unsolved = next > goal;
            if !unsolved {
                return iteration;
            }
            let beta = next / rho;
            rho = next;
            for (d, z) in self.direction.iter_mut().zip(&self.preconditioned) {
                for (d, z) in d.iter_mut().zip(z) {
                    *d = z + beta * *d;
                }
            }
        }
        cap
    }
}

/// The talk's cap on iterations for N unknowns: 6 + 2 √N.
fn iteration_cap(unknowns: usize) -> usize {
    6 + (2.0 * (unknowns as f64).sqrt()) as usize
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::matrix::tests::{D, entries, largest_difference, matrix, tree};
    use super::super::preconditioner::IncompleteFactorization;
    use super::*;

    /// Solves A x = b with b the product of A with known entries; answers iterations and the largest error.
    fn solve(matrix: &Matrix<D>, forcing: f64) -> (usize, f64) {
        let x = entries(matrix.diagonal.len());
        let mut g = vec![[0.0; D]; x.len()];
        matrix.multiply(&x, &mut g);
        g.iter_mut().flatten().for_each(|g| *g = -*g);
        let mut preconditioner = IncompleteFactorization::default();
        preconditioner.prepare(matrix);
        let mut solved = Vec::new();
        let iterations = ConjugateGradient::default().solve(matrix, &preconditioner, &g, forcing, &mut solved);
        (iterations, largest_difference(&solved, x.as_flattened()))
    }

    proptest! {
        #[test]
        fn an_exact_preconditioner_needs_one_iteration(
            parents in prop::collection::vec(any::<prop::sample::Index>(), 1..12),
            numbers in prop::collection::vec(-1.0..1.0f64, 30),
        ) {
            prop_assert_eq!(solve(&matrix(parents.len() + 1, &tree(&parents), &numbers).0, 0.1).0, 1);
        }

        /// They solve what the factorisation only approximates.
        #[test]
        fn any_pattern_is_solved(
            wanted in prop::collection::btree_set((1u32..8, 0u32..7), 0..20),
            numbers in prop::collection::vec(-1.0..1.0f64, 40),
        ) {
            let pairs: Vec<_> = wanted.into_iter().filter(|(row, column)| column < row).collect();
            let (iterations, error) = solve(&matrix(8, &pairs, &numbers).0, 1e-9);
            prop_assert!(iterations <= 6 + (2.0 * 24f64.sqrt()) as usize);
            prop_assert!(error < 1e-4);
        }
    }
}
