//! Slope: a unit cube on a slope of arctan 0.5, with a little more friction than it needs, and with a little less.

use pita_sim::{DQuat, DVec3, Shape, SimError};

use super::Finding;
use super::stage::{DENSITY, G, Stage};

const SECONDS: f64 = 25.0;
const SLOPE: f64 = 0.5;
const STICKS: f64 = 0.51;
const SLIDES: f64 = 0.49;

/// Farthest that the cube that sticks may move, m.
const SHIFT_MAX: f64 = 1e-3;
/// ... and in the last second, m.
const CREEP_MAX: f64 = 1e-6;
/// Error of the acceleration of the one that slides.
const SLIDE_ERROR_MAX: f64 = 0.02;

/// The slope is level and gravity tilted: down the slope is along x.
fn cube(dt: f64, friction: f64) -> Result<(Stage, pita_sim::BodyId), SimError> {
    let mut stage = Stage::under(dt, DVec3::new(SLOPE, -1.0, 0.0).normalize() * G)?;
    stage.ground(friction)?;
    let cube = Shape::Box { half: DVec3::splat(0.5) };
    let cube = stage.put(cube, DENSITY, friction, (DVec3::Y * 0.5, DQuat::IDENTITY))?;
    Ok((stage, cube))
}

pub(super) fn run(dt: f64) -> Result<Vec<Finding>, SimError> {
    Ok(vec![stick(dt)?, slide(dt)?])
}

fn stick(dt: f64) -> Result<Finding, SimError> {
    let (mut stage, cube) = cube(dt, STICKS)?;
    stage.run(SECONDS - 1.0);
    let before = stage.position(cube);
    stage.run(1.0);
    let shift = (stage.position(cube) - DVec3::Y * 0.5).length();
    let creep = (stage.position(cube) - before).length();
    Ok(Finding {
        scene: "slope, friction 0.51".into(),
        ours: format!("moved {:.4} mm, {:.1e} mm of it in the last second", 1e3 * shift, 1e3 * creep),
        wanted: "below 1 mm in 25 s, still at the end",
        theirs: "Rigid-IPC: sticks",
        holds: shift < SHIFT_MAX && creep < CREEP_MAX,
        figures: vec![("shift_m", shift), ("creep_m_s", creep)],
        stage,
    })
}

fn slide(dt: f64) -> Result<Finding, SimError> {
    let (mut stage, cube) = cube(dt, SLIDES)?;
    stage.run(SECONDS);
    let acceleration = stage.velocity(cube).x / SECONDS;
    let expected = G * (SLOPE - SLIDES) / SLOPE.hypot(1.0);
    Ok(Finding {
        scene: "slope, friction 0.49".into(),
        ours: format!("slides with {acceleration:.4} m/s²"),
        wanted: "0.0877 m/s² within 2 %",
        theirs: "closed form",
        holds: (acceleration / expected - 1.0).abs() < SLIDE_ERROR_MAX,
        figures: vec![("acceleration_m_s2", acceleration)],
        stage,
    })
}
