//! Truncated Newton (talk, "Truncated Newton" and "The Cel Damage Solver"): "almost, but not quite" solve the Newton
//! system, by preconditioned conjugate gradients capped at 6 + 2 √N iterations.

use super::super::block::Entry;
use super::super::conjugate_gradient::ConjugateGradient;
use super::super::preconditioner::{ApproximateInverse, Selected};
use super::method::Preconditioner;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct TruncatedNewton<const D: usize> {
    preconditioner: Selected<D>,
    linear: ConjugateGradient<D>,
}

impl<const D: usize> TruncatedNewton<D> {
    /// Almost solves with the matrix as it is assembled, with a preconditioner of `kind`.
    pub fn solve(&mut self, mut at: Standpoint<D>, kind: Preconditioner, step: &mut Vec<Entry<D>>) -> usize {
        if at.iteration == 0 {
            self.preconditioner.select(kind, at.settings.relaxation);
            self.preconditioner.analyse(at.matrix);
        }
        let iterations = self.try_to_solve(&mut at, step);
        if self.linear.met_negative_curvature() && at.assemble_definite() {
            return iterations + self.try_to_solve(&mut at, step);
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
        let kind = at.settings.preconditioner;
        self.solve(at, kind, step)
    }
}
