//! Articulated figures against closed forms, conservation laws and the same thing made of rigid bodies.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties};
use pita_sim::{Articulated, BodyId, DVec3, FigureDesc, JointDesc, JointKind, PartDesc, PartPoint, Shape, World};

use super::{DT, precise, world};

const G: f64 = 9.81;

fn solid(shape: Shape, mass: f64) -> MassProperties {
    shape.mass_properties(Density::constant(1.0)).unwrap().scaled_to(mass).unwrap()
}

/// Nearly a point.
fn bob(mass: f64, at: DVec3) -> MassProperties {
    let ball = solid(Shape::Ball { radius: 1e-3 }, mass);
    MassProperties { centre: at, ..ball }
}

fn part(name: &str, mass: MassProperties, parent: Option<u32>, joint: JointDesc) -> PartDesc {
    PartDesc { name: name.into(), mass, parent, joint }
}

fn hinge(axis: DVec3) -> JointDesc {
    JointDesc::new(JointKind::Hinge { axis })
}

/// Adds a figure with coordinates and rates that differ from rest by `set`.
fn add(world: &mut World, parts: Vec<PartDesc>, set: impl FnOnce(&mut [f64], &mut [f64])) -> BodyId {
    let figure = Articulated::new(parts).unwrap();
    let (mut q, mut v) = (figure.rest(), figure.still());
    set(&mut q, &mut v);
    world.add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap()
}

fn q(world: &World, id: BodyId) -> &[f64] {
    world.slice(id).unwrap().q
}

fn v(world: &World, id: BodyId) -> &[f64] {
    world.slice(id).unwrap().v
}

/// A compound pendulum swings with ω² = m g r / (I + m r²) as implicit Euler samples it: a tick turns its phase by
/// atan(ω dt) and leaves 1/√(1 + ω²dt²) of it.
#[test]
fn a_compound_pendulum_has_its_period_and_its_decay() {
    let mut world = precise(DVec3::Y * -G);
    let (mass, length, start) = (2.0, 1.2, 1e-3);
    let rod = solid(Shape::Box { half: DVec3::new(0.02, length / 2.0, 0.02) }, mass);
    let joint = hinge(DVec3::Z).at(DVec3::ZERO, DVec3::Y * length / 2.0);
    let pendulum = add(&mut world, vec![part("rod", rod, None, joint)], |q, _| q[0] = start);
    let inertia = rod.inertia_about(DVec3::Y * length / 2.0).z_axis.z;
    let omega = (mass * G * length / 2.0 / inertia).sqrt();
    let (turn, kept) = ((omega * DT).atan(), 1.0 / (1.0 + (omega * DT).powi(2)).sqrt());
    for n in 1..=120 {
        world.step();
        let expected = start * kept.powi(n) * (f64::from(n) * turn).cos();
        // sin x is x − x³/6.
        assert!((q(&world, pendulum)[0] - expected).abs() < 1e-5 * start, "tick {n}: {expected}");
    }
}

/// An off-axis mass on a free hinge turns by θ' = θ cos θ' a tick.
#[test]
fn an_off_axis_mass_on_a_hinge_decays_as_documented() {
    let mut world = precise(DVec3::ZERO);
    let rate = 10.0;
    let wheel = add(&mut world, vec![part("arm", bob(2.0, DVec3::X), None, hinge(DVec3::Z))], |_, v| v[0] = rate);
    let mut theta: f64 = rate * DT;
    for tick in 0..60 {
        let before = theta;
        for _ in 0..40 {
            theta = before * theta.cos();
        }
        // A cubic a tick, while the turn is small: the documented decay.
        assert!((theta - (before - before.powi(3) / 2.0)).abs() < before.powi(5));
        world.step();
        let found = v(&world, wheel)[0] * DT;
        // The ball's own inertia, 1e-6 of the whole, does not decay.
        assert!((found - theta).abs() < 1e-6, "tick {tick}: {found} {theta}");
        if tick == 29 {
            assert!((found / (rate * DT) - 0.487).abs() < 0.01, "half is left after a second: {found}");
        }
    }
}

/// Links of 0.5 kg from the world's origin along +x, joint to joint 0.25 m, and a ball of 500 kg held at its surface.
fn loaded_chain(kind: JointKind, links: u32) -> Vec<PartDesc> {
    let link = |i: u32| {
        let in_parent = if i == 0 { DVec3::ZERO } else { DVec3::X * 0.125 };
        let shape = Shape::Capsule { half_length: 0.095, radius: 0.03 };
        let joint = JointDesc::new(kind).at(in_parent, DVec3::X * -0.125);
        part("link", solid(shape, 0.5), i.checked_sub(1), joint)
    };
    let joint = JointDesc::new(kind).at(DVec3::X * 0.125, DVec3::X * -0.5);
    let load = part("load", solid(Shape::Ball { radius: 0.5 }, 500.0), Some(links - 1), joint);
    (0..links).map(link).chain([load]).collect()
}

/// A light chain swings a load a thousand times as heavy as a link. Without geometric stiffness Newton does not
/// converge here in 16 iterations, and energy is no bound any more.
#[test]
fn a_loaded_chain_takes_one_newton_iteration_a_tick() {
    for kind in [JointKind::Hinge { axis: DVec3::Z }, JointKind::Ball] {
        let mut world = world();
        let chain = add(&mut world, loaded_chain(kind, 20), |_, _| {});
        let (mut energy, mut iterations, mut lowest) = (world.energy().total(), 0, 0.0f64);
        for tick in 0..300 {
            world.step();
            let report = world.report();
            assert_eq!(report.unconverged_islands, 0, "tick {tick}: {report:?}");
            iterations += report.iterations;
            let now = world.energy().total();
            // Of m g (5.5 m).
            assert!(now < energy + 1e-6 * 500.0 * G * 5.5, "tick {tick}: {energy} J to {now}");
            energy = now;
            let load = world.frame(chain, PartPoint { part: 20, point: DVec3::ZERO }).unwrap();
            lowest = lowest.min(load.position.y);
        }
        assert!(lowest < -5.45 && lowest > -5.5, "{lowest}");
        assert!(iterations < 2 * 300, "{kind:?}: {iterations}");
    }
}
