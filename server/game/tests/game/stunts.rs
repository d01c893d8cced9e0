//! Boost, jump, turning in the air, getting up again; and that nothing of it, and no crash, breaks the simulation.

use pita_game::vehicle::VehicleParameters;
use pita_game::{ArenaSettings, Controls};
use pita_sim::{DQuat, DVec3};

use crate::test_track::{COAST, FLAT, FULL_BRAKE, FULL_THROTTLE, SETTINGS, TestTrack};

/// Flat ground with a single spawn point, and `extra`.
fn track(extra: &str) -> TestTrack {
    let ground = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let mut track = TestTrack::new(&format!("{ground}\n{extra}\n"), SETTINGS);
    track.enter(0);
    track.run(1.0, COAST);
    track
}

/// Of the whole world, J.
fn energy(track: &TestTrack) -> f64 {
    track.arena.world().energy().total()
}

fn boost_held() -> Controls {
    Controls { boost: true, ..COAST }
}

#[test]
fn a_boost_pushes_until_its_tank_is_empty_and_fills_again() {
    let (p, mut track) = (VehicleParameters::default(), track(""));
    track.run(1.0, boost_held());
    let speed = track.car(0).forward_speed();
    // The engine brakes meanwhile.
    let expected = p.boost.force / p.mass();
    assert!((0.8 * expected..expected).contains(&speed), "{speed} m/s after a second of {expected} m/s²");
    track.run(p.boost.lasts, boost_held());
    let empty = track.car(0).forward_speed();
    track.run(0.5, boost_held());
    assert!(track.car(0).forward_speed() < empty, "the tank is empty");
    track.run(p.boost.refill, FULL_BRAKE);
    track.run(1.0, boost_held());
    assert!(track.car(0).forward_speed() > 0.8 * expected, "full again");
}

#[test]
fn a_jump_is_as_high_as_its_speed_and_needs_the_ground() {
    let (p, mut track) = (VehicleParameters::default(), track(""));
    // So long that it sleeps.
    track.run(4.0, COAST);
    let rest = track.car(0).position.y;
    let mut highest = rest;
    // Pressed again and again in the air: nothing more comes of it.
    for tick in 0..25 {
        track.run(1.0 / 30.0, Controls { jump: tick % 2 == 0, ..COAST });
        highest = highest.max(track.car(0).position.y);
    }
    let expected = p.jump.speed.powi(2) / (2.0 * 9.81);
    assert!(((highest - rest) / expected - 1.0).abs() < 0.15, "{} m instead of {expected} m", highest - rest);
    track.run(3.0, COAST);
    assert!((track.car(0).position.y - rest).abs() < 0.01 && track.car(0).upright() > 0.999);
    track.run(0.2, Controls { jump: true, ..COAST });
    assert!(track.car(0).position.y > rest + 0.2, "and again from the ground");
}

#[test]
fn a_car_turns_in_the_air_as_it_is_steered_and_lands_level() {
    let mut track = track("[vehicle]\njump.speed = 12.0");
    track.run(0.1, Controls { jump: true, ..COAST });
    track.run(1.5, Controls { steer: -1.0, ..COAST });
    let yaw = track.car(0).yaw();
    assert!((0.8..2.0).contains(&yaw), "{yaw} rad to the left");
    track.run(4.0, FULL_BRAKE);
    assert!(track.car(0).upright() > 0.99 && track.speed() < 0.1);
}

/// Dropped on its roof, and on its side, it gets up by itself.
#[test]
fn a_car_that_lies_gets_up() {
    for roll in [0.5, 1.0, -0.5] {
        let mut track = track("");
        let turn = DQuat::from_rotation_x(roll * std::f64::consts::PI);
        track.place(0, DVec3::Y * 1.5, turn, DVec3::ZERO);
        track.run_until(8.0, FULL_BRAKE, |t| t.car(0).upright() > 0.99 && t.speed() < 0.05);
        track.run(1.0, FULL_BRAKE);
        let rest = VehicleParameters::default().ride_height();
        assert!((track.car(0).position.y - rest).abs() < 0.02, "{}", track.car(0).position.y);
    }
}

#[test]
fn sixty_metres_a_second_are_stable() {
    let mut track = track("[vehicle]\ntop_speed = 65.0\ndrag = 0.0");
    track.run_until(60.0, FULL_THROTTLE, |t| t.speed() > 60.0);
    let (heading, height) = (track.car(0).yaw(), track.car(0).position.y);
    track.run_with(10.0, |t| if t.speed() < 60.0 { FULL_THROTTLE } else { COAST });
    let car = track.car(0);
    assert!((car.yaw() - heading).abs() < 0.02 && (car.position.y - height).abs() < 0.02, "{car:?}");
    assert!(track.speed() > 58.0);
    // A jerk at the wheel.
    track.run(0.5, Controls { steer: 0.5, ..FULL_THROTTLE });
    track.run(5.0, FULL_BRAKE);
    assert!(track.car(0).upright() > 0.99, "{:?}", track.car(0));
    assert_eq!(track.quarantined(), 0);
}

