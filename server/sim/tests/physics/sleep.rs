//! Sleep: what is still leaves the tick, and everything that should wakes it.

use pita_sim::{
    Anchor, AngleLimitDesc, AxleControl, AxleDesc, AxleId, BodyId, Collider, DQuat, DVec3, HingeDesc, Motor,
    RigidBodyDesc, RodDesc, Settings, Shape, SpringDesc, StaticDesc, StepReport, World,
};

use super::sheep::{PARTS, add_articulated, coordinates};
use super::{DT, body, cube, ground, particle, weightless, world};

fn run(world: &mut World, ticks: usize) {
    for _ in 0..ticks {
        world.step();
    }
}

/// Runs until all of `bodies` sleep.
fn settle(world: &mut World, bodies: &[BodyId]) {
    for _ in 0..600 {
        world.step();
        if bodies.iter().all(|&id| world.is_asleep(id)) {
            return;
        }
    }
    let speeds: Vec<_> = bodies.iter().map(|&id| world.velocity(id).unwrap().length()).collect();
    panic!("still awake after 20 s: {speeds:?} m/s");
}

fn pile(world: &mut World) -> Vec<BodyId> {
    let at = |i: i32| DVec3::new(0.3 * f64::from(i % 3), 0.5 + 1.05 * f64::from(i), 0.2 * f64::from(i % 2));
    (0..12).map(|i| cube(world, at(i))).collect()
}

/// What a tick did, but for how many sleep.
fn work(world: &World) -> StepReport {
    StepReport { asleep: 0, ..world.report().clone() }
}

#[test]
fn a_pile_sleeps_for_nothing_and_one_touch_wakes_it() {
    let mut world = world();
    ground(&mut world);
    let crates = pile(&mut world);
    settle(&mut world, &crates);
    let (hash, places) = (world.state_hash(), crates.iter().map(|&id| world.position(id)).collect::<Vec<_>>());
    run(&mut world, 30);
    assert_eq!(work(&world), StepReport::default(), "sleeping costs something");
    assert_eq!(world.report().asleep, crates.len());
    assert_eq!(world.state_hash(), hash, "sleepers moved");
    assert!(crates.iter().all(|&id| world.velocity(id) == Some(DVec3::ZERO)));
    // A ball drops on one of them. Contacts that bear the pile are still known: nothing shifts.
    let top = crates.iter().map(|&id| world.position(id).unwrap()).max_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
    let ball = body(&mut world, Shape::Ball { radius: 0.1 }, 0.1, top + DVec3::Y * 1.0, 0.5);
    run(&mut world, 3);
    assert!(crates.iter().all(|&id| world.is_asleep(id)), "woken by what has not touched yet");
    run(&mut world, 12);
    let woken = crates.iter().filter(|&&id| !world.is_asleep(id)).count();
    assert!(woken > 0 && !world.is_asleep(ball), "the ball woke nothing");
    run(&mut world, 60);
    for (&id, before) in crates.iter().zip(places) {
        let shift = (world.position(id).unwrap() - before.unwrap()).length();
        assert!(shift < 2e-3, "a crate shifted by {shift} m");
    }
}

/// Sleepers that touch one another wake as one.
#[test]
fn an_island_wakes_as_a_whole() {
    let mut world = world();
    ground(&mut world);
    let tower: Vec<_> = (0..4).map(|i| cube(&mut world, DVec3::Y * (0.5 + f64::from(i)))).collect();
    let far = cube(&mut world, DVec3::new(20.0, 0.5, 0.0));
    settle(&mut world, &[tower.as_slice(), &[far]].concat());
    world.wake(tower[3]).unwrap();
    assert!(tower.iter().all(|&id| !world.is_asleep(id)) && world.is_asleep(far));
    run(&mut world, 2);
    assert_eq!(world.report().bodies, 4);
    settle(&mut world, &tower);
}

#[test]
fn removed_and_moved_supports_wake() {
    let mut world = world();
    let table = Collider::new(Shape::Box { half: DVec3::new(3.0, 0.5, 3.0) }, 0.5);
    let table = world.add_static(StaticDesc { position: DVec3::Y * -0.5, ..StaticDesc::new(table) }).unwrap();
    let tower = [0.5, 1.5, 2.5].map(|y| cube(&mut world, DVec3::Y * y));
    settle(&mut world, &tower);
    world.remove_body(tower[1]);
    run(&mut world, 10);
    assert!(world.position(tower[2]).unwrap().y < 2.3, "nothing fell");
    settle(&mut world, &[tower[0], tower[2]]);
    world.set_pose(tower[0], DVec3::new(30.0, 0.5, 0.0), DQuat::IDENTITY).unwrap();
    run(&mut world, 10);
    assert!(world.position(tower[2]).unwrap().y < 1.3, "nothing fell");
    settle(&mut world, &[tower[2]]);
    assert!(world.remove_static(table));
    run(&mut world, 30);
    assert!(world.position(tower[2]).unwrap().y < -1.0, "nothing fell");
}

