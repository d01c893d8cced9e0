//! Non-linear conjugate gradients (talk, "The Conjugate Gradient Method": "the method that I used for Cel Damage Xbox").
//!
//! Exactly: Polak-Ribière+, d ← −z + max(0, β) d with β = z·(R − R_last) / z_last·R_last and z = P R. P is the
//! settings' preconditioner for the Hessian at hand, and the inverse mass where that is `none`, which needs no Hessian.
//! It restarts along −z where d leads uphill, where β is negative, and after as many iterations as there are unknowns.

use super::super::block::Entry;
use super::super::line_search::Walk;
use super::super::preconditioner::{ApproximateInverse, Selected};
use super::super::vector::{add_scaled, inner, scale};
use super::method::Preconditioner;
use super::step_length::StepLength;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct NonlinearConjugateGradient<const D: usize> {
    preconditioner: Selected<D>,
    preconditioned: Vec<Entry<D>>,
    direction: Vec<Entry<D>>,
    last_residual: Vec<Entry<D>>,
    /// R·z of the last iteration.
    last_rho: f64,
    since_restart: usize,
    length: StepLength,
}

impl<const D: usize> NonlinearConjugateGradient<D> {
    /// z = P R.
    fn precondition(&mut self, at: &mut Standpoint<D>) {
        let kind = at.settings.preconditioner;
        if kind == Preconditioner::None {
            at.problem.divide_by_mass(at.residual, &mut self.preconditioned);
            at.work.divided_by_mass();
            return;
        }
        at.assemble();
        if at.iteration == 0 {
            self.preconditioner.select(kind, at.settings.relaxation);
            self.preconditioner.analyse(at.matrix);
        }
        at.work.add(self.preconditioner.prepare(at.matrix));
        self.preconditioned.clear();
        self.preconditioned.extend_from_slice(at.residual);
        self.preconditioner.apply(at.matrix, &mut self.preconditioned);
        at.work.add(self.preconditioner.apply_work(at.matrix));
    }

    /// d ← −z + β d; answers the slope along it.
    fn turn(&mut self, residual: &[Entry<D>], beta: f64) -> f64 {
        self.since_restart = if beta > 0.0 { self.since_restart + 1 } else { 0 };
        self.direction.resize(residual.len(), [0.0; D]);
        scale(&mut self.direction, beta);
        add_scaled(&mut self.direction, -1.0, &self.preconditioned);
        inner(residual, &self.direction)
    }
}

impl<const D: usize> Solver<D> for NonlinearConjugateGradient<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        self.precondition(&mut at);
        let rho = inner(at.residual, &self.preconditioned);
        let may_conjugate = at.iteration > 0 && self.since_restart < D * at.residual.len();
        let beta = if may_conjugate {
            ((rho - inner(&self.last_residual, &self.preconditioned)) / self.last_rho).max(0.0)
        } else {
            self.direction.clear();
            0.0
        };
        let mut slope = self.turn(at.residual, beta);
        let descends = slope < 0.0;
        if !descends {
            slope = self.turn(at.residual, 0.0);
        }
        self.last_residual.clear();
        self.last_residual.extend_from_slice(at.residual);
        self.last_rho = rho;
        step.clone_from(&self.direction);
        scale(step, self.length.next(at.iteration, slope));
        at.work.vectors(8);
        0
    }

    fn walked(&mut self, alpha: f64, _step: &[Entry<D>], _residual: &[Entry<D>]) {
        self.length.walked(alpha);
    }

    fn walk(&self) -> Walk {
        Walk::CONJUGATE
    }
}
