//! Every method on a net of springs, from the inside: directions, decrease, reasons to stop, budgets.

use glam::{DMat3, DQuat, DVec3};

use super::super::block::Entry;
use super::super::problem::Unknown;
use super::super::vector::inner;
use super::*;
use crate::dof::{Node, Pose, Twist};
use crate::potential::spring::SpringTerm;
use crate::potential::{Anchor, End, FIXED, SpringDesc};

const DT: f64 = 1.0 / 30.0;

/// Particles of a net that hangs from one corner, stretched, and thrown upwards.
pub(super) fn net(stiffness: f64) -> Problem {
    const SIDE: usize = 3;
    let mut problem = Problem { dt: DT, ..Problem::default() };
    let place = |i: usize| DVec3::new((i % SIDE) as f64, -((i / SIDE) as f64), 0.1 * (i % 2) as f64);
    for i in 0..SIDE * SIDE {
        let before = DVec3::new(0.1 * i as f64, 2.0, 0.3);
        problem.unknowns.push(Unknown::Body(particle(place(i), before, 1.0 + 0.5 * i as f64)));
    }
    let mut spring = |a: u32, b: u32| {
        let ends = [a, b].map(|frame| End { frame, point: if frame == FIXED { DVec3::Y } else { DVec3::ZERO } });
        let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::world(DVec3::ZERO));
        let desc = SpringDesc { a, b, rest_length: 0.8, stiffness, damping: 0.02 * stiffness };
        problem.terms.springs.push(SpringTerm::new(ends, &desc, 1.0));
    };
    spring(FIXED, 0);
    for i in 0..SIDE * SIDE {
        if i % SIDE + 1 < SIDE {
            spring(i as u32, i as u32 + 1);
        }
        if i + SIDE < SIDE * SIDE {
            spring(i as u32, (i + SIDE) as u32);
        }
    }
    problem
}

fn particle(position: DVec3, velocity: DVec3, mass: f64) -> Node {
    let twist = |linear: DVec3| Twist { linear, angular: DVec3::ZERO };
    Node {
        start: Pose { position, rotation: DQuat::IDENTITY },
        free_rotation: DQuat::IDENTITY,
        free_spin: DVec3::ZERO,
        target: twist(velocity - DVec3::Y * 9.81 * DT),
        before: twist(velocity),
        impulse: Twist::REST,
        mass,
        inertia: DMat3::IDENTITY,
        inverse_inertia: DMat3::IDENTITY,
        rotates: false,
        wheel_axis: None,
        guessed_spin: None,
    }
}

fn settings(method: Method) -> SolverSettings {
    SolverSettings { method, tolerance: 3e-5, ..SolverSettings::default() }
}

/// A method that is watched: the merit at each of its standpoints, and that all its directions lead downhill.
struct Watched<'a> {
    method: &'a mut dyn Solver<3>,
    merits: Vec<f64>,
}

impl Solver<3> for Watched<'_> {
    fn direction(&mut self, at: Standpoint<3>, step: &mut Vec<Entry<3>>) -> usize {
        let residual = at.residual.to_vec();
        self.merits.push(at.problem.evaluate(&mut Vec::<Entry<3>>::new()));
        let linear_iterations = self.method.direction(at, step);
        assert!(inner(&residual, step) < 0.0, "uphill at iteration {}", self.merits.len());
        linear_iterations
    }

    fn walked(&mut self, alpha: f64, step: &[Entry<3>], residual: &[Entry<3>]) {
        self.method.walked(alpha, step, residual);
    }

    fn walk(&self) -> Walk {
        self.method.walk()
    }
}

/// The energy of springs has no frozen parts, so the promise holds for every method: no iteration makes it larger.
#[test]
fn every_iteration_of_every_method_leads_downhill() {
    for (name, method) in Method::ALL {
        let settings = settings(method);
        let (mut problem, mut solvers) = (net(3e3), Solvers::<3>::default());
        let (mut watched, descent) = solvers.watched(method);
        let report = descent.solve(&mut watched, &mut problem, &settings, None);
        assert_eq!(report.stopped_because, StoppedBecause::Tolerance, "{name}: {report:?}");
        assert_eq!(watched.merits.len(), report.iterations);
        let size = watched.merits[0].abs();
        for pair in watched.merits.windows(2) {
            assert!(pair[1] <= pair[0] + 1e-12 * size, "{name}: {pair:?} of {:?}", watched.merits);
        }
        assert!(report.merit <= watched.merits[0], "{name}");
    }
}

