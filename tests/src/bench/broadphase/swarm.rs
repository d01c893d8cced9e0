//! What the broad phases are measured on: swarms of hulls that fly, turn and wobble, the same in every run.

use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec3};

/// A swarm.
pub struct Swarm {
    pub name: &'static str,
    pub hulls: Vec<Hull>,
    shapes: Vec<Flight>,
}

/// A convex hull at a tick.
#[derive(Clone, Debug, Default)]
pub struct Hull {
    /// In the world, m.
    pub points: Vec<DVec3>,
    /// Where its own axes point: of an oriented box.
    pub axes: DMat3,
}

/// How a hull moves.
struct Flight {
    points: Vec<DVec3>,
    home: DVec3,
    /// How far it flies about its home, m, and how fast it turns, rad a tick.
    reach: f64,
    turn: DVec3,
    /// How far its points move in it, as a fraction of their distance from the centre.
    wobble: f64,
    phase: f64,
}

/// The corners of a box.
fn corners(half: DVec3) -> Vec<DVec3> {
    let sign = |i: u32, bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
    (0..8).map(|i| half * DVec3::new(sign(i, 1), sign(i, 2), sign(i, 4))).collect()
}

fn tetrahedron(size: f64) -> Vec<DVec3> {
    [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)]
        .map(|(x, y, z)| DVec3::new(x, y, z) * size)
        .to_vec()
}

impl Swarm {
    /// Boxes in a heap that flies apart, boxes that lie still, bars, and bodies that deform.
    pub fn all() -> Vec<Self> {
        vec![
            Self::new("500 crates, flying", 500, 0.9, (0.3, 0.1, 0.0), |_| corners(DVec3::new(0.5, 0.4, 0.45))),
            Self::new("500 crates, at rest", 500, 0.9, (0.0005, 0.0005, 0.0), |_| corners(DVec3::new(0.5, 0.4, 0.45))),
            Self::new("400 bars, flying", 400, 1.0, (0.3, 0.1, 0.0), |_| corners(DVec3::new(1.5, 0.08, 0.08))),
            Self::new("400 deforming", 400, 0.9, (0.3, 0.1, 0.3), |i| {
                if i % 2 == 0 { tetrahedron(0.5) } else { corners(DVec3::splat(0.4)) }
            }),
        ]
    }

    /// `spacing` is the distance of homes, m; `motion` the reach, the turn and the wobble of a [`Flight`].
    fn new(
        name: &'static str,
        count: usize,
        spacing: f64,
        (reach, turn, wobble): (f64, f64, f64),
        points: impl Fn(usize) -> Vec<DVec3>,
    ) -> Self {
        let side = (count as f64).cbrt().ceil() as usize;
        let flight = |i: usize| {
            // Golden-angle steps: nothing lines up, and nothing is random.
            let phase = TAU * (0.618_034 * i as f64).fract();
            let home = spacing * DVec3::new((i % side) as f64, (i / side % side) as f64, (i / side / side) as f64);
            let axis = DVec3::new(phase.cos(), (2.1 * phase).sin(), (3.7 * phase).cos());
            Flight { points: points(i), home, reach, turn: turn * axis, wobble, phase }
        };
        let shapes: Vec<_> = (0..count).map(flight).collect();
        let mut swarm = Self { name, hulls: vec![Hull::default(); count], shapes };
        swarm.fly_to(0);
        swarm
    }

    /// Moves to a tick.
    pub fn fly_to(&mut self, tick: u32) {
        let t = f64::from(tick);
        for (flight, hull) in self.shapes.iter().zip(&mut self.hulls) {
            let sway = DVec3::new(flight.phase.sin(), (1.3 * flight.phase).cos(), (0.7 * flight.phase).sin());
            let centre = flight.home + flight.reach * 3.0 * sway * (0.1 * t + flight.phase).sin();
            let start = DQuat::from_scaled_axis(DVec3::new(1.0, 2.0, 0.5) * flight.phase);
            let axes = DMat3::from_quat(DQuat::from_scaled_axis(flight.turn * t) * start);
            let swell = |i: usize| 1.0 + flight.wobble * (0.2 * t + flight.phase + i as f64).sin();
            hull.axes = axes;
            hull.points.clear();
            hull.points.extend(flight.points.iter().enumerate().map(|(i, &p)| centre + axes * (p * swell(i))));
        }
    }
}
