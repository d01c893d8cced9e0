//! Arch: 25 stones along a weighted catenary, that of the Gateway Arch, 60 m high and 60 wide, without mortar.
//!
//! The authors leave gaps of 0.1 m between the stones, so that the arch closes by falling; here it is also built without.
//! Its lowest stones stand on the ground.

use pita_sim::{DVec3, SimError};

use super::Finding;
use super::stage::Stage;

const SECONDS: f64 = 20.0;
const STONES: usize = 25;
const FRICTION: f64 = 0.5;
/// Height and half width of the line of centres, m.
const HEIGHT: f64 = 60.0;
const HALF_WIDTH: f64 = 30.0;
/// Width of a stone at the foot and at the top, m: square roots of the cross sections.
const WIDTHS: [f64; 2] = [10.0, 7.0];
/// cosh of where the catenary ends: the ratio of the cross sections, 100 to 49.
const RATIO: f64 = 100.0 / 49.0;

/// How far a stone of an arch that stands may move after the first five seconds, m: at 60 m of height.
const SHIFT_MAX: f64 = 0.05;

pub(super) fn run(dt: f64) -> Result<Vec<Finding>, SimError> {
    Ok(vec![build(dt, 0.0, "arch, built")?, build(dt, 0.1, "arch, dropped")?])
}

fn build(dt: f64, gap: f64, name: &str) -> Result<Finding, SimError> {
    let mut stage = Stage::new(dt)?;
    stage.ground(FRICTION)?;
    let mut stones = Vec::new();
    for corners in corners(gap) {
        stones.push(stage.put_solid(&corners, FRICTION)?);
    }
    stage.run(5.0);
    let settled: Vec<_> = stones.iter().map(|&stone| stage.position(stone)).collect();
    stage.run(SECONDS - 5.0);
    let moved = stones.iter().zip(&settled).map(|(&stone, from)| stage.position(stone).distance(*from));
    let shift = moved.fold(0.0, f64::max);
    let top = stage.position(stones[STONES / 2]).y;
    let stands = top > HEIGHT - 2.0;
    Ok(Finding {
        scene: name.to_owned(),
        ours: format!("{}, shifts {:.2} mm", if stands { "stands" } else { "falls" }, 1e3 * shift),
        wanted: "stands 20 s, shifts below 50 mm after the first five",
        theirs: "Rigid-IPC: stands",
        holds: stands && shift < SHIFT_MAX,
        figures: vec![("shift_m", shift), ("top_m", top)],
        stage,
    })
}

/// Corners of every stone, from left to right. Neighbours are `gap` apart each way.
fn corners(gap: f64) -> Vec<[DVec3; 8]> {
    let end = RATIO.acosh();
    let rise = HEIGHT / (RATIO - 1.0);
    let height = |x: f64| HEIGHT - rise * ((end * x / HALF_WIDTH).cosh() - 1.0);
    let normal = |x: f64| DVec3::new(rise * (end * x / HALF_WIDTH).sinh() * end / HALF_WIDTH, 1.0, 0.0).normalize();
    // Half the width of a joint's face, by its height.
    let half_width = |x: f64| {
        let up = (height(x) / HEIGHT).clamp(0.0, 1.0);
        0.5 * (WIDTHS[0] + (WIDTHS[1] - WIDTHS[0]) * up)
    };
    let joints = joints(|x| DVec3::new(x, height(x), 0.0));
    let middle = (STONES / 2) as f64;
    let stone = |(k, ends): (usize, &[f64])| {
        let from_middle = k as f64 - middle;
        let lift = DVec3::new(from_middle, middle - from_middle.abs(), 0.0) * gap;
        let mut corners = [DVec3::ZERO; 8];
        for (i, corner) in corners.iter_mut().enumerate() {
            let x = ends[i & 1];
            let half = half_width(x);
            let (inside, depth) = (if i & 2 == 0 { -half } else { half }, if i & 4 == 0 { -half } else { half });
            *corner = DVec3::new(x, height(x), depth) + normal(x) * inside + lift;
        }
        corners
    };
    let mut stones: Vec<_> = joints.windows(2).enumerate().map(stone).collect();
    level(&mut stones[0], 0);
    level(&mut stones[STONES - 1], 1);
    stones
}

/// Lays the lower face of a stone, that with `side` as bit 0 of its corners, level on the ground, along the stone's edges.
fn level(stone: &mut [DVec3; 8], side: usize) {
    for i in (0..8).filter(|i| i & 1 == side) {
        let (low, high) = (stone[i], stone[i ^ 1]);
        stone[i] = low + (high - low) * (-low.y / (high.y - low.y));
    }
}

/// Where the joints are: at equal lengths along the line, found on a fine polygon.
fn joints(line: impl Fn(f64) -> DVec3) -> Vec<f64> {
    const PIECES: usize = 20_000;
    let place = |i: usize| -HALF_WIDTH + 2.0 * HALF_WIDTH * i as f64 / PIECES as f64;
    let piece = |i: usize| line(place(i)).distance(line(place(i + 1)));
    let total: f64 = (0..PIECES).map(piece).sum();
    let (mut joints, mut run) = (vec![-HALF_WIDTH], 0.0);
    for i in 0..PIECES {
        run += piece(i);
        if joints.len() < STONES && run >= total * joints.len() as f64 / STONES as f64 {
            joints.push(place(i + 1));
        }
    }
    joints.push(HALF_WIDTH);
    joints
}
