//! Work: what a solve has done, counted instead of timed, so that it is the same on every machine and in every run.
//!
//! The unit is a *block operation*: a 3×3 block times a vector, 9 multiply-adds. Counted are, D being 3 or 6:
//!
//! | what | multiply-adds |
//! |-|-|
//! | a D×D block times an entry of a vector, or a triangular solve of both halves | D² |
//! | a D×D block times another; half of it where the product is symmetric or the other is triangular | D³ |
//! | the Cholesky factor of a D×D block | D³/6 |
//! | a vector added, scaled, copied or multiplied with another | D an entry |
//! | poses, momenta: each block of unknowns in each pass | D² |
//! | energy, gradient, linearisation, proposed step: each entry that a potential touches, in each pass | D² |
//! | assembly: each block that a potential adds to, and each diagonal block | D² |
//!
//! The last three are not block products, but about as dear; patterns and symbolic factorisations are whole-number work
//! and not counted.

use super::super::figures::Figures;
use super::super::problem::{Problem, Visitor};
use crate::potential::{FIXED, FrameIndex, Term};

/// Multiply-adds of a block operation.
const UNIT: u64 = 9;

/// A meter of work, and what may be spent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    multiply_adds: u64,
    limit: u64,
    evaluations: usize,
    /// Multiply-adds of the last iteration.
    iteration: u64,
    costs: Costs,
}

/// What passes over an island's problem cost, in multiply-adds.
#[derive(Clone, Copy, Debug, Default)]
struct Costs {
    bodies: u64,
    potentials: u64,
    assembly: u64,
    vector: u64,
}

impl Work {
    /// Starts at zero, with `budget` block operations to be spent on `problem`.
    pub fn begin<const D: usize>(problem: &mut Problem, budget: Option<u64>) -> Self {
        let n = problem.len() as u64;
        let Problem { terms, figures, .. } = problem;
        let mut touched = Touched::by_figures(figures);
        terms.visit(&mut TouchedByTerms { bodies: n as usize, figures, touched: &mut touched });
        let costs = Costs {
            bodies: n * block(D),
            potentials: touched.entries * block(D),
            assembly: (n + touched.blocks) * block(D),
            vector: n * D as u64,
        };
        Self { limit: budget.map_or(u64::MAX, |budget| budget.saturating_mul(UNIT)), costs, ..Self::default() }
    }

    /// Starts at zero, with nothing known and all that is wanted.
    #[cfg(test)]
    pub fn unlimited() -> Self {
        Self { limit: u64::MAX, ..Self::default() }
    }

    /// Block operations so far.
    pub fn spent(&self) -> u64 {
        self.multiply_adds / UNIT
    }

    /// Evaluations of the residual so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Multiply-adds so far.
    pub fn multiply_adds(&self) -> u64 {
        self.multiply_adds
    }

    /// Whether `multiply_adds` more would exceed the budget.
    pub fn affords(&self, multiply_adds: u64) -> bool {
        self.multiply_adds.saturating_add(multiply_adds) <= self.limit
    }

    /// Whether the budget allows for one more iteration like the last.
    pub fn affords_iteration(&self) -> bool {
        self.affords(self.iteration.max(1))
    }

    /// An iteration took this.
    pub fn iteration_took(&mut self, multiply_adds: u64) {
        self.iteration = multiply_adds;
    }

    /// The trial was moved.
    pub fn moved(&mut self) {
        self.multiply_adds += self.costs.bodies;
    }

    /// A vector was multiplied with masses or inverse masses.
    pub fn divided_by_mass(&mut self) {
        self.multiply_adds += self.costs.bodies;
    }

    /// The trial was moved and the residual evaluated there.
    pub fn moved_and_evaluated(&mut self) {
        self.moved();
        self.evaluated();
    }

    /// Multiply-adds of the derivative of an evaluation along a vector: every number is two.
    pub fn derivative_work(&self) -> u64 {
        2 * (self.costs.bodies + self.costs.potentials)
    }

    /// The residual was evaluated.
    pub fn evaluated(&mut self) {
        self.evaluations += 1;
        self.multiply_adds += self.costs.bodies + self.costs.potentials;
    }

    /// All potentials were told something.
    pub fn told_potentials(&mut self) {
        self.multiply_adds += self.costs.potentials;
    }

    /// The matrix was assembled.
    pub fn assembled(&mut self) {
        self.multiply_adds += self.costs.assembly;
    }

    /// `passes` operations on whole vectors.
    pub fn vectors(&mut self, passes: u64) {
        self.multiply_adds += passes * self.costs.vector;
    }

    /// Multiply-adds that were counted elsewhere.
    pub fn add(&mut self, multiply_adds: u64) {
        self.multiply_adds += multiply_adds;
    }
}

/// Multiply-adds of a D×D block times an entry of a vector.
pub(crate) const fn block(d: usize) -> u64 {
    (d * d) as u64
}

/// Multiply-adds of a D×D block times another.
pub(crate) const fn block_product(d: usize) -> u64 {
    (d * d * d) as u64
}

/// Entries of vectors and blocks of the matrix that potentials touch, summed over potentials.
#[derive(Default)]
struct Touched {
    entries: u64,
    blocks: u64,
}

impl Touched {
    /// By the figures' own potentials and by what couples their blocks.
    fn by_figures(figures: &Figures) -> Self {
        let mut touched = Self::default();
        figures.couplings(&mut |_, _| {
            touched.entries += 1;
            touched.blocks += 1;
        });
        touched
    }

    fn add(&mut self, entries: u64) {
        self.entries += entries;
        self.blocks += entries * (entries + 1) / 2;
    }
}

struct TouchedByTerms<'a> {
    bodies: usize,
    figures: &'a Figures,
    touched: &'a mut Touched,
}

impl TouchedByTerms<'_> {
    /// Entries that move a frame.
    fn movers(&self, frame: FrameIndex) -> u64 {
        match (frame as usize).checked_sub(self.bodies) {
            None => 1,
            Some(_) if frame == FIXED => 0,
            Some(attachment) => self.figures.influences(attachment).len() as u64,
        }
    }
}

impl Visitor for TouchedByTerms<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let [a, b] = term.frames().map(|frame| self.movers(frame));
            self.touched.add(a + b);
        }
    }
}
