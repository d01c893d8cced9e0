//! Linear preconditioned conjugate gradients, truncated: "almost, but not quite" solves a Newton iteration (talk, "The
//! Cel Damage Solver": capped at 6 + 2 √N iterations).

use super::block::Entry;
use super::matrix::Matrix;
use super::preconditioner::ApproximateInverse;
use super::solver::work::Work;
use super::vector::{add_scaled, inner, scale_and_add};

/// Passes over vectors before the first iteration: to negate, to copy, to copy, to multiply.
const VECTORS_TO_START: u64 = 4;

/// Passes over vectors in an iteration: two products, three sums, a copy.
const VECTORS_AN_ITERATION: u64 = 6;

/// What conjugate gradients solve with: a product with vectors, and the matrix that preconditioners are made of.
pub(super) trait Operator<const D: usize> {
    /// y = A x.
    fn product(&mut self, x: &[Entry<D>], y: &mut Vec<Entry<D>>);

    /// Multiply-adds of a product.
    fn product_work(&self) -> u64;

    /// A, or something like it, assembled.
    fn matrix(&self) -> &Matrix<D>;
}

impl<const D: usize> Operator<D> for &Matrix<D> {
    fn product(&mut self, x: &[Entry<D>], y: &mut Vec<Entry<D>>) {
        self.multiply(x, y);
    }

    fn product_work(&self) -> u64 {
        self.multiply_work()
    }

    fn matrix(&self) -> &Matrix<D> {
        self
    }
}

/// Vectors of the method, kept from call to call.
#[derive(Default)]
pub(super) struct ConjugateGradient<const D: usize> {
    residual: Vec<Entry<D>>,
    preconditioned: Vec<Entry<D>>,
    direction: Vec<Entry<D>>,
    product: Vec<Entry<D>>,
    met_negative_curvature: bool,
}

impl<const D: usize> ConjugateGradient<D> {
    /// Whether the last matrix was found not to be positive definite.
    pub fn met_negative_curvature(&self) -> bool {
        self.met_negative_curvature
    }

    /// Solves A x = −g, with a preconditioner that was prepared for A or for something like it, until the preconditioned residual has shrunk to
    /// `forcing`, to the cap, to a direction of negative curvature, or until the budget has run out. Answers the number
    /// of iterations.
    ///
    /// `x` is always a direction of descent: every iterate is one, and where there is none yet it is the preconditioned
    /// −g (Nash's and Steihaug's rule).
    pub fn solve(
        &mut self,
        a: &mut impl Operator<D>,
        preconditioner: &impl ApproximateInverse<D>,
        g: &[Entry<D>],
        forcing: f64,
        work: &mut Work,
        x: &mut Vec<Entry<D>>,
    ) -> usize {
        let cap = iteration_cap(D * g.len());
        let iteration_work = a.product_work() + preconditioner.apply_work(a.matrix());
        self.met_negative_curvature = false;
        x.clear();
        x.resize(g.len(), [0.0; D]);
        self.residual.clear();
        self.residual.extend(g.iter().map(|entry| entry.map(|v| -v)));
        self.preconditioned.clone_from(&self.residual);
        preconditioner.apply(a.matrix(), &mut self.preconditioned);
        self.direction.clone_from(&self.preconditioned);
        self.product.resize(g.len(), [0.0; D]);
        let mut rho = inner(&self.residual, &self.preconditioned);
        let goal = forcing * forcing * rho;
        work.add(preconditioner.apply_work(a.matrix()));
        work.vectors(VECTORS_TO_START);
        for iteration in 1..=cap {
            if !work.affords(iteration_work) {
                return self.stop_early(iteration, x);
            }
            work.add(iteration_work);
            work.vectors(VECTORS_AN_ITERATION);
            a.product(&self.direction, &mut self.product);
            let curvature = inner(&self.direction, &self.product);
            let convex = curvature > 0.0;
            if !convex {
                self.met_negative_curvature = true;
                return self.stop_early(iteration, x);
            }
            let alpha = rho / curvature;
            add_scaled(x, alpha, &self.direction);
            add_scaled(&mut self.residual, -alpha, &self.product);
            self.preconditioned.clone_from(&self.residual);
            preconditioner.apply(a.matrix(), &mut self.preconditioned);
            let next = inner(&self.residual, &self.preconditioned);
            let unsolved = next > goal;
            if !unsolved {
                return iteration;
            }
            let beta = next / rho;
            rho = next;
            scale_and_add(&mut self.direction, beta, &self.preconditioned);
        }
        cap
    }

    /// Leaves `x` as it is after the iterations before this one; makes it the first direction where there were none.
    fn stop_early(&self, iteration: usize, x: &mut Vec<Entry<D>>) -> usize {
        if iteration == 1 {
            x.clone_from(&self.direction);
        }
        iteration - 1
    }
}

/// The talk's cap on iterations for N unknowns: 6 + 2 √N.
fn iteration_cap(unknowns: usize) -> usize {
    6 + (2.0 * (unknowns as f64).sqrt()) as usize
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::matrix::tests::{D, entries, largest_difference, matrix, pattern, tree};
    use super::super::preconditioner::Selected;
    use super::super::solver::method::Preconditioner;
    use super::*;

    /// Solves A x = b with b the product of A with known entries; answers iterations and the largest error.
    fn solve(matrix: &Matrix<D>, forcing: f64) -> (usize, f64) {
        let x = entries(matrix.diagonal.len());
        let mut g = vec![[0.0; D]; x.len()];
        matrix.multiply(&x, &mut g);
        g.iter_mut().flatten().for_each(|g| *g = -*g);
        let mut preconditioner = Selected::default();
        preconditioner.analyse(matrix);
        preconditioner.prepare(matrix);
        let mut solved = Vec::new();
        let mut work = Work::unlimited();
        let mut linear = ConjugateGradient::default();
        let iterations = linear.solve(&mut &*matrix, &preconditioner, &g, forcing, &mut work, &mut solved);
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
        fn any_pattern_is_solved(pairs in pattern(8), numbers in prop::collection::vec(-1.0..1.0f64, 40)) {
            let (iterations, error) = solve(&matrix(8, &pairs, &numbers).0, 1e-9);
            prop_assert!(iterations <= 6 + (2.0 * 24f64.sqrt()) as usize);
            prop_assert!(error < 1e-4);
        }
    }

    /// Whatever the curvature, the answer leads downhill.
    #[test]
    fn negative_curvature_ends_in_a_direction_of_descent() {
        let g = [[1.0, -2.0, 0.5], [0.3, 0.0, -1.0]];
        for (first, second) in [(-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0)] {
            let (mut a, _) = matrix(2, &[], &[0.0]);
            for (block, sign) in a.diagonal.iter_mut().zip([first, second]) {
                *block = std::array::from_fn(|i| {
                    std::array::from_fn(|j| if i == j { sign * (1.0 + i as f64) } else { 0.0 })
                });
            }
            let mut preconditioner = Selected::default();
            preconditioner.select(Preconditioner::None, 1.0);
            let mut x = Vec::new();
            ConjugateGradient::default().solve(&mut &a, &preconditioner, &g, 1e-9, &mut Work::unlimited(), &mut x);
            assert!(inner(&g, &x) < 0.0, "{first} {second}: {x:?}");
        }
    }
}
