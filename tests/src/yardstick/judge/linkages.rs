//! Sheep, chain and cars: how far joints open, and what the linkage does as a whole.

use pita_sim::DVec3;

use super::{Figure, SECOND, Unit, Verdict, largest, mean, speed_at_the_end};
use crate::yardstick::scene::{Ball, Body, Item, RigidScene};
use crate::yardstick::trace::{BodyState, Trace};

/// Widest gap that a sheep's joints may have, m.
const SHEEP_GAP: f64 = 0.01;

/// Length of the chain, m.
const CHAIN_LENGTH: f64 = 5.0;
/// Gaps of all joints together over the chain's length.
const CHAIN_STRETCH: f64 = 0.01;
/// Energy that the chain has to swing with: of its weight over the depth of its centre, J.
const CHAIN_ENERGY: f64 = 500.0 * 9.81 * 5.5;
/// Largest gain of energy at any time.
const CHAIN_ENERGY_RISE: f64 = 0.05;

/// A car's chassis comes first, its wheels follow.
const BODIES_OF_A_CAR: usize = 5;
/// A fine solution (MuJoCo's at small steps): speed, m/s, height of the chassis, m, radius of the circle, m.
const CAR: [f64; 3] = [14.94, 0.7764, 39.9];

pub fn sheep(scene: &RigidScene, trace: &Trace) -> Verdict {
    let gap = |bodies: &[BodyState]| largest(balls(scene).map(|ball| gap(ball, bodies)));
    let worst = largest(trace.iter().map(gap));
    let at_rest = largest(trace.last(SECOND).map(gap));
    Verdict::new(
        worst < SHEEP_GAP,
        [
            Figure { label: "gap", key: "gap_max_m", value: worst, unit: Unit::Millimetres },
            Figure { label: "at rest", key: "gap_rest_m", value: at_rest, unit: Unit::Millimetres },
            Figure {
                label: "v",
                key: "speed_m_per_s",
                value: speed_at_the_end(trace),
                unit: Unit::MillimetresPerSecond,
            },
        ],
    )
}

pub fn chain(scene: &RigidScene, trace: &Trace) -> Verdict {
    let stretch = |bodies: &[BodyState]| balls(scene).map(|ball| gap(ball, bodies)).sum::<f64>() / CHAIN_LENGTH;
    let worst = largest(trace.iter().map(stretch));
    let energy = |bodies: &[BodyState]| scene.bodies().zip(bodies).map(|(body, state)| energy(body, state)).sum();
    let energies: Vec<f64> = trace.iter().map(energy).collect();
    let gain = |now: f64| (now - energies[0]) / CHAIN_ENERGY;
    let rise = gain(largest(energies.iter().copied()));
    let end = gain(energies[energies.len() - 1]);
    Verdict::new(
        worst < CHAIN_STRETCH && rise < CHAIN_ENERGY_RISE,
        [
            Figure { label: "stretch", key: "stretch_max", value: worst, unit: Unit::Percent },
            Figure { label: "energy at most", key: "energy_rise_max", value: rise, unit: Unit::Percent },
            Figure { label: "at the end", key: "energy_change", value: end, unit: Unit::Percent },
        ],
    )
}

pub fn cars(_: &RigidScene, trace: &Trace) -> Verdict {
    let chassis =
        |bodies: &'_ [BodyState]| -> Vec<BodyState> { bodies.iter().step_by(BODIES_OF_A_CAR).copied().collect() };
    let last: Vec<BodyState> = trace.last(SECOND).flat_map(chassis).collect();
    let turning: Vec<BodyState> = trace.last(3 * SECOND).flat_map(chassis).collect();

    let speeds = || last.iter().map(|car| car.velocity.length());
    let (speed, slowest, fastest) = (mean(speeds()), -largest(speeds().map(|v| -v)), largest(speeds()));
    let height = mean(last.iter().map(|car| car.position.y));
    let least_upright = -largest(last.iter().map(|car| -(car.rotation.normalize() * DVec3::Y).y));
    let yaw_rate = mean(turning.iter().map(|car| car.angular_velocity.y)).abs();
    let radius = mean(turning.iter().map(|car| car.velocity.length())) / yaw_rate;

    let stable = least_upright > 0.9 && (0.5..1.1).contains(&height) && slowest > 10.0 && fastest < 20.0;
    let near = |value: f64, right: f64| (value / right - 1.0).abs() < 0.05;
    let accurate = near(speed, CAR[0]) && (height - CAR[1]).abs() < 0.01 && near(radius, CAR[2]);
    Verdict {
        failure: (!stable).then_some("unstable"),
        ..Verdict::new(
            stable && accurate,
            [
                Figure { label: "v", key: "speed_m_per_s", value: speed, unit: Unit::MetresPerSecond },
                Figure { label: "ride", key: "ride_height_m", value: height, unit: Unit::Metres },
                Figure { label: "radius", key: "turn_radius_m", value: radius, unit: Unit::Metres },
            ],
        )
    }
}

fn balls(scene: &RigidScene) -> impl Iterator<Item = &Ball> {
    scene.items.iter().filter_map(|item| if let Item::Ball(ball) = item { Some(ball) } else { None })
}

/// Distance of a ball joint's two anchors, m.
fn gap(ball: &Ball, bodies: &[BodyState]) -> f64 {
    let at = |body: &BodyState, point: DVec3| body.position + body.rotation.normalize() * point;
    let a = ball.a.map_or(ball.point_a, |a| at(&bodies[a], ball.point_a));
    a.distance(at(&bodies[ball.b], ball.point_b))
}

/// Of motion, and against gravity from the origin's height, J.
fn energy(body: &Body, state: &BodyState) -> f64 {
    let spin = state.rotation.normalize().inverse() * state.angular_velocity;
    let linear = 0.5 * state.velocity.length_squared() + 9.81 * state.position.y;
    body.mass * linear + 0.5 * body.inertia.dot(spin * spin)
}
