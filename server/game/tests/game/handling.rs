//! Figures of the default car on flat asphalt, as `docs/VEHICLE.md` has them: at 30 and 25 Hz within 5 % of the same car at
//! a sixteenth of the tick, and within 5 % of their closed forms.

use std::f64::consts::PI;

use pita_game::Controls;
use pita_game::driver::Motion;
use pita_game::vehicle::VehicleParameters;
use pita_game::vehicle::parameters::drive_train::RPM;
use pita_sim::DVec3;

use crate::test_track::{COAST, FULL_BRAKE, FULL_THROTTLE, TestTrack};

/// What is measured, of a car at one tick rate.
#[derive(Debug)]
struct Figures {
    /// From a standstill to 100 km/h, s.
    sprint: f64,
    /// From 20 m/s, m.
    braking: f64,
    /// Radius of the chassis's path at full lock and walking pace, m.
    lock: f64,
    /// Radius of the skid pad: at full lock and 15 m/s, m.
    skid_pad: f64,
    /// Sideways there, m/s².
    cornering: f64,
    /// Slalom: half the width of its wave, m.
    slalom_width: f64,
    /// Slalom: half of its change of heading, rad.
    slalom_heading: f64,
    /// The same of a wave that a driver follows.
    pursuit_width: f64,
    pursuit_heading: f64,
}

impl Figures {
    fn of(tick_hz: u16) -> Self {
        let (skid_pad, cornering) = skid_pad(tick_hz);
        let (slalom_width, slalom_heading) = slalom(tick_hz);
        let (pursuit_width, pursuit_heading) = pursuit(tick_hz);
        Self {
            sprint: TestTrack::with_parked_car_at(tick_hz).run_until(20.0, FULL_THROTTLE, |t| t.speed() >= 100.0 / 3.6),
            braking: braking(tick_hz),
            lock: lock(tick_hz),
            skid_pad,
            cornering,
            slalom_width,
            slalom_heading,
            pursuit_width,
            pursuit_heading,
        }
    }

