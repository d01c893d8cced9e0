//! One body: free spin, and a cube on a slope.

use pita_sim::DVec3;

use super::{Figure, Unit, Verdict, mean};
use crate::yardstick::TICK_HZ;
use crate::yardstick::scene::{Item, RigidScene};
use crate::yardstick::trace::{BodyState, Trace};

/// Largest relative change of momentum and of energy in free spin.
const SPIN_CHANGE: f64 = 0.01;
/// Furthest that what sticks may move, m.
const CREEP: f64 = 1e-3;
/// Largest relative error of the acceleration of what slides.
const ACCELERATION_ERROR: f64 = 0.02;
/// The acceleration is fitted from this record on: half a second.
const FIT_FROM: usize = 15;

pub fn spin(scene: &RigidScene, trace: &Trace) -> Verdict {
    let inertia = scene.bodies().next().map_or(DVec3::ZERO, |body| body.inertia);
    let momentum_and_energy = |bodies: &[BodyState]| {
        let rotation = bodies[0].rotation.normalize();
        let spin = rotation.inverse() * bodies[0].angular_velocity;
        (rotation * (inertia * spin), 0.5 * inertia.dot(spin * spin))
    };
    let (momentum, energy) = momentum_and_energy(trace.record(0));
    let (mut momentum_change, mut energy_change) = (0f64, 0f64);
    for bodies in trace.iter() {
        let (l, e) = momentum_and_energy(bodies);
        momentum_change = momentum_change.max(l.distance(momentum) / momentum.length());
        let change = e / energy - 1.0;
        energy_change = if change.abs() > energy_change.abs() { change } else { energy_change };
    }
    Verdict::new(
        momentum_change < SPIN_CHANGE && energy_change.abs() < SPIN_CHANGE,
        [
            Figure { label: "L", key: "momentum_change_max", value: momentum_change, unit: Unit::Percent },
            Figure { label: "E", key: "energy_change_max", value: energy_change, unit: Unit::Percent },
        ],
    )
}

pub fn stick(scene: &RigidScene, trace: &Trace) -> Verdict {
    let [start, end] = [0, trace.records() - 1].map(|record| trace.record(record)[0].position);
    let creep = (end - start).dot(downhill(scene));
    let figure = Figure { label: "creep", key: "creep_m", value: creep, unit: Unit::Millimetres };
    Verdict::new(creep < CREEP, [figure])
}

pub fn slide(scene: &RigidScene, trace: &Trace) -> Verdict {
    let downhill = downhill(scene);
    let friction = scene.bodies().next().map_or(0.0, |body| body.friction);
    // The slope falls by sin, and presses by cos of its angle.
    let theory = scene.gravity.length() * (-downhill.y - friction * downhill.x);
    let speed = |(tick, bodies): (usize, &[BodyState])| (tick as f64 / TICK_HZ, bodies[0].velocity.dot(downhill));
    let speeds: Vec<_> = trace.iter().enumerate().skip(FIT_FROM).map(speed).collect();
    let acceleration = fitted_rate(&speeds);
    let error = acceleration / theory - 1.0;
    let figure = Figure { label: "acc", key: "acceleration_error", value: error, unit: Unit::Percent };
    Verdict::new(error.abs() < ACCELERATION_ERROR, [figure])
}

/// Along the steepest way down the first plane.
fn downhill(scene: &RigidScene) -> DVec3 {
    let planes =
        scene.items.iter().filter_map(|item| if let Item::Plane(plane) = item { Some(plane.normal) } else { None });
    planes.take(1).map(|normal| DVec3::new(normal.y, -normal.x, 0.0)).sum()
}

/// Slope of the straight line that fits points (t, y) best.
fn fitted_rate(points: &[(f64, f64)]) -> f64 {
    let (t_mean, y_mean) = (mean(points.iter().map(|(t, _)| *t)), mean(points.iter().map(|(_, y)| *y)));
    let moment = |f: fn(f64, f64) -> f64| points.iter().map(|(t, y)| f(t - t_mean, y - y_mean)).sum::<f64>();
    moment(|t, y| t * y) / moment(|t, _| t * t)
}
