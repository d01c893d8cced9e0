//! Every method through the world: same ends, honest reports.

use pita_sim::{Anchor, DVec3, Method, Preconditioner, Settings, SolverSettings, SpringDesc, World};

use super::{DT, cube, ground, particle};

fn world_with(solver: SolverSettings) -> World {
    World::new(Settings { solver, sleep: None, ..Settings::at(DT) }).unwrap()
}

/// A square net of springs that hangs from two corners.
fn net(solver: SolverSettings) -> World {
    const SIDE: usize = 4;
    let mut world = world_with(solver);
    let at = |i: usize| DVec3::new((i % SIDE) as f64, (i / SIDE) as f64, 0.0) * 0.5;
    let knots: Vec<_> = (0..SIDE * SIDE).map(|i| particle(&mut world, at(i), DVec3::Z * 0.1 * i as f64, 0.5)).collect();
    let mut spring = |a: Anchor, b: Anchor, rest_length: f64| {
        world.add_spring(SpringDesc { a, b, rest_length, stiffness: 200.0, damping: 1.0 }).unwrap();
    };
    for i in 0..SIDE * SIDE {
        let here = Anchor::body(knots[i], DVec3::ZERO);
        if i % SIDE + 1 < SIDE {
            spring(here, Anchor::body(knots[i + 1], DVec3::ZERO), 0.45);
        }
        if i + SIDE < SIDE * SIDE {
            spring(here, Anchor::body(knots[i + SIDE], DVec3::ZERO), 0.45);
        }
    }
    for corner in [SIDE * (SIDE - 1), SIDE * SIDE - 1] {
        spring(Anchor::world(at(corner) + DVec3::Y * 0.5), Anchor::body(knots[corner], DVec3::ZERO), 0.4);
    }
    world
}

/// A box that settles on the ground.
fn resting_box(solver: SolverSettings) -> World {
    let mut world = world_with(solver);
    ground(&mut world);
    cube(&mut world, DVec3::new(0.0, 0.501, 0.0));
    world
}

fn state(world: &World) -> Vec<f64> {
    world.slices().flat_map(|slice| slice.q.to_vec()).collect()
}

/// Every method, and those that have preconditioners with all of them.
fn every_solver() -> impl Iterator<Item = SolverSettings> {
    Method::ALL.into_iter().flat_map(|(_, method)| {
        let preconditioned =
            matches!(method, Method::TruncatedNewton | Method::CelDamage | Method::NonlinearConjugateGradient);
        let all = Preconditioner::ALL.into_iter().map(|(_, preconditioner)| preconditioner);
        let chosen = all.filter(move |&p| preconditioned || p == Preconditioner::default());
        chosen.map(move |preconditioner| SolverSettings { method, preconditioner, ..SolverSettings::default() })
    })
}

#[test]
fn every_solver_comes_to_the_same_end() {
    for (name, scene, ticks) in [("net", net as fn(_) -> _, 30), ("box", resting_box, 30)] {
        let run = |solver: &SolverSettings| {
            let mut world = scene(SolverSettings { tolerance: 3e-6, iterations: Some(1000), ..solver.clone() });
            for tick in 0..ticks {
                let report = world.step();
                assert_eq!(report.unconverged_islands, 0, "{name}, {solver:?}, tick {tick}: {report:?}");
                let works = report.work > 0 || report.evaluations == 0;
                assert!(report.residual <= 1e-7 && works, "{name}, {solver:?}: {report:?}");
            }
            state(&world)
        };
        let expected = run(&SolverSettings { method: Method::Newton, ..SolverSettings::default() });
        for solver in every_solver() {
            let difference = state_difference(&run(&solver), &expected);
            assert!(difference < 1e-4, "{name}: {solver:?} ends {difference} m from newton");
        }
    }
}

/// Boxes on one another, that have just been let go, and others that were thrown at them.
fn heap(solver: SolverSettings, threads: usize) -> World {
    let mut world = World::new(Settings { solver, threads, ..Settings::at(DT) }).unwrap();
    ground(&mut world);
    for i in 0..24 {
        let (column, row) = (i % 6, i / 6);
        let shift = 0.05 * f64::from(row % 2);
        cube(&mut world, DVec3::new(f64::from(column) * 3.0 + shift, 0.55 + 1.02 * f64::from(row), 0.0));
    }
    world
}

