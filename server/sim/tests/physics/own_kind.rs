//! A kind of a game's own, from the example: curved coordinates, straight lines.

use pita_sim::{DVec3, PartPoint};

use super::{DT, precise};
use polar::PolarParticle;

#[path = "../../examples/own_kind/polar.rs"]
mod polar;

/// The velocity, differenced in world space, stays exactly what it is. The step of a tick is straight in r and θ, not in
/// space: 33 mm are lost on the way round, once. Differencing r' and r²θ' would leave the radius at 1 for ever.
#[test]
fn a_polar_particle_flies_straight() {
    let mut world = precise(DVec3::ZERO);
    let particle = world.add_figure(PolarParticle::describe(2.0, [1.0, 0.0], [0.0, 1.0])).unwrap();
    let at = PartPoint { part: 0, point: DVec3::ZERO };
    for tick in 1..=150 {
        world.step();
        let frame = world.frame(particle, at).unwrap();
        let straight = DVec3::new(1.0, f64::from(tick) * DT, 0.0);
        let velocity = frame.velocity_at(DVec3::ZERO);
        assert!((DVec3::from(velocity) - DVec3::Y).length() < 1e-8, "tick {tick}: {velocity:?}");
        assert!((DVec3::from(frame.position) - straight).length() < 0.035, "tick {tick}: {frame:?}");
    }
}

#[test]
fn a_polar_particle_without_an_angle_is_refused() {
    let mut world = precise(DVec3::ZERO);
    let error = world.add_figure(PolarParticle::describe(2.0, [0.0, 0.0], [1.0, 0.0])).unwrap_err();
    assert!(error.to_string().contains("no angle"), "{error}");
}
