//! Contacts: momentum, rest, friction, deep starts, fast things.

use pita_sim::{BodyId, Collider, DQuat, DVec3, RigidBodyDesc, Shape, StaticDesc, World};

use super::{DT, body, cube, ground, weightless, world};

fn thrown(world: &mut World, shape: Shape, mass: f64, position: DVec3, velocity: DVec3, spin: DVec3) -> BodyId {
    let inertia = shape.inertia(mass);
    let collider = Some(Collider::new(shape, 0.5));
    let desc = RigidBodyDesc::new(position, mass, inertia);
    world.add_rigid_body(RigidBodyDesc { velocity, angular_velocity: spin, collider, ..desc }).unwrap()
}

/// Bodies of several shapes and masses meet in space: what one loses the other gains.
#[test]
fn momentum_is_conserved() {
    let shapes = [
        Shape::Box { half: DVec3::new(0.5, 0.3, 0.4) },
        Shape::Ball { radius: 0.4 },
        Shape::Capsule { half_length: 0.5, radius: 0.2 },
        Shape::Cylinder { half_length: 0.2, radius: 0.5, rounding: 0.05 },
    ];
    for (i, a) in shapes.iter().enumerate() {
        for b in &shapes[i..] {
            let mut world = weightless();
            let spin = DVec3::new(0.3, -0.2, 0.5);
            thrown(&mut world, a.clone(), 3.0, DVec3::new(-1.5, 0.1, 0.0), DVec3::X * 4.0, spin);
            thrown(&mut world, b.clone(), 5.0, DVec3::new(1.5, 0.0, 0.1), DVec3::X * -3.0, -spin);
            let (before, energy) = (world.momentum(), world.energy().total());
            let mut met = false;
            for _ in 0..30 {
                world.step();
                met |= world.contacts().any(|c| c.normal_force > 0.0);
            }
            let after = world.momentum();
            assert!(met, "{a:?} {b:?} missed");
            // Newton stops at 1e-3 m/s a body and tick.
            let error = (after.linear - before.linear).length();
            assert!(error < 0.05, "{a:?} {b:?}: linear momentum changed by {error}");
            let error = (after.angular - before.angular).length();
            assert!(error < 0.05, "{a:?} {b:?}: angular momentum changed by {error}");
            assert!(world.energy().total() <= energy * (1.0 + 1e-9), "{a:?} {b:?}: energy rose");
        }
    }
}

#[test]
fn a_box_comes_to_rest_and_stays() {
    let mut world = world();
    ground(&mut world);
    let cube = cube(&mut world, DVec3::new(0.0, 1.0, 0.0));
    for _ in 0..60 {
        world.step();
    }
    let settled = world.position(cube).unwrap();
    assert!((settled.y - 0.5).abs() < 2e-3, "{settled}");
    for _ in 0..300 {
        world.step();
    }
    assert!((world.position(cube).unwrap() - settled).length() < 1e-5);
    assert!(world.velocity(cube).unwrap().length() < 1e-4);
}

/// On a slope of tan θ = 0.45 a coefficient of 0.5 sticks; at 0.55 it slides with g (sin θ − µ cos θ).
#[test]
fn friction_sticks_and_slides() {
    for (slope, sticks) in [(0.45f64, true), (0.55, false)] {
        let angle = slope.atan();
        let mut world = world();
        let normal = DVec3::new(angle.sin(), angle.cos(), 0.0);
        let shape = Shape::HalfSpace { normal };
        let plane = StaticDesc::new(Collider::new(shape, 0.5));
        world.add_static(plane).unwrap();
        let cube = cube(&mut world, normal * 0.5);
        world.set_pose(cube, normal * 0.5, DQuat::from_rotation_z(-angle)).unwrap();
        for _ in 0..90 {
            world.step();
        }
        let (moved, speed) =
            ((world.position(cube).unwrap() - normal * 0.5).length(), world.velocity(cube).unwrap().length());
        if sticks {
            assert!(moved < 1e-3 && speed < 1e-5, "moved {moved} m, still {speed} m/s");
        } else {
            let expected = 9.81 * (angle.sin() - 0.5 * angle.cos()) * 3.0;
            assert!((speed / expected - 1.0).abs() < 0.03, "{speed} m/s instead of {expected}");
        }
    }
}

