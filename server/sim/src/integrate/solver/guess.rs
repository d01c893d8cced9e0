//! The starting guess.

use super::super::block::Entry;
use super::super::problem::Problem;
use super::work::Work;
use crate::settings::SolverSettings;

/// Share of the tolerance that a guess must be within to be taken as it is. The error of an iterate has any sign, that
/// of a repeated guess repeats: it makes what slides slide too slowly by the tolerance in every tick.
const SHARE: f64 = 0.3;

/// Largest residual with which a guess is taken as it is, m/s.
pub(super) fn good_enough(settings: &SolverSettings, dt: f64) -> f64 {
    SHARE * settings.tolerance * dt
}

/// Moves `u` and the trial to the first of the guesses that is good enough as it is, else to the cheapest in
/// incremental potential, and takes there what is frozen during an iteration. Answers the potential, J, and leaves its
/// gradient in `residual`. `scratch` is memory.
pub(super) fn guess<const D: usize>(
    problem: &mut Problem,
    settings: &SolverSettings,
    work: &mut Work,
    u: &mut Vec<Entry<D>>,
    scratch: &mut Vec<Entry<D>>,
    residual: &mut Vec<Entry<D>>,
) -> f64 {
    let mut least = f64::NAN;
    let mut is_last = true;
    for &guess in problem.guesses() {
        problem.guess(guess, scratch);
        problem.move_to(scratch);
        let energy = problem.relinearise_and_evaluate(residual);
        work.moved_and_evaluated();
        work.told_potentials();
        is_last = energy < least || least.is_nan();
        if is_last {
            least = energy;
            std::mem::swap(u, scratch);
            if problem.residual_speed(residual) <= good_enough(settings, problem.dt) {
                return least;
            }
        }
    }
    if !is_last {
        problem.move_to(u);
        least = problem.relinearise_and_evaluate(residual);
        work.moved_and_evaluated();
        work.told_potentials();
    }
    least
}
