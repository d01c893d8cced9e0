//! Articulated figures against closed forms, conservation laws and the same thing made of rigid bodies.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties};
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, DVec3, FigureDesc, JointDesc, JointDrive, JointKind, JointLimit,
    JointMotor, JointSpring, LimitRange, PartDesc, PartPoint, RigidBodyDesc, Settings, Shape, World,
};

use super::{DT, precise, weightless, world};

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

/// A slider falls along its axis as a free particle along a frictionless rail.
#[test]
fn a_slider_falls_along_its_axis() {
    let mut world = precise(DVec3::Y * -G);
    let axis = DVec3::new(3.0, -4.0, 0.0);
    let joint = JointDesc::new(JointKind::Slider { axis });
    let bead = add(&mut world, vec![part("bead", bob(0.5, DVec3::ZERO), None, joint)], |_, _| {});
    let along = G * 0.8;
    for n in 1..=60 {
        world.step();
        let t = f64::from(n);
        assert!((v(&world, bead)[0] - along * DT * t).abs() < 1e-8, "tick {n}");
        assert!((q(&world, bead)[0] - along * DT * DT * t * (t + 1.0) / 2.0).abs() < 1e-8, "tick {n}");
    }
}

/// A box with an arm on a universal joint, a hinge, a slider and a ball joint, everything spinning.
fn octopus() -> Vec<PartDesc> {
    let solid = |mass| solid(Shape::Box { half: DVec3::new(0.3, 0.1, 0.15) }, mass);
    let kinds = [
        JointKind::Universal { axes: [DVec3::Y, DVec3::new(0.3, 0.0, 1.0)] },
        JointKind::Hinge { axis: DVec3::Z },
        JointKind::Slider { axis: DVec3::X },
        JointKind::Ball,
    ];
    let arm = |(i, kind): (usize, JointKind)| {
        let root = DVec3::new(0.3, 0.1, 0.15) * [DVec3::X, DVec3::Y, -DVec3::X, DVec3::Z][i];
        part("arm", solid(1.0 + i as f64), Some(0), JointDesc::new(kind).at(root, DVec3::X * -0.3))
    };
    let body = part("body", solid(4.0), None, JointDesc::new(JointKind::Free));
    [body].into_iter().chain(kinds.into_iter().enumerate().map(arm)).collect()
}

/// Whatever turns within it, the momentum of a free figure is kept but for what the solver leaves, and energy falls.
/// Angular momentum is not exact (module header): within 10 % after two seconds of this.
#[test]
fn a_free_figure_keeps_its_momentum_and_gains_no_energy() {
    let spins = [1.0, -2.0, 0.5, 3.0, 4.0, -2.0, 2.0, -3.0, 5.0, 0.3, 2.0, -4.0, 1.0];
    for (mut world, lost, iterations) in [(weightless(), 0.1, 5), (precise(DVec3::ZERO), 1e-6, 16)] {
        add(&mut world, octopus(), |_, v| v.copy_from_slice(&spins));
        let (momentum, mut energy) = (world.momentum(), world.energy().total());
        for tick in 0..60 {
            world.step();
            let (now, found) = (world.energy().total(), world.momentum());
            assert!(now < energy, "tick {tick}: {energy} J to {now}");
            energy = now;
            let (linear, angular) = (found.linear - momentum.linear, found.angular - momentum.angular);
            assert!(linear.length() < lost, "tick {tick}: {linear} of {}", momentum.linear);
            assert!(angular.length() < 0.1 * momentum.angular.length(), "tick {tick}: {angular}");
            assert!(world.report().iterations <= iterations, "tick {tick}: {:?}", world.report());
        }
    }
}

