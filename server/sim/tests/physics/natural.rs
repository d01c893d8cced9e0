//! Figures in natural coordinates against closed forms and conservation laws.

use std::sync::Arc;

use pita_sim::dof::PointRod;
use pita_sim::mass::{Density, MassProperties};
use pita_sim::{
    Anchor, BallJointDesc, BodyId, DQuat, DVec3, FigureDesc, Natural, NaturalDesc, NaturalPart, PartPoint, Shape, World,
};

use super::{DT, precise, weightless, world};

const G: f64 = 9.81;

fn solid(shape: Shape, mass: f64) -> MassProperties {
    shape.mass_properties(Density::constant(1.0)).unwrap().scaled_to(mass).unwrap()
}

fn part(name: &str, points: &[u32], position: DVec3, mass: MassProperties) -> NaturalPart {
    NaturalPart { name: name.into(), points: points.to_vec(), position, rotation: DQuat::IDENTITY, mass }
}

/// Points of a given mass, and rods between some.
fn dumbbell(points: &[(DVec3, f64)], rods: &[[u32; 2]]) -> NaturalDesc {
    let bob = |(i, &(at, mass)): (usize, &(DVec3, f64))| {
        part("bob", &[i as u32], at, MassProperties::of_point(mass, DVec3::ZERO).unwrap())
    };
    let distance = |[a, b]: [u32; 2]| points[a as usize].0.distance(points[b as usize].0);
    NaturalDesc {
        points: points.iter().map(|&(point, _)| point).collect(),
        rods: rods.iter().map(|&ends| PointRod { tolerance: 1e-5, ..PointRod::new(ends, distance(ends)) }).collect(),
        parts: points.iter().enumerate().map(bob).collect(),
    }
}

/// A box in a tetrahedron.
fn boxed(mass: f64) -> NaturalDesc {
    let points = [DVec3::new(-0.3, -0.2, -0.2), DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5].to_vec();
    let shape = Shape::Box { half: DVec3::new(0.4, 0.2, 0.3) };
    NaturalDesc { points, rods: Vec::new(), parts: vec![part("box", &[0, 1, 2, 3], DVec3::ZERO, solid(shape, mass))] }
        .with_edges()
}

fn add(world: &mut World, desc: NaturalDesc, velocity: DVec3, spin: DVec3) -> BodyId {
    let figure = Natural::new(desc).unwrap();
    let q = figure.placed(DVec3::ZERO, DQuat::IDENTITY);
    let v = figure.moving(&q, DVec3::ZERO, velocity, spin);
    world.add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap()
}

fn point(world: &World, id: BodyId, i: usize) -> DVec3 {
    DVec3::from_slice(&world.slice(id).unwrap().q[3 * i..])
}

#[test]
fn free_fall() {
    let mut world = world();
    let body = add(&mut world, boxed(3.0), DVec3::X, DVec3::ZERO);
    for n in 1..=30 {
        world.step();
        let t = f64::from(n);
        let expected = DVec3::new(DT * t, -G * DT * DT * t * (t + 1.0) / 2.0, 0.0);
        let frame = world.frame(body, PartPoint { part: 0, point: DVec3::ZERO }).unwrap();
        assert!((frame.place(DVec3::ZERO) - expected).length() < 1e-9, "tick {n}");
    }
}

/// Two equal masses on a rod turn about their middle, which does not move: the documented decay.
#[test]
fn a_rod_spins_down_as_documented() {
    let mut world = precise(DVec3::ZERO);
    let bobs = [(DVec3::X, 1.0), (DVec3::NEG_X, 1.0)];
    let body = add(&mut world, dumbbell(&bobs, &[[0, 1]]), DVec3::ZERO, DVec3::Z * 10.0);
    // The start is no tick: a bob leaves along the tangent with its speed. From then on θ' follows θ.
    let mut theta = (10.0 * DT).atan();
    let mut angle = DVec3::X;
    for tick in 0..60 {
        world.step();
        angle = DQuat::from_rotation_z(theta) * angle;
        let off = (point(&world, body, 0) - angle).length();
        assert!(off < 1e-5, "tick {tick}: {off}");
        if tick == 30 {
            assert!((theta / DT - 3.6).abs() < 0.05, "{}", theta / DT);
        }
        theta = (theta.sin() / (2.0 - theta.cos())).atan();
    }
}

