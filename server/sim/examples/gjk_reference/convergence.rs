//! What an extrusion radius does for GJK (the talk: "extrusion improves convergence"): hulls of about the same outer size
//! at the same gap, sharp, or shrunk about their middle and extruded.

use std::cell::Cell;

use parry3d_f64::math::Pose;
use parry3d_f64::query::epa::EPA;
use parry3d_f64::query::gjk::{CsoPoint, GJKResult, VoronoiSimplex, closest_points};
use parry3d_f64::shape::SupportMap;
use pita_sim::DVec3;
use serde::Serialize;

use super::pairs::Pairs;
use super::reference::{Core, Solid, signed_distance};

/// Of one gap and one radius.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Convergence {
    /// Between the surfaces, m.
    pub gap: f64,
    /// Extrusion radius, m; the hulls are about 1 m wide.
    pub radius: f64,
    /// Support points of both, as asked for by GJK: mean and largest.
    pub mean: f64,
    /// See `mean`.
    pub most: u32,
    /// Share of pairs whose cores overlap, which takes EPA as well.
    pub epa_share: f64,
    /// Support points that EPA asks for where it runs, mean.
    pub epa_mean: f64,
}

/// Counts how often it is asked.
struct Counted<'a> {
    points: &'a [DVec3],
    asked: Cell<u32>,
}

impl SupportMap for Counted<'_> {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        self.asked.set(self.asked.get() + 1);
        let farther = |a: DVec3, &b: &DVec3| if b.dot(direction) > a.dot(direction) { b } else { a };
        self.points[1..].iter().fold(self.points[0], farther)
    }
}

/// Measures `pairs` pairs for each gap and radius.
pub fn measure(pairs: u32, seed: u64) -> Vec<Convergence> {
    let radii = [0.0, 0.005, 0.02, 0.1];
    let gaps = [-1e-2, -1e-3, 0.0, 1e-6, 1e-3, 1e-1];
    gaps.into_iter().flat_map(|gap| radii.map(|radius| of(gap, radius, pairs, seed))).collect()
}

fn of(gap: f64, radius: f64, pairs: u32, seed: u64) -> Convergence {
    let mut source = Pairs::new(seed);
    let (mut asked, mut most, mut overlaps, mut epa_asked) = (0, 0, 0, 0);
    for _ in 0..pairs {
        let hulls = [source.cloud(), source.cloud()];
        let apart = source.direction() * 3.0;
        let shrunk = hulls.map(|points| points.into_iter().map(|p| p * (1.0 - 2.0 * radius)).collect::<Vec<_>>());
        let [a, mut b] = shrunk;
        b.iter_mut().for_each(|p| *p += apart);
        let solid = |points: &[DVec3]| Solid { core: Core::Points(points.to_vec()), radius };
        let now = signed_distance(&solid(&a), &solid(&b));
        b.iter_mut().for_each(|p| *p += now.normal * (gap - now.gap));
        let [a, b] = [&a, &b].map(|points| Counted { points, asked: Cell::new(0) });
        let mut simplex = VoronoiSimplex::new();
        simplex.reset(CsoPoint::from_shapes(&Pose::IDENTITY, &a, &b, apart.normalize()));
        let found = closest_points(&Pose::IDENTITY, &a, &b, f64::MAX, true, &mut simplex);
        let count = a.asked.get();
        asked += count;
        most = most.max(count);
        if found == GJKResult::Intersection {
            overlaps += 1;
            EPA::new().closest_points(&Pose::IDENTITY, &a, &b, &simplex);
            epa_asked += a.asked.get() - count;
        }
    }
    let mean = |sum: u32, of: u32| f64::from(sum) / f64::from(of.max(1));
    let (epa_share, epa_mean) = (mean(overlaps, pairs), mean(epa_asked, overlaps));
    Convergence { gap, radius, mean: mean(asked, pairs), most, epa_share, epa_mean }
}
