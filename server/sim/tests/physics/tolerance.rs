//! Tolerances of joints and rods: held whatever the masses, redundant constraints solved, disagreeing ones reported.

use pita_sim::{Anchor, BallJointDesc, BodyId, DVec3, RigidBodyDesc, RodDesc, Shape, World};

use super::joints::chain;
use super::{particle, world};

/// Links of one mass and a load on the last, straight out from the world's origin; every joint is held to `tolerance`.
fn loaded_chain(links: usize, link: f64, load: f64, tolerance: f64) -> World {
    let mut world = world();
    let links = chain(&mut world, links, link, tolerance);
    let end = DVec3::X * (0.25 * links.len() as f64 + 0.5);
    let load = world.add_rigid_body(RigidBodyDesc::new(end, load, Shape::Ball { radius: 0.5 }.inertia(load))).unwrap();
    let a = Anchor::body(links[links.len() - 1], DVec3::X * 0.125);
    let b = Anchor::body(load, DVec3::X * -0.5);
    world.add_ball_joint(BallJointDesc { a, b, tolerance }).unwrap();
    world
}

/// From the first tick on, and without more than a few Newton iterations: a swing takes about two a tick.
#[test]
fn joints_hold_their_tolerance_whatever_the_masses() {
    for (links, link, load, tolerance, newton) in [
        (20, 0.5, 500.0, 1e-3, 650),
        (20, 0.5, 500.0, 1e-4, 650),
        (1, 1e-3, 1e4, 1e-3, 800),
        (3, 1e-3, 1e4, 1e-3, 800),
        (1, 1.0, 100.0, 1e-3, 650),
        (1, 100.0, 1.0, 1e-3, 1600),
    ] {
        let mut world = loaded_chain(links, link, load, tolerance);
        let mut iterations = 0;
        for tick in 0..300 {
            let report = world.step();
            iterations += report.iterations;
            assert!(report.worst_joint_gap <= tolerance, "{link} kg carry {load} kg, tick {tick}: {report:?}");
            assert_eq!(report.open_joints, 0);
        }
        assert!(iterations < newton, "{link} kg carry {load} kg: {iterations} Newton iterations");
    }
}

/// Every pair of six particles held by a rod, and each twice: 30 rods for 12 DOF of shape.
#[test]
fn a_rigid_frame_of_redundant_rods_is_solved() {
    let mut world = world();
    let corners: Vec<DVec3> = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
    let ids: Vec<BodyId> = corners.iter().map(|&p| particle(&mut world, p, DVec3::X * p.y, 1.0)).collect();
    for (i, j) in (0..6).flat_map(|i| (0..i).flat_map(move |j| [(i, j), (i, j)])) {
        let [a, b] = [i, j].map(|i| Anchor::body(ids[i], DVec3::ZERO));
        world.add_rod(RodDesc::new(a, b, corners[i].distance(corners[j]))).unwrap();
    }
    let end = Anchor::body(ids[0], DVec3::ZERO);
    world.add_rod(RodDesc::new(end, Anchor::world(DVec3::X * 2.0), 1.0)).unwrap();
    let mut iterations = 0;
    for tick in 0..150 {
        let report = world.step();
        iterations += report.iterations;
        assert!(report.open_joints == 0 && report.unconverged_islands == 0, "tick {tick}: {report:?}");
    }
    assert!(iterations < 450, "{iterations}");
}

/// Two rods of different lengths between the same points: they are reported, and nothing else suffers.
#[test]
fn lengths_that_cannot_agree_are_reported() {
    let mut world = world();
    let bobs = [1.0, 2.0].map(|x| particle(&mut world, DVec3::X * x, DVec3::ZERO, 1.0));
    let [a, b] = bobs.map(|bob| Anchor::body(bob, DVec3::ZERO));
    world.add_rod(RodDesc::new(Anchor::world(DVec3::ZERO), a, 1.0)).unwrap();
    world.add_rod(RodDesc::new(a, b, 1.0)).unwrap();
    let wrong = world.add_rod(RodDesc::new(a, b, 1.1)).unwrap();
    for tick in 0..150 {
        let report = world.step();
        assert!(report.open_joints == 2 && report.worst_joint_gap < 0.1, "tick {tick}: {report:?}");
        assert!(report.residual < 0.5, "tick {tick}: {report:?}");
        let held = world.position(bobs[0]).unwrap().length();
        assert!((held - 1.0).abs() <= 1e-3, "tick {tick}: {held}");
    }
    assert!(world.remove_rod(wrong) && !world.remove_rod(wrong));
    for tick in 0..50 {
        let report = world.step();
        assert!(tick == 0 || report.open_joints == 0, "tick {tick}: {report:?}");
        assert_eq!(report.unconverged_islands, 0);
    }
}

/// The author's stiffness stays the author's: a spring beside open joints sags as far as it would alone.
#[test]
fn springs_are_never_stiffened() {
    let mut world = world();
    let bob = particle(&mut world, DVec3::ZERO, DVec3::ZERO, 100.0);
    let bob = Anchor::body(bob, DVec3::ZERO);
    let spring = |a, b| pita_sim::SpringDesc { a, b, rest_length: 1.0, stiffness: 1e4, damping: 2e3 };
    world.add_spring(spring(Anchor::world(DVec3::Y), bob)).unwrap();
    let hook = particle(&mut world, DVec3::NEG_Y, DVec3::ZERO, 1e-3);
    let load = particle(&mut world, DVec3::Y * -2.0, DVec3::ZERO, 1e3);
    let [hook, load_end] = [hook, load].map(|body| Anchor::body(body, DVec3::ZERO));
    world.add_rod(RodDesc::new(bob, hook, 1.0)).unwrap();
    world.add_rod(RodDesc::new(hook, load_end, 1.0)).unwrap();
    for _ in 0..300 {
        world.step();
    }
    let sag = -2.0 - world.position(load).unwrap().y;
    let expected = 9.81 * 1100.0 / 1e4;
    assert!((sag - expected).abs() < 3e-3, "{sag}, expected {expected}");
    assert_eq!(world.report().open_joints, 0);
}