/// Two rods, one on the other, fall from the level: joint coordinates and rigid bodies on ball joints are two schemes of
/// one system. They differ by the tick: 0.13 m after a second and some 5 m of way at 30 Hz, a fifth of that at 240 Hz.
#[test]
fn a_double_pendulum_is_that_of_rigid_bodies() {
    let rod = Shape::Box { half: DVec3::new(0.5, 0.05, 0.05) };
    for (ticks, tolerance) in [(30, 0.13), (240, 0.03)] {
        let [mut figures, mut bodies] = [0, 0].map(|_| {
            let mut settings = Settings::at(1.0 / f64::from(ticks));
            settings.solver.tolerance = 1e-8;
            World::new(settings).unwrap()
        });
        let joint = |i: u32| hinge(DVec3::Z).at(if i == 0 { DVec3::ZERO } else { DVec3::X * 0.5 }, DVec3::X * -0.5);
        let rods = (0..2).map(|i: u32| part("rod", solid(rod.clone(), 1.0), i.checked_sub(1), joint(i))).collect();
        let figure = add(&mut figures, rods, |_, _| {});
        let mut last = Anchor::world(DVec3::ZERO);
        let ids = [0.5, 1.5].map(|x| {
            let id = bodies.add_rigid_body(RigidBodyDesc::new(DVec3::X * x, 1.0, rod.inertia(1.0))).unwrap();
            bodies.add_ball_joint(BallJointDesc::new(last, Anchor::body(id, DVec3::X * -0.5))).unwrap();
            last = Anchor::body(id, DVec3::X * 0.5);
            id
        });
        for tick in 0..ticks {
            figures.step();
            bodies.step();
            for (part, id) in (0..).zip(ids) {
                let at = figures.frame(figure, PartPoint { part, point: DVec3::ZERO }).unwrap();
                let apart = (DVec3::from(at.position) - bodies.position(id).unwrap()).length();
                assert!(apart < tolerance, "{ticks} Hz, tick {tick}, rod {part}: {apart}");
            }
        }
    }
}

/// A rod that stands on its hinge falls over and comes to hang, and no tick gives it energy: what the solver leaves,
/// 1e-3 m/s of a rod's speed, is 1e-6 of the 20 J that it has to lose.
#[test]
fn an_inverted_pendulum_falls() {
    let mut world = world();
    let rod = solid(Shape::Box { half: DVec3::new(0.02, 0.5, 0.02) }, 2.0);
    let joint = hinge(DVec3::Z).at(DVec3::ZERO, DVec3::Y * -0.5);
    let id = add(&mut world, vec![part("rod", rod, None, joint)], |q, _| q[0] = 0.01);
    let mut energy = world.energy().total();
    for tick in 0..300 {
        world.step();
        let now = world.energy().total();
        assert!(now < energy + 2e-5, "tick {tick}: {energy} J to {now}");
        assert!(world.report().iterations <= 3, "tick {tick}: {:?}", world.report());
        energy = now;
    }
    let angle = q(&world, id)[0];
    assert!((angle - std::f64::consts::PI).abs() < 0.2, "{angle}");
}

/// A figure whose part `index` has a motor, and its target.
fn drive(world: &mut World, mut parts: Vec<PartDesc>, index: u32, motor: JointMotor, target: [f64; 2]) -> BodyId {
    parts[index as usize].joint.motor = Some(motor);
    let figure = Articulated::new(parts.clone()).unwrap();
    let id = add(world, parts, |_, _| {});
    let (mut controls, places) = (world.controls(id).unwrap().to_vec(), figure.motor(index).unwrap());
    controls[places.position.start] = target[0];
    controls[places.rate.start] = target[1];
    world.set_controls(id, &controls).unwrap();
    id
}

/// The talk's two examples, seen by a player: exact on the world, where inertia does not change, and within a percent on
/// a free figure with limbs that give way.
#[test]
fn motors_reach_their_targets_as_asked() {
    let target = 0.8;
    for (frequency, damping_ratio, ticks, left) in [(2.0, 1.0, 15, 0.0115), (0.2, 0.5, 87, -0.163)] {
        let motor = JointMotor { drive: JointDrive::Position { frequency, damping_ratio }, max_force: f64::INFINITY };
        let arm = vec![part("arm", bob(2.0, DVec3::X), None, hinge(DVec3::Z))];
        for (parts, index, place, tolerance) in [(arm, 0, 0, 2e-3), (octopus(), 2, 9, 1e-2)] {
            let mut world = precise(DVec3::ZERO);
            let id = drive(&mut world, parts, index, motor, [target, 0.0]);
            (0..ticks).for_each(|_| drop(world.step().clone()));
            let found = 1.0 - q(&world, id)[place] / target;
            assert!((found - left).abs() < tolerance, "{frequency} Hz: {found} left");
        }
    }
}

