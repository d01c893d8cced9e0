//! What all methods share: guess, ask for a direction, walk along it, until there is a reason to stop.

use super::super::block::Entry;
use super::super::line_search::{self, Walk};
use super::super::matrix::Matrix;
use super::super::problem::Problem;
use super::super::vector::{add_scaled, inner};
use super::block_descent::BlockDescent;
use super::guess::{good_enough, guess};
use super::watchdog::{Slopes, Standing, Verdict, Watchdog};
use super::work::Work;
use super::{SolveReport, Solver, Standpoint, StoppedBecause};
use crate::settings::SolverSettings;

/// A walk that changes no unknown by more than this fraction of the largest goes nowhere: some units of rounding.
const STANDSTILL: f64 = 1e-15;

/// Passes over vectors in an iteration, besides a method's own: the norm of the residual, and the slope.
const VECTORS_AN_ITERATION: u64 = 2;

/// Passes over vectors in each step of a line search: copy, add, product.
const VECTORS_A_TRIAL: u64 = 3;

/// Most times that open joints of an island are stiffened in a tick: in 6, a link of a gram comes to hold ten tonnes
/// that it meets for the first time.
const STIFFENING_ROUNDS: usize = 7;

/// First iteration that friction's tangent comes in: what slides, and which way, has to be seen before.
const FRICTION_FROM: usize = 3;

/// A step with friction's tangent is good if it shrinks the residual to this fraction.
const FRICTION_SHRINK: f64 = 0.7;

/// Residual of a guess above which block descent comes first, m/s.
const HIT: f64 = 0.1;

/// Its sweeps: Newton iterations a tick of `pile100` and `pile500` without, after one, two, three and four of them: 6.5,
/// 4.7, 4.5, 3.0, 2.7 and 14.8, 8.5, 7.1, 6.2, 6.0.
const SWEEPS: usize = 3;

/// The state of a solve, kept from solve to solve for its memory.
#[derive(Default)]
pub(super) struct Descent<const D: usize> {
    u: Vec<Entry<D>>,
    /// Where the last walk began; scratch of the guess before.
    start: Vec<Entry<D>>,
    residual: Vec<Entry<D>>,
    step: Vec<Entry<D>>,
    /// The step as it was before friction came into it.
    symmetric_step: Vec<Entry<D>>,
    /// Friction's tangent comes in at this iteration; later each time that it was of no use.
    friction_from: usize,
    friction_failures: usize,
    /// Something in the island holds things on arcs.
    bends: bool,
    best: Best<D>,
    watchdog: Watchdog<D>,
    blocks: BlockDescent<D>,
    matrix: Matrix<D>,
}

/// Merits that differ by less than this share of what has been gained since the start are alike, and the residual
/// decides: friction's limits, which every iteration takes anew, move the merit too.
const ALIKE: f64 = 0.01;

/// When to stop.
#[derive(Clone, Copy)]
struct Goal {
    /// m/s.
    residual: f64,
    /// The same of a guess, m/s.
    guess: f64,
    /// Most iterations.
    iterations: usize,
}

/// The best state so far.
#[derive(Default)]
struct Best<const D: usize> {
    u: Vec<Entry<D>>,
    /// J.
    merit: f64,
    /// m/s.
    residual: f64,
    /// Merit of the start, J.
    first_merit: f64,
}

impl<const D: usize> Best<D> {
    fn forget(&mut self) {
        (self.merit, self.residual, self.first_merit) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    }

    /// Takes the state if it is better.
    fn offer(&mut self, u: &[Entry<D>], merit: f64, residual: f64) {
        if !self.merit.is_finite() {
            self.first_merit = merit;
        }
        let slack = ALIKE * (self.first_merit - self.merit.min(merit)).max(0.0);
        let better = merit < self.merit - slack || merit <= self.merit + slack && residual < self.residual;
        if better && residual.is_finite() {
            self.u.clear();
            self.u.extend_from_slice(u);
            (self.merit, self.residual) = (merit, residual);
        }
    }
}

