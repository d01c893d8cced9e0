//! Traces whose figures are known in closed form, on both sides of every test.

use pita_sim::{DQuat, DVec3};

use super::{Verdict, judge};
use crate::yardstick::catalogue;
use crate::yardstick::scene::{Body, Content};
use crate::yardstick::trace::{BodyState, Trace};

/// Verdict on `scene` with every record of its start changed by `change`, which gets time in ticks and the bodies.
fn verdict(scene: &str, change: impl Fn(f64, &mut [BodyState])) -> Verdict {
    let content = catalogue::content(scene).unwrap();
    let start = start(&content);
    let mut states = Vec::new();
    for tick in 0..=content.ticks() {
        let mut bodies = start.clone();
        change(tick as f64, &mut bodies);
        states.extend(bodies);
    }
    judge(&content, &Trace::new(start.len(), states))
}

fn start(content: &Content) -> Vec<BodyState> {
    let state = |&Body { position, rotation, velocity, angular_velocity, .. }: &Body| BodyState {
        position,
        rotation,
        velocity,
        angular_velocity,
    };
    match content {
        Content::Rigid(_, scene) => scene.bodies().map(state).collect(),
        Content::Beam(beam) => (0..beam.nodes())
            .map(|node| BodyState {
                // Along x first; where along y and z does not matter to the judge.
                position: DVec3::new(f64::from(node % (beam.cells[0] + 1)) * 0.2, 0.0, 0.0),
                rotation: DQuat::IDENTITY,
                velocity: DVec3::ZERO,
                angular_velocity: DVec3::ZERO,
            })
            .collect(),
    }
}

#[track_caller]
fn expect(verdict: &Verdict, accepted: bool, figures: &[(&str, f64)]) {
    assert_eq!(verdict.accepted, accepted, "{}", verdict.text());
    for (key, expected) in figures {
        let value = verdict.value(key).unwrap();
        assert!((value - expected).abs() < 1e-9, "{key}: {value} is not {expected}");
    }
}

#[test]
fn what_is_not_finite_or_far_away_blows_up() {
    for bad in [f64::NAN, f64::INFINITY, 101.0] {
        let verdict = verdict("stack10", |tick, bodies| {
            if tick == 200.0 {
                bodies[3].position.y = bad;
            }
        });
        assert_eq!((verdict.accepted, verdict.failure), (false, Some("blows up")));
    }
}

#[test]
fn a_pile_may_sink_by_less_than_50_mm_and_has_to_rest() {
    let sunk_by = |depth: f64, speed: f64| {
        verdict("pile100", move |tick, bodies| {
            // Seen at each tenth record; 60 mm between two of them are not.
            bodies[0].position.y = if tick == 150.0 { 0.25 - depth } else { 0.25 };
            bodies[1].position.y = if tick == 151.0 { 0.19 } else { 0.25 };
            bodies[2].velocity.x = 100.0 * speed;
        })
    };
    expect(&sunk_by(0.049, 0.009), true, &[("penetration_max_m", 0.049), ("speed_m_per_s", 0.009)]);
    expect(&sunk_by(0.051, 0.009), false, &[("penetration_max_m", 0.051), ("penetration_rest_m", 0.0)]);
    expect(&sunk_by(0.049, 0.011), false, &[("speed_m_per_s", 0.011)]);
}

#[test]
fn a_stack_may_drift_by_less_than_5_mm_and_has_to_stand() {
    let moved = |x: f64, y: f64| {
        verdict("stack10", move |tick, bodies| {
            bodies[9].position += DVec3::new(x, y, 0.0) * (tick / 300.0);
        })
    };
    expect(&moved(0.003, -0.04), true, &[("drift_max_m", 0.003), ("sag_m", 0.04), ("penetration_max_m", 0.04)]);
    expect(&moved(0.006, 0.0), false, &[("drift_max_m", 0.006)]);
    expect(&moved(0.0, -0.06), false, &[("penetration_max_m", 0.06)]);
    let fallen = verdict("stack10", |tick, bodies| bodies[9].position.y -= tick / 300.0);
    assert_eq!((fallen.accepted, fallen.failure), (false, Some("falls")));
}

#[test]
fn a_sheeps_joints_may_open_by_less_than_10_mm() {
    let opened = |gap: f64| {
        verdict("sheep100", move |tick, bodies| {
            let open = if tick == 7.0 { gap } else { 0.001 };
            let down = bodies[4 * 50].rotation * -DVec3::Y;
            bodies[4 * 50 + 2].position += open * down;
        })
    };
    expect(&opened(0.0099), true, &[("gap_max_m", 0.0099), ("gap_rest_m", 0.001)]);
    expect(&opened(0.0101), false, &[("gap_max_m", 0.0101)]);
}

