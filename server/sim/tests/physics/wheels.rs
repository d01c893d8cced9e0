//! Wheels on hinges: as stable as those on axles, however fast they spin.

use pita_sim::{Anchor, BodyId, DVec3, Driven, HingeDesc, Motor, MotorDesc, MotorId, RigidBodyDesc, Shape, World};

use super::weightless;

/// Where the hubs are in the chassis' frame, m.
const HUBS: [(f64, f64); 4] = [(1.3, -0.8), (1.3, 0.8), (-1.3, -0.8), (-1.3, 0.8)];

/// A car in free flight that turns with `turn` while its wheels spin at 20 m/s. `wheel_first` makes the wheel the first
/// end of every hinge.
fn flying_car(turn: DVec3, brake: f64, wheel_first: bool) -> (World, BodyId, Vec<BodyId>, Vec<MotorId>) {
    let mut world = weightless();
    let inertia = Shape::Box { half: DVec3::new(1.9, 0.3, 0.85) }.inertia(1100.0);
    let body = RigidBodyDesc { angular_velocity: turn, ..RigidBodyDesc::new(DVec3::ZERO, 1100.0, inertia) };
    let chassis = world.add_rigid_body(body).unwrap();
    let inertia = Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 }.inertia(25.0);
    let (mut wheels, mut motors) = (Vec::new(), Vec::new());
    for hub in HUBS.map(|(x, z)| DVec3::new(x, -0.25, z)) {
        let wheel = RigidBodyDesc {
            velocity: turn.cross(hub),
            angular_velocity: turn - DVec3::Z * 57.0,
            ..RigidBodyDesc::new(hub, 25.0, inertia)
        };
        let wheel = world.add_rigid_body(wheel).unwrap();
        let (a, b) = (Anchor::body(chassis, hub), Anchor::body(wheel, DVec3::ZERO));
        let (a, b) = if wheel_first { (b, a) } else { (a, b) };
        let hinge = world.add_hinge(HingeDesc::new(a, b, DVec3::Z, DVec3::Z)).unwrap();
        if brake > 0.0 {
            let motor = Motor { target_speed: 0.0, gain: 1e6, max_torque: brake };
            motors.push(world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor }).unwrap());
        }
        wheels.push(wheel);
    }
    (world, chassis, wheels, motors)
}

/// Where the free nutation of the wheels is predicted, Newton diverges within a second (`potential/axle.rs`).
#[test]
fn spinning_wheels_on_hinges_follow_a_turning_chassis() {
    for wheel_first in [false, true] {
        let (mut world, chassis, wheels, _) = flying_car(DVec3::new(0.0, 0.5, 0.0), 0.0, wheel_first);
        let before = world.momentum().angular;
        for tick in 0..30 {
            let report = world.step();
            assert!(report.unconverged_islands == 0 && report.iterations <= 6, "tick {tick}: {report:?}");
            assert!(report.worst_joint_gap < 1e-3 && report.worst_joint_tilt < 1.1e-3, "tick {tick}: {report:?}");
        }
        let change = (world.momentum().angular - before).length() / before.length();
        assert!(change < 3e-3, "angular momentum changed by {change}");
        let turn = world.angular_velocity(chassis).unwrap();
        assert!((0.2..0.5).contains(&turn.x) && (turn.y - 0.5).abs() < 0.05, "{turn}");
        for wheel in wheels {
            let spin = world.angular_velocity(wheel).unwrap().dot(world.rotation(wheel).unwrap() * DVec3::Z);
            assert!((spin + 57.0).abs() < 0.6, "{spin}");
        }
    }
}

#[test]
fn a_tumbling_car_keeps_its_wheels_on_hinges_while_they_lock() {
    for turn in [DVec3::new(6.0, 0.0, 0.0), DVec3::new(0.0, 6.0, 0.0), DVec3::new(4.0, -3.0, 5.0)] {
        let (mut world, chassis, ..) = flying_car(turn, 2_500.0, false);
        let energy = world.energy().kinetic;
        for tick in 0..60 {
            let report = world.step();
            assert!(report.worst_joint_gap < 5e-3 && report.residual < 1.0, "{turn}, tick {tick}: {report:?}");
        }
        assert!(world.energy().kinetic < energy);
        assert!(world.angular_velocity(chassis).unwrap().length() < 10.0);
    }
}

/// A wheel on the world, at 500 rad/s, does not slow down, and where its axis is held is where it stays.
#[test]
fn a_flywheel_on_the_world_keeps_its_spin() {
    let mut world = weightless();
    let inertia = Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 }.inertia(25.0);
    let spin = DVec3::Z * 500.0;
    let wheel = RigidBodyDesc { angular_velocity: spin, ..RigidBodyDesc::new(DVec3::ZERO, 25.0, inertia) };
    let wheel = world.add_rigid_body(wheel).unwrap();
    let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(wheel, DVec3::ZERO));
    world.add_hinge(HingeDesc::new(a, b, DVec3::Z, DVec3::Z)).unwrap();
    for tick in 0..150 {
        if tick == 20 {
            world.apply_force(wheel, DVec3::X * 5e3, DVec3::Z * 0.1).unwrap();
        }
        let report = world.step();
        assert!(report.unconverged_islands == 0 && report.open_joints == 0, "tick {tick}: {report:?}");
    }
    let left = world.angular_velocity(wheel).unwrap();
    assert!((left - spin).length() < 0.5, "{left}");
}
