//! Near misses: what passes feels nothing of what it passes, along whatever direction, and what hits hits.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

use std::sync::Arc;

use pita_sim::collide::TriangleMesh;
use pita_sim::{BodyId, Collider, Compound, DQuat, DVec3, Piece, RigidBodyDesc, Shape, StaticDesc, World};

use super::sheep::{PARTS, Poses, add_articulated, coordinates};
use super::sheep_forms::add_natural;
use super::{DT, body, weightless, world};

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

fn posts() -> [Figure; 7] {
    let figure = |name, shape, rotation, reach| Figure { name, shape, rotation, reach };
    let block = Shape::Box { half: DVec3::new(0.5, 1.0, 0.5) };
    let post = Shape::Cylinder { half_length: 1.0, radius: 0.2, rounding: 0.02 };
    let triangles = block_of_triangles();
    [
        figure("block of triangles", triangles.clone(), DQuat::IDENTITY, 0.5),
        figure("corner of triangles", triangles, DQuat::from_rotation_y(FRAC_PI_4), 0.5 * SQRT_2),
        figure("post", post, DQuat::from_rotation_x(FRAC_PI_2), 0.2),
        figure("block", block.clone(), DQuat::IDENTITY, 0.5),
        figure("corner", block, DQuat::from_rotation_y(FRAC_PI_4), 0.5 * SQRT_2),
        figure("ball", Shape::Ball { radius: 0.3 }, DQuat::IDENTITY, 0.3),
        figure("wall", Shape::Box { half: DVec3::new(3.0, 1.0, 0.05) }, DQuat::IDENTITY, 0.05),
    ]
}

