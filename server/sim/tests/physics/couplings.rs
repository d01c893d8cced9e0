//! What couples the wheels of a car: anti-roll bars and the clutches of differentials.

use pita_sim::{
    AntiRollBarDesc, AxleControl, AxleDesc, AxleId, BodyId, DVec3, Driven, Motor, MotorDesc, RigidBodyDesc, Shape,
    SimError, World,
};

use super::{body, ground, weightless, world};

const STIFFNESS: f64 = 4e4;
const BAR: f64 = 1.5e4;
const HALF_TRACK: f64 = 0.8;
const MASS: f64 = 1100.0;

struct Car {
    chassis: BodyId,
    wheels: Vec<BodyId>,
    axles: Vec<AxleId>,
}

/// Front left, front right, rear left, rear right.
fn car(world: &mut World) -> Car {
    let inertia = Shape::Box { half: DVec3::new(1.9, 0.3, 0.85) }.inertia(MASS);
    let chassis = world.add_rigid_body(RigidBodyDesc::new(DVec3::Y * 0.55, MASS, inertia)).unwrap();
    // A broad wheel stands on its edge as soon as the car rolls, and bears a torque.
    let tyre = Shape::Ball { radius: 0.35 };
    let (mut wheels, mut axles) = (Vec::new(), Vec::new());
    for (x, z) in [(1.3, -HALF_TRACK), (1.3, HALF_TRACK), (-1.3, -HALF_TRACK), (-1.3, HALF_TRACK)] {
        let wheel = body(world, tyre.clone(), 25.0, DVec3::new(x, 0.35, z), 1.0);
        let (hub, control) = (DVec3::new(x, -0.25, z), AxleControl::default());
        let desc = AxleDesc { chassis, wheel, hub, stiffness: STIFFNESS, damping: 4e3, control };
        axles.push(world.add_axle(desc).unwrap());
        wheels.push(wheel);
    }
    Car { chassis, wheels, axles }
}

fn roll(world: &World, car: &Car) -> f64 {
    (world.rotation(car.chassis).unwrap() * DVec3::Z).y.asin()
}

/// A torque about the car's length rolls it by torque / stiffness: four springs at half the track, two bars.
#[test]
fn an_anti_roll_bar_adds_its_stiffness_to_that_of_the_springs() {
    for bar in [0.0, BAR] {
        let mut world = world();
        ground(&mut world);
        let car = car(&mut world);
        for pair in [[0, 1], [2, 3]] {
            let axles = pair.map(|i: usize| car.axles[i]);
            world.add_anti_roll_bar(AntiRollBarDesc { axles, stiffness: bar }).unwrap();
        }
        let torque = 2_000.0;
        for _ in 0..120 {
            world.apply_torque(car.chassis, DVec3::NEG_X * torque).unwrap();
            world.step();
        }
        let lever = HALF_TRACK * HALF_TRACK;
        // A bar sees the difference of both travels, which is twice the travel of each.
        let stiffness = 4.0 * STIFFNESS * lever + 2.0 * 2.0 * 2.0 * bar * lever;
        let (found, expected) = (roll(&world, &car), torque / stiffness);
        assert!((found / expected - 1.0).abs() < 0.03, "bar {bar}: {found} rad instead of {expected}");
    }
}

/// It is inner: a car in free flight keeps its momenta while its wheels swing against each other.
#[test]
fn an_anti_roll_bar_keeps_momentum_and_does_not_mind_travel_of_both_wheels() {
    let mut world = weightless();
    let car = car(&mut world);
    let axles = [car.axles[0], car.axles[1]];
    world.add_anti_roll_bar(AntiRollBarDesc { axles, stiffness: 1e5 }).unwrap();
    world.set_velocity(car.wheels[0], DVec3::Y * 3.0, DVec3::ZERO).unwrap();
    let before = world.momentum();
    for _ in 0..60 {
        world.step();
    }
    let after = world.momentum();
    assert!(after.linear.distance(before.linear) < 1e-3 * before.linear.length(), "{before:?} {after:?}");
    assert!(after.angular.distance(before.angular) < 3e-3 * before.angular.length(), "{before:?} {after:?}");
    assert!(world.energy().kinetic < 0.5 * 25.0 * 9.0);
}

/// All torque goes to one wheel; the clutch shares it, up to its limit.
#[test]
fn a_clutch_locks_two_wheels_up_to_its_limit() {
    let spins = |limit: f64| {
        let mut world = weightless();
        let car = car(&mut world);
        let joint = Driven::Wheels([car.axles[0], car.axles[1]]);
        let motor = Motor { target_speed: 0.0, gain: 1e4, max_torque: limit };
        world.add_motor(MotorDesc { joint, motor }).unwrap();
        let drive = Motor { target_speed: -1e3, gain: 1e3, max_torque: 100.0 };
        world.set_axle(car.axles[0], AxleControl { drive, ..AxleControl::default() }).unwrap();
        for _ in 0..15 {
            world.step();
        }
        [0, 1].map(|i| -world.angular_velocity(car.wheels[i]).unwrap().z)
    };
    let [open, none] = spins(0.0);
    assert!(open > 20.0 && none.abs() < 1.0, "open: {open} {none}");
    let [driven, dragged] = spins(1e6);
    assert!((driven - dragged).abs() < 0.1 && (driven / open - 0.5).abs() < 0.03, "locked: {driven} {dragged}");
    let [driven, dragged] = spins(20.0);
    assert!((dragged / driven - 0.25).abs() < 0.02, "20 of 100 N m: {driven} {dragged}");
}

#[test]
fn couplings_go_with_their_axles_and_need_one_chassis() {
    let mut world = weightless();
    let (one, other) = (car(&mut world), car(&mut world));
    let motor = Motor { target_speed: 0.0, gain: 1e4, max_torque: 1.0 };
    for axles in [[one.axles[0], one.axles[0]], [one.axles[0], other.axles[0]]] {
        let refused = world.add_anti_roll_bar(AntiRollBarDesc { axles, stiffness: BAR }).unwrap_err();
        assert!(matches!(refused, SimError::Unusable { .. }), "{refused}");
        let refused = world.add_motor(MotorDesc { joint: Driven::Wheels(axles), motor }).unwrap_err();
        assert!(refused.to_string().contains("one chassis"), "{refused}");
    }
    let axles = [one.axles[2], one.axles[3]];
    let bar = world.add_anti_roll_bar(AntiRollBarDesc { axles, stiffness: BAR }).unwrap();
    let clutch = world.add_motor(MotorDesc { joint: Driven::Wheels(axles), motor }).unwrap();
    let refused = world.add_anti_roll_bar(AntiRollBarDesc { axles, stiffness: -1.0 }).unwrap_err();
    assert!(refused.to_string().contains("stiffness is -1"), "{refused}");
    world.remove_body(one.wheels[3]);
    assert!(!world.remove_anti_roll_bar(bar) && world.motor(clutch).is_none());
    world.step();
}
