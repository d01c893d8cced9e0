//! 666: a lattice of 6 × 6 × 6 balls without friction falls apart. What counts is how deep they get.

use pita_sim::{BodyId, DQuat, DVec3, Shape, SimError};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::Finding;
use super::stage::Stage;

const SECONDS: f64 = 10.0;
const EDGE: u32 = 6;
const RADIUS: f64 = 0.1;
const MASS: f64 = 10.0;
const SPACING: f64 = 0.21;
const JITTER: f64 = 1e-3;
const LOWEST: f64 = 0.101;
const SEED: u64 = 666;

/// Least error that anybody published, at the finer and at the coarser of their steps, m².
const WANTED: (f64, f64) = (0.0153, 0.237);

pub(super) fn run(dt: f64) -> Result<Vec<Finding>, SimError> {
    let mut stage = Stage::new(dt)?;
    stage.ground(0.0)?;
    let mut random = StdRng::seed_from_u64(SEED);
    let mut balls = Vec::new();
    for place in 0..EDGE.pow(3) {
        let lattice = DVec3::from_array([place % EDGE, place / EDGE.pow(2), place / EDGE % EDGE].map(f64::from));
        let jitter = DVec3::from_array(std::array::from_fn(|_| random.random_range(0.0..JITTER)));
        let at = lattice * SPACING + DVec3::Y * LOWEST + jitter;
        balls.push(stage.put(Shape::Ball { radius: RADIUS }, MASS, 0.0, (at, DQuat::IDENTITY))?);
    }
    let steps = stage.steps_in(SECONDS);
    let mut error = 0.0;
    for _ in 0..steps {
        stage.step();
        error += squared_depths(&stage, &balls) / f64::from(steps);
    }
    let is_fine = dt <= 0.01;
    let (theirs, wanted) = if is_fine {
        ("RaiSim 0.0153, ODE 0.0162, MuJoCo 0.934, Bullet 37.4", "below 0.0153 m²")
    } else {
        ("at 40 ms RaiSim 0.250, ODE 0.237, MuJoCo 3.85, Bullet 728", "below 0.237 m²")
    };
    let bound = if is_fine { WANTED.0 } else { WANTED.1 };
    Ok(vec![Finding {
        scene: "666".into(),
        ours: format!("error {error:.2e} m²"),
        wanted,
        theirs,
        holds: error < bound,
        figures: vec![("squared_penetration_m2", error)],
        stage,
    }])
}

/// Squares of all penetrations, of pairs and of the ground, summed up, m².
fn squared_depths(stage: &Stage, balls: &[BodyId]) -> f64 {
    let places: Vec<_> = balls.iter().map(|&ball| stage.position(ball)).collect();
    let squared = |depth: f64| depth.max(0.0).powi(2);
    let mut sum = 0.0;
    for (i, &a) in places.iter().enumerate() {
        sum += squared(RADIUS - a.y);
        sum += places[..i].iter().map(|&b| squared(2.0 * RADIUS - a.distance(b))).sum::<f64>();
    }
    sum
}