/// Over three kerbs of 12 cm at 5 to 40 m/s, straight and with one side.
#[test]
fn kerbs_are_survived() {
    let kerb = |x: f64, z: f64| {
        format!(
            "[[statics]]\nshape.box.half = [0.25, 0.12, 6.0]\nmaterial = \"asphalt\"\nposition = [{x:?}, 0.0, {z:?}]\n"
        )
    };
    for (speed, z) in [(5.0, 0.0), (15.0, 0.0), (25.0, 0.0), (40.0, 0.0), (15.0, 6.2), (30.0, 6.2)] {
        let mut track = track(&[20.0, 22.0, 24.0].map(|x| kerb(x, z)).concat());
        track.push(0, DVec3::X * speed);
        let before = energy(&track);
        let time = track.run_until(10.0, Controls { throttle: 0.3, ..COAST }, |t| t.car(0).position.x > 30.0);
        // Three tenths of the throttle push by less than that.
        let gain = energy(&track) - before;
        assert!(gain < 3_000.0 * 30.0, "{speed} m/s, kerbs at {z}: {gain} J gained in {time} s");
        track.run_until(20.0, FULL_BRAKE, |t| t.car(0).upright() > 0.99 && t.speed() < 0.05);
        assert_eq!(track.quarantined(), 0);
    }
}

#[test]
fn landings_from_ten_metres_are_survived() {
    let rest = VehicleParameters::default().ride_height();
    for (roll, pitch) in [(0.0, 0.0), (0.3, 0.0), (0.0, 0.4), (-0.2, -0.3)] {
        let mut track = track("[vehicle]\nair_control.rate = 0.0");
        let turn = DQuat::from_rotation_x(roll) * DQuat::from_rotation_z(pitch);
        track.place(0, DVec3::Y * 10.0, turn, DVec3::X * 10.0);
        let mut most = energy(&track);
        for _ in 0..150 {
            track.run(1.0 / 30.0, FULL_BRAKE);
            let now = energy(&track);
            assert!(now < most + 500.0, "{now} J after {most} J");
            most = most.min(now);
        }
        track.run(6.0, FULL_BRAKE);
        let car = track.car(0);
        assert!(car.upright() > 0.99 && (car.position.y - rest).abs() < 0.02, "{roll} {pitch}: {car:?}");
        assert!(track.speed() < 0.05 && track.quarantined() == 0);
    }
}

/// Into each other at 25 m/s each, straight and offset by half a width; and into a wall.
#[test]
fn crashes_give_no_energy() {
    for offset in [0.0, 0.85] {
        let mut track = track("");
        track.enter(1);
        track.run(1.0, COAST);
        track.place(0, DVec3::new(-20.0, 0.54, 0.0), DQuat::IDENTITY, DVec3::X * 25.0);
        track.place(1, DVec3::new(20.0, 0.54, offset), DQuat::from_rotation_y(std::f64::consts::PI), DVec3::X * -25.0);
        let mut most = energy(&track);
        let before = most;
        for _ in 0..90 {
            track.run(1.0 / 30.0, COAST);
            let now = energy(&track);
            assert!(now < most + 0.02 * before, "{now} J after {most} J");
            most = most.min(now);
        }
        assert!(most < 0.6 * before, "{most} J of {before} J are left");
        track.run(10.0, FULL_BRAKE);
        for slot in [0, 1] {
            assert!(track.car(slot).upright() > 0.9, "{offset}: {:?}", track.car(slot));
        }
        assert_eq!(track.quarantined(), 0);
    }
}

#[test]
fn a_wall_at_sixty_metres_a_second_is_survived() {
    let mut track =
        track("[[statics]]\nshape.box.half = [1.0, 3.0, 20.0]\nmaterial = \"asphalt\"\nposition = [40.0, 3.0, 0.0]");
    track.push(0, DVec3::X * 60.0);
    track.run(2.0, COAST);
    assert!(track.car(0).position.x < 38.0, "{:?}", track.car(0));
    track.run(8.0, FULL_BRAKE);
    assert!(track.car(0).upright() > 0.99 && track.speed() < 0.1 && track.quarantined() == 0);
}

/// Rolled at up to 8 rad/s and 20 m/s it comes to rest, and on its wheels.
#[test]
fn roll_overs_end_on_wheels() {
    for (spin, speed) in [(4.0, 10.0), (8.0, 20.0), (-6.0, 15.0)] {
        let mut track = track("");
        track.place(0, DVec3::Y * 2.0, DQuat::from_rotation_x(1.0), DVec3::Z * speed);
        track.spin(0, DVec3::X * spin);
        let mut most = energy(&track);
        let before = most;
        for _ in 0..45 {
            track.run(1.0 / 30.0, COAST);
            let now = energy(&track);
            assert!(now < most + 0.05 * before, "{now} J after {most} J");
            most = most.min(now);
        }
        track.run_until(20.0, COAST, |t| t.speed() < 0.1 && t.car(0).upright() > 0.99);
        assert_eq!(track.quarantined(), 0);
    }
}

