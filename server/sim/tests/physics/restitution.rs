//! Restitution: how high things bounce, that they do not gain by it, and that they come to rest.

use pita_sim::{BodyId, Collider, DQuat, DVec3, Material, RigidBodyDesc, Shape, StaticDesc, Surface, World};

use super::{DT, weightless, world};

fn bouncy(restitution: f64, friction: f64) -> Material {
    Material { surface: Surface { restitution, friction, ..Surface::default() }, ..Material::default() }
}

fn floor(world: &mut World, restitution: f64) {
    let shape = Shape::HalfSpace { normal: DVec3::Y };
    world.add_static(StaticDesc::new(Collider::new(shape, bouncy(restitution, 0.5)))).unwrap();
}

fn add(world: &mut World, shape: Shape, material: Material, position: DVec3, velocity: DVec3) -> BodyId {
    let desc = RigidBodyDesc::new(position, 2.0, shape.inertia(2.0));
    let collider = Some(Collider::new(shape, material));
    world.add_rigid_body(RigidBodyDesc { velocity, collider, ..desc }).unwrap()
}

const RADIUS: f64 = 0.2;
const BALL: Shape = Shape::Ball { radius: RADIUS };

/// Heights of the first bounces of a ball that falls from `height`, m.
fn bounces(restitution: f64, height: f64, ticks: usize) -> Vec<f64> {
    let mut world = world();
    floor(&mut world, restitution);
    let ball = add(&mut world, BALL, bouncy(0.0, 0.0), DVec3::Y * (height + RADIUS), DVec3::ZERO);
    let (mut apexes, mut rising, mut last) = (Vec::new(), false, height);
    for _ in 0..ticks {
        world.step();
        let now = world.position(ball).unwrap().y - RADIUS;
        assert!(now > -2e-3, "sank to {now}");
        if rising && now < last {
            apexes.push(last);
        }
        (rising, last) = (now > last, now);
    }
    apexes
}

/// The first bounce rises to e² of the height within 1.5 % and 4 mm, wherever the ticks fall; a tick samples the apex
/// within 1.4 mm.
#[test]
fn bounce_heights_are_the_square_of_the_restitution() {
    for restitution in [0.5, 0.8, 1.0] {
        for height in [0.5, 0.77, 1.0, 1.9, 3.1, 10.0] {
            let expected = restitution * restitution * height;
            let apex = bounces(restitution, height, 90)[0];
            assert!(
                (apex - expected).abs() < 0.015 * expected + 4e-3,
                "e {restitution}, {height} m: {apex}, {expected}"
            );
        }
    }
}

#[test]
fn without_restitution_nothing_bounces() {
    for height in [0.3, 1.0, 5.0] {
        let highest = bounces(0.0, height, 90).into_iter().fold(0.0, f64::max);
        assert!(highest < 1e-3, "{highest}");
    }
}

/// Not one of many bounces is higher than the one before, up to how apexes are sampled, and e = 1 goes on bouncing.
#[test]
fn bounces_never_gain() {
    for restitution in [0.6, 0.9, 1.0] {
        let apexes = bounces(restitution, 2.0, 1800);
        let mut last = 2.0;
        for apex in &apexes {
            assert!(*apex < last + 3e-3, "e {restitution}: {apex} after {last}");
            last = last.min(*apex);
        }
        if restitution == 1.0 {
            assert!(apexes.len() > 35 && last > 1.2, "{} bounces, the last to {last}", apexes.len());
        } else {
            assert!(last < 0.05, "e {restitution}: still {last}");
        }
    }
}

/// Two balls of different masses in space: momentum stays, relative speed becomes e times what it was.
#[test]
fn balls_exchange_momentum() {
    for restitution in [0.3, 1.0] {
        let mut world = weightless();
        let heavy = RigidBodyDesc::new(DVec3::X * 2.03, 6.0, BALL.inertia(6.0));
        let light = add(&mut world, BALL, bouncy(restitution, 0.3), DVec3::ZERO, DVec3::X * 5.0);
        let collider = Some(Collider::new(BALL, bouncy(0.0, 0.3)));
        let heavy = world.add_rigid_body(RigidBodyDesc { collider, ..heavy }).unwrap();
        (0..30).for_each(|_| {
            world.step();
        });
        let parting = world.velocity(heavy).unwrap().x - world.velocity(light).unwrap().x;
        assert!((parting - restitution * 5.0).abs() < 0.02, "e {restitution}: {parting}");
        assert!((world.momentum().linear.x - 10.0).abs() < 0.02, "{}", world.momentum().linear);
    }
}

/// Boxes, capsules and wheels thrown onto the floor, tumbling, without friction: the energy that they have in all never
/// rises by more than the bounce of a tick is off.
#[test]
fn tumbling_shapes_do_not_gain_energy() {
    let shapes = [
        Shape::Box { half: DVec3::new(0.5, 0.2, 0.3) },
        Shape::Capsule { half_length: 0.5, radius: 0.2 },
        Shape::Cylinder { half_length: 0.2, radius: 0.4, rounding: 0.03 },
    ];
    for shape in shapes {
        for restitution in [0.5, 0.9] {
            let mut world = world();
            floor(&mut world, restitution);
            let body = add(&mut world, shape.clone(), bouncy(0.0, 0.0), DVec3::Y * 2.0, DVec3::ZERO);
            let turned = DQuat::from_scaled_axis(DVec3::new(0.4, 0.2, 0.7));
            world.set_pose(body, DVec3::Y * 2.0, turned).unwrap();
            let start = world.energy().total();
            let mut highest: f64 = 0.0;
            for _ in 0..600 {
                world.step();
                highest = highest.max(world.energy().total());
            }
            // The speed at the end of a tick is half a tick ahead of the position: g dt v / 2 at 6 m/s.
            assert!(highest < start + 2.0 * 9.81 * DT * 3.2, "{shape:?} {restitution}: {highest} of {start}");
            // What spins without friction may go on spinning.
            let end = world.energy().total();
            assert!(end < 0.8 * start, "{shape:?} {restitution}: still {end} of {start}");
        }
    }
}

/// A stack of bouncy boxes that is dropped comes to rest and stands.
#[test]
fn a_bouncy_stack_comes_to_rest() {
    let mut world = world();
    floor(&mut world, 0.3);
    let half = DVec3::splat(0.25);
    let place = |i: usize| DVec3::Y * (0.25 + 0.5 * i as f64 + 0.05 * (i + 1) as f64);
    let boxes: Vec<_> =
        (0..6).map(|i| add(&mut world, Shape::Box { half }, bouncy(0.3, 0.5), place(i), DVec3::ZERO)).collect();
    for _ in 0..240 {
        world.step();
    }
    for (i, &id) in boxes.iter().enumerate() {
        let (position, speed) = (world.position(id).unwrap(), world.velocity(id).unwrap().length());
        let expected = 0.25 + 0.5 * i as f64;
        assert!((position - DVec3::Y * expected).length() < 5e-3 && speed < 1e-3, "box {i} at {position}, {speed} m/s");
    }
}
