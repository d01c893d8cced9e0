//! Heavy on light: a unit cube under one of ten times its edge and the same density, and 10 kg under ten tonnes.

use pita_sim::{DQuat, DVec3, Shape, SimError};

use super::Finding;
use super::stage::{DENSITY, Stage};

const SECONDS: f64 = 10.0;
const FRICTION: f64 = 0.5;

/// How far either cube of a pile that stands may move in the last five seconds, m.
const SHIFT_MAX: f64 = 1e-3;
/// How deep they may be at the end, m.
const DEPTH_MAX: f64 = 1.5e-3;

/// Two cubes on each other.
struct Pile {
    name: &'static str,
    /// Half of the edges of the lower and the upper, m.
    half: [f64; 2],
    /// kg.
    mass: [f64; 2],
    /// Gaps below the lower and below the upper at the start, m.
    gaps: [f64; 2],
}

pub(super) fn run(dt: f64) -> Result<Vec<Finding>, SimError> {
    let sizes =
        Pile { name: "1 m under 10 m, dropped", half: [0.5, 5.0], mass: [DENSITY, 1000.0 * DENSITY], gaps: [0.1, 0.4] };
    let set = Pile { name: "1 m under 10 m, set down", gaps: [0.0, 0.0], ..sizes };
    let masses = Pile { name: "10 kg under 10 t", half: [0.5, 0.5], mass: [10.0, 1e4], gaps: [0.0, 0.0] };
    [sizes, set, masses].iter().map(|pile| stand(dt, pile)).collect()
}

fn stand(dt: f64, pile: &Pile) -> Result<Finding, SimError> {
    let mut stage = Stage::new(dt)?;
    stage.ground(FRICTION)?;
    let mut at = 0.0;
    let mut cubes = Vec::new();
    for i in 0..2 {
        at += pile.gaps[i] + pile.half[i];
        let shape = Shape::Box { half: DVec3::splat(pile.half[i]) };
        cubes.push(stage.put(shape, pile.mass[i], FRICTION, (DVec3::Y * at, DQuat::IDENTITY))?);
        at += pile.half[i];
    }
    stage.run(SECONDS / 2.0);
    let settled: Vec<_> = cubes.iter().map(|&cube| stage.position(cube)).collect();
    stage.run(SECONDS / 2.0);
    let moved = cubes.iter().zip(&settled).map(|(&cube, from)| stage.position(cube).distance(*from));
    let shift = moved.fold(0.0, f64::max);
    let depth = stage.world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max);
    Ok(Finding {
        scene: format!("heavy on light, {}", pile.name),
        ours: format!("shifts {:.3} mm, {:.2} mm deep at the end", 1e3 * shift, 1e3 * depth),
        wanted: "stands: below 1 mm in the last 5 s, 1.5 mm deep at most",
        theirs: "Rigid-IPC: stands",
        holds: shift < SHIFT_MAX && depth < DEPTH_MAX,
        figures: vec![("shift_m", shift), ("final_depth_m", depth)],
        stage,
    })
}
