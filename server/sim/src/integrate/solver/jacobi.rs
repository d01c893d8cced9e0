//! Jacobi iterations (talk, "Jacobi Iterations"): "divide and conquer", every body solves its own equations as if the
//! others stayed where they are.
//!
//! Exactly: one iteration of block Jacobi for the Newton system, s = −B⁻¹ R with B the diagonal blocks of the Hessian,
//! then the line search, without which it diverges as soon as bodies share a stiff potential. A second sweep on the
//! same system would not do: with an even number of them s can lead uphill.

use super::super::block::Entry;
use super::super::preconditioner::{ApproximateInverse, BlockJacobi};
use super::super::vector::negate;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct Jacobi<const D: usize> {
    blocks: BlockJacobi<D>,
}

impl<const D: usize> Solver<D> for Jacobi<D> {
    fn direction(&mut self, mut at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        at.work.add(self.blocks.prepare(at.matrix));
        negate(at.residual, step);
        self.blocks.apply(at.matrix, step);
        at.work.vectors(1);
        at.work.add(self.blocks.apply_work(at.matrix));
        1
    }
}
