//! Fast things: nothing gets through what is thin, and nothing is hit by what it passes.

use pita_sim::{Anchor, BodyId, Collider, DQuat, DVec3, RigidBodyDesc, Shape, SpringDesc, StaticDesc, World};

use super::{DT, ground, weightless, world};

fn throw(world: &mut World, shape: Shape, mass: f64, position: DVec3, velocity: DVec3, spin: DVec3) -> BodyId {
    let desc = RigidBodyDesc::new(position, mass, shape.inertia(mass));
    let collider = Some(Collider::new(shape, 0.5));
    world.add_rigid_body(RigidBodyDesc { velocity, angular_velocity: spin, collider, ..desc }).unwrap()
}

fn stand(world: &mut World, shape: Shape, position: DVec3) {
    world.add_static(StaticDesc { position, ..StaticDesc::new(Collider::new(shape, 0.5)) }).unwrap();
}

/// Balls, boxes and capsules that come down on a plane at 1000 m/s stop on it, wherever in the tick they meet it.
#[test]
fn nothing_gets_through_a_plane_at_1000_m_s() {
    let shapes = [
        Shape::Ball { radius: 0.3 },
        Shape::Box { half: DVec3::new(0.3, 0.2, 0.4) },
        Shape::Capsule { half_length: 0.4, radius: 0.1 },
    ];
    for shape in shapes {
        for start in [5.0, 17.3, 31.9] {
            let mut world = world();
            ground(&mut world);
            let id = throw(&mut world, shape.clone(), 2.0, DVec3::Y * start, DVec3::NEG_Y * 1000.0, DVec3::ZERO);
            for _ in 0..30 {
                let deepest = world.step().worst_penetration;
                assert!(deepest < 3e-3, "{shape:?} from {start} m: {deepest} m deep");
                let at = world.position(id).unwrap();
                assert!(at.y > 0.05, "{shape:?} from {start} m: at {at}, {:?}", world.report());
            }
        }
    }
}

/// A ball at 100 m/s against a wall of 1 cm, straight and at an angle, from where the ticks fall differently.
#[test]
fn a_ball_at_100_m_s_stops_at_a_wall_of_a_centimetre() {
    for start in [0.0, 0.7, 1.9, 2.6, 3.3] {
        for across in [0.0, 40.0] {
            let mut world = weightless();
            stand(&mut world, Shape::Box { half: DVec3::new(0.005, 20.0, 20.0) }, DVec3::X * 10.0);
            let velocity = DVec3::new(100.0, across, 0.0);
            let id = throw(&mut world, Shape::Ball { radius: 0.05 }, 1.0, DVec3::X * start, velocity, DVec3::ZERO);
            for _ in 0..10 {
                world.step();
                let x = world.position(id).unwrap().x;
                assert!(x < 9.947, "from {start} m: at {x}");
            }
        }
    }
}

/// A spring that drives a ball 2.5 m from rest in one tick, at a wall of 5 cm: with what it is expected to do, the ball stops
/// in its near half, wherever that is; beside it, the ball passes.
#[test]
fn what_a_spring_drives_stops_at_a_thin_wall() {
    let (stiffness, mass, reach) = (50_000.0, 10.0, 3.0);
    let push = stiffness / mass * DT * DT;
    let drive = |wall: f64, aside: f64| {
        let mut world = weightless();
        stand(&mut world, Shape::Box { half: DVec3::new(0.025, 2.0, 2.0) }, DVec3::new(wall, 0.0, 2.0 + aside));
        let id = throw(&mut world, Shape::Ball { radius: 0.3 }, mass, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let (a, b) = (Anchor::world(DVec3::X * -0.5), Anchor::body(id, DVec3::ZERO));
        let damping = (stiffness * mass).sqrt();
        world.add_spring(SpringDesc { a, b, rest_length: 0.5 + reach, stiffness, damping }).unwrap();
        let mut farthest = 0.0f64;
        for _ in 0..15 {
            let ahead = reach - world.position(id).unwrap().x;
            world.set_surge(id, DVec3::X * (ahead * push / (1.0 + push) / DT)).unwrap();
            world.step();
            farthest = farthest.max(world.position(id).unwrap().x);
        }
        farthest
    };
    for wall in (4..30).map(|wall| 0.1 * f64::from(wall)) {
        let farthest = drive(wall, -2.0);
        assert!((wall - 0.335..wall - 0.3).contains(&farthest), "wall at {wall} m: at {farthest} m");
        assert!(drive(wall, 0.31) > 2.8, "wall at {wall} m, beside it");
    }
}

const WHEEL: Shape = Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 };

fn rolling_wheel(world: &mut World, position: DVec3, speed: f64) -> BodyId {
    throw(world, WHEEL, 25.0, position, DVec3::X * speed, DVec3::NEG_Z * speed / 0.35)
}

/// A wheel that rolls at 60 m/s over a kerb of 6 cm comes over it or off it, and never into the ground.
#[test]
fn a_wheel_at_60_m_s_takes_a_kerb() {
    for start in [0.0, 0.5, 1.0, 1.5] {
        let mut world = world();
        ground(&mut world);
        stand(&mut world, Shape::Box { half: DVec3::new(0.25, 0.06, 6.0) }, DVec3::X * 20.0);
        let id = rolling_wheel(&mut world, DVec3::new(start, 0.35, 0.0), 60.0);
        for tick in 0..60 {
            world.step();
            let (at, velocity) = (world.position(id).unwrap(), world.velocity(id).unwrap());
            assert!(at.y > 0.1 && at.is_finite(), "from {start} m: at {at} in tick {tick}");
            assert!(velocity.length() < 61.0, "from {start} m: {velocity} in tick {tick}");
        }
    }
}

