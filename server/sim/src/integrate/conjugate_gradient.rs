//! Linear preconditioned conjugate gradients, truncated: "almost, but not quite" solves a Newton iteration (talk, "The
//! Cel Damage Solver": capped at 6 + 2 √N iterations).

use super::block::Entry;
use super::system::{System, inner};

/// Vectors of the method, kept from call to call.
#[derive(Default)]
pub(super) struct ConjugateGradient<const D: usize> {
    residual: Vec<Entry<D>>,
    preconditioned: Vec<Entry<D>>,
    direction: Vec<Entry<D>>,
    product: Vec<Entry<D>>,
}

impl<const D: usize> ConjugateGradient<D> {
    /// Solves A x = −g until the preconditioned residual has shrunk to `forcing`, or to the cap. Answers the number of
    /// iterations. `x` is a direction of descent, or zero where A is not positive definite along the first direction.
    pub fn solve(&mut self, a: &System<D>, g: &[Entry<D>], forcing: f64, x: &mut Vec<Entry<D>>) -> usize {
        let cap = iteration_cap(D * g.len());
        x.clear();
        x.resize(g.len(), [0.0; D]);
        self.residual.clear();
        self.residual.extend(g.iter().map(|entry| entry.map(|v| -v)));
        self.preconditioned.clone_from(&self.residual);
        a.precondition(&mut self.preconditioned);
        self.direction.clone_from(&self.preconditioned);
        self.product.resize(g.len(), [0.0; D]);
        let mut rho = inner(&self.residual, &self.preconditioned);
        let goal = forcing * forcing * rho;
        for iteration in 1..=cap {
            a.multiply(&self.direction, &mut self.product);
            let curvature = inner(&self.direction, &self.product);
            let convex = curvature > 0.0;
            if !convex {
                return iteration;
            }
            let alpha = rho / curvature;
            add_scaled(x, alpha, &self.direction);
            add_scaled(&mut self.residual, -alpha, &self.product);
            self.preconditioned.clone_from(&self.residual);
            a.precondition(&mut self.preconditioned);
            let next = inner(&self.residual, &self.preconditioned);
            let unsolved = next > goal;
            if !unsolved {
                return iteration;
            }
            let beta = next / rho;
            rho = next;
            for (d, z) in self.direction.iter_mut().zip(&self.preconditioned) {
                for (d, z) in d.iter_mut().zip(z) {
                    *d = z + beta * *d;
                }
            }
        }
        cap
    }
}

/// The talk's cap on iterations for N unknowns: 6 + 2 √N.
fn iteration_cap(unknowns: usize) -> usize {
    6 + (2.0 * (unknowns as f64).sqrt()) as usize
}

/// y += a x.
pub(super) fn add_scaled<const D: usize>(y: &mut [Entry<D>], a: f64, x: &[Entry<D>]) {
    for (y, x) in y.iter_mut().zip(x) {
        for (y, x) in y.iter_mut().zip(x) {
            *y += a * x;
        }
    }
}