impl SolveReport {
    fn standing(&self) -> Standing {
        Standing { merit: self.merit, residual: self.residual }
    }
}

impl<const D: usize> Descent<D> {
    /// Moves `problem`'s trial to the end of the tick by the method's directions. `budget` is exceeded by one iteration
    /// at most, and by what the start takes.
    pub fn solve(
        &mut self,
        method: &mut dyn Solver<D>,
        problem: &mut Problem,
        settings: &SolverSettings,
        budget: Option<u64>,
    ) -> SolveReport {
        let mut work = Work::begin::<D>(problem, budget);
        let merit = guess(problem, settings, &mut work, &mut self.u, &mut self.start, &mut self.residual);
        let mut report = SolveReport { merit, ..SolveReport::default() };
        self.best.forget();
        if method.starts_by_blocks() {
            self.start_by_blocks(problem, &mut work, &mut report);
        }
        self.bends = method.walk() == Walk::NEWTON && problem.bends();
        self.watchdog.begin(self.bends);
        (self.friction_from, self.friction_failures) = (FRICTION_FROM, 0);
        let (residual, guess) = (settings.tolerance * problem.dt, good_enough(settings, problem.dt));
        let mut goal = Goal { residual, guess, iterations: settings.iterations() };
        let mut rounds = 0;
        loop {
            self.stand(problem, &mut work, &mut report);
            if self.watchdog.judge(report.standing()) == Verdict::GoBack {
                report.merit = self.walk_again(problem, &mut work);
                self.stand(problem, &mut work, &mut report);
            }
            if let Some(reason) = self.reason_to_stop(goal, &work, &report) {
                let solved = reason == StoppedBecause::Tolerance;
                if solved && rounds < STIFFENING_ROUNDS && problem.stiffen() {
                    goal.iterations = report.iterations + settings.iterations();
                    rounds += 1;
                    self.best.forget();
                    report.merit = self.relinearise(problem, &mut work);
                    continue;
                }
                report.stopped_because = reason;
                break;
            }
            let before = work.multiply_adds();
            let iteration = report.iterations;
            let Self { u, residual, matrix, step, .. } = self;
            let at = Standpoint { problem, u, residual, matrix, settings, work: &mut work, iteration };
            report.linear_iterations += method.direction(at, step);
            report.iterations += 1;
            let walked = self.follow_friction(method, problem, &mut work, &mut report);
            let walked = walked.or_else(|| self.walk(method, problem, &mut work, report.standing(), goal));
            work.iteration_took(work.multiply_adds() - before);
            match walked {
                Some(merit) => report.merit = merit,
                None => {
                    report.stopped_because = StoppedBecause::Stagnation;
                    break;
                }
            }
        }
        self.return_to_best(problem, &mut work, &mut report);
        SolveReport { evaluations: work.evaluations(), work: work.spent(), ..report }
    }

    /// Sweeps over the bodies where the guess is far off.
    fn start_by_blocks(&mut self, problem: &mut Problem, work: &mut Work, report: &mut SolveReport) {
        self.stand(problem, work, report);
        if report.residual <= HIT || !report.residual.is_finite() || !self.blocks.begin(problem) {
            return;
        }
        for _ in 0..SWEEPS {
            if work.affords(self.blocks.expected_work()) {
                self.blocks.sweep(problem, &mut self.u, work);
            }
        }
        problem.move_to(&self.u);
        work.moved();
        report.merit = self.relinearise(problem, work);
    }

    /// Takes anew what is frozen during an iteration, and evaluates. Answers the incremental potential, J.
    fn relinearise(&mut self, problem: &mut Problem, work: &mut Work) -> f64 {
        work.told_potentials();
        work.evaluated();
        problem.relinearise_and_evaluate(&mut self.residual)
    }

    /// Sees how good the state is.
    fn stand(&mut self, problem: &Problem, work: &mut Work, report: &mut SolveReport) {
        report.residual = problem.residual_speed(&self.residual);
        work.vectors(VECTORS_AN_ITERATION);
        self.best.offer(&self.u, report.merit, report.residual);
    }