/// The same for a half-space, which has no bounds, and for geometry that comes.
#[test]
fn ground_that_goes_and_walls_that_come_wake() {
    let mut world = world();
    let plane = Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5);
    let plane = world.add_static(StaticDesc::new(plane)).unwrap();
    let crates = [cube(&mut world, DVec3::Y * 0.5), cube(&mut world, DVec3::new(10.0, 0.5, 0.0))];
    settle(&mut world, &crates);
    let wall = Collider::new(Shape::Box { half: DVec3::splat(0.5) }, 0.5);
    world.add_static(StaticDesc { position: DVec3::new(0.8, 0.5, 0.0), ..StaticDesc::new(wall) }).unwrap();
    assert!(!world.is_asleep(crates[0]) && world.is_asleep(crates[1]));
    run(&mut world, 30);
    assert!(world.position(crates[0]).unwrap().x < -0.15, "not pushed out");
    settle(&mut world, &crates);
    world.remove_static(plane);
    run(&mut world, 10);
    assert!(crates.iter().all(|&id| world.position(id).unwrap().y < 0.3), "nothing fell");
}

#[test]
fn forces_velocities_and_code_wake() {
    let mut world = world();
    ground(&mut world);
    let id = cube(&mut world, DVec3::Y * 0.5);
    type Deed = fn(&mut World, BodyId);
    let wakes: [Deed; 4] = [
        |world, id| world.apply_force(id, DVec3::X, DVec3::ZERO).unwrap(),
        |world, id| world.set_velocity(id, DVec3::X * 1e-3, DVec3::ZERO).unwrap(),
        |world, id| world.set_pose(id, DVec3::Y * 0.5, DQuat::IDENTITY).unwrap(),
        |world, id| world.wake(id).unwrap(),
    ];
    for (i, wake) in wakes.into_iter().enumerate() {
        settle(&mut world, &[id]);
        wake(&mut world, id);
        assert!(!world.is_asleep(id), "deed {i}");
        world.step();
        assert_eq!(world.report().bodies, 1, "deed {i}");
    }
    settle(&mut world, &[id]);
    world.apply_force(id, DVec3::ZERO, DVec3::ZERO).unwrap();
    assert!(world.is_asleep(id), "no force at all woke it");
    // By code to sleep, in mid-air and on the move.
    world.set_pose(id, DVec3::Y * 5.0, DQuat::IDENTITY).unwrap();
    run(&mut world, 5);
    world.sleep(id).unwrap();
    let at = world.position(id).unwrap();
    run(&mut world, 30);
    assert!(world.is_asleep(id) && world.position(id) == Some(at));
    world.wake(id).unwrap();
    run(&mut world, 5);
    assert!(world.position(id).unwrap().y < at.y);
    world.remove_body(id);
    assert!(!world.is_asleep(id) && world.wake(id).is_err() && world.sleep(id).is_err());
}

/// What holds or drives two bodies lets neither sleep alone, and wakes both when it comes, goes or changes.
#[test]
fn joint_partners_and_controls_wake() {
    let mut world = world();
    ground(&mut world);
    let (a, b) = (cube(&mut world, DVec3::Y * 0.5), cube(&mut world, DVec3::new(5.0, 0.5, 0.0)));
    let rod = RodDesc::new(Anchor::body(a, DVec3::ZERO), Anchor::body(b, DVec3::ZERO), 5.0);
    let rod = world.add_rod(rod).unwrap();
    settle(&mut world, &[a, b]);
    world.wake(a).unwrap();
    assert!(!world.is_asleep(b), "the partner sleeps on");
    settle(&mut world, &[a, b]);
    world.remove_rod(rod);
    assert!(!world.is_asleep(a) && !world.is_asleep(b));
    settle(&mut world, &[a, b]);
    let (ends, far) = ([Anchor::body(a, DVec3::ZERO), Anchor::body(b, DVec3::ZERO)], 5.0);
    let spring = SpringDesc { a: ends[0], b: ends[1], rest_length: far, stiffness: 10.0, damping: 1.0 };
    world.add_spring(spring).unwrap();
    assert!(!world.is_asleep(a) && !world.is_asleep(b));
    settle(&mut world, &[a, b]);
    world.remove_body(b);
    assert!(!world.is_asleep(a), "its partner is gone and it sleeps on");
}