/// Momentum stays, spin and energy fall, however fast it tumbles.
#[test]
fn a_tumbling_part_keeps_its_momentum_and_gains_no_energy() {
    for rate in [1.0, 3.0, 10.0, 30.0] {
        let mut world = weightless();
        add(&mut world, boxed(3.0), DVec3::ONE, DVec3::new(0.1, 1.0, 0.2) * rate);
        let (start, mut energy, mut iterations) = (world.momentum(), world.energy().total(), 0);
        let mut spin = start.angular.length();
        for tick in 0..60 {
            let report = world.step();
            assert!(
                report.unconverged_islands == 0 && report.open_joints == 0,
                "{rate} rad/s, tick {tick}: {report:?}"
            );
            iterations += report.iterations;
            assert!(world.energy().total() < energy && world.momentum().angular.length() < spin);
            (energy, spin) = (world.energy().total(), world.momentum().angular.length());
        }
        assert!((world.momentum().linear - start.linear).length() < 1e-12);
        let turned = world.momentum().angular.angle_between(start.angular);
        assert!(turned < 0.02, "{rate} rad/s: the axis turned by {turned}");
        assert!(iterations < 200, "{rate} rad/s: {iterations} iterations");
    }
}

/// A box on a ball joint swings with ω² = m g r / (I + m r²) as implicit Euler samples it: a tick turns its phase by
/// atan(ω dt) and leaves 1/√(1 + ω²dt²) of it.
#[test]
fn a_compound_pendulum_has_its_period_and_its_decay() {
    let mut world = precise(DVec3::Y * -G);
    let (start, arm) = (1e-3, DVec3::Y * 0.5);
    let desc = boxed(3.0);
    let props = desc.parts[0].mass;
    let figure = Natural::new(desc).unwrap();
    let turn = DQuat::from_rotation_z(start);
    let q = figure.placed(turn * -arm, turn);
    let v = vec![0.0; q.len()];
    let body = world.add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap();
    let joint =
        BallJointDesc { tolerance: 1e-6, ..BallJointDesc::new(Anchor::world(DVec3::ZERO), Anchor::body(body, arm)) };
    world.add_ball_joint(joint).unwrap();
    let omega = (3.0 * G * arm.y / props.inertia_about(arm).z_axis.z).sqrt();
    let (turn, kept) = ((omega * DT).atan(), 1.0 / (1.0 + (omega * DT).powi(2)).sqrt());
    for n in 1..=60 {
        world.step();
        let expected = start * kept.powi(n) * (f64::from(n) * turn).cos();
        let at = world.frame(body, PartPoint { part: 0, point: DVec3::ZERO }).unwrap().place(DVec3::ZERO);
        assert!((at.x / arm.y - expected).abs() < 2e-4 * start, "tick {n}: {} {expected}", at.x / arm.y);
    }
}

/// A bob balanced on a rod falls over. The rod under pressure is no convex potential, so energy may rise: by no more a
/// tick than the rod stores, half the load times what that compresses it.
#[test]
fn an_inverted_rod_pendulum_gains_no_more_than_stated() {
    for tilt in [1e-6, 1e-3, 0.1] {
        let mut world = precise(DVec3::Y * -G);
        let (mass, bob) = (2.0, DVec3::new(tilt, 1.0, 0.0).normalize());
        let desc = dumbbell(&[(DVec3::ZERO, 1.0), (bob, mass)], &[[0, 1]]);
        let body = add(&mut world, desc, DVec3::ZERO, DVec3::ZERO);
        let foot = Anchor::body(body, DVec3::ZERO);
        world.add_ball_joint(BallJointDesc::new(Anchor::world(DVec3::ZERO), foot)).unwrap();
        let mut energy = world.energy().total();
        let mut lowest = 1.0f64;
        for tick in 0..300 {
            world.step();
            let rise = world.energy().total() - energy;
            let stored = 0.5 * mass * G * world.report().worst_joint_gap;
            assert!(rise <= stored, "tilt {tilt}, tick {tick}: {rise} J, stored {stored} J");
            energy = world.energy().total();
            lowest = lowest.min(point(&world, body, 1).y);
        }
        assert!(lowest < -0.99, "tilt {tilt}: {lowest}");
    }
}