/// Pushed under a board, and put between walls that are nearer to one another than it is wide: it stands, brakes or not,
/// and what its state says of its motion is how it moves.
#[test]
fn who_is_wedged_in_stands_still() {
    let block = |half: [f64; 3], position: [f64; 3], keys: &str| {
        format!("[[statics]]\nshape.box.half = {half:?}\nmaterial = \"asphalt\"\nposition = {position:?}\n{keys}\n")
    };
    let board = block([6.0, 0.2, 3.0], [60.0, 1.3, 0.0], "pitch = 12.0");
    let walls: String = [-1.0, 1.0].map(|side| block([6.0, 1.0, 0.5], [60.0, 1.0, side * 1.3], "")).concat();
    for (what, statics, x, push) in [
        ("board", &board, 1.0, 0.0),
        ("board", &board, 5.0, 12.0),
        ("walls", &walls, 0.0, 0.0),
        ("walls", &walls, 5.0, 0.0),
    ] {
        for controls in [COAST, FULL_BRAKE, FULL_THROTTLE] {
            let mut track = track(statics);
            track.place(
                0,
                DVec3::new(60.0 + x, 0.54, 0.0),
                DQuat::from_rotation_y(std::f64::consts::PI),
                DVec3::NEG_X * push,
            );
            track.run(3.0, controls);
            let (mut fastest, mut unmoved, from) = (0.0f64, 0.0f64, track.car(0).position);
            for _ in 0..60 {
                let before = track.car(0).position;
                track.run(1.0 / 30.0, controls);
                let car = track.car(0);
                fastest = fastest.max(car.velocity.length());
                unmoved = unmoved.max((car.velocity - (car.position - before) * 30.0).length());
            }
            let moved = track.car(0).position.distance(from);
            // Wheels that spin may work it loose.
            let stands = controls.throttle > 0.0 || fastest < 0.01 && moved < 0.001;
            assert!(
                stands && unmoved < 0.01,
                "{what}, {x} m, {push} m/s, {controls:?}: {fastest} m/s, {unmoved} without moving, {moved} m"
            );
        }
    }
}

/// A wall of 5 cm, 1 m high, is no kerb: it stops a car at 60 m/s that comes with its nose or with the wheels of a side, and
/// all of the car stays on this side of it.
#[test]
fn a_thin_wall_stops_a_fast_car() {
    for (yaw, half) in [(0.0, 1.3), (0.5 * std::f64::consts::PI, 0.8)] {
        for x in [20.0, 20.4, 20.8, 21.2, 21.6] {
            let wall = format!(
                "[[statics]]\nshape.box.half = [0.025, 0.5, 20.0]\nmaterial = \"asphalt\"\nposition = [{x:?}, 0.5, 0.0]\n"
            );
            let mut track = track(&wall);
            let rest = track.car(0).position;
            track.place(0, rest, DQuat::from_rotation_y(yaw), DVec3::X * 60.0);
            for tick in 0..60 {
                track.tick();
                for part in 0..5 {
                    let at = track.part(0, part).position;
                    assert!(at.x < x, "yaw {yaw}, wall at {x} m, tick {tick}: part {part} at {at}");
                }
            }
            let car = track.car(0);
            assert!(car.position.x < x - 0.5 * half && car.velocity.x < 1.0, "yaw {yaw}, wall at {x} m: {car:?}");
            assert_eq!(track.quarantined(), 0);
        }
    }
}

/// Three kerbs cost a fast car what they do at a sixteenth of the tick, or up to a fifth of its speed less: a tick may take a
/// wheel from one side of a kerb to the other.
#[test]
fn kerbs_do_not_stop_a_fast_car() {
    let left = |height: f64, speed: f64, tick_hz: u16| {
        let kerb = |x: f64| {
            format!(
                "[[statics]]\nshape.box.half = [0.25, {height:?}, 6.0]\nmaterial = \"asphalt\"\nposition = [{x:?}, 0.0, 0.0]\n"
            )
        };
        let text = FLAT.replace("count = [8, 8]", "count = [1, 1]") + &[20.0, 22.0, 24.0].map(kerb).concat();
        let mut track = TestTrack::new(&text, ArenaSettings { tick_hz, ..SETTINGS });
        track.enter(0);
        track.run(1.0, COAST);
        track.push(0, DVec3::X * speed);
        track.run_until(5.0, COAST, |track| track.car(0).position.x > 30.0);
        assert!(track.car(0).upright() > 0.95, "{height} m, {speed} m/s, {tick_hz} Hz: {:?}", track.car(0));
        track.speed()
    };
    for height in [0.06, 0.12] {
        for speed in [15.0, 25.0, 40.0, 60.0] {
            let [coarse, fine] = [30, 480].map(|tick_hz| left(height, speed, tick_hz));
            assert!(
                (0.95..1.2).contains(&(coarse / fine)),
                "{height} m, {speed} m/s: {coarse} and {fine} m/s are left"
            );
        }
    }
}
