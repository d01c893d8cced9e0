//! Rolling: a box is pushed over the ground with 25 balls on it, which roll.
//!
//! A friction pyramid instead of a cone shows where the push is along no axis; regularised or truncated friction shows in
//! the speed of both.

use pita_sim::{DQuat, DVec3, Material, MaterialId, Shape, SimError, Surface};

use super::Finding;
use super::stage::{G, Stage};

const SECONDS: f64 = 4.0;
const PUSH: f64 = 150.0;
const GROUND_FRICTION: f64 = 0.4;
const BALL_FRICTION: f64 = 0.8;
const BOX_MASS: f64 = 10.0;
const BALL_MASS: f64 = 1.0;
const BALLS: i32 = 5;
/// How deep everything starts, m.
const DEPTH: f64 = 2e-5;

/// Mean squared error of speed that Bullet and RaiSim stay below and box or pyramid models do not, m²/s².
const WANTED: f64 = 1e-3;

const GROUND: MaterialId = MaterialId(1);
const BOX: MaterialId = MaterialId(2);
const BALL: MaterialId = MaterialId(3);

pub(super) fn run(dt: f64) -> Result<Vec<Finding>, SimError> {
    let along_axis = "RaiSim 4.1e-7, Bullet 4.9e-9, ODE 7.7e-9, MuJoCo 8.4e-3, DART 0.43";
    let diagonal = "RaiSim 4.1e-7, Bullet 5.7e-9, ODE 3.145, MuJoCo 6.9e-3, DART 3.145";
    let directions =
        [(DVec3::Z, "along an axis", along_axis), (DVec3::new(0.5, 0.0, 0.75f64.sqrt()), "diagonal", diagonal)];
    directions.into_iter().map(|(direction, name, theirs)| push(dt, direction, name, theirs)).collect()
}

fn push(dt: f64, direction: DVec3, name: &str, theirs: &'static str) -> Result<Finding, SimError> {
    let mut stage = Stage::new(dt)?;
    let material = |id| Material { id, surface: Surface { friction: BALL_FRICTION, ..Surface::default() } };
    let pair = |friction| Surface { friction, ..Surface::default() };
    stage.world.set_material_pair(GROUND, BOX, pair(GROUND_FRICTION))?;
    stage.world.set_material_pair(BOX, BALL, pair(BALL_FRICTION))?;
    stage.ground(material(GROUND))?;
    let top = 1.0 - DEPTH;
    let slab = Shape::Box { half: DVec3::new(10.0, 0.5, 10.0) };
    let slab = stage.put(slab, BOX_MASS, material(BOX), (DVec3::Y * (top - 0.5), DQuat::IDENTITY))?;
    let mut first = slab;
    for place in 0..BALLS * BALLS {
        let (i, j) = (f64::from(place % BALLS - BALLS / 2), f64::from(place / BALLS - BALLS / 2));
        let at = DVec3::new(2.0 * i, top + 0.5 - DEPTH, 2.0 * j);
        let ball = stage.put(Shape::Ball { radius: 0.5 }, BALL_MASS, material(BALL), (at, DQuat::IDENTITY))?;
        if place == 0 {
            first = ball;
        }
    }
    let accelerations = closed_form();
    let steps = stage.steps_in(SECONDS);
    let mut error = 0.0;
    for step in 1..=steps {
        stage.world.apply_force(slab, direction * PUSH, stage.position(slab))?;
        stage.step();
        let elapsed = dt * f64::from(step);
        for (body, acceleration) in [slab, first].into_iter().zip(accelerations) {
            error += (stage.velocity(body) - direction * acceleration * elapsed).length_squared() / f64::from(steps);
        }
    }
    let speeds = [slab, first].map(|body| stage.velocity(body).dot(direction));
    Ok(Finding {
        scene: format!("rolling, {name}"),
        ours: format!("error {error:.1e}; at the end {:.4} and {:.4} m/s", speeds[0], speeds[1]),
        wanted: "2.9541 and 0.8440 m/s, error below 1e-3 (m/s)²",
        theirs,
        holds: error < WANTED,
        figures: vec![("squared_speed_error_m2_s2", error), ("box_end_m_s", speeds[0]), ("ball_end_m_s", speeds[1])],
        stage,
    })
}

/// Accelerations of the box and of the balls, m/s². A ball that rolls on what accelerates by a follows with 2/7 a, and
/// holds it back by that much of its mass.
fn closed_form() -> [f64; 2] {
    let balls = f64::from(BALLS * BALLS) * BALL_MASS;
    let slab = (PUSH - GROUND_FRICTION * (BOX_MASS + balls) * G) / (BOX_MASS + 2.0 / 7.0 * balls);
    [slab, 2.0 / 7.0 * slab]
}
