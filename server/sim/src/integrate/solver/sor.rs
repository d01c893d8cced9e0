//! Successive over-relaxation (talk, "Successive Over Relaxation": "finicky but effective for certain problems").
//!
//! Exactly: Newton-SOR. Each iteration takes `sweeps` sweeps of block SOR for the Newton system H s = −R, from s = 0,
//! and walks along s with the line search. A body's new value is the old one, moved by `relaxation` times what would
//! solve its own block of equations with the newest values of the others. On a positive definite H every sweep makes
//! the quadratic model smaller as long as the relaxation is between 0 and 2, so s leads downhill.

use super::super::block::{Entry, multiply_sub, transposed_multiply_sub};
use super::super::preconditioner::{ApproximateInverse, BlockJacobi};
use super::super::vector::negate;
use super::work::block;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct Sor<const D: usize> {
    blocks: BlockJacobi<D>,
    /// −R less what bodies later in the order contribute.
    right: Vec<Entry<D>>,
}

impl<const D: usize> Sor<D> {
    /// The direction after the settings' number of sweeps with `relaxation`.
    pub fn sweep(&mut self, mut at: Standpoint<D>, relaxation: f64, step: &mut Vec<Entry<D>>) -> usize {
        at.assemble();
        let a = at.matrix;
        at.work.add(self.blocks.prepare(a));
        step.clear();
        step.resize(at.residual.len(), [0.0; D]);
        for _ in 0..at.settings.sweeps {
            negate(at.residual, &mut self.right);
            for (i, x) in step.iter().enumerate() {
                for k in a.row(i) {
                    transposed_multiply_sub(&a.lower[k], x, &mut self.right[a.columns[k] as usize]);
                }
            }
            for i in 0..step.len() {
                let mut entry = self.right[i];
                for k in a.row(i) {
                    multiply_sub(&a.lower[k], &step[a.columns[k] as usize], &mut entry);
                }
                self.blocks.solve_body(i, &mut entry);
                for (x, solved) in step[i].iter_mut().zip(entry) {
                    *x += relaxation * (solved - *x);
                }
            }
            at.work.vectors(2);
            at.work.add((a.diagonal.len() + 2 * a.lower.len()) as u64 * block(D));
        }
        at.settings.sweeps
    }
}

impl<const D: usize> Solver<D> for Sor<D> {
    fn direction(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        let relaxation = at.settings.relaxation;
        self.sweep(at, relaxation, step)
    }
}