/// A wheel that rolls at 60 m/s into a wall of 5 cm, 1 m high, does not come to lie beyond it, nor rolls over it.
#[test]
fn a_wheel_at_60_m_s_does_not_take_a_wall() {
    for start in [0.0, 0.4, 0.8, 1.2, 1.6] {
        let mut world = world();
        ground(&mut world);
        stand(&mut world, Shape::Box { half: DVec3::new(0.025, 0.5, 6.0) }, DVec3::new(20.0, 0.5, 0.0));
        let id = rolling_wheel(&mut world, DVec3::new(start, 0.35, 0.0), 60.0);
        for tick in 0..60 {
            world.step();
            let at = world.position(id).unwrap();
            assert!(at.x < 19.975 - 0.34, "from {start} m: at {at} in tick {tick}");
        }
    }
}

/// A thin bar that turns by up to 0.7 rad a tick about its middle does not come to lie beyond a post in its way.
#[test]
fn a_turning_bar_does_not_pass_a_post() {
    for spin in [5.0, 10.0, 21.0] {
        let mut world = weightless();
        let post = Shape::Cylinder { half_length: 1.0, radius: 0.1, rounding: 0.02 };
        stand(&mut world, post, DVec3::new(0.0, 0.8, 0.0));
        let bar = Shape::Box { half: DVec3::new(1.0, 0.02, 0.1) };
        // A joint in the middle keeps it there.
        let id = throw(&mut world, bar, 5.0, DVec3::ZERO, DVec3::ZERO, DVec3::Z * spin);
        let (middle, here) = (pita_sim::Anchor::body(id, DVec3::ZERO), pita_sim::Anchor::world(DVec3::ZERO));
        world.add_ball_joint(pita_sim::BallJointDesc::new(middle, here)).unwrap();
        let mut angle: f64 = 0.0;
        for tick in 0..60 {
            world.step();
            let along = world.rotation(id).unwrap() * DVec3::X;
            angle = f64::atan2(along.y, along.x);
            assert!(angle > -0.1 && angle < 1.6, "{spin} rad/s: at {angle} rad in tick {tick}");
        }
        assert!(angle < 1.6, "{spin} rad/s: ends at {angle}");
    }
}

/// A wheel at 60 m/s that passes half a metre beside a post feels nothing of it.
#[test]
fn a_wheel_that_passes_a_post_feels_nothing() {
    let post = Shape::Cylinder { half_length: 1.0, radius: 0.2, rounding: 0.02 };
    for start in [0.0, 0.3, 0.7, 1.1, 1.6] {
        let mut world = weightless();
        let turned = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
        let post = Collider::new(post.clone(), 0.5);
        let beside = DVec3::new(20.0, 0.35, 0.12 + 0.2 + 0.5);
        world.add_static(StaticDesc { position: beside, rotation: turned, ..StaticDesc::new(post) }).unwrap();
        let id = rolling_wheel(&mut world, DVec3::new(start, 0.35, 0.0), 60.0);
        for _ in 0..20 {
            world.step();
        }
        let velocity = world.velocity(id).unwrap();
        assert!((velocity - DVec3::X * 60.0).length() < 1e-6, "from {start} m: {velocity}");
    }
}

/// Near misses: a ball at 80 m/s past a box's edge, a ball between two posts, two balls that cross.
#[test]
fn near_misses_miss() {
    const BALL: Shape = Shape::Ball { radius: 0.2 };
    for start in [0.0, 0.9, 1.8] {
        let mut world = weightless();
        stand(&mut world, Shape::Box { half: DVec3::ONE }, DVec3::new(20.0, -1.25, 0.0));
        stand(&mut world, Shape::Box { half: DVec3::ONE }, DVec3::new(20.0, 1.25, 0.0));
        let id = throw(&mut world, BALL, 1.0, DVec3::X * start, DVec3::X * 80.0, DVec3::ZERO);
        (0..20).for_each(|_| {
            world.step();
        });
        assert!((world.velocity(id).unwrap() - DVec3::X * 80.0).length() < 1e-6, "{}", world.velocity(id).unwrap());
    }
    // They would be at the same place, two ticks apart.
    let mut world = weightless();
    let a = throw(&mut world, BALL, 1.0, DVec3::X * -10.0, DVec3::X * 50.0, DVec3::ZERO);
    let b = throw(&mut world, BALL, 1.0, DVec3::Z * -(10.0 + 2.0 * DT * 50.0), DVec3::Z * 50.0, DVec3::ZERO);
    (0..20).for_each(|_| {
        world.step();
    });
    assert!((world.velocity(a).unwrap() - DVec3::X * 50.0).length() < 1e-6, "{}", world.velocity(a).unwrap());
    assert!((world.velocity(b).unwrap() - DVec3::Z * 50.0).length() < 1e-6, "{}", world.velocity(b).unwrap());
}
