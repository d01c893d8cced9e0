//! Contacts under load: gaps that hold whatever the masses, and resistance to rolling and spinning.

use pita_sim::{BodyId, Collider, DQuat, DVec3, Material, RigidBodyDesc, Shape, StaticDesc, Surface, World};

use super::{DT, body, ground, world};

/// What is heavy stands on what is light: no contact is deeper than the tolerance and half of it again once it rests, none
/// was ever deeper than a few of them, and nothing moves.
#[test]
fn heavy_stands_on_light() {
    for (light, heavy) in [(1.0, 1000.0), (1.0, 10_000.0), (0.1, 1000.0)] {
        let mut world = world();
        ground(&mut world);
        let shape = Shape::Box { half: DVec3::splat(0.5) };
        let small: Vec<_> =
            (0..3).map(|i| body(&mut world, shape.clone(), light, DVec3::Y * (0.5 + f64::from(i)), 0.5)).collect();
        let top = body(&mut world, shape.clone(), heavy, DVec3::Y * 3.5, 0.5);
        let mut worst: f64 = 0.0;
        for tick in 0..300 {
            worst = worst.max(world.step().worst_penetration);
            let now = world.report().worst_penetration;
            assert!(tick < 60 || now < 1.5e-3, "{heavy} kg on {light} kg: {now} m deep in tick {tick}");
        }
        assert!(worst < 6e-3, "{heavy} kg on {light} kg: {worst} m deep at first");
        for (i, &id) in small.iter().chain([&top]).enumerate() {
            let (position, speed) = (world.position(id).unwrap(), world.velocity(id).unwrap().length());
            let expected = DVec3::Y * (0.5 + i as f64);
            assert!((position - expected).length() < 5e-3 && speed < 1e-4, "box {i} at {position}, {speed} m/s");
        }
    }
}

fn resisting(rolling_resistance: f64, spinning_resistance: f64) -> Material {
    let surface = Surface { friction: 0.8, rolling_resistance, spinning_resistance, ..Surface::default() };
    Material { surface, ..Material::default() }
}

const RADIUS: f64 = 0.2;

fn ball(world: &mut World, material: Material, velocity: DVec3, spin: DVec3) -> BodyId {
    let shape = Shape::Ball { radius: RADIUS };
    let desc = RigidBodyDesc::new(DVec3::Y * RADIUS, 3.0, shape.inertia(3.0));
    let collider = Some(Collider::new(shape, material));
    world.add_rigid_body(RigidBodyDesc { velocity, angular_velocity: spin, collider, ..desc }).unwrap()
}

/// A ball that rolls slows down by 5/7 g b / r, and then stands; without resistance it goes on.
#[test]
fn a_ball_rolls_out_by_the_stated_coefficient() {
    let lever = 0.01;
    let mut world = world();
    ground(&mut world);
    let rolls = |speed: f64| (DVec3::X * speed, DVec3::NEG_Z * speed / RADIUS);
    let (velocity, spin) = rolls(2.0);
    let id = ball(&mut world, resisting(lever, 0.0), velocity, spin);
    let deceleration = 5.0 / 7.0 * 9.81 * lever / RADIUS;
    for _ in 0..60 {
        world.step();
    }
    let (speed, expected) = (world.velocity(id).unwrap().x, 2.0 - deceleration * 60.0 * DT);
    assert!((speed - expected).abs() < 0.01, "{speed} instead of {expected}");
    for _ in 0..180 {
        world.step();
    }
    let stands = world.position(id).unwrap();
    assert!(world.velocity(id).unwrap().length() < 1e-4, "{}", world.velocity(id).unwrap());
    (0..60).for_each(|_| {
        world.step();
    });
    assert!((world.position(id).unwrap() - stands).length() < 1e-5);
    let mut free = super::world();
    ground(&mut free);
    let id = ball(&mut free, resisting(0.0, 0.0), velocity, spin);
    (0..240).for_each(|_| {
        free.step();
    });
    assert!((free.velocity(id).unwrap().x - 2.0).abs() < 0.01, "{}", free.velocity(id).unwrap());
}

/// On a slope a ball stays where tan θ is less than b / r, without creep, and rolls where it is more.
#[test]
fn a_ball_stays_on_a_gentle_slope() {
    for (slope, stays) in [(0.04f64, true), (0.06, false)] {
        let angle = slope.atan();
        let normal = DVec3::new(angle.sin(), angle.cos(), 0.0);
        let mut world = world();
        let plane = Collider::new(Shape::HalfSpace { normal }, resisting(0.0, 0.0));
        world.add_static(StaticDesc::new(plane)).unwrap();
        let id = ball(&mut world, resisting(0.01, 0.0), DVec3::ZERO, DVec3::ZERO);
        world.set_pose(id, normal * RADIUS, DQuat::IDENTITY).unwrap();
        let mut second = DVec3::ZERO;
        for tick in 0..90 {
            world.step();
            if tick == 60 {
                second = world.position(id).unwrap();
            }
        }
        let crept = (world.position(id).unwrap() - second).length();
        if stays {
            assert!(crept < 1e-6, "crept by {crept} m in the last second");
        } else {
            let expected = 5.0 / 7.0 * 9.81 * (angle.sin() - 0.05 * angle.cos()) * 3.0;
            let speed = world.velocity(id).unwrap().length();
            assert!((speed / expected - 1.0).abs() < 0.05, "{speed} m/s instead of {expected}");
        }
    }
}

/// A ball that spins on the spot slows down by b m g over its inertia, and then stands.
#[test]
fn a_ball_spins_out_by_the_stated_coefficient() {
    let lever = 0.005;
    let mut world = world();
    ground(&mut world);
    let id = ball(&mut world, resisting(0.0, lever), DVec3::ZERO, DVec3::Y * 10.0);
    let deceleration = 9.81 * lever / (0.4 * RADIUS * RADIUS);
    (0..60).for_each(|_| {
        world.step();
    });
    let (spin, expected) = (world.angular_velocity(id).unwrap().y, 10.0 - deceleration * 60.0 * DT);
    assert!((spin - expected).abs() < 0.05, "{spin} instead of {expected}");
    (0..60).for_each(|_| {
        world.step();
    });
    assert!(world.angular_velocity(id).unwrap().length() < 1e-3);
}