/// Without limit a tick takes what it takes; with less it ends sooner, says so, and the world stays in one piece.
#[test]
fn budgets_are_shared_by_islands_and_reported() {
    for (_, method) in Method::ALL {
        let solver = SolverSettings { method, ..SolverSettings::default() };
        let mut free = heap(solver.clone(), 1);
        let most = (0..20).map(|_| free.step().clone()).max_by_key(|report| report.work).unwrap();
        assert_eq!(most.out_of_budget_islands, 0, "{method}");
        let mut tight = heap(SolverSettings { budget: Some(most.work / 4), ..solver.clone() }, 1);
        let mut threaded = heap(SolverSettings { budget: Some(most.work / 4), ..solver }, 2);
        let mut stopped = 0;
        for tick in 0..40 {
            let report = tight.step().clone();
            assert!(report.work < most.work / 2, "{method}, tick {tick}: {} of {}", report.work, most.work);
            assert!(report.residual.is_finite() && report.quarantined == 0, "{method}: {report:?}");
            stopped += report.out_of_budget_islands;
            assert_eq!(
                (threaded.step().clone(), threaded.state_hash()),
                (report, tight.state_hash()),
                "{method}, tick {tick}"
            );
        }
        assert!(stopped > 0, "{method} never ran out");
        assert!(state(&tight).iter().all(|x| x.abs() < 50.0), "{method}");
    }
}

/// A rehearsal tells what a tick would take, and the world does not notice.
#[test]
fn rehearsals_leave_no_trace() {
    let mut rehearsing = heap(SolverSettings::default(), 1);
    let mut alone = heap(SolverSettings::default(), 1);
    for tick in 0..20 {
        for world in [&mut rehearsing, &mut alone] {
            let first = world.bodies()[0];
            world.apply_force(first, DVec3::X * 2e3, world.position(first).unwrap()).unwrap();
            world.detect_collisions();
        }
        let mut reports = Vec::new();
        for (_, method) in Method::ALL.into_iter().filter(|(_, method)| *method != Method::Jacobi) {
            let solver = SolverSettings { method, ..SolverSettings::default() };
            reports.push((method, rehearsing.rehearse(&solver).unwrap()));
        }
        let integrated = rehearsing.integrate().clone();
        assert_eq!(&integrated, alone.integrate(), "tick {tick}");
        assert_eq!(rehearsing.state_hash(), alone.state_hash(), "tick {tick}");
        let (_, rehearsed) = reports.iter().find(|(method, _)| *method == Method::default()).unwrap();
        assert_eq!((rehearsed.work, rehearsed.residual), (integrated.work, integrated.residual), "tick {tick}");
        assert_eq!(rehearsed.contacts, integrated.contacts, "tick {tick}");
    }
    let nonsense = SolverSettings { sweeps: 0, ..SolverSettings::default() };
    assert!(rehearsing.rehearse(&nonsense).is_err());
}

#[test]
fn settings_that_make_no_sense_are_refused_by_name() {
    let refused = |solver: SolverSettings, what: &str| {
        let error = World::new(Settings { solver, ..Settings::at(DT) }).err().map(|error| error.to_string());
        assert!(error.as_ref().is_some_and(|error| error.contains(what)), "{what}: {error:?}");
    };
    let default = SolverSettings::default;
    refused(SolverSettings { iterations: Some(0), ..default() }, "solver.iterations is 0, allowed is 1 to 100000");
    refused(SolverSettings { relaxation: 2.0, ..default() }, "solver.relaxation is 2, allowed is above 0, below 2");
    refused(SolverSettings { sweeps: 0, ..default() }, "solver.sweeps is 0, allowed is 1 to 1000");
    refused(SolverSettings { forcing: f64::NAN, ..default() }, "solver.forcing is NaN");
}

fn state_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
