//! The default car drives, turns, stops, climbs and gets up again: one step a tick at 30 Hz.

use pita_game::Controls;
use pita_game::vehicle::VehicleParameters;

use crate::test_track::{FLAT, FULL_BRAKE, FULL_THROTTLE, SETTINGS, TestTrack};

#[test]
fn a_parked_car_rests_at_its_static_sag() {
    let mut track = TestTrack::with_parked_car();
    track.run(3.0, Controls::default());
    let p = VehicleParameters::default();
    let car = track.car(0);
    assert!((car.position.y - p.ride_height()).abs() < 5e-3, "{} instead of {}", car.position.y, p.ride_height());
    assert!(car.velocity.length() < 1e-2, "{:?}", car.velocity);
    for wheel in 1..=4 {
        let height = track.part(0, wheel).position.y;
        assert!((height - p.wheel_radius).abs() < 5e-3, "wheel {wheel} at {height}");
    }
}

#[test]
fn a_parked_car_does_not_creep() {
    let mut track = TestTrack::with_parked_car();
    let before = track.car(0).position;
    track.run(10.0, Controls::default());
    assert!(track.car(0).position.distance(before) < 1e-3, "{:?}", track.car(0).position - before);
}

#[test]
fn full_throttle_drives_straight() {
    let mut track = TestTrack::with_parked_car();
    let start = track.car(0);
    track.run(5.0, FULL_THROTTLE);
    let car = track.car(0);
    assert!(car.forward_speed() > 20.0, "{}", car.forward_speed());
    assert!((car.yaw() - start.yaw()).abs() < 0.5f64.to_radians(), "{}", car.yaw());
    assert!((car.position.z - start.position.z).abs() < 0.2, "{}", car.position.z - start.position.z);
    assert!(car.upright() > 0.99);
}

#[test]
fn reverse_drives_backwards_up_to_its_own_top_speed() {
    let mut track = TestTrack::with_parked_car();
    track.run(6.0, Controls { reverse: true, ..FULL_THROTTLE });
    let (speed, p) = (track.car(0).forward_speed(), VehicleParameters::default());
    assert!(speed < -0.8 * p.reverse_speed && speed > -1.1 * p.reverse_speed, "{speed}");
}

#[test]
fn full_lock_at_walking_pace_turns_as_the_wheels_point() {
    let p = VehicleParameters::default();
    let to_rear_axle = p.wheelbase / p.steering.max_deg.to_radians().tan();
    let expected = to_rear_axle.hypot(0.5 * p.wheelbase);
    for (steer, sign) in [(-1.0, 1.0), (1.0, -1.0)] {
        let mut track = TestTrack::with_parked_car();
        track.run_until(5.0, Controls { steer, throttle: 0.3, ..Controls::default() }, |t| t.speed() > 2.5);
        let creep = Controls { steer, throttle: 0.08, ..Controls::default() };
        track.run(2.0, creep);
        let (radius, yaw_rate) = track.turn(creep);
        assert!(yaw_rate * sign > 0.0, "steer {steer} turns by {yaw_rate} rad/s");
        assert!((radius / expected - 1.0).abs() < 0.1, "steer {steer}: radius {radius} m, expected {expected} m");
    }
}

#[test]
fn steering_at_speed_turns_without_spinning_or_rolling_over() {
    for (steer, sign) in [(-1.0, 1.0), (1.0, -1.0)] {
        let mut track = TestTrack::with_parked_car();
        track.run_until(8.0, FULL_THROTTLE, |t| t.speed() > 20.0);
        let corner = Controls { steer, throttle: 0.3, ..Controls::default() };
        track.run(2.0, corner);
        let (_, yaw_rate) = track.turn(corner);
        let car = track.car(0);
        assert!(yaw_rate * sign > 0.1, "steer {steer} turns by {yaw_rate} rad/s");
        assert!(car.upright() > 0.95, "{}", car.upright());
        let sideways = (car.rotation.inverse() * car.velocity).z.abs();
        assert!(sideways < 0.3 * track.speed(), "sideways {sideways} m/s of {} m/s", track.speed());
    }
}

#[test]
fn full_brake_stops_within_a_fifth_more_than_friction_allows() {
    let mut track = TestTrack::with_parked_car();
    track.run_until(8.0, FULL_THROTTLE, |t| t.speed() > 20.0);
    let (from, speed, heading) = (track.car(0).position, track.speed(), track.car(0).yaw());
    track.run_until(6.0, FULL_BRAKE, |t| t.speed() < 0.05);
    let distance = track.car(0).position.distance(from);
    let closed_form = speed * speed / (2.0 * 9.81);
    assert!(distance < 1.2 * closed_form, "{distance} m from {speed} m/s, v²/2µg is {closed_form} m");
    assert!(distance > 0.95 * closed_form, "{distance} m from {speed} m/s, v²/2µg is {closed_form} m");
    assert!((track.car(0).yaw() - heading).abs() < 0.02, "{}", track.car(0).yaw() - heading);
    let stopped = track.car(0).position;
    track.run(3.0, FULL_BRAKE);
    assert!(track.car(0).position.distance(stopped) < 0.02, "moves on after stopping");
}

#[test]
fn a_ramp_is_climbed_and_the_landing_survived() {
    let ramp = "\n[[statics]]\nshape.box.half = [4.0, 0.2, 3.0]\nmaterial = \"asphalt\"\nposition = [40.0, 0.636, 0.0]\npitch = 12.0\n";
    let spawn = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let mut track = TestTrack::new(&format!("{spawn}{ramp}"), SETTINGS);
    track.enter(0);
    track.run(1.0, Controls::default());
    let rest = VehicleParameters::default().ride_height();
    let mut highest = 0.0f64;
    for _ in 0..6 * 30 {
        track.drive(0, FULL_THROTTLE);
        track.tick();
        highest = highest.max(track.car(0).position.y);
    }
    let car = track.car(0);
    assert!(highest > rest + 1.5, "highest {highest}");
    assert!(car.position.x > 60.0, "{:?}", car.position);
    assert!(car.upright() > 0.9, "{}", car.upright());
    track.run(6.0, FULL_BRAKE);
    assert!((track.car(0).position.y - rest).abs() < 0.01, "{}", track.car(0).position.y);
}

#[test]
fn reset_puts_an_overturned_car_on_its_wheels_where_it_is() {
    let spawn = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let roof = "\n[vehicle]\ntyre_friction = 3.0\nsteering.acceleration = 100.0\nself_righting.hop = 0.0\n";
    let mut track = TestTrack::new(&format!("{spawn}{roof}"), SETTINGS);
    track.enter(0);
    track.tick();
    track.run_until(10.0, FULL_THROTTLE, |t| t.speed() > 25.0);
    track.run_until(10.0, Controls { steer: 1.0, ..Controls::default() }, |t| t.car(0).upright() < 0.2);
    track.run_until(20.0, Controls::default(), |t| t.speed() < 0.1);
    let before = track.car(0).position;
    track.run(2.0, Controls { reset: true, ..Controls::default() });
    assert!(track.car(0).upright() > 0.99, "{}", track.car(0).upright());
    assert!(track.car(0).position.with_y(0.0).distance(before.with_y(0.0)) < 0.5);
}
