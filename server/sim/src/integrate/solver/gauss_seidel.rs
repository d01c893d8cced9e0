//! Gauss-Seidel (talk, "Gauss Seidel": "squad #0 tells squad #1 it's results"): bodies are solved one after another, in
//! elimination order, with the newest values of the others.
//!
//! Exactly: [`sor`](super::sor) with a relaxation of 1.

use super::super::block::Entry;
use super::sor::Sor;
use super::{Solver, Standpoint};

/// The method's memory.
#[derive(Default)]
pub(super) struct GaussSeidel<const D: usize> {
    sweeps: Sor<D>,
}

impl<const D: usize> Solver<D> for GaussSeidel<D> {
    fn direction(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        self.sweeps.sweep(at, 1.0, step)
    }
}
