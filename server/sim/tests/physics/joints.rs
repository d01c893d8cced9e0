//! Joints: gaps, loads, removal.

use pita_sim::{
    Anchor, BallJointDesc, BodyId, DQuat, DVec3, FixedJointDesc, JointId, RigidBodyDesc, Shape, SpringDesc, World,
};

use super::{body, particle, world};

/// Links from the world's origin along +x, joint to joint 0.25 m; answers the last one.
pub fn chain(world: &mut World, links: usize, mass: f64, tolerance: f64) -> Vec<BodyId> {
    let mut ids: Vec<BodyId> = Vec::new();
    for i in 0..links {
        let shape = Shape::Capsule { half_length: 0.1, radius: 0.03 };
        let position = DVec3::X * (0.25 * i as f64 + 0.125);
        let link = world.add_rigid_body(RigidBodyDesc::new(position, mass, shape.inertia(mass))).unwrap();
        let a = match ids.last() {
            Some(&last) => Anchor::body(last, DVec3::X * 0.125),
            None => Anchor::world(DVec3::ZERO),
        };
        let b = Anchor::body(link, DVec3::X * -0.125);
        world.add_ball_joint(BallJointDesc { a, b, tolerance }).unwrap();
        ids.push(link);
    }
    ids
}

/// A light chain swings a load a thousand times as heavy as a link, straight down in the end, and never gains energy.
#[test]
fn a_loaded_chain_holds() {
    let mut world = world();
    let links = chain(&mut world, 20, 0.5, 1e-3);
    let load = Shape::Ball { radius: 0.5 }.inertia(500.0);
    let load = world.add_rigid_body(RigidBodyDesc::new(DVec3::X * 5.5, 500.0, load)).unwrap();
    let a = Anchor::body(links[19], DVec3::X * 0.125);
    world.add_ball_joint(BallJointDesc::new(a, Anchor::body(load, DVec3::X * -0.5))).unwrap();
    let start = world.energy().total();
    for tick in 0..300 {
        world.step();
        let report = world.report();
        assert!(report.worst_joint_gap < 5e-3, "tick {tick}: {report:?}");
        assert!(world.energy().total() < start + 0.01 * 500.0 * 9.81 * 5.5, "tick {tick}");
    }
}

/// A two-point pendulum keeps to its rod and loses energy, as implicit Euler at 30 Hz does (DESIGN, section 4).
#[test]
fn a_rod_pendulum_swings_and_fades() {
    let mut world = world();
    let bob = particle(&mut world, DVec3::X, DVec3::ZERO, 1.0);
    let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(bob, DVec3::ZERO));
    world.add_spring(SpringDesc { a, b, rest_length: 1.0, stiffness: 1e6, damping: 0.0 }).unwrap();
    let (mut lowest, mut energy) = (0.0f64, world.energy().total());
    for _ in 0..30 {
        world.step();
        lowest = lowest.min(world.position(bob).unwrap().y);
        assert!(world.energy().total() <= energy + 1e-3);
        energy = world.energy().total();
        assert!((world.position(bob).unwrap().length() - 1.0).abs() < 1e-3);
    }
    assert!(lowest < -0.95, "{lowest}");
}

#[test]
fn removing_a_body_frees_what_hung_on_it() {
    let mut world = world();
    let links = chain(&mut world, 3, 1.0, 1e-3);
    for _ in 0..30 {
        world.step();
    }
    assert!(world.remove_body(links[1]));
    assert!(!world.remove_body(links[1]));
    let before = world.velocity(links[2]).unwrap().y;
    world.step();
    let fallen = world.velocity(links[2]).unwrap().y - before;
    assert!((fallen + 9.81 / 30.0).abs() < 1e-9, "{fallen}");
    assert_eq!(world.report().islands, 1);
}

/// A lamp hangs from the ceiling by a ball joint, or is welded to it: the joint bears its weight, upwards on the lamp.
#[test]
fn joints_tell_what_they_bear() {
    let mut world = world();
    let above = DVec3::Y * 3.0;
    let lamp = body(&mut world, Shape::Ball { radius: 0.2 }, 5.0, DVec3::Y * 2.0, 0.5);
    let ends = (Anchor::world(above), Anchor::body(lamp, DVec3::Y));
    let hung = JointId::Ball(world.add_ball_joint(BallJointDesc::new(ends.0, ends.1)).unwrap());
    assert_eq!(world.joint_load(hung), Some((above, DVec3::ZERO)), "nothing yet");
    let bears_weight = |world: &World, joint| {
        let (at, force) = world.joint_load(joint).unwrap();
        assert!(at == above && (force - DVec3::Y * 5.0 * 9.81).length() < 0.01 * 5.0 * 9.81, "{force} at {at}");
    };
    (0..30).for_each(|_| {
        world.step();
    });
    bears_weight(&world, hung);
    assert!(world.remove_joint(hung) && world.joint_load(hung).is_none() && !world.remove_joint(hung));
    world.set_pose(lamp, DVec3::Y * 2.0, DQuat::IDENTITY).unwrap();
    world.set_velocity(lamp, DVec3::ZERO, DVec3::ZERO).unwrap();
    let welded = JointId::Fixed(world.add_fixed_joint(FixedJointDesc::new(ends.0, ends.1)).unwrap());
    (0..30).for_each(|_| {
        world.step();
    });
    bears_weight(&world, welded);
}
