//! Degenerate pairs (Erleben's method): spikes, wedges, cracks, internal edges and cliffs, without friction.
//!
//! Solids of 1 m and 3 m on static ones. Where nothing tells on which side to fall, they may stand or fall; they may not
//! gain energy, get deeper than the tolerance, or stop on an edge that is none.

use std::sync::Arc;

use pita_sim::collide::TriangleMesh;
use pita_sim::{DVec3, Shape, SimError};

use super::Finding;
use super::stage::{G, Stage};

/// Deepest overlap, m: what the piles of the yardstick may have.
const DEPTH_MAX: f64 = 0.015;
/// Height to which the energy that a scene gains may lift the solid, m.
const RISE_MAX: f64 = 0.01;
/// Share of its speed that what slides on a flat mesh may lose or gain.
const SPEED_CHANGE_MAX: f64 = 1e-3;
const SLIDING_SPEED: f64 = 5.0;

/// A pyramid over a square of 1 m, 3 m high.
const SPIKE: [[f64; 3]; 5] = [[0.5, 0.0, -0.5], [0.5, 0.0, 0.5], [-0.5, 0.0, 0.5], [-0.5, 0.0, -0.5], [0.0, 3.0, 0.0]];

/// A prism over a triangle 3 m high, 2 m long.
const WEDGE: [[f64; 3]; 6] =
    [[-0.5, 0.0, 1.0], [0.0, 3.0, 1.0], [-0.5, 0.0, -1.0], [0.0, 3.0, -1.0], [0.5, 0.0, 1.0], [0.5, 0.0, -1.0]];

/// A cube of 1 m.
const CUBE: [[f64; 3]; 8] = [
    [-0.5, -0.5, -0.5],
    [0.5, -0.5, -0.5],
    [-0.5, 0.5, -0.5],
    [0.5, 0.5, -0.5],
    [-0.5, -0.5, 0.5],
    [0.5, -0.5, 0.5],
    [-0.5, 0.5, 0.5],
    [0.5, 0.5, 0.5],
];

/// A frustum whose top is as large as the cube.
const CLIFF: [[f64; 3]; 8] = [
    [-0.75, -0.5, 0.75],
    [-0.5, 0.5, 0.5],
    [-0.75, -0.5, -0.75],
    [-0.5, 0.5, -0.5],
    [0.75, -0.5, 0.75],
    [0.5, 0.5, 0.5],
    [0.75, -0.5, -0.75],
    [0.5, 0.5, -0.5],
];

/// A solid that meets a static one.
struct Pair {
    name: &'static str,
    /// Corners of what moves, and where its frame is; upside down where `inverted`.
    solid: &'static [[f64; 3]],
    at: DVec3,
    inverted: bool,
    /// m/s.
    velocity: DVec3,
    /// N, all the time.
    force: DVec3,
    seconds: f64,
    ground: Ground,
}

