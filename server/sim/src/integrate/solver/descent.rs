//! What all methods share: guess, ask for a direction, walk along it, until there is a reason to stop.

use super::super::block::Entry;
use super::super::line_search::{self, Walk};
use super::super::matrix::Matrix;
use super::super::problem::Problem;
use super::super::vector::{add_scaled, inner};
use super::guess::guess;
use super::watchdog::{Standing, Verdict, Watchdog};
use super::work::Work;
use super::{SolveReport, Solver, Standpoint, StoppedBecause};
use crate::settings::SolverSettings;

/// A walk that changes no unknown by more than this fraction of the largest goes nowhere: some units of rounding.
const STANDSTILL: f64 = 1e-15;

/// Passes over vectors in an iteration, besides a method's own: the norm of the residual, and the slope.
const VECTORS_AN_ITERATION: u64 = 2;

/// Passes over vectors in each step of a line search: copy, add, product.
const VECTORS_A_TRIAL: u64 = 3;

/// Most times that open joints of an island are stiffened in a tick: in 5, a link of a gram comes to hold ten tonnes
/// that it meets for the first time.
const STIFFENING_ROUNDS: usize = 6;

/// Share of the tolerance that a guess must be within to be taken as it is. The error of an iterate has any sign, that
/// of a repeated guess repeats: it makes what slides slide too slowly by the tolerance in every tick.
const GUESS_SHARE: f64 = 0.3;

/// The state of a solve, kept from solve to solve for its memory.
#[derive(Default)]
pub(super) struct Descent<const D: usize> {
    u: Vec<Entry<D>>,
    /// Where the last walk began; scratch of the guess before.
    start: Vec<Entry<D>>,
    residual: Vec<Entry<D>>,
    step: Vec<Entry<D>>,
    best: Best<D>,
    watchdog: Watchdog<D>,
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
        let mut report = SolveReport::default();
        guess(problem, settings, &mut work, &mut self.u, &mut self.start, &mut self.residual);
        self.best.forget();
        self.watchdog.begin(method.walk() == Walk::NEWTON && problem.bends());
        let mut goal = Goal { residual: settings.tolerance * problem.dt, iterations: settings.iterations() };
        let mut rounds = 0;
        loop {
            self.relinearise(problem, &mut work, &mut report);
            if self.watchdog.judge(report.standing()) == Verdict::GoBack {
                self.walk_again(method, problem, &mut work);
                self.relinearise(problem, &mut work, &mut report);
            }
            if let Some(reason) = self.reason_to_stop(goal, &work, &report) {
                let solved = reason == StoppedBecause::Tolerance;
                if solved && rounds < STIFFENING_ROUNDS && problem.stiffen() {
                    goal.iterations = report.iterations + settings.iterations();
                    rounds += 1;
                    self.best.forget();
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
            let moved = self.walk(method, problem, &mut work, report.standing());
            work.iteration_took(work.multiply_adds() - before);
            if !moved {
                self.relinearise(problem, &mut work, &mut report);
                report.stopped_because =
                    self.reason_to_stop(goal, &work, &report).unwrap_or(StoppedBecause::Stagnation);
                break;
            }
        }
        self.return_to_best(problem, &mut report);
        SolveReport { evaluations: work.evaluations(), work: work.spent(), ..report }
    }

    /// Takes anew what is frozen during an iteration, and sees how good the state is.
    fn relinearise(&mut self, problem: &mut Problem, work: &mut Work, report: &mut SolveReport) {
        report.merit = problem.relinearise_and_evaluate(&mut self.residual);
        work.told_potentials();
        work.evaluated();
        report.residual = problem.residual_speed(&self.residual);
        work.vectors(VECTORS_AN_ITERATION);
        self.best.offer(&self.u, report.merit, report.residual);
    }

    fn reason_to_stop(&self, goal: Goal, work: &Work, report: &SolveReport) -> Option<StoppedBecause> {
        if !report.residual.is_finite() {
            return Some(StoppedBecause::NonFinite);
        }
        let share = if report.iterations == 0 { GUESS_SHARE } else { 1.0 };
        if report.residual <= share * goal.residual {
            return Some(StoppedBecause::Tolerance);
        }
        if report.iterations >= goal.iterations {
            return Some(StoppedBecause::IterationLimit);
        }
        (!work.affords_iteration()).then_some(StoppedBecause::Budget)
    }

    /// Walks along the step from a state that is as good as `standing`; leaves `u` and the trial where it ends. Answers
    /// whether that is elsewhere.
    fn walk(&mut self, method: &mut dyn Solver<D>, problem: &mut Problem, work: &mut Work, standing: Standing) -> bool {
        let slope = inner(&self.residual, &self.step);
        let descends = slope < 0.0;
        if !descends {
            return false;
        }
        let bold = self.watchdog.is_bold();
        let walk = if bold { Walk::FULL } else { method.walk() };
        self.search(method, problem, work, walk);
        if bold && !method.walk().ends_at(slope, inner(&self.residual, &self.step)) {
            self.watchdog.overstepped(&self.start, standing, &self.step, slope);
        }
        let Self { u, start, .. } = self;
        let largest = u.as_flattened().iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        u.as_flattened().iter().zip(start.as_flattened()).any(|(now, before)| {
            let still = (now - before).abs() <= STANDSTILL * largest;
            !still
        })
    }

    /// Goes back to where the watchdog's trial began, and from there no farther than the line search says.
    fn walk_again(&mut self, method: &mut dyn Solver<D>, problem: &mut Problem, work: &mut Work) {
        let (u, step) = self.watchdog.go_back();
        self.u.clear();
        self.u.extend_from_slice(u);
        self.step.clear();
        self.step.extend_from_slice(step);
        problem.move_to(&self.u);
        problem.relinearise_and_evaluate(&mut self.residual);
        work.told_potentials();
        work.moved_and_evaluated();
        let walk = method.walk();
        self.search(method, problem, work, walk);
    }

    /// Searches along the step; leaves `u`, the trial and the residual where that ends.
    fn search(&mut self, method: &mut dyn Solver<D>, problem: &mut Problem, work: &mut Work, walk: Walk) {
        let Self { u, start, residual, step, .. } = self;
        let slope = inner(residual, step);
        problem.propose(step);
        work.told_potentials();
        start.clone_from(u);
        let alpha = line_search::search(slope, walk, |alpha| {
            u.clone_from(start);
            add_scaled(u, alpha, step);
            problem.move_to(u);
            problem.evaluate(residual);
            work.moved_and_evaluated();
            work.vectors(VECTORS_A_TRIAL);
            inner(residual, step)
        });
        method.walked(alpha, step, residual);
    }

    /// One body's overflow must not spread over its island, nor a last step that went wrong.
    fn return_to_best(&mut self, problem: &mut Problem, report: &mut SolveReport) {
        let Best { u, merit, residual, .. } = &self.best;
        let is_there = report.stopped_because == StoppedBecause::Tolerance || *u == self.u;
        if !is_there && merit.is_finite() {
            problem.move_to(u);
            (report.merit, report.residual) = (*merit, *residual);
        }
    }
}
