//! Truncated Newton, the Cel Damage solver: linearise at the guess, almost solve the linear system by preconditioned
//! conjugate gradients, then walk along the answer with a non-linear line search.

use super::block::Entry;
use super::conjugate_gradient::ConjugateGradient;
use super::line_search;
use super::matrix::Matrix;
use super::preconditioner::{IncompleteFactorization, Preconditioner};
use super::problem::{Guess, Problem};
use super::vector::{add_scaled, inner};
use crate::settings::SolverSettings;

/// What solving an island took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NewtonInfo {
    pub newton_iterations: usize,
    pub linear_iterations: usize,
    pub evaluations: usize,
    /// Largest residual of a body at the end, m/s.
    pub residual: f64,
    pub converged: bool,
}

/// Truncated Newton with its memory; D is 3 where no body of the island rotates, else 6.
#[derive(Default)]
pub(crate) struct Newton<const D: usize> {
    u: Vec<Entry<D>>,
    start: Vec<Entry<D>>,
    residual: Vec<Entry<D>>,
    step: Vec<Entry<D>>,
    matrix: Matrix<D>,
    preconditioner: IncompleteFactorization<D>,
    linear: ConjugateGradient<D>,
}

impl<const D: usize> Newton<D> {
    /// Moves `problem`'s trial to the end of the tick.
    pub fn solve(&mut self, problem: &mut Problem, settings: &SolverSettings) -> NewtonInfo {
        let mut info = NewtonInfo { evaluations: self.guess(problem), ..NewtonInfo::default() };
        loop {
            problem.relinearise();
            problem.evaluate(&mut self.residual);
            info.evaluations += 1;
            info.residual = problem.residual_speed(&self.residual);
            info.converged = info.residual <= settings.tolerance;
            if !info.residual.is_finite() {
                return self.retreat(problem, info);
            }
            if info.converged || info.newton_iterations == settings.newton_iterations {
                return info;
            }
            if info.newton_iterations == 0 {
                self.matrix.analyse(problem);
            }
            self.matrix.assemble(problem);
            self.preconditioner.prepare(&self.matrix);
            let Self { matrix, preconditioner, residual, step, .. } = self;
            info.linear_iterations += self.linear.solve(matrix, preconditioner, residual, settings.forcing, step);
            info.newton_iterations += 1;
            problem.propose(&self.step);
            info.evaluations += self.walk(problem);
        }
    }

    /// Starts at the cheapest, in incremental potential, of: the motion without potentials, last tick's motion, rest, and
    /// last tick's impulses once more. Answers the evaluations.
    fn guess(&mut self, problem: &mut Problem) -> usize {
        let mut least = f64::NAN;
        for guess in Guess::ALL {
            problem.guess(guess, &mut self.start);
            problem.move_to(&self.start);
            let energy = problem.evaluate(&mut self.residual);
            if guess == Guess::ALL[0] || energy < least {
                least = energy;
                std::mem::swap(&mut self.u, &mut self.start);
            }
        }
        problem.move_to(&self.u);
        Guess::ALL.len()
    }

    /// Back to where the last step began: one body's overflow must not spread over its island.
    fn retreat(&mut self, problem: &mut Problem, info: NewtonInfo) -> NewtonInfo {
        if info.newton_iterations > 0 {
            problem.move_to(&self.start);
        }
        NewtonInfo { residual: f64::INFINITY, ..info }
    }

    /// Walks along the step; leaves `u` and the trial where it ends. Answers the evaluations.
    fn walk(&mut self, problem: &mut Problem) -> usize {
        let Self { u, start, residual, step, .. } = self;
        start.clone_from(u);
        let slope = inner(residual, step);
        let (_, evaluations) = line_search::search(slope, |alpha| {
            u.clone_from(start);
            add_scaled(u, alpha, step);
            problem.move_to(u);
            problem.evaluate(residual);
            inner(residual, step)
        });
        evaluations
    }
}