/// The block as a surface.
fn block_of_triangles() -> Shape {
    let sign = |i: u32, bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
    let corners: Vec<_> = (0..8).map(|i| DVec3::new(0.5 * sign(i, 1), sign(i, 2), 0.5 * sign(i, 4))).collect();
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves: Vec<_> = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Shape::Mesh(Arc::new(TriangleMesh::new(&corners, &halves).unwrap()))
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

/// Speeds, phases, and whether the post is fixed: what has no inside cannot move.
fn cases(post: &Figure) -> impl Iterator<Item = (f64, f64, bool)> {
    let moves = !matches!(post.shape, Shape::Mesh(_));
    let speeds = [10.0, 30.0, 60.0, 100.0].into_iter();
    let cases = speeds.flat_map(|speed| [0.0, 0.3, 0.55, 0.9].map(|phase| (speed, phase)));
    let ways = if moves { &[true, false][..] } else { &[true] };
    cases.flat_map(move |(speed, phase)| ways.iter().map(move |&is_fixed| (speed, phase, is_fixed)))
}

#[test]
fn what_passes_feels_nothing() {
    for mover in &movers() {
        for post in &posts() {
            for (clearance, (speed, phase, is_fixed)) in
                [0.01, 0.05, 0.1, 0.2, 0.35, 0.5].into_iter().flat_map(|c| cases(post).map(move |case| (c, case)))
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
            for (speed, phase, is_fixed) in cases(post) {
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

/// Two balls on one body go round each other, and past a post just outside their circle.
#[test]
fn balls_on_one_body_go_round_past_a_post() {
    let ball = |x: f64| Piece::new(Collider::new(Shape::Ball { radius: 0.1 }, 0.5), DVec3::X * x, 1000.0);
    let pair = Compound::new(vec![ball(-1.0), ball(1.0)]).unwrap();
    for spin in [3.0, 10.0, 21.0] {
        for clearance in [0.01, 0.05, 0.2] {
            let mut world = weightless();
            let post = Collider::new(Shape::Cylinder { half_length: 1.0, radius: 0.1, rounding: 0.02 }, 0.5);
            let position = DVec3::new(0.6, 0.8, 0.0) * (1.2 + clearance);
            world.add_static(StaticDesc { position, ..StaticDesc::new(post) }).unwrap();
            let id = world.add_compound(&pair, DVec3::ZERO, DQuat::IDENTITY).unwrap();
            world.set_velocity(id, DVec3::ZERO, DVec3::Z * spin).unwrap();
            (0..60).for_each(|_| drop(world.step().clone()));
            let (velocity, now) = (world.velocity(id).unwrap(), world.angular_velocity(id).unwrap());
            let change = velocity.length() + (now - DVec3::Z * spin).length();
            assert!(change < 1e-6, "{spin} rad/s, {clearance} m: {velocity} {now}");
        }
    }
}

/// A sheep as it stands, turned, thrown along its own x axis from the origin.
fn throw_sheep(world: &mut World, is_natural: bool, turn: DQuat, start: DVec3, speed: f64) -> BodyId {
    let poses: Poses = std::array::from_fn(|i| (turn * (PARTS[i].centre + start), turn));
    let velocity = turn * DVec3::X * speed;
    let id = match is_natural {
        true => add_natural(world, &poses, true),
        false => add_articulated(world, coordinates(&poses), true),
    };
    let slice = world.slice(id).unwrap();
    let (q, mut v) = (slice.q.to_vec(), slice.v.to_vec());
    let moving = if is_natural { v.len() } else { 3 };
    v[..moving].chunks_exact_mut(3).for_each(|v| v.copy_from_slice(&velocity.to_array()));
    world.set_slice(id, &q, &v).unwrap();
    id
}

/// A sheep in natural coordinates, or an articulated one, flies past a post at 30 m/s, half a metre and less beside it.
#[test]
fn a_sheep_that_passes_a_post_feels_nothing() {
    for is_natural in [true, false] {
        for (clearance, phase) in [0.05, 0.2, 0.5].into_iter().flat_map(|c| [0.0, 0.3, 0.55, 0.9].map(|p| (c, p))) {
            let turn = DQuat::from_rotation_y(0.2 + phase);
            let mut world = weightless();
            let post = Collider::new(Shape::Cylinder { half_length: 2.0, radius: 0.2, rounding: 0.02 }, 0.5);
            let position = turn * DVec3::new(12.0, 0.0, 0.25 + 0.2 + clearance);
            let rotation = DQuat::from_rotation_x(FRAC_PI_2);
            world.add_static(StaticDesc { position, rotation, ..StaticDesc::new(post) }).unwrap();
            throw_sheep(&mut world, is_natural, turn, DVec3::X * phase, 30.0);
            let before = world.momentum().linear;
            (0..24).for_each(|_| drop(world.step().clone()));
            let change = (world.momentum().linear - before).length() / before.length();
            assert!(change < 1e-6, "natural {is_natural}, {clearance} m, {phase}: {change}");
        }
    }
}

/// Thrown at a post it is stopped, and at a wall of 5 cm nothing of it gets through.
#[test]
fn a_sheep_that_hits_hits() {
    for (is_natural, phase) in [true, false].into_iter().flat_map(|n| [0.0, 0.3, 0.55, 0.9].map(|p| (n, p))) {
        for shape in [Shape::Ball { radius: 0.4 }, Shape::Box { half: DVec3::new(0.025, 5.0, 5.0) }] {
            let mut world = weightless();
            let is_wall = matches!(shape, Shape::Box { .. });
            world
                .add_static(StaticDesc { position: DVec3::X * 8.0, ..StaticDesc::new(Collider::new(shape, 0.5)) })
                .unwrap();
            let id = throw_sheep(&mut world, is_natural, DQuat::IDENTITY, DVec3::X * phase, 30.0);
            let before = world.momentum().linear;
            for tick in 0..20 {
                world.step();
                for part in 0..4 {
                    let at = world.frame(id, pita_sim::PartPoint { part, point: DVec3::ZERO }).unwrap().position;
                    let x = DVec3::from(at).x;
                    assert!(!is_wall || x < 8.0, "natural {is_natural}, {phase}: part {part} at {x} in tick {tick}");
                }
            }
            let lost = (world.momentum().linear - before).length() / before.length();
            assert!(lost > 0.1, "natural {is_natural}, {phase}: {lost}");
        }
    }
}

/// What flies past a sleeper lets it sleep; what flies at it wakes it, moves it, and does not get into it.
#[test]
fn a_fast_ball_wakes_what_it_hits_and_nothing_else() {
    for (speed, phase) in [10.0, 30.0, 100.0].into_iter().flat_map(|v| [0.0, 0.3, 0.7].map(|p| (v, p))) {
        for clearance in [0.02, 0.5, -0.3] {
            let mut world = world();
            super::ground(&mut world);
            let crate_id = super::cube(&mut world, DVec3::new(12.0, 0.5, 0.7 + clearance));
            world.sleep(crate_id).unwrap();
            let id = body(&mut world, Shape::Ball { radius: 0.2 }, 50.0, DVec3::new(phase * speed * DT, 0.6, 0.0), 0.5);
            world.set_velocity(id, DVec3::new(speed, 0.0, 0.0), DVec3::ZERO).unwrap();
            let mut deepest = 0.0f64;
            for _ in 0..(20.0 / (speed * DT)) as u32 {
                world.step();
                world.detect_collisions();
                let depths = world.contacts().filter(|contact| contact.b.is_some()).map(|contact| -contact.gap);
                deepest = depths.fold(deepest, f64::max);
            }
            let moved = world.position(crate_id).unwrap().distance(DVec3::new(12.0, 0.5, 0.7 + clearance));
            assert!(deepest < 5e-3, "{speed} m/s, {clearance} m: {deepest} m deep");
            if clearance > 0.0 {
                assert!(world.is_asleep(crate_id) && moved == 0.0, "{speed} m/s, {clearance} m: {moved} m");
            } else {
                assert!(moved > 1e-3, "{speed} m/s, {phase}: {moved} m");
            }
        }
    }
}
