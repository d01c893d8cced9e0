//! Chooses the method for an island by the work that it would take.
//!
//! The symbolic factorisation tells exactly what a direct solution costs. Where that is no more than what incomplete
//! factorisation with some iterations of conjugate gradients costs, as on trees and towers, where there is no fill at
//! all, [`Newton`] it is; else [`TruncatedNewton`].

use super::super::block::Entry;
use super::super::matrix::Matrix;
use super::method::Preconditioner;
use super::newton::Newton;
use super::truncated_newton::TruncatedNewton;
use super::work::{block, block_product};
use super::{Solver, Standpoint};

/// Iterations of conjugate gradients that a Newton iteration of a large island is expected to take.
const EXPECTED_ITERATIONS: u64 = 3;

/// The same where a mesh of points is among it: elastic meshes are as ill-conditioned as they are fine, and incomplete
/// factorisation serves them badly. A beam of 200 tetrahedra takes 12.
const EXPECTED_ITERATIONS_OF_MESHES: u64 = 12;

/// Both methods and the choice.
#[derive(Default)]
pub(super) struct Auto<const D: usize> {
    newton: Newton<D>,
    truncated: TruncatedNewton<D>,
    direct: bool,
}

impl<const D: usize> Solver<D> for Auto<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        if at.iteration == 0 {
            let expected =
                if at.problem.figures.have_points() { EXPECTED_ITERATIONS_OF_MESHES } else { EXPECTED_ITERATIONS };
            self.direct = self.newton.analyse(at.matrix) <= truncated_work(at.matrix, expected);
        }
        if self.direct {
            self.newton.descend(&mut at, step);
            1
        } else {
            self.truncated.solve(at, Preconditioner::IncompleteFactorization, step)
        }
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
