//! Newton's method (talk, "Newton's Method"): "why not just pick a search direction that will solve the quadratic in one
//! step?" The Newton system is solved exactly, by block Cholesky factorisation with all its fill, in the island's
//! elimination order.

use super::super::block::Entry;
use super::super::factorization::{Factorised, Factorization, Fill};
use super::super::friction_tangent::FrictionTangent;
use super::super::matrix::Matrix;
use super::super::problem::Problem;
use super::super::vector::negate;
use super::work::{Work, block_product};
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct Newton<const D: usize> {
    factorization: Factorization<D>,
    friction: FrictionTangent<D>,
}

impl<const D: usize> Newton<D> {
    /// Finds the fill.
    pub fn analyse(&mut self, a: &Matrix<D>) {
        self.factorization.analyse(a, Fill::Complete);
    }

    /// Finds the fill, and answers the multiply-adds of a solution, unless they are more than `most`.
    pub fn analyse_within(&mut self, a: &Matrix<D>, most: u64) -> Option<u64> {
        // Every block of the factor takes a product at least.
        let blocks = usize::try_from(most / block_product(D)).unwrap_or(usize::MAX);
        let Self { factorization, .. } = self;
        let fits = factorization.analyse_within(a, Fill::Complete, blocks);
        fits.then(|| factorization.complete_work() + factorization.solve_work()).filter(|&work| work <= most)
    }

    /// Factorises the matrix as it is. Answers how many of its pivots are not positive definite.
    pub fn factorise(&mut self, a: &Matrix<D>, work: &mut Work) -> usize {
        let Factorised { multiply_adds, breakdowns } = self.factorization.factorise(a);
        work.add(multiply_adds);
        breakdowns
    }

    /// step ← −A⁻¹ R with the matrix as it is assembled; with a definite one if it is not.
    pub fn descend(&mut self, at: &mut Standpoint<D>, step: &mut Vec<Entry<D>>) {
        if self.factorise(at.matrix, at.work) > 0 && at.assemble_definite() {
            self.factorise(at.matrix, at.work);
        }
        self.solve(at.residual, at.work, step);
    }

    /// step ← −A⁻¹ R.
    pub fn solve(&self, residual: &[Entry<D>], work: &mut Work, step: &mut Vec<Entry<D>>) {
        negate(residual, step);
        self.factorization.solve(step);
        work.vectors(1);
        work.add(self.factorization.solve_work());
    }
}

impl<const D: usize> Solver<D> for Newton<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        if at.iteration == 0 {
            self.analyse(at.matrix);
        }
        self.descend(&mut at, step);
        1
    }

    fn follow_friction(&mut self, problem: &Problem, work: &mut Work, step: &mut [Entry<D>]) -> usize {
        self.friction.correct(problem, &self.factorization, work, step)
    }
}