    fn numbers(&self) -> [(&'static str, f64); 9] {
        [
            ("0 to 100 km/h, s", self.sprint),
            ("braking from 20 m/s, m", self.braking),
            ("radius at full lock, m", self.lock),
            ("radius of the skid pad, m", self.skid_pad),
            ("sideways there, m/s²", self.cornering),
            ("half width of the slalom, m", self.slalom_width),
            ("half the change of heading in the slalom, rad", self.slalom_heading),
            ("half width of a wave with a driver, m", self.pursuit_width),
            ("half its change of heading, rad", self.pursuit_heading),
        ]
    }
}

fn braking(tick_hz: u16) -> f64 {
    let mut track = TestTrack::with_parked_car_at(tick_hz);
    track.run_until(10.0, FULL_THROTTLE, |t| t.speed() >= 20.0);
    let (from, speed) = (track.car(0).position, track.speed());
    track.run_until(6.0, FULL_BRAKE, |t| t.speed() < 0.05);
    // The tick in which it passes 20 m/s ends a little above.
    track.car(0).position.distance(from) * (20.0 / speed).powi(2)
}

fn lock(tick_hz: u16) -> f64 {
    let mut track = TestTrack::with_parked_car_at(tick_hz);
    let hold = |t: &TestTrack| Controls { steer: 1.0, throttle: (2.0 - t.speed()).clamp(0.02, 0.3), ..COAST };
    track.run_with(3.0, hold);
    track.turn_with(2.0, hold).0
}

/// Holds 15 m/s by the throttle.
fn skid_pad(tick_hz: u16) -> (f64, f64) {
    let mut track = TestTrack::with_parked_car_at(tick_hz);
    track.run_until(10.0, FULL_THROTTLE, |t| t.speed() >= 15.0);
    let hold = |t: &TestTrack| Controls { steer: 1.0, throttle: (0.5 * (15.0 - t.speed())).clamp(0.0, 1.0), ..COAST };
    track.run_with(3.0, hold);
    let (radius, yaw_rate) = track.turn_with(2.0, hold);
    (radius, radius * yaw_rate * yaw_rate)
}

/// At 15 m/s the wheel goes to and fro once in two seconds (ISO 7401): half the width of the wave that the car drives,
/// and half of its change of heading.
fn slalom(tick_hz: u16) -> (f64, f64) {
    let mut track = TestTrack::with_parked_car_at(tick_hz);
    track.run_until(10.0, FULL_THROTTLE, |t| t.speed() >= 15.0);
    let hold = |t: &TestTrack| (0.5 * (15.0 - t.speed())).clamp(0.0, 1.0);
    track.run_with(2.0, |t| Controls { throttle: hold(t), ..COAST });
    let period = 2 * usize::from(tick_hz);
    let mut path = Vec::new();
    for tick in 0..3 * period {
        let steer = 0.5 * (2.0 * PI * tick as f64 / period as f64).sin();
        let throttle = hold(&track);
        track.drive(0, Controls { steer, throttle, ..COAST });
        track.tick();
        path.push(track.car(0));
    }
    // The last wave, against the line through its ends: it may lead somewhere.
    let wave = &path[2 * period - 1..];
    let (first, line) = (wave[0].position, wave[period].position - wave[0].position);
    let across = line.cross(DVec3::Y).normalize();
    let width = half_range(wave.iter().map(|car| across.dot(car.position - first)));
    (width, half_range(wave.iter().map(|car| (car.yaw() - wave[0].yaw()).sin())))
}

fn half_range(numbers: impl Iterator<Item = f64>) -> f64 {
    let (least, most) = numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    0.5 * (most - least)
}

/// A driver in the loop, who steers in every tick after a point 8 m ahead of the car on a wave of 60 m and 2 m, at 15 m/s:
/// half the width of what the car drives, and half of its change of heading. Whatever is late in car or tick widens it.
fn pursuit(tick_hz: u16) -> (f64, f64) {
    let mut track = TestTrack::with_parked_car_at(tick_hz);
    track.run_until(10.0, FULL_THROTTLE, |t| t.speed() >= 15.0);
    let (start, mut path) = (track.car(0).position.x, Vec::new());
    while path.last().is_none_or(|car: &Motion| car.position.x < start + 240.0) {
        let car = track.car(0);
        let ahead = car.position.x + 8.0;
        let aim = DVec3::new(ahead, 0.0, 2.0 * (2.0 * PI * (ahead - start) / 60.0).sin());
        let steer = (-car.bearing(aim) / 0.5).clamp(-1.0, 1.0);
        let throttle = (0.5 * (15.0 - track.speed())).clamp(0.0, 1.0);
        track.drive(0, Controls { steer, throttle, ..COAST });
        track.tick();
        path.push(track.car(0));
        assert!(path.len() < 40 * usize::from(tick_hz), "{:?}", track.car(0));
    }
    let waves = path.iter().filter(|car| car.position.x > start + 120.0);
    (half_range(waves.clone().map(|car| car.position.z)), half_range(waves.map(Motion::yaw)))
}

#[test]
fn figures_are_those_of_a_sixteenth_of_the_tick() {
    for tick_hz in [30, 25] {
        let (fine, coarse) = (Figures::of(16 * tick_hz), Figures::of(tick_hz));
        eprintln!("{tick_hz} Hz: {coarse:?}, a sixteenth: {fine:?}");
        for ((what, coarse), (_, fine)) in coarse.numbers().into_iter().zip(fine.numbers()) {
            assert!(
                (coarse / fine - 1.0).abs() < 0.05,
                "{what}: {coarse} at {tick_hz} Hz, {fine} at a sixteenth of the tick"
            );
        }
    }
}

/// Time from a standstill to 100 km/h: the engine's torque through its gears against mass, wheels and air, by quadrature.
fn sprint(p: &VehicleParameters) -> f64 {
    let mass = p.mass() + 4.0 * p.wheel_inertia() / p.wheel_radius.powi(2);
    let (mut speed, mut time, mut gear, mut shift) = (0.0f64, 0.0f64, 1, 0.0f64);
    const STEP: f64 = 1e-4;
    while speed < 100.0 / 3.6 {
        let ratio = p.gearbox.ratio(gear);
        let rpm = speed / p.wheel_radius * ratio / RPM;
        if rpm > p.gearbox.up_rpm {
            (gear, shift) = (gear + 1, p.gearbox.shift_time);
            continue;
        }
        let torque = p.engine.torque_at(rpm.max(p.engine.clutch_rpm)) * ratio;
        let pedal = 1.0 - (-time / p.steering.pedal_time).exp();
        let drive = if shift > 0.0 { 0.0 } else { pedal * torque / p.wheel_radius };
        speed += (drive - p.drag * speed * speed) / mass * STEP;
        shift -= STEP;
        time += STEP;
    }
    time
}

#[test]
fn figures_agree_with_their_closed_forms() {
    let (p, f) = (VehicleParameters::default(), Figures::of(30));
    let near = |what: &str, found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 0.05, "{what}: {found}, closed form {expected}");
    };
    near("0 to 100 km/h", f.sprint, sprint(&p));
    near("v²/2µg, and the pedal", f.braking, 20.0 * 20.0 / (2.0 * 9.81) + 20.0 * p.steering.pedal_time);
    let rear = p.wheelbase / p.steering.max_deg.to_radians().tan();
    near("radius at full lock", f.lock, rear.hypot(0.5 * p.wheelbase));
    near("sideways", f.cornering, p.steering.acceleration);
}