impl Solvers<3> {
    fn watched(&mut self, method: Method) -> (Watched<'_>, &mut Descent<3>) {
        let (method, descent) = self.parts(method);
        (Watched { method, merits: Vec::new() }, descent)
    }
}

/// Solves the net, and checks what every report promises.
fn solve(problem: &mut Problem, settings: &SolverSettings, budget: Option<u64>) -> SolveReport {
    let report = Solvers::<3>::default().solve(problem, settings, budget);
    let mut residual = Vec::<Entry<3>>::new();
    let merit = problem.relinearise_and_evaluate(&mut residual);
    if merit.is_finite() {
        assert_eq!((merit, problem.residual_speed(&residual)), (report.merit, report.residual), "{settings:?}");
    }
    report
}

#[test]
fn reports_say_why_a_solver_stopped() {
    for (name, method) in Method::ALL {
        let mut settings = settings(method);
        let stopped = |settings: &SolverSettings, budget| solve(&mut net(3e3), settings, budget).stopped_because;
        assert_eq!(stopped(&settings, None), StoppedBecause::Tolerance, "{name}");
        assert_eq!(stopped(&settings, Some(1)), StoppedBecause::Budget, "{name}");
        settings.iterations = Some(1);
        assert_eq!(stopped(&settings, None), StoppedBecause::IterationLimit, "{name}");
        settings.tolerance = 1e-300;
        settings.iterations = Some(100_000);
        assert_eq!(stopped(&settings, None), StoppedBecause::Stagnation, "{name}");
        let overflowing = solve(&mut net(f64::MAX), &settings, None);
        assert_eq!(overflowing.stopped_because, StoppedBecause::NonFinite, "{name}");
    }
}

/// Whatever the budget: no more than the start or one iteration beyond it, and never worse than the start; more is
/// never worse than less by more than what counts as alike.
#[test]
fn budgets_are_kept_and_buy_something() {
    for (name, method) in Method::ALL {
        let settings = settings(method);
        let start = solve(&mut net(3e3), &settings, Some(0));
        assert_eq!(start.iterations, 0, "{name}");
        let all = solve(&mut net(3e3), &settings, None);
        let mut last = start;
        for share in 1..=10 {
            let budget = start.work + (all.work - start.work) * share / 10;
            let report = solve(&mut net(3e3), &settings, Some(budget));
            let gain = start.merit - all.merit;
            assert!(report.merit <= start.merit, "{name}: {report:?}");
            assert!(report.merit <= last.merit + 0.011 * gain, "{name}: {last:?} {report:?}");
            let allowed = budget + (all.work - start.work) / 2;
            assert!(report.work <= allowed, "{name}: {budget} {report:?} {all:?}");
            last = report;
        }
    }
}

/// The procedural Hessian is the residual's derivative, by central differences.
#[test]
fn products_by_automatic_differentiation_are_those_of_the_hessian() {
    let mut problem = net(3e3);
    let u: Vec<Entry<3>> = (0..problem.len()).map(|i| [0.3 * i as f64, -1.0, 0.2]).collect();
    let x: Vec<Entry<3>> = (0..problem.len()).map(|i| [1.0, 0.5 - 0.2 * i as f64, (i % 3) as f64]).collect();
    let mut residual_at = |h: f64| {
        let moved: Vec<Entry<3>> = u.iter().zip(&x).map(|(u, x)| std::array::from_fn(|k| u[k] + h * x[k])).collect();
        let mut residual = Vec::new();
        problem.move_to(&moved);
        problem.evaluate::<3>(&mut residual);
        residual
    };
    let h = 1e-5;
    let (above, below) = (residual_at(h), residual_at(-h));
    residual_at(0.0);
    let mut product = Vec::new();
    problem.hessian_product(&x, &mut product);
    for ((above, below), product) in above.iter().zip(&below).zip(&product) {
        for k in 0..3 {
            let difference = (above[k] - below[k]) / (2.0 * h);
            assert!((difference - product[k]).abs() < 1e-6 * (1.0 + product[k].abs()), "{difference} {}", product[k]);
        }
    }
}
