//! What the Newton matrix leaves out because it is not symmetric: friction changes with the normal force.
//!
//! The matrix H holds friction's limit, µ × normal force, fixed during an iteration. Where a body slides on what it leans
//! on, the two then chase each other, and the residual shrinks by a tenth to a third an iteration. With the missing part C
//! the step is −(H + C)⁻¹ R = (1 + H⁻¹ C)⁻¹ s, s = −H⁻¹ R being the symmetric step. C has the rank of the contacts that
//! slide, so GMRES ends after as many iterations as those are, each one solution with the factors that are there already.

use super::block::Entry;
use super::factorization::Factorization;
use super::gmres::Gmres;
use super::problem::Problem;
use super::solver::work::Work;
use super::vector::add_scaled;
use crate::potential::contact::Slide;

/// GMRES stops when the residual has shrunk to this fraction; the tangent itself is good for no more.
const FORCING: f64 = 0.05;

/// Makes steps that know how friction follows the load.
#[derive(Default)]
pub(super) struct FrictionTangent<const D: usize> {
    slides: Vec<Slide>,
    gmres: Gmres<D>,
}

impl<const D: usize> FrictionTangent<D> {
    /// `step` ← (1 + H⁻¹ C)⁻¹ `step`, with the factors of H, C at the candidate of `problem`. Answers the iterations that
    /// this took: none where nothing slides.
    pub fn correct(
        &mut self,
        problem: &Problem,
        factors: &Factorization<D>,
        work: &mut Work,
        step: &mut [Entry<D>],
    ) -> usize {
        let Self { slides, gmres } = self;
        slides.clear();
        let contacts = &problem.terms.contacts;
        slides.extend(contacts.iter().filter_map(|term| term.slide(problem.dt, problem.pair(term))));
        if slides.is_empty() {
            return 0;
        }
        gmres.solve(step, FORCING, |x, product| {
            problem.add_slide_product(slides, x, product);
            factors.solve(product);
            add_scaled(product, 1.0, x);
            work.add(factors.solve_work());
            work.vectors(2);
        })
    }
}
