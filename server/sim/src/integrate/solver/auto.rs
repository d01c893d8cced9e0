//! Chooses the method for an island by the work that it would take.
//!
//! The symbolic factorisation tells exactly what a direct solution costs. Where that is no more than what incomplete
//! factorisation with some iterations of conjugate gradients costs, as on trees and towers, where there is no fill at
//! all, [`Newton`] it is; else [`TruncatedNewton`]. How many iterations those are is a guess at first; from then on it is
//! what they have been.

use super::super::block::Entry;
use super::super::matrix::Matrix;
use super::super::problem::Problem;
use super::method::Preconditioner;
use super::newton::Newton;
use super::truncated_newton::TruncatedNewton;
use super::work::{Work, block, block_product};
use super::{Solver, Standpoint};

/// Iterations of conjugate gradients that a Newton iteration of a large island is expected to take.
const EXPECTED_ITERATIONS: u64 = 3;

/// The same where a mesh of points is among it: elastic meshes are as ill-conditioned as they are fine, and incomplete
/// factorisation serves them badly. A beam of 200 tetrahedra takes 12.
const EXPECTED_ITERATIONS_OF_MESHES: u64 = 12;

/// Fill is followed up to so many times the work of the guess, in case the guess is too low.
const PATIENCE: u64 = 4;

/// Both methods and the choice.
#[derive(Default)]
pub(super) struct Auto<const D: usize> {
    newton: Newton<D>,
    truncated: TruncatedNewton<D>,
    /// Multiply-adds of a direct solution; `None` where that is out of the question.
    direct_work: Option<u64>,
    /// Iterations of conjugate gradients in the last Newton iteration.
    linear_iterations: u64,
    /// The last direction was a direct solution.
    was_direct: bool,
}

impl<const D: usize> Solver<D> for Auto<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        if at.iteration == 0 {
            let has_mesh = at.problem.figures.have_points();
            self.linear_iterations = if has_mesh { EXPECTED_ITERATIONS_OF_MESHES } else { EXPECTED_ITERATIONS };
            let truncated = truncated_work(at.matrix, self.linear_iterations);
            self.direct_work = self.newton.analyse_within(at.matrix, PATIENCE * truncated);
            self.truncated.analyse(at.matrix, Preconditioner::IncompleteFactorization, at.settings);
        }
        let truncated = truncated_work(at.matrix, self.linear_iterations);
        self.was_direct = self.direct_work.is_some_and(|direct| direct <= truncated);
        if self.was_direct {
            self.newton.descend(&mut at, step);
            return 1;
        }
        let iterations = self.truncated.descend(&mut at, step);
        self.linear_iterations = iterations as u64;
        iterations
    }

    fn starts_by_blocks(&self) -> bool {
        true
    }

    fn follow_friction(&mut self, problem: &Problem, work: &mut Work, step: &mut [Entry<D>]) -> usize {
        if self.was_direct { self.newton.follow_friction(problem, work, step) } else { 0 }
    }
}

/// Multiply-adds that incomplete factorisation and `iterations` of conjugate gradients take: blocks are multiplied with
/// themselves and solved for, products inside the pattern are left out; an iteration is a product with the matrix and
/// one with the preconditioner, which is applied once more at the start.
fn truncated_work<const D: usize>(a: &Matrix<D>, iterations: u64) -> u64 {
    let (n, below) = (a.diagonal.len() as u64, a.lower.len() as u64);
    let pass = (n + 2 * below) * block(D);
    (6 * below + n) * block_product(D) / 6 + (2 * iterations + 1) * pass
}
