//! The Cel Damage solver as the talk has it: truncated Newton whose Hessian is a procedure. Automatic differentiation
//! along a vector answers the product with it; the assembled matrix serves the preconditioner alone.
//!
//! The products are those of the true Hessian, which can be indefinite, where the assembled one is made definite term by
//! term.

use super::super::block::Entry;
use super::super::conjugate_gradient::{ConjugateGradient, Operator};
use super::super::matrix::Matrix;
use super::super::preconditioner::{ApproximateInverse, Selected};
use super::super::problem::Problem;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct CelDamage<const D: usize> {
    preconditioner: Selected<D>,
    linear: ConjugateGradient<D>,
}

/// The Hessian at the problem's candidate.
struct Procedure<'a, const D: usize> {
    problem: &'a mut Problem,
    matrix: &'a Matrix<D>,
    product_work: u64,
}

impl<const D: usize> Operator<D> for Procedure<'_, D> {
    fn product(&mut self, x: &[Entry<D>], y: &mut Vec<Entry<D>>) {
        self.problem.hessian_product(x, y);
    }

    fn product_work(&self) -> u64 {
        self.product_work
    }

    fn matrix(&self) -> &Matrix<D> {
        self.matrix
    }
}

impl<const D: usize> Solver<D> for CelDamage<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        if at.iteration == 0 {
            self.preconditioner.select(at.settings.preconditioner, at.settings.relaxation);
            self.preconditioner.analyse(at.matrix);
        }
        at.work.add(self.preconditioner.prepare(at.matrix));
        let product_work = at.work.derivative_work();
        let mut hessian = Procedure { problem: at.problem, matrix: at.matrix, product_work };
        self.linear.solve(&mut hessian, &self.preconditioner, at.residual, at.settings.forcing, at.work, step)
    }
}