#[test]
fn velocity_motors_have_their_time_constant() {
    let mut world = precise(DVec3::ZERO);
    let motor = JointMotor { drive: JointDrive::Velocity { time_constant: 0.2 }, max_force: f64::INFINITY };
    let wheel = part("wheel", solid(Shape::Ball { radius: 0.3 }, 5.0), None, hinge(DVec3::Z));
    let id = drive(&mut world, vec![wheel], 0, motor, [0.0, 12.0]);
    for n in 1..=30 {
        world.step();
        let left = 1.0 - v(&world, id)[0] / 12.0;
        assert!((left - (-f64::from(n) * DT / 0.2).exp()).abs() < 1e-6, "tick {n}: {left}");
    }
}

/// Far from the target the motor gives what it has, and no more.
#[test]
fn motors_are_as_strong_as_they_may_be() {
    let mut world = precise(DVec3::ZERO);
    let motor = JointMotor { drive: JointDrive::Position { frequency: 2.0, damping_ratio: 1.0 }, max_force: 6.0 };
    let slider = JointDesc::new(JointKind::Slider { axis: DVec3::X });
    let id = drive(&mut world, vec![part("sledge", bob(2.0, DVec3::ZERO), None, slider)], 0, motor, [100.0, 0.0]);
    for n in 1..=30 {
        world.step();
        assert!((v(&world, id)[0] - 3.0 * DT * f64::from(n)).abs() < 1e-6, "tick {n}");
    }
}

#[test]
fn a_motor_that_this_tick_cannot_show_is_refused_by_name() {
    let drive = JointDrive::Position { frequency: 5.0, damping_ratio: 0.3 };
    let joint = JointDesc { motor: Some(JointMotor { drive, max_force: 1.0 }), ..hinge(DVec3::Z) };
    let figure = Articulated::new(vec![part("left arm", bob(1.0, DVec3::X), None, joint)]).unwrap();
    let (q, v) = (figure.rest(), figure.still());
    let error = world().add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap_err();
    assert!(error.to_string().starts_with("motor of the left arm: damping gain is "), "{error}");
}

/// The range is kept to its tolerance, a hundredth of a radian: at 20 rad/s, and with a tonne at the end of 2 kg.
#[test]
fn hinge_limits_hold_to_their_tolerance() {
    let arm = solid(Shape::Box { half: DVec3::new(0.5, 0.05, 0.05) }, 2.0);
    for load in [None, Some(1000.0)] {
        let mut world = world();
        let limits = vec![JointLimit::range(-0.5, 0.5)];
        let joint = JointDesc { limits, ..hinge(DVec3::Z).at(DVec3::ZERO, DVec3::X * -0.5) };
        let id = add(&mut world, vec![part("arm", arm, None, joint)], |_, v| v[0] = 20.0);
        if let Some(mass) = load {
            let ball = world.add_rigid_body(RigidBodyDesc::new(DVec3::X, mass, DVec3::splat(10.0))).unwrap();
            let (a, b) = (Anchor::part(id, 0, DVec3::X * 0.5), Anchor::body(ball, DVec3::ZERO));
            world.add_ball_joint(BallJointDesc::new(a, b)).unwrap();
        }
        for tick in 0..90 {
            world.step();
            let angle = q(&world, id)[0];
            assert!(angle.abs() < 0.51, "tick {tick}, load {load:?}: {angle}");
            assert_eq!(world.report().unconverged_islands, 0, "tick {tick}: {:?}", world.report());
        }
        assert!(q(&world, id)[0] < -0.5 && v(&world, id)[0].abs() < 1e-3);
    }
}

