//! Figures of the default car on flat asphalt, as the documentation of
//! [`VehicleParameters`](pita_game::vehicle::VehicleParameters) has them: at 30 and 25 Hz, and at 480 Hz, a sixteenth of
//! the tick.

use pita_game::Controls;
use pita_game::vehicle::VehicleParameters;

use crate::test_track::{FULL_BRAKE, FULL_THROTTLE, TestTrack};

/// What is measured, of a car at one tick rate.
#[derive(Debug)]
struct Figures {
    /// From a standstill, s.
    to_100_km_h: f64,
    /// From 20 m/s, the pedal's time included, m.
    braking_distance: f64,
    /// Of the chassis's centre at full lock and walking pace, m.
    turning_radius: f64,
    /// Sideways at full lock from 15 m/s, m/s².
    cornering: f64,
}

fn figures(tick_hz: u16) -> Figures {
    let mut track = TestTrack::with_parked_car_at(tick_hz);
    let to_100_km_h = track.run_until(20.0, FULL_THROTTLE, |t| t.speed() >= 100.0 / 3.6);

    let mut track = TestTrack::with_parked_car_at(tick_hz);
    track.run_until(8.0, FULL_THROTTLE, |t| t.speed() >= 20.0);
    let (from, speed) = (track.car(0).position, track.speed());
    track.run_until(6.0, FULL_BRAKE, |t| t.speed() < 0.05);
    // The tick in which it passes 20 m/s ends a little above.
    let braking_distance = track.car(0).position.distance(from) * (20.0 / speed).powi(2);

    let mut track = TestTrack::with_parked_car_at(tick_hz);
    let creep = Controls { steer: 1.0, throttle: 0.08, ..Controls::default() };
    track.run(4.0, creep);
    let (turning_radius, _) = track.turn(creep);

    let mut track = TestTrack::with_parked_car_at(tick_hz);
    track.run_until(8.0, FULL_THROTTLE, |t| t.speed() >= 15.0);
    let corner = Controls { steer: 1.0, throttle: 0.2, ..Controls::default() };
    track.run(1.0, corner);
    let (radius, yaw_rate) = track.turn(corner);
    Figures { to_100_km_h, braking_distance, turning_radius, cornering: radius * yaw_rate * yaw_rate }
}

#[test]
fn figures_are_as_documented_at_every_tick_rate() {
    let close = |a: f64, b: f64, part: f64| (a / b - 1.0).abs() < part;
    for tick_hz in [30, 25, 480] {
        let f = figures(tick_hz);
        assert!(close(f.to_100_km_h, 5.27, 0.02), "{tick_hz} Hz: {f:?}");
        assert!(close(f.braking_distance, 23.2, 0.03), "{tick_hz} Hz: {f:?}");
        assert!(close(f.turning_radius, 3.94, 0.02), "{tick_hz} Hz: {f:?}");
        assert!(close(f.cornering, 7.5, 0.02), "{tick_hz} Hz: {f:?}");
    }
}

#[test]
fn figures_agree_with_their_closed_forms() {
    let (p, f) = (VehicleParameters::default(), figures(30));
    // A constant force up to the speed where the power takes over, a constant power from there; wheels spin up, too.
    let wheel_inertia = 0.5 * p.wheel_mass * p.wheel_radius.powi(2);
    let mass = p.mass() + 4.0 * wheel_inertia / p.wheel_radius.powi(2);
    let force = p.engine_torque / p.wheel_radius;
    let (changeover, end) = (p.engine_power / force, 100.0 / 3.6);
    let time = mass * changeover / force + mass * (end * end - changeover * changeover) / (2.0 * p.engine_power);
    assert!((f.to_100_km_h - p.pedal_time - time).abs() < 0.03 * time, "{} s, closed form {time} s", f.to_100_km_h);

    // Friction alone, µ = 1, stops in v²/2µg; these brakes stay below it, so that the front wheels still steer.
    let by_friction = 20.0 * 20.0 / (2.0 * 9.81);
    let ratio = f.braking_distance / by_friction;
    assert!((1.05..1.2).contains(&ratio), "{} m, v²/2µg is {by_friction} m", f.braking_distance);

    let rear = p.wheelbase / p.steer_max_deg.to_radians().tan();
    let radius = rear.hypot(0.5 * p.wheelbase);
    assert!((f.turning_radius / radius - 1.0).abs() < 0.01, "{} m, closed form {radius} m", f.turning_radius);
    assert!((f.cornering / p.steer_acceleration - 1.0).abs() < 0.02, "{} m/s²", f.cornering);
}
