//! Newton's method (talk, "Newton's Method"): "why not just pick a search direction that will solve the quadratic in one
//! step?" The Newton system is solved exactly, by block Cholesky factorisation with all its fill, in the island's
//! elimination order.

use super::super::block::Entry;
use super::super::factorization::{Factorization, Fill};
use super::super::matrix::Matrix;
use super::super::vector::negate;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct Newton<const D: usize> {
    factorization: Factorization<D>,
}

impl<const D: usize> Newton<D> {
    /// Finds the fill. Answers the multiply-adds that a solution will take.
    pub fn analyse(&mut self, a: &Matrix<D>) -> u64 {
        self.factorization.analyse(a, Fill::Complete);
        self.factorization.complete_work() + self.factorization.solve_work()
    }

    /// Solves with the matrix as it is.
    pub fn solve(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.work.add(self.factorization.factorise(at.matrix));
        negate(at.residual, step);
        self.factorization.solve(step);
        at.work.vectors(1);
        at.work.add(self.factorization.solve_work());
        1
    }
}

impl<const D: usize> Solver<D> for Newton<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        if at.iteration == 0 {
            self.analyse(at.matrix);
        }
        self.solve(at, step)
    }
}
