//! Truncated Newton (talk, "Truncated Newton" and "The Cel Damage Solver"): "almost, but not quite" solve the Newton
//! system, by preconditioned conjugate gradients capped at 6 + 2 √N iterations.

use super::super::block::Entry;
use super::super::conjugate_gradient::ConjugateGradient;
use super::super::matrix::Matrix;
use super::super::preconditioner::{ApproximateInverse, Selected};
use super::method::Preconditioner;
use super::{Solver, Standpoint};
use crate::settings::SolverSettings;

/// The method's memory.
#[derive(Default)]
pub(super) struct TruncatedNewton<const D: usize> {
    preconditioner: Selected<D>,
    linear: ConjugateGradient<D>,
}

impl<const D: usize> TruncatedNewton<D> {
    /// Takes a preconditioner of `kind`, and what that needs from the matrix' pattern.
    pub fn analyse(&mut self, a: &Matrix<D>, kind: Preconditioner, settings: &SolverSettings) {
        self.preconditioner.select(kind, settings.relaxation);
        self.preconditioner.analyse(a);
    }

    /// Almost solves with the matrix as it is assembled; with a definite one if it is not.
    pub fn descend(&mut self, at: &mut Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        let iterations = self.try_to_solve(at, step);
        if self.linear.met_negative_curvature() && at.assemble_definite() {
            return iterations + self.try_to_solve(at, step);
        }
        iterations
    }

    fn try_to_solve(&mut self, at: &mut Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.work.add(self.preconditioner.prepare(at.matrix));
        self.linear.solve(&mut &*at.matrix, &self.preconditioner, at.residual, at.settings.forcing, at.work, step)
    }
}

impl<const D: usize> Solver<D> for TruncatedNewton<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        if at.iteration == 0 {
            self.analyse(at.matrix, at.settings.preconditioner, at.settings);
        }
        self.descend(&mut at, step)
    }
}
