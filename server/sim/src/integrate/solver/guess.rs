//! The starting guess.

use super::super::block::Entry;
use super::super::problem::{Guess, Problem};
use super::work::Work;
use crate::settings::SolverSettings;

/// Moves `u` and the trial to the first guess if it is within the tolerance as it is, else to the cheapest in
/// incremental potential. `scratch` and `residual` are memory.
pub(super) fn guess<const D: usize>(
    problem: &mut Problem,
    settings: &SolverSettings,
    work: &mut Work,
    u: &mut Vec<Entry<D>>,
    scratch: &mut Vec<Entry<D>>,
    residual: &mut Vec<Entry<D>>,
) {
    let mut least = f64::NAN;
    for (i, guess) in Guess::ALL.into_iter().enumerate() {
        problem.guess(guess, scratch);
        problem.move_to(scratch);
        let energy = problem.evaluate(residual);
        work.moved_and_evaluated();
        if energy < least || least.is_nan() {
            least = energy;
            std::mem::swap(u, scratch);
        }
        if i == 0 && problem.residual_speed(residual) <= settings.tolerance * problem.dt {
            return;
        }
    }
    problem.move_to(u);
    work.moved();
}
