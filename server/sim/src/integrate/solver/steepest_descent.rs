//! Steepest descent (talk, three slides): "the search direction that we choose is simply the residual".
//!
//! Exactly: s = −M⁻¹ R, the steepest descent of the incremental potential in the metric of kinetic energy. The residual
//! itself is a momentum: as a direction it would have kilograms turn heavy bodies faster than light ones. The length
//! of a step is not given: it starts from what the last one came to.

use super::super::block::Entry;
use super::super::line_search::Walk;
use super::super::vector::{inner, scale};
use super::step_length::StepLength;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct SteepestDescent<const D: usize> {
    length: StepLength,
}

impl<const D: usize> Solver<D> for SteepestDescent<D> {
    fn direction(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.problem.divide_by_mass(at.residual, step);
        let slope = -inner(at.residual, step);
        scale(step, -self.length.next(at.iteration, slope));
        at.work.divided_by_mass();
        at.work.vectors(2);
        0
    }

    fn walked(&mut self, alpha: f64, _step: &[Entry<D>], _residual: &[Entry<D>]) {
        self.length.walked(alpha);
    }

    fn walk(&self) -> Walk {
        Walk::GRADIENT
    }
}