/// What stands still.
enum Ground {
    Solid(&'static [[f64; 3]], DVec3),
    /// A block with a crack along z, or with a funnel, cut into its top at −0.5 m.
    Crack,
    Funnel,
}

pub(super) fn run(dt: f64) -> Result<Vec<Finding>, SimError> {
    let rest = Pair {
        name: "",
        solid: &SPIKE,
        at: DVec3::Y * 3.0001,
        inverted: true,
        velocity: DVec3::ZERO,
        force: DVec3::ZERO,
        seconds: 2.0,
        ground: Ground::Solid(&SPIKE, DVec3::Y * -3.0),
    };
    let below = DVec3::Y * -3.0;
    let low = DVec3::Y * 2.0001;
    let pairs = [
        Pair { name: "spike on spike", ..rest },
        Pair { name: "spike on wedge", ground: Ground::Solid(&WEDGE, below), ..rest },
        Pair { name: "edge on edge", solid: &WEDGE, ground: Ground::Solid(&WEDGE, below), ..rest },
        Pair { name: "spike in crack", at: low, velocity: DVec3::X, force: DVec3::X, ground: Ground::Crack, ..rest },
        Pair {
            name: "wedge in crack",
            solid: &WEDGE,
            at: low,
            velocity: DVec3::X,
            force: DVec3::X * 10.0,
            ground: Ground::Crack,
            ..rest
        },
        Pair { name: "spike in funnel", at: low, velocity: DVec3::X, ground: Ground::Funnel, ..rest },
        Pair {
            name: "cliff edge",
            solid: &CUBE,
            at: DVec3::Y * 0.05,
            inverted: false,
            ground: Ground::Solid(&CLIFF, DVec3::NEG_Y),
            ..rest
        },
        Pair {
            name: "half over a cliff",
            solid: &CUBE,
            at: DVec3::new(0.5, 0.05, 0.0),
            inverted: false,
            ground: Ground::Solid(&CLIFF, DVec3::NEG_Y),
            ..rest
        },
    ];
    let met = pairs.iter().map(|pair| meet(dt, pair));
    let slid = [("box", &CUBE[..], false), ("spike", &SPIKE[..], true), ("wedge", &WEDGE[..], true)];
    met.chain(slid.into_iter().map(|(name, solid, inverted)| slide(dt, name, solid, inverted))).collect()
}

fn points(corners: &[[f64; 3]], at: DVec3, inverted: bool) -> Vec<DVec3> {
    let upright = |corner: &[f64; 3]| DVec3::from_array(*corner);
    // Half a turn about z.
    let turned = |p: DVec3| if inverted { DVec3::new(-p.x, -p.y, p.z) } else { p };
    corners.iter().map(|corner| turned(upright(corner)) + at).collect()
}

fn meet(dt: f64, pair: &Pair) -> Result<Finding, SimError> {
    let mut stage = Stage::new(dt)?;
    match pair.ground {
        Ground::Solid(corners, at) => {
            stage.fix(Shape::Hull { points: points(corners, DVec3::ZERO, false), radius: 0.0 }, 0.0, at)?;
        }
        Ground::Crack => stage.fix(crack()?, 0.0, DVec3::NEG_Y)?,
        Ground::Funnel => stage.fix(funnel()?, 0.0, DVec3::NEG_Y)?,
    }
    let id = stage.put_solid(&points(pair.solid, pair.at, pair.inverted), 0.0)?;
    stage.world.set_velocity(id, pair.velocity, DVec3::ZERO)?;
    let mut energies = vec![stage.world.energy().total()];
    let (mut work, mut is_sane) = (0.0, true);
    for _ in 0..stage.steps_in(pair.seconds) {
        let before = stage.position(id);
        stage.world.apply_force(id, pair.force, before)?;
        stage.step();
        work += pair.force.dot(stage.position(id) - before);
        energies.push(stage.world.energy().total() - work);
        is_sane &= stage.position(id).is_finite() && !stage.world.is_quarantined(id);
    }
    let weight = stage.world.mass(id).unwrap_or_default() * G;
    let rise = highest_rise(&energies) / weight;
    Ok(Finding {
        scene: format!("degenerate, {}", pair.name),
        ours: format!("gains {:.2} mm, {:.2} m/s at the end", 1e3 * rise, stage.velocity(id).length()),
        wanted: "gains energy for 10 mm of height at most, 15 mm deep at most",
        theirs: "Rigid-IPC: passes",
        holds: is_sane && rise < RISE_MAX && stage.deepest < DEPTH_MAX,
        figures: vec![("energy_gain_m", rise), ("end_speed_m_s", stage.velocity(id).length())],
        stage,
    })
}

/// By how much a series rises at most above the least that came before.
fn highest_rise(series: &[f64]) -> f64 {
    let (mut least, mut rise) = (f64::INFINITY, 0.0f64);
    for &value in series {
        least = least.min(value);
        rise = rise.max(value - least);
    }
    rise
}

/// Over a flat mesh whose triangles meet at edges and corners of every kind. What stands on its tip slides without gravity,
/// 0.1 mm above, as the authors have it.
fn slide(dt: f64, name: &str, solid: &[[f64; 3]], inverted: bool) -> Result<Finding, SimError> {
    let (mut stage, above) = if inverted { (Stage::under(dt, DVec3::ZERO)?, 1e-4) } else { (Stage::new(dt)?, 0.0) };
    stage.fix(flat()?, 0.0, DVec3::ZERO)?;
    let lowest = points(solid, DVec3::ZERO, inverted).iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let id = stage.put_solid(&points(solid, DVec3::new(-9.0, above - lowest, 0.07), inverted), 0.0)?;
    stage.world.set_velocity(id, DVec3::X * SLIDING_SPEED, DVec3::ZERO)?;
    let mut worst: f64 = 0.0;
    for _ in 0..stage.steps_in(3.0) {
        stage.step();
        worst = worst.max((stage.velocity(id).x / SLIDING_SPEED - 1.0).abs());
    }
    Ok(Finding {
        scene: format!("degenerate, {name} over internal edges"),
        ours: format!("speed changes by {:.1e}", worst),
        wanted: "below 1e-3 of the speed, 15 mm deep at most",
        theirs: "Rigid-IPC: passes",
        holds: worst < SPEED_CHANGE_MAX && stage.deepest < DEPTH_MAX,
        figures: vec![("speed_change_share", worst)],
        stage,
    })
}

/// A block of 2 × 4 m with a crack of 1 m and 45° along z.
fn crack() -> Result<Shape, SimError> {
    let cracked = |x: f64, _: f64| x.abs().min(0.5);
    surface(&[-1.0, -0.5, 0.0, 0.5, 1.0], &[-2.0, 2.0], cracked)
}

/// A block of 2 × 2 m with a square funnel of 1 m and 45°.
fn funnel() -> Result<Shape, SimError> {
    let across = [-1.0, -0.5, 0.0, 0.5, 1.0];
    surface(&across, &across, |x, z| x.abs().max(z.abs()).min(0.5))
}

/// Ten metres each way in cells of unequal size.
fn flat() -> Result<Shape, SimError> {
    let across: Vec<f64> = (-20..=20).map(|i| 0.5 * f64::from(i) + 0.1 * f64::from(i % 3)).collect();
    surface(&across, &across, |_, _| 0.0)
}

/// A block between heights over a lattice and 0.5 m below their origin. Cells are cut along the diagonal that leads to the
/// middle.
fn surface(xs: &[f64], zs: &[f64], height: impl Fn(f64, f64) -> f64) -> Result<Shape, SimError> {
    let vertices: Vec<_> = zs.iter().flat_map(|&z| xs.iter().map(move |&x| [x, z])).collect();
    let mut vertices: Vec<_> = vertices.into_iter().map(|[x, z]| DVec3::new(x, height(x, z), z)).collect();
    let mut triangles = Vec::new();
    for row in 0..zs.len() - 1 {
        for column in 0..xs.len() - 1 {
            let place = |i: usize, j: usize| ((row + j) * xs.len() + column + i) as u32;
            let [a, b, c, d] = [place(0, 0), place(1, 0), place(0, 1), place(1, 1)];
            let same_side = (xs[column] + xs[column + 1] > 0.0) == (zs[row] + zs[row + 1] > 0.0);
            triangles.extend(if same_side { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] });
        }
    }
    // Sides, down from the rim; the bottom is out of reach.
    let (columns, rows) = (xs.len(), zs.len());
    let rim = (0..columns - 1)
        .map(|i| [i + 1, i])
        .chain((0..columns - 1).map(|i| [i, i + 1].map(|i| (rows - 1) * columns + i)));
    let rim = rim.chain((0..rows - 1).map(|j| [j * columns, (j + 1) * columns]));
    let rim = rim.chain((0..rows - 1).map(|j| [(j + 1) * columns, j * columns].map(|i| i + columns - 1)));
    for [from, to] in rim.collect::<Vec<_>>() {
        let below = vertices.len() as u32;
        for place in [from, to] {
            vertices.push(DVec3 { y: -0.5, ..vertices[place] });
        }
        let [from, to] = [from as u32, to as u32];
        triangles.extend([[from, below, below + 1], [from, below + 1, to]]);
    }
    Ok(Shape::Mesh(Arc::new(TriangleMesh::new(&vertices, &triangles)?)))
}
