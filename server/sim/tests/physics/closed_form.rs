//! What implicit Euler gives in closed form.

use pita_sim::{Anchor, DQuat, DVec3, JointDrive, PdControl, PdDesc, RigidBodyDesc, SpringDesc};

use super::{DT, cube, particle, weightless, world};

/// Axiom 3: Q1 = Q0 + Q0' dt + Q'' dt², without the half.
#[test]
fn free_fall() {
    let mut world = world();
    let start = DVec3::new(1.0, 100.0, -2.0);
    let (a, b) = (particle(&mut world, start, DVec3::X, 0.1), cube(&mut world, start));
    let g = 9.81;
    for n in 1..=60 {
        world.step();
        let t = f64::from(n);
        let fallen = g * DT * DT * t * (t + 1.0) / 2.0;
        assert!((world.velocity(a).unwrap() - DVec3::new(1.0, -g * DT * t, 0.0)).length() < 1e-12);
        assert!((world.position(a).unwrap() - start - DVec3::new(DT * t, -fallen, 0.0)).length() < 1e-11);
        assert!((world.position(b).unwrap() - start + DVec3::Y * fallen).length() < 1e-11);
    }
}

/// x'' = −(k/m) x − (c/m) x' by implicit Euler is a 2×2 linear map; the engine follows it.
#[test]
fn damped_spring() {
    for (k, c) in [(400.0, 0.0), (400.0, 3.0), (30.0, 0.5), (1e6, 10.0)] {
        let mut world = weightless();
        let (m, rest) = (2.0, 1.0);
        let body = particle(&mut world, DVec3::X * 1.5, DVec3::ZERO, m);
        let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(body, DVec3::ZERO));
        world.add_spring(SpringDesc { a, b, rest_length: rest, stiffness: k, damping: c }).unwrap();
        let (mut x, mut v) = (0.5, 0.0);
        for tick in 0..60 {
            v = (v - DT * k / m * x) / (1.0 + DT * c / m + DT * DT * k / m);
            x += DT * v;
            world.step();
            let error = (world.position(body).unwrap() - DVec3::X * (rest + x)).length();
            // The solver's tolerance is a speed; a tick turns it into this much way.
            assert!(error < 2.0 * 1e-3 * DT * (1.0 + f64::from(tick)), "k {k} c {c} tick {tick}: {error}");
        }
    }
}

/// The scheme damps a spring of ω to 1/√(1 + ω²dt²) a tick (DESIGN, section 3).
#[test]
fn spring_amplitude_decays_as_the_scheme_says() {
    let mut world = weightless();
    let omega = 10.0;
    let body = particle(&mut world, DVec3::X * 2.0, DVec3::ZERO, 1.0);
    let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(body, DVec3::ZERO));
    world.add_spring(SpringDesc { a, b, rest_length: 1.0, stiffness: omega * omega, damping: 0.0 }).unwrap();
    // ½v² + ½ω²x² shrinks by exactly that factor squared.
    let energy = |world: &pita_sim::World| world.energy().total();
    let factor = 1.0 / (1.0 + omega * omega * DT * DT);
    for _ in 0..30 {
        let before = energy(&world);
        world.step();
        assert!((energy(&world) / before - factor).abs() < 0.02, "{}", energy(&world) / before);
    }
}

/// A free body keeps spin and energy, about any axis, at one step a tick.
#[test]
fn torque_free_spin_is_kept() {
    let mut world = weightless();
    let spin = DVec3::new(0.01, 5.0, 0.01);
    let desc = RigidBodyDesc::new(DVec3::ZERO, 1.0, DVec3::new(1.0, 2.0, 3.0));
    world.add_rigid_body(RigidBodyDesc { angular_velocity: spin, ..desc }).unwrap();
    let (energy, momentum) = (world.energy().total(), world.momentum().angular);
    for _ in 0..1800 {
        world.step();
        assert!((world.energy().total() / energy - 1.0).abs() < 1e-5);
        assert!((world.momentum().angular - momentum).length() < 1e-9);
    }
}

/// A constant force and torque give constant accelerations about a principal axis.
#[test]
fn outer_forces_accelerate() {
    let mut world = weightless();
    let body = cube(&mut world, DVec3::ZERO);
    for _ in 0..30 {
        let force = DVec3::new(0.0, 0.0, -600.0);
        let arm = world.rotation(body).unwrap() * DVec3::X;
        let turned = DQuat::from_rotation_arc(DVec3::X, arm) * force;
        world.apply_force(body, turned, world.position(body).unwrap() + arm).unwrap();
        world.step();
    }
    // 600 N at 1 m for 1 s on 1000/6 kg m².
    let spin = world.angular_velocity(body).unwrap();
    assert!((spin - DVec3::Y * 3.6).length() < 1e-9, "{spin}");
}

/// What a player sees: frequency and damping ratio as asked for (DESIGN, section 3; the talk's two examples).
#[test]
fn pd_controllers_reach_their_target() {
    for (frequency, damping_ratio, ticks, expected) in [(2.0, 1.0, 15, 0.0115), (0.2, 0.5, 87, -0.163)] {
        let mut world = world();
        let body = cube(&mut world, DVec3::new(0.0, 0.0, 1.0));
        let control = PdControl { target: DVec3::ZERO, target_velocity: DVec3::ZERO };
        let drive = JointDrive::Position { frequency, damping_ratio };
        let pd = PdDesc { at: Anchor::body(body, DVec3::ZERO), drive, max_force: f64::INFINITY, control };
        world.add_pd(pd).unwrap();
        for _ in 0..ticks {
            world.step();
        }
        let left = world.position(body).unwrap().z;
        assert!((left - expected).abs() < 2e-3, "{frequency} Hz: {left}");
    }
}