/// A ball joint's cone and twist, hit while it spins about everything.
#[test]
fn ball_limits_hold_to_their_tolerance() {
    let limb = solid(Shape::Capsule { half_length: 0.3, radius: 0.05 }, 3.0);
    for seed in 0..8 {
        let mut world = world();
        let swing = JointLimit { range: LimitRange::Swing { axis: DVec3::X, upper: 0.7 }, tolerance: 0.01 };
        let twist = LimitRange::Twist { axis: DVec3::X, lower: -0.2, upper: 0.4 };
        let limits = vec![swing, JointLimit { range: twist, tolerance: 0.01 }];
        let joint = JointDesc { limits, ..JointDesc::new(JointKind::Ball).at(DVec3::ZERO, DVec3::X * -0.35) };
        let turn = 0.8 * f64::from(seed);
        let spin = [7.0 * turn.sin(), 9.0 * turn.cos(), 10.0 * (2.0 * turn).sin()];
        let id = add(&mut world, vec![part("limb", limb, None, joint)], |_, v| v.copy_from_slice(&spin));
        for tick in 0..90 {
            world.step();
            let frame = world.frame(id, PartPoint { part: 0, point: DVec3::ZERO }).unwrap();
            let x = DVec3::from(frame.arm(DVec3::X));
            let swung = DVec3::X.cross(x).length().atan2(x.x);
            let [qx, .., qw] = *q(&world, id) else { panic!("a quaternion") };
            let twisted = 2.0 * (qx / qw).atan();
            assert!(swung < 0.71 && (-0.21..0.41).contains(&twisted), "{seed}, tick {tick}: {swung} {twisted}");
            // Where it spins by a third of a radian a tick and hits, 16 iterations do not quite do.
            assert!(world.report().residual < 0.05, "{seed}, tick {tick}: {:?}", world.report());
        }
    }
}

/// A joint that is put far beyond its limit comes back at a bounded speed.
#[test]
fn a_joint_beyond_its_limit_does_not_leap() {
    let mut world = weightless();
    let joint = JointDesc { limits: vec![JointLimit::range(-0.5, 0.5)], ..hinge(DVec3::Z) };
    let id = add(&mut world, vec![part("arm", bob(2.0, DVec3::X), None, joint)], |q, _| q[0] = 2.0);
    for _ in 0..20 {
        world.step();
        assert!(v(&world, id)[0].abs() < 10.0 * 0.01 / DT + 1e-6, "{}", v(&world, id)[0]);
    }
    assert!(q(&world, id)[0] < 0.51, "{}", q(&world, id)[0]);
}

/// A spring at a joint is as stiff as its author says: ω² = K / I, sampled by implicit Euler.
#[test]
fn joint_springs_swing_as_they_are_made() {
    let (inertia, stiffness) = (2.0, 50.0);
    for (kind, rates) in [(JointKind::Hinge { axis: DVec3::Z }, 1), (JointKind::Ball, 3)] {
        let mut world = precise(DVec3::ZERO);
        let spring = Some(JointSpring { stiffness, damping: 0.0 });
        let ball = solid(Shape::Ball { radius: 0.5 }, inertia / 0.1);
        let joint = JointDesc { spring, ..JointDesc::new(kind) };
        let id = add(&mut world, vec![part("ball", ball, None, joint)], |_, v| v[rates - 1] = 3.0);
        let (mut x, mut rate) = (0.0, 3.0);
        for tick in 0..60 {
            rate = (rate - DT * stiffness / inertia * x) / (1.0 + DT * DT * stiffness / inertia);
            x += DT * rate;
            world.step();
            assert!((v(&world, id)[rates - 1] - rate).abs() < 1e-6, "tick {tick}");
        }
    }
}

/// Parts that are welded together are one: two boxes end to end swing as one of twice the length. (As long as they swing
/// little: the decay of the scheme takes from ways round a joint, not from spin, and two parts have more of the former.)
#[test]
fn welded_parts_are_one_body() {
    let half = |length: f64| DVec3::new(0.05, length / 2.0, 0.05);
    let joint = |length: f64| hinge(DVec3::Z).at(DVec3::ZERO, DVec3::Y * (length / 2.0));
    let piece = solid(Shape::Box { half: half(0.5) }, 1.0);
    let weld = JointDesc::new(JointKind::Fixed).at(DVec3::Y * -0.25, DVec3::Y * 0.25);
    let two = vec![part("upper", piece, None, joint(0.5)), part("lower", piece, Some(0), weld)];
    let one = vec![part("whole", solid(Shape::Box { half: half(1.0) }, 2.0), None, joint(1.0))];
    let mut worlds = [precise(DVec3::Y * -G), precise(DVec3::Y * -G)];
    let ids = [two, one].map(|parts| add(&mut worlds[parts.len() % 2], parts, |q, _| q[0] = 1e-3));
    for tick in 0..90 {
        worlds.iter_mut().for_each(|world| drop(world.step().clone()));
        let angles = [q(&worlds[0], ids[0])[0], q(&worlds[1], ids[1])[0]];
        assert!((angles[0] - angles[1]).abs() < 1e-8, "tick {tick}: {angles:?}");
    }
}
