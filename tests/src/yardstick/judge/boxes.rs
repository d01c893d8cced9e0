//! Piles and stacks: how deep, how far, how restless.

use super::penetration::{deepest, half_extents};
use super::{Figure, Unit, Verdict, largest, speed_at_the_end};
use crate::yardstick::scene::RigidScene;
use crate::yardstick::trace::Trace;

/// Deepest penetration that is accepted, m.
const PENETRATION: f64 = 0.05;
/// Fastest a pile may be in its last second, m/s.
const REST_SPEED: f64 = 0.01;
/// Furthest the top of a stack may move sideways, m.
const DRIFT: f64 = 0.005;
/// A stack whose top is below this part of its first height has fallen.
const STANDING: f64 = 0.9;

/// Up to this many bodies every record is looked at, above each tenth.
const FEW_BODIES: usize = 50;

pub fn pile(scene: &RigidScene, trace: &Trace) -> Verdict {
    let depths = depths(scene, trace);
    let penetration = largest(depths.iter().copied());
    let speed = speed_at_the_end(trace);
    Verdict::new(
        penetration < PENETRATION && speed < REST_SPEED,
        [
            penetration_figure(penetration),
            Figure { label: "at rest", key: "penetration_rest_m", value: at_rest(&depths), unit: Unit::Millimetres },
            Figure { label: "v", key: "speed_m_per_s", value: speed, unit: Unit::MillimetresPerSecond },
        ],
    )
}

pub fn stack(scene: &RigidScene, trace: &Trace) -> Verdict {
    let top = trace.bodies() - 1;
    let [start, end] = [0, trace.records() - 1].map(|record| trace.record(record)[top].position);
    let drift = largest(trace.iter().map(|bodies| (bodies[top].position - start).with_y(0.0).length()));
    let penetration = largest(depths(scene, trace).into_iter());
    let stands = end.y > STANDING * start.y;
    Verdict {
        failure: (!stands).then_some("falls"),
        ..Verdict::new(
            stands && drift < DRIFT && penetration < PENETRATION,
            [
                Figure { label: "drift", key: "drift_max_m", value: drift, unit: Unit::Millimetres },
                Figure { label: "sag", key: "sag_m", value: start.y - end.y, unit: Unit::Millimetres },
                penetration_figure(penetration),
            ],
        )
    }
}

fn penetration_figure(value: f64) -> Figure {
    Figure { label: "pen", key: "penetration_max_m", value, unit: Unit::Millimetres }
}

/// Deepest penetration of the records that are looked at, m.
fn depths(scene: &RigidScene, trace: &Trace) -> Vec<f64> {
    let half_extents = half_extents(scene);
    let stride = if trace.bodies() > FEW_BODIES { 10 } else { 1 };
    trace.iter().step_by(stride).map(|bodies| deepest(bodies, &half_extents)).collect()
}

/// The deepest of the last three records that were looked at, m.
fn at_rest(depths: &[f64]) -> f64 {
    largest(depths.iter().rev().take(3).copied())
}