/// A parked car sleeps while its driver holds the same controls, and wakes when he does something.
#[test]
fn controls_wake() {
    let mut world = world();
    ground(&mut world);
    let (bodies, axles) = car(&mut world);
    let parked = AxleControl { brake: 200.0, ..AxleControl::default() };
    axles.iter().for_each(|&axle| world.set_axle(axle, parked).unwrap());
    settle(&mut world, &bodies);
    world.set_axle(axles[0], parked).unwrap();
    assert!(world.is_asleep(bodies[0]));
    world.set_axle(axles[0], AxleControl { brake: 0.0, ..parked }).unwrap();
    assert!(bodies.iter().all(|&id| !world.is_asleep(id)));
}

/// A plank on a hinge with a crate on either side, put to sleep in balance: without one of the crates it tips.
#[test]
fn a_seesaw_wakes_when_one_side_is_taken() {
    let mut world = world();
    ground(&mut world);
    let plank = body(&mut world, Shape::Box { half: DVec3::new(3.0, 0.1, 0.5) }, 50.0, DVec3::Y * 1.5, 0.5);
    let hinge = HingeDesc::new(Anchor::world(DVec3::Y * 1.5), Anchor::body(plank, DVec3::ZERO), DVec3::Z, DVec3::Z);
    let hinge = world.add_hinge(hinge).unwrap();
    let sides = [-2.0, 2.0]
        .map(|x| body(&mut world, Shape::Box { half: DVec3::splat(0.3) }, 20.0, DVec3::new(x, 1.9, 0.0), 0.8));
    world.add_angle_limit(AngleLimitDesc::new(hinge, -1.0, 1.0)).unwrap();
    run(&mut world, 40);
    let balanced = [plank, sides[0], sides[1]];
    world.sleep(plank).unwrap();
    assert!(balanced.iter().all(|&id| world.is_asleep(id)));
    world.remove_body(sides[0]);
    run(&mut world, 20);
    assert!(world.position(sides[1]).unwrap().y < 1.7, "{}", world.position(sides[1]).unwrap());
}

/// A ball at the top of its flight, and one that turns back on a faint slope, are slow and not at rest.
#[test]
fn nothing_sleeps_at_its_apex() {
    for gravity in [9.81, 1.0, 0.05] {
        let mut world = World::new(Settings { gravity: DVec3::Y * -gravity, ..Settings::at(DT) }).unwrap();
        let ball = particle(&mut world, DVec3::ZERO, DVec3::Y * 0.3, 1.0);
        for tick in 0..(0.6 / gravity / DT).ceil() as usize {
            world.step();
            assert!(!world.is_asleep(ball), "g {gravity}: asleep in tick {tick}");
        }
        assert!(world.velocity(ball).unwrap().y < -0.2);
    }
    let mut world = world();
    let normal = DVec3::new(0.01, 1.0, 0.0).normalize();
    world.add_static(StaticDesc::new(Collider::new(Shape::HalfSpace { normal }, 0.5))).unwrap();
    let ball = body(&mut world, Shape::Ball { radius: 0.3 }, 2.0, normal * 0.3, 0.5);
    world.set_velocity(ball, DVec3::X * -0.2, DVec3::Z * (0.2 / 0.3)).unwrap();
    for _ in 0..200 {
        world.step();
        assert!(!world.is_asleep(ball), "{}", world.velocity(ball).unwrap());
    }
    assert!(world.velocity(ball).unwrap().x > 0.1, "{}", world.velocity(ball).unwrap());
}

/// Drifting in space is not rest; standing still there is.
#[test]
fn what_stands_still_in_space_sleeps() {
    let mut world = World::new(Settings { gravity: DVec3::ZERO, ..Settings::at(DT) }).unwrap();
    let (still, drifting) =
        (particle(&mut world, DVec3::ZERO, DVec3::ZERO, 1.0), particle(&mut world, DVec3::X, DVec3::X * 0.02, 1.0));
    run(&mut world, 60);
    assert!(world.is_asleep(still) && !world.is_asleep(drifting));
    assert!((world.position(drifting).unwrap().x - 1.0 - 1.2 / 30.0).abs() < 1e-9);
    let mut restless = weightless();
    let still = particle(&mut restless, DVec3::ZERO, DVec3::ZERO, 1.0);
    run(&mut restless, 60);
    assert!(!restless.is_asleep(still), "sleep is switched off here");
}

/// A figure lies down, sleeps and is woken.
#[test]
fn figures_sleep() {
    let mut world = world();
    ground(&mut world);
    let poses = PARTS.each_ref().map(|part| (DVec3::Y * 1.5 + part.centre, DQuat::IDENTITY));
    let sheep = add_articulated(&mut world, coordinates(&poses), true);
    settle(&mut world, &[sheep]);
    run(&mut world, 1);
    assert_eq!(work(&world), StepReport::default());
    let at = world.position(sheep).unwrap();
    body(&mut world, Shape::Ball { radius: 0.2 }, 20.0, at + DVec3::Y * 2.0, 0.5);
    run(&mut world, 30);
    assert!(!world.is_asleep(sheep), "a ball of 20 kg fell on a sheep and it sleeps on");
}