    fn reason_to_stop(&self, goal: Goal, work: &Work, report: &SolveReport) -> Option<StoppedBecause> {
        if !report.residual.is_finite() {
            return Some(StoppedBecause::NonFinite);
        }
        let wanted = if report.iterations == 0 { goal.guess } else { goal.residual };
        if report.residual <= wanted {
            return Some(StoppedBecause::Tolerance);
        }
        if report.iterations >= goal.iterations {
            return Some(StoppedBecause::IterationLimit);
        }
        (!work.affords_iteration()).then_some(StoppedBecause::Budget)
    }

    /// Tries the step that knows how friction follows the load. Answers the incremental potential where it ends, J, or
    /// nothing where the residual does not shrink: then all is as it was.
    ///
    /// Where something bends a full step raises the residual whatever friction does. There the step is walked along like
    /// any other, if it leads downhill, and the line search takes friction's limits anew wherever it looks: of a flock of
    /// 40 walking sheep 0.8 instead of 3.3 islands a tick end at the cap of iterations, and evaluations fall by a third.
    /// Contacts alone keep the test: without it six crates that were thrown at one another got 24 mm deep instead of 5.
    fn follow_friction(
        &mut self,
        method: &mut dyn Solver<D>,
        problem: &mut Problem,
        work: &mut Work,
        report: &mut SolveReport,
    ) -> Option<f64> {
        if report.iterations < self.friction_from {
            return None;
        }
        self.symmetric_step.clone_from(&self.step);
        let iterations = method.follow_friction(problem, work, &mut self.step);
        if iterations == 0 {
            return None;
        }
        report.linear_iterations += iterations;
        if self.bends {
            let descends = inner(&self.residual, &self.step) < 0.0;
            if !descends {
                self.step.clone_from(&self.symmetric_step);
            }
            return None;
        }
        problem.propose(&self.step);
        work.told_potentials();
        self.start.clone_from(&self.u);
        self.go(1.0, problem, work);
        let merit = self.relinearise(problem, work);
        let residual = problem.residual_speed(&self.residual);
        work.vectors(1);
        if residual < FRICTION_SHRINK * report.residual {
            return Some(merit);
        }
        self.friction_failures += 1;
        self.friction_from = report.iterations + 1 + self.friction_failures;
        self.u.clone_from(&self.start);
        self.step.clone_from(&self.symmetric_step);
        problem.move_to(&self.u);
        self.relinearise(problem, work);
        work.moved();
        None
    }

    /// Walks along the step from a state that is as good as `standing`; leaves `u`, the trial and the residual where it
    /// ends. Answers the incremental potential there, J, or nothing if that is nowhere else.
    fn walk(
        &mut self,
        method: &mut dyn Solver<D>,
        problem: &mut Problem,
        work: &mut Work,
        standing: Standing,
        goal: Goal,
    ) -> Option<f64> {
        let slope = inner(&self.residual, &self.step);
        let descends = slope < 0.0;
        if !descends {
            return None;
        }
        problem.propose(&self.step);
        work.told_potentials();
        self.start.clone_from(&self.u);
        let merit = if method.walk() == Walk::NEWTON {
            self.walk_as_model_says(problem, work, standing, slope, goal)
        } else {
            self.search(method, problem, work, slope);
            self.relinearise(problem, work)
        };
        let Self { u, start, .. } = self;
        let largest = u.as_flattened().iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let moved = u.as_flattened().iter().zip(start.as_flattened()).any(|(now, before)| {
            let still = (now - before).abs() <= STANDSTILL * largest;
            !still
        });
        moved.then_some(merit)
    }