/// A ball that slides ends up rolling at 5/7 of its speed.
#[test]
fn a_sliding_ball_ends_rolling() {
    let mut world = world();
    ground(&mut world);
    let ball = body(&mut world, Shape::Ball { radius: 0.3 }, 2.0, DVec3::new(0.0, 0.3, 0.0), 0.5);
    world.set_velocity(ball, DVec3::X * 7.0, DVec3::ZERO).unwrap();
    for _ in 0..60 {
        world.step();
    }
    let (velocity, spin) = (world.velocity(ball).unwrap(), world.angular_velocity(ball).unwrap());
    assert!((velocity.x - 5.0).abs() < 0.05, "{velocity}");
    assert!((spin.z * 0.3 + velocity.x).abs() < 0.02, "slips: {velocity} {spin}");
}

#[test]
fn a_tower_and_a_heavy_load_stand() {
    let mut world = world();
    ground(&mut world);
    let light: Vec<_> = (0..5)
        .map(|i| body(&mut world, Shape::Box { half: DVec3::splat(0.5) }, 10.0, DVec3::Y * (0.5 + f64::from(i)), 0.5))
        .collect();
    let heavy = body(&mut world, Shape::Box { half: DVec3::splat(0.5) }, 1000.0, DVec3::Y * 5.5, 0.5);
    for _ in 0..300 {
        world.step();
    }
    for (i, &id) in light.iter().chain([&heavy]).enumerate() {
        let position = world.position(id).unwrap();
        let sideways = DVec3::new(position.x, 0.0, position.z).length();
        assert!(sideways < 5e-3 && position.y > 0.4 + i as f64 * 0.95, "box {i} at {position}");
    }
}

/// A contact potential sees the gap at the end of the step: what is fast stops in front of what is thin.
#[test]
fn fast_bodies_do_not_tunnel() {
    for speed in [10.0, 100.0, 1000.0] {
        let mut world = weightless();
        let wall = Shape::Box { half: DVec3::new(0.005, 5.0, 5.0) };
        let at = DVec3::X * 10.0;
        world.add_static(StaticDesc { position: at, ..StaticDesc::new(Collider::new(wall, 0.5)) }).unwrap();
        let ball = body(&mut world, Shape::Ball { radius: 0.1 }, 1.0, DVec3::new(0.013, 0.02, 0.03), 0.5);
        world.set_velocity(ball, DVec3::X * speed, DVec3::ZERO).unwrap();
        for _ in 0..60 {
            world.step();
            assert!(
                world.position(ball).unwrap().x < 10.0 - 0.1 + 2e-3,
                "{speed} m/s: {}",
                world.position(ball).unwrap()
            );
        }
    }
}

/// A body can be put anywhere; its old contacts do not pull it back.
#[test]
fn a_moved_body_forgets_its_contacts() {
    let mut world = world();
    ground(&mut world);
    let cube = cube(&mut world, DVec3::Y * 0.5);
    for _ in 0..10 {
        world.step();
    }
    assert!(world.contacts().count() == 4);
    world.set_pose(cube, DVec3::Y * 50.0, DQuat::IDENTITY).unwrap();
    world.integrate();
    assert!(world.velocity(cube).unwrap().y < -9.8 * DT);
}

/// Extrusion is part of the shape: a rounded cylinder rolls at its outer radius, and an extruded hull rests on it, on the
/// ground and on static geometry.
#[test]
fn a_rolling_wheel_is_a_rounded_cylinder() {
    let mut world = world();
    ground(&mut world);
    let table = Shape::Box { half: DVec3::new(2.0, 0.5, 2.0) };
    let at = DVec3::new(0.0, 0.5, 20.0);
    world.add_static(StaticDesc { position: at, ..StaticDesc::new(Collider::new(table, 0.5)) }).unwrap();
    let wheel = Shape::Cylinder { half_length: 0.15, radius: 0.4, rounding: 0.05 };
    let wheel = thrown(&mut world, wheel, 20.0, DVec3::Y * 0.45, DVec3::X * 4.0, DVec3::Z * -10.0);
    let corners = (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5);
    let hull = Shape::Hull { points: corners.map(|corner| corner * 0.6).collect(), radius: 0.1 };
    let on_ground = body(&mut world, hull.clone(), 10.0, DVec3::new(0.0, 0.5, -5.0), 0.5);
    let on_table = body(&mut world, hull, 10.0, DVec3::new(0.0, 1.5, 20.0), 0.5);
    for _ in 0..60 {
        world.step();
    }
    assert!((world.position(wheel).unwrap().y - 0.4).abs() < 3e-3, "{}", world.position(wheel).unwrap());
    assert!((world.velocity(wheel).unwrap().x - 4.0).abs() < 0.05, "{}", world.velocity(wheel).unwrap());
    assert!((world.position(on_ground).unwrap().y - 0.4).abs() < 3e-3, "{}", world.position(on_ground).unwrap());
    assert!((world.position(on_table).unwrap().y - 1.4).abs() < 3e-3, "{}", world.position(on_table).unwrap());
}