/// A car of a chassis and four driven wheels.
fn car(world: &mut World) -> (Vec<BodyId>, Vec<AxleId>) {
    let half = DVec3::new(1.2, 0.3, 0.7);
    let chassis = body(world, Shape::Box { half }, 800.0, DVec3::Y * 0.9, 0.5);
    let (mut bodies, mut axles) = (vec![chassis], Vec::new());
    for (x, z) in [(0.9, 0.8), (0.9, -0.8), (-0.9, 0.8), (-0.9, -0.8)] {
        let shape = Shape::Cylinder { half_length: 0.1, radius: 0.4, rounding: 0.02 };
        let hub = DVec3::new(x, -0.4, z);
        let inertia = shape.inertia(20.0);
        let collider = Some(Collider::new(shape, 0.9));
        let desc = RigidBodyDesc::new(DVec3::Y * 0.9 + hub, 20.0, inertia);
        let wheel = world.add_rigid_body(RigidBodyDesc { collider, ..desc }).unwrap();
        let drive = Motor { target_speed: -10.0, gain: 50.0, max_torque: 100.0 };
        let control = AxleControl { drive, ..AxleControl::default() };
        let axle = AxleDesc { chassis, wheel, hub, stiffness: 20_000.0, damping: 2_000.0, control };
        axles.push(world.add_axle(axle).unwrap());
        bodies.push(wheel);
    }
    (bodies, axles)
}

#[test]
fn ten_thousand_sleepers_and_a_car_cost_the_car() {
    let mut alone = world();
    ground(&mut alone);
    let mut crowded = world();
    ground(&mut crowded);
    let cars = [car(&mut alone), car(&mut crowded)];
    for i in 0..10_000 {
        let at = DVec3::new(f64::from(i % 100) * 1.5 - 75.0, 0.5, 10.0 + f64::from(i / 100) * 1.5);
        let sleeper = cube(&mut crowded, at);
        crowded.sleep(sleeper).unwrap();
    }
    for tick in 0..90 {
        alone.step();
        crowded.step();
        assert_eq!(work(&alone), work(&crowded), "tick {tick}");
        assert_eq!(crowded.report().asleep, 10_000);
    }
    assert_eq!(alone.position(cars[0].0[0]), crowded.position(cars[1].0[0]));
    assert!(alone.velocity(cars[0].0[0]).unwrap().length() > 1.0, "it does not drive");
}

/// A cube that sticks to a slope, woken again and again, stays where it is: its anchors sleep with it.
#[test]
fn waking_loses_no_anchor() {
    let mut world = world();
    let normal = DVec3::new(0.4, 1.0, 0.0).normalize();
    world.add_static(StaticDesc::new(Collider::new(Shape::HalfSpace { normal }, 0.5))).unwrap();
    let id = cube(&mut world, normal * 0.5);
    world.set_pose(id, normal * 0.5, DQuat::from_rotation_arc(DVec3::Y, normal)).unwrap();
    settle(&mut world, &[id]);
    let before = world.position(id).unwrap();
    for _ in 0..10 {
        world.wake(id).unwrap();
        settle(&mut world, &[id]);
    }
    let shift = (world.position(id).unwrap() - before).length();
    assert!(shift < 1e-5, "crept {shift} m");
}

/// Falling asleep and waking are the same with one thread and with two.
#[test]
fn threads_do_not_change_a_bit() {
    let build = |threads| {
        let mut world = World::new(Settings { threads, ..Settings::at(DT) }).unwrap();
        ground(&mut world);
        for heap in 0..10 {
            for i in 0..5 {
                let x = f64::from(heap) * 4.0 + 0.1 * f64::from(i % 3);
                cube(&mut world, DVec3::new(x, 0.5 + 1.02 * f64::from(i), 0.0));
            }
        }
        world
    };
    let (mut one, mut two) = (build(1), build(2));
    let mut seen = [false; 2];
    for tick in 0..240 {
        for world in [&mut one, &mut two] {
            let id = world.bodies()[(tick * 7) % 50];
            if tick % 40 == 39 {
                world.apply_force(id, DVec3::new(2e4, 1e4, 0.0), DVec3::ZERO).unwrap();
            }
            world.step();
        }
        assert_eq!(one.state_hash(), two.state_hash(), "tick {tick}");
        assert_eq!(one.report(), two.report(), "tick {tick}");
        seen[usize::from(one.report().asleep > 20)] = true;
    }
    assert!(seen[0] && seen[1], "nothing slept, or nothing woke");
}