#[test]
fn a_chain_may_stretch_by_1_percent_and_gain_5_percent_of_its_energy() {
    // The ball hangs off the last joint; its 500 kg gain m g h.
    let lifted = |gap: f64, height: f64| {
        verdict("chain", move |tick, bodies| {
            bodies[20].position.x += gap;
            bodies[20].velocity.y = if tick == 30.0 { (2.0 * 9.81 * height).sqrt() } else { 0.0 };
        })
    };
    let figures = [("stretch_max", 0.008), ("energy_rise_max", 0.2 / 5.5), ("energy_change", 0.0)];
    expect(&lifted(0.04, 0.2), true, &figures);
    expect(&lifted(0.06, 0.2), false, &[("stretch_max", 0.012)]);
    expect(&lifted(0.04, 0.3), false, &[("energy_rise_max", 0.3 / 5.5)]);
}

#[test]
fn cars_drive_the_right_circle() {
    let driven = |speed: f64, height: f64, radius: f64| {
        verdict("cars16", move |tick, bodies| {
            let rate = speed / radius;
            let heading = DQuat::from_rotation_y(rate * tick / 30.0);
            for car in bodies.chunks_exact_mut(5) {
                car[0].rotation = heading;
                car[0].position = heading * DVec3::new(0.0, height, radius);
                car[0].velocity = heading * DVec3::new(speed, 0.0, 0.0);
                car[0].angular_velocity = DVec3::new(0.0, rate, 0.0);
            }
        })
    };
    let figures = [("speed_m_per_s", 14.9), ("ride_height_m", 0.78), ("turn_radius_m", 40.6)];
    expect(&driven(14.9, 0.78, 40.6), true, &figures);
    expect(&driven(14.0, 0.78, 40.6), false, &[("speed_m_per_s", 14.0)]);
    expect(&driven(14.9, 0.79, 40.6), false, &[("ride_height_m", 0.79)]);
    expect(&driven(14.9, 0.78, 45.0), false, &[("turn_radius_m", 45.0)]);
    let toppled = verdict("cars16", |_, bodies| bodies[0].rotation = DQuat::from_rotation_x(1.0));
    assert_eq!((toppled.accepted, toppled.failure), (false, Some("unstable")));
}

#[test]
fn spin_keeps_momentum_and_energy() {
    let faster = |factor: f64| {
        verdict("spin", move |tick, bodies| {
            if tick == 900.0 {
                bodies[0].angular_velocity *= factor;
            }
        })
    };
    let slower = faster(0.996);
    expect(&slower, true, &[("momentum_change_max", 0.004), ("energy_change_max", 0.996f64.powi(2) - 1.0)]);
    expect(&faster(1.006), false, &[("momentum_change_max", 0.006), ("energy_change_max", 1.006f64.powi(2) - 1.0)]);
    // A turned body with the same spin in the world has another momentum.
    let turned = verdict("spin", |tick, bodies| bodies[0].rotation = DQuat::from_rotation_z(0.1 * tick));
    assert!(!turned.accepted && turned.value("momentum_change_max").unwrap() > 0.4, "{}", turned.text());
}

#[test]
fn what_sticks_stays_and_what_slides_accelerates_as_theory_says() {
    let downhill = |tangent: f64| DVec3::new(tangent.atan().cos(), -tangent.atan().sin(), 0.0);
    let crept = |creep: f64| {
        verdict("slope45", move |tick, bodies| bodies[0].position += downhill(0.45) * creep * (tick / 90.0))
    };
    expect(&crept(0.0009), true, &[("creep_m", 0.0009)]);
    expect(&crept(0.0011), false, &[("creep_m", 0.0011)]);

    let theory = 9.81 * (0.55f64.atan().sin() - 0.5 * 0.55f64.atan().cos());
    let slid = |error: f64| {
        verdict("slope55", move |tick, bodies| {
            // The fit looks past the first half second.
            let speed = if tick < 15.0 { 0.0 } else { theory * (1.0 + error) * tick / 30.0 };
            bodies[0].velocity = downhill(0.55) * speed;
        })
    };
    expect(&slid(0.015), true, &[("acceleration_error", 0.015)]);
    expect(&slid(-0.025), false, &[("acceleration_error", -0.025)]);
}

#[test]
fn a_beam_sags_as_beams_do() {
    let sagged = |sag: f64, lowest: f64| {
        verdict("soft", move |tick, bodies| {
            let depth = match tick {
                0.0 => 0.0,
                20.0 => lowest,
                _ => sag,
            };
            bodies.iter_mut().filter(|node| node.position.x > 1.9).for_each(|node| node.position.y = 5.0 - depth);
        })
    };
    expect(&sagged(0.147, 0.3), true, &[("tip_mean_m", -0.147), ("tip_lowest_m", -0.3)]);
    expect(&sagged(0.06, 0.3), false, &[("tip_mean_m", -0.06)]);
    expect(&sagged(0.19, 0.3), false, &[("tip_mean_m", -0.19)]);
    expect(&sagged(0.147, 0.46), false, &[("tip_lowest_m", -0.46)]);
    assert!(!sagged(f64::NAN, 0.3).accepted);
}
