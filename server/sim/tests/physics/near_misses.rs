//! Near misses: what passes feels nothing of what it passes, along whatever direction, and what hits hits.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

use pita_sim::{BodyId, Collider, DQuat, DVec3, RigidBodyDesc, Shape, StaticDesc, World};

use super::{DT, weightless};

/// A shape as it stands beside a path along x, and how far it reaches towards the path, m.
struct Figure {
    name: &'static str,
    shape: Shape,
    rotation: DQuat,
    reach: f64,
}

fn movers() -> [Figure; 4] {
    let figure = |name, shape, reach| Figure { name, shape, rotation: DQuat::IDENTITY, reach };
    [
        figure("ball", Shape::Ball { radius: 0.2 }, 0.2),
        figure("box", Shape::Box { half: DVec3::new(0.4, 0.2, 0.2) }, 0.2),
        figure("wheel", Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 }, 0.12),
        figure("capsule", Shape::Capsule { half_length: 0.5, radius: 0.1 }, 0.1),
    ]
}

fn posts() -> [Figure; 5] {
    let figure = |name, shape, rotation, reach| Figure { name, shape, rotation, reach };
    let block = Shape::Box { half: DVec3::new(0.5, 1.0, 0.5) };
    let post = Shape::Cylinder { half_length: 1.0, radius: 0.2, rounding: 0.02 };
    [
        figure("post", post, DQuat::from_rotation_x(FRAC_PI_2), 0.2),
        figure("block", block.clone(), DQuat::IDENTITY, 0.5),
        figure("corner", block, DQuat::from_rotation_y(FRAC_PI_4), 0.5 * SQRT_2),
        figure("ball", Shape::Ball { radius: 0.3 }, DQuat::IDENTITY, 0.3),
        figure("wall", Shape::Box { half: DVec3::new(3.0, 1.0, 0.05) }, DQuat::IDENTITY, 0.05),
    ]
}

fn thrown(world: &mut World, figure: &Figure, turn: DQuat, position: DVec3, velocity: DVec3) -> BodyId {
    let desc = RigidBodyDesc::new(turn * position, 10.0, figure.shape.inertia(10.0));
    let (rotation, velocity) = (turn * figure.rotation, turn * velocity);
    let collider = Some(Collider::new(figure.shape.clone(), 0.5));
    world.add_rigid_body(RigidBodyDesc { rotation, velocity, collider, ..desc }).unwrap()
}

/// Share of its speed that a body loses or gains on its way past another one, that stands still or may move, `clearance`
/// beside its path.
fn change(mover: &Figure, post: &Figure, clearance: f64, speed: f64, phase: f64, is_fixed: bool) -> f64 {
    // The bounds have thirteen axes: none of them is along this one.
    let turn = DQuat::from_rotation_y(0.2 + phase);
    let mut world = weightless();
    let place = DVec3::new(12.0, 0.0, mover.reach + post.reach + clearance);
    if is_fixed {
        let desc = StaticDesc::new(Collider::new(post.shape.clone(), 0.5));
        let (position, rotation) = (turn * place, turn * post.rotation);
        world.add_static(StaticDesc { position, rotation, ..desc }).unwrap();
    } else {
        thrown(&mut world, post, turn, place, DVec3::ZERO);
    }
    let start = DVec3::X * (speed * DT * phase);
    let id = thrown(&mut world, mover, turn, start, DVec3::X * speed);
    for _ in 0..(20.0 / (speed * DT)) as u32 {
        world.step();
    }
    (world.velocity(id).unwrap() - turn * DVec3::X * speed).length() / speed
}

fn cases() -> impl Iterator<Item = (f64, f64, bool)> {
    let speeds = [10.0, 30.0, 60.0, 100.0].into_iter();
    let cases = speeds.flat_map(|speed| [0.0, 0.3, 0.55, 0.9].map(|phase| (speed, phase)));
    cases.flat_map(|(speed, phase)| [true, false].map(|is_fixed| (speed, phase, is_fixed)))
}

#[test]
fn what_passes_feels_nothing() {
    for mover in &movers() {
        for post in &posts() {
            for (clearance, (speed, phase, is_fixed)) in
                [0.01, 0.05, 0.1, 0.2, 0.35, 0.5].into_iter().flat_map(|c| cases().map(move |case| (c, case)))
            {
                let change = change(mover, post, clearance, speed, phase, is_fixed);
                let (mover, post) = (mover.name, post.name);
                assert!(change < 1e-9, "{mover} past {post}, {clearance} m, {speed} m/s, {phase}: {change}");
            }
        }
    }
}

#[test]
fn what_hits_hits() {
    for mover in &movers() {
        for post in &posts() {
            for (speed, phase, is_fixed) in cases() {
                // The edge of a corner is met by a hair.
                let change = change(mover, post, -0.05, speed, phase, is_fixed);
                let (mover, post) = (mover.name, post.name);
                assert!(change > 1e-4, "{mover} through {post}, {speed} m/s, {phase}: {change}");
            }
        }
    }
}

/// A thin bar turns past a post that stands just outside the circle of its ends, or above its plane.
#[test]
fn a_bar_turns_past_a_post() {
    let half = DVec3::new(1.0, 0.02, 0.1);
    let end = half.x.hypot(half.y);
    for spin in [3.0, 10.0, 21.0] {
        for clearance in [0.01, 0.05, 0.2] {
            let places = [
                (DVec3::Y * (end + 0.1 + clearance), DQuat::IDENTITY),
                (DVec3::new(0.5, 0.0, half.z + 0.1 + clearance), DQuat::from_rotation_x(FRAC_PI_2)),
            ];
            for (position, rotation) in places {
                let mut world = weightless();
                let post = Collider::new(Shape::Cylinder { half_length: 1.0, radius: 0.1, rounding: 0.02 }, 0.5);
                world.add_static(StaticDesc { position, rotation, ..StaticDesc::new(post) }).unwrap();
                let shape = Shape::Box { half };
                let desc = RigidBodyDesc::new(DVec3::ZERO, 5.0, shape.inertia(5.0));
                let (collider, angular_velocity) = (Some(Collider::new(shape, 0.5)), DVec3::Z * spin);
                let id = world.add_rigid_body(RigidBodyDesc { angular_velocity, collider, ..desc }).unwrap();
                (0..60).for_each(|_| drop(world.step().clone()));
                let (velocity, now) = (world.velocity(id).unwrap(), world.angular_velocity(id).unwrap());
                let change = velocity.length() + (now - DVec3::Z * spin).length();
                assert!(change < 1e-6, "{spin} rad/s, {clearance} m, post at {position}: {velocity} {now}");
            }
        }
    }
}