    /// Takes the full step, and shortens it where that went too far and not to the goal, unless the watchdog wants to see
    /// where it leads.
    fn walk_as_model_says(
        &mut self,
        problem: &mut Problem,
        work: &mut Work,
        standing: Standing,
        slope: f64,
        goal: Goal,
    ) -> f64 {
        self.go(1.0, problem, work);
        let merit = self.relinearise(problem, work);
        let end = inner(&self.residual, &self.step);
        if Walk::NEWTON.ends_at(slope, end) || problem.residual_speed(&self.residual) <= goal.residual {
            return merit;
        }
        if self.watchdog.is_bold() && end.is_finite() {
            self.watchdog.overstepped(&self.start, standing, &self.step, Slopes { start: slope, end });
            return merit;
        }
        self.shorten(problem, work, Slopes { start: slope, end })
    }

    /// Goes back to where the watchdog's trial began, and from there no farther than the line search says.
    fn walk_again(&mut self, problem: &mut Problem, work: &mut Work) -> f64 {
        let (u, step, slopes) = self.watchdog.go_back();
        self.start.clear();
        self.start.extend_from_slice(u);
        self.step.clear();
        self.step.extend_from_slice(step);
        self.shorten(problem, work, slopes)
    }

    /// Walks along the step from `start`, whose full length is too far.
    fn shorten(&mut self, problem: &mut Problem, work: &mut Work, slopes: Slopes) -> f64 {
        problem.move_to(&self.start);
        self.relinearise(problem, work);
        problem.propose(&self.step);
        work.told_potentials();
        let mut merit = None;
        line_search::shorten(slopes.start, slopes.end, Walk::NEWTON, |alpha| {
            let (slope, taken) = self.slope_at(alpha, problem, work);
            merit = taken;
            slope
        });
        merit.unwrap_or_else(|| self.relinearise(problem, work))
    }

    /// Searches along the step from `start`.
    fn search(&mut self, method: &mut dyn Solver<D>, problem: &mut Problem, work: &mut Work, slope: f64) {
        let alpha = line_search::search(slope, method.walk(), |alpha| self.slope_at(alpha, problem, work).0);
        method.walked(alpha, &self.step, &self.residual);
    }

    /// The directional derivative so many steps from `start`, J. What is frozen is left as it is, but where something bends:
    /// there the incremental potential comes with it, J.
    fn slope_at(&mut self, alpha: f64, problem: &mut Problem, work: &mut Work) -> (f64, Option<f64>) {
        self.go(alpha, problem, work);
        let merit = if self.bends {
            Some(self.relinearise(problem, work))
        } else {
            problem.evaluate(&mut self.residual);
            work.evaluated();
            None
        };
        (inner(&self.residual, &self.step), merit)
    }

    /// Moves `u` and the trial so many steps from `start`.
    fn go(&mut self, alpha: f64, problem: &mut Problem, work: &mut Work) {
        let Self { u, start, step, .. } = self;
        u.clone_from(start);
        add_scaled(u, alpha, step);
        problem.move_to(u);
        work.moved();
        work.vectors(VECTORS_A_TRIAL);
    }

    /// One body's overflow must not spread over its island, nor a last step that went wrong. What is not the solution has
    /// to pay for its motion, and so has what the second look takes out of something in one tick, at any speed.
    fn return_to_best(&mut self, problem: &mut Problem, work: &mut Work, report: &mut SolveReport) {
        let Best { u, merit, residual, .. } = &self.best;
        let is_solved = report.stopped_because == StoppedBecause::Tolerance;
        if !is_solved && merit.is_finite() {
            self.u.clone_from(u);
            (report.merit, report.residual) = (*merit, *residual);
        }
        if !is_solved || problem.looked_again {
            self.pay(problem, work);
        }
        problem.remember_solution(&self.u);
    }

    /// Moves to `u`, and as near to rest as its energy demands.
    fn pay(&mut self, problem: &mut Problem, work: &mut Work) {
        problem.move_to(&self.u);
        problem.evaluate(&mut self.residual);
        work.moved_and_evaluated();
        let share = problem.affordable_share();
        if share < 1.0 {
            self.u.iter_mut().flatten().for_each(|rate| *rate *= share);
            problem.move_to(&self.u);
            work.moved();
        }
    }
}
