//! Quasi-Newton (talk, "Quasi Newton (QN)": it "builds an approximation of the Hessian (or the inverse Hessian) as it
//! searches").
//!
//! Exactly: L-BFGS with the last [`MEMORY`] steps, by the two-loop recursion, from γ M⁻¹ with γ = s·y / y·M⁻¹y of the
//! newest step (Nocedal and Wright, "Numerical Optimization", 7.4). Steps along which the residual did not grow are
//! not taken up, so that the approximation stays positive definite.

use super::super::block::Entry;
use super::super::line_search::Walk;
use super::super::vector::{add_scaled, inner, scale};
use super::{Solver, Standpoint};

/// Steps that are remembered. More bring little: the potentials' transitions make old ones wrong.
const MEMORY: usize = 10;

/// Least s·y / √(s·s y·y): a step below it tells nothing but rounding.
const LEAST_COSINE: f64 = 1e-8;

/// A remembered step.
#[derive(Default)]
struct Pair<const D: usize> {
    /// The change of the unknowns.
    s: Vec<Entry<D>>,
    /// The change of the residual.
    y: Vec<Entry<D>>,
    /// 1 / s·y.
    rho: f64,
    /// Of the two loops.
    alpha: f64,
}

/// The method's memory.
#[derive(Default)]
pub(super) struct QuasiNewton<const D: usize> {
    /// The newest is first; `known` of them are filled.
    pairs: [Pair<D>; MEMORY],
    known: usize,
    before: Vec<Entry<D>>,
    scratch: Vec<Entry<D>>,
}

impl<const D: usize> QuasiNewton<D> {
    /// step ← −H R, H the approximate inverse Hessian.
    fn apply(&mut self, at: &Standpoint<D>, step: &mut Vec<Entry<D>>) {
        self.scratch.clear();
        self.scratch.extend_from_slice(at.residual);
        let known = &mut self.pairs[..self.known];
        for pair in known.iter_mut() {
            pair.alpha = pair.rho * inner(&pair.s, &self.scratch);
            add_scaled(&mut self.scratch, -pair.alpha, &pair.y);
        }
        at.problem.divide_by_mass(&self.scratch, step);
        if let Some(Pair { y, rho, .. }) = known.first() {
            at.problem.divide_by_mass(y, &mut self.scratch);
            scale(step, (rho * inner(y, &self.scratch)).recip());
        }
        for pair in known.iter().rev() {
            let beta = pair.rho * inner(&pair.y, step);
            add_scaled(step, pair.alpha - beta, &pair.s);
        }
        scale(step, -1.0);
    }
}

impl<const D: usize> Solver<D> for QuasiNewton<D> {
    fn direction(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        if at.iteration == 0 {
            self.known = 0;
        }
        self.apply(&at, step);
        self.before.clear();
        self.before.extend_from_slice(at.residual);
        at.work.vectors(4 * self.known as u64 + 8);
        at.work.divided_by_mass();
        at.work.divided_by_mass();
        0
    }

    fn walked(&mut self, alpha: f64, step: &[Entry<D>], residual: &[Entry<D>]) {
        self.pairs.rotate_right(1);
        let Pair { s, y, rho, .. } = &mut self.pairs[0];
        s.clear();
        s.extend_from_slice(step);
        scale(s, alpha);
        y.clear();
        y.extend_from_slice(residual);
        add_scaled(y, -1.0, &self.before);
        let curvature = inner(s, y);
        let tells = curvature > LEAST_COSINE * (inner(s, s) * inner(y, y)).sqrt();
        if tells && curvature.recip().is_finite() {
            *rho = curvature.recip();
            self.known = (self.known + 1).min(MEMORY);
        } else {
            self.pairs.rotate_left(1);
        }
    }

    fn walk(&self) -> Walk {
        Walk::GRADIENT
    }
}
