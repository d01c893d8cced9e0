//! Nearest points of two convex cores: parry's GJK, and EPA where they overlap, with their answers checked.
//!
//! GJK's and EPA's answers are proposals. What counts is the separation along the normal that they propose, two support
//! points away, which holds whatever went wrong on the way. Where it disagrees with the points that come with it, other
//! starts are tried, and the best normal of all is polished.

use glam::DVec3;
use parry3d_f64::math::Pose as ParryPose;
use parry3d_f64::query::epa::EPA;
use parry3d_f64::query::gjk::{CsoPoint, GJKResult, VoronoiSimplex, closest_points};
use parry3d_f64::shape::PolygonalFeatureMap;

/// How far the separation along the normal may be from the distance of the points, m. A tenth of what the check against
/// the slow reference (`examples/gjk_reference`) allows.
const AGREEMENT: f64 = 1e-7;

/// Most rounds of polishing a normal.
const POLISHING_MAX: u32 = 600;

/// Crosses of directions that are tried before the step is halved.
const TURNS: u32 = 4;

/// Of a simplex that encloses a volume.
const SIMPLEX_DIMENSION: usize = 3;

/// Normals that are tried around a line in which the origin lies.
const AROUND_A_LINE: u32 = 32;

/// rad; no two crosses are alike.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Two cores, the second seen from the first.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a> {
    pub a: &'a dyn PolygonalFeatureMap,
    pub b: &'a dyn PolygonalFeatureMap,
    /// Pose of `b` in `a`'s axes.
    pub b_in_a: &'a ParryPose,
}

/// Nearest points of two cores, in the first one's axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Unit vector from the first to the second.
    pub normal: DVec3,
    /// Along the normal, m; negative where they overlap.
    pub gap: f64,
    pub on_a: DVec3,
    pub on_b: DVec3,
}

/// Memory of GJK and EPA, used again by every pair.
#[derive(Default)]
pub(super) struct Workspace {
    simplex: VoronoiSimplex,
    epa: EPA,
}

/// A gap that is not known to be wider than `within`, or a direction along which it is.
pub(super) enum Found {
    Beyond(DVec3),
    Nearest(Nearest),
}

impl Pair<'_> {
    /// How far apart the cores are along a unit normal, m.
    fn separation(&self, normal: DVec3) -> f64 {
        let [on_a, on_b] = self.support(normal);
        (on_b - on_a).dot(normal)
    }

    /// The points of both that reach farthest towards the other along a unit normal.
    pub fn support(&self, normal: DVec3) -> [DVec3; 2] {
        let CsoPoint { orig1, orig2, .. } = CsoPoint::from_shapes(self.b_in_a, self.a, self.b, normal);
        [orig1, orig2]
    }

    /// The nearest points. `guess` is the normal of last time.
    pub fn nearest(&self, within: f64, guess: Option<DVec3>, workspace: &mut Workspace) -> Found {
        let middle = self.b_in_a.translation.try_normalize();
        let first = guess.or(middle).unwrap_or(DVec3::X);
        let mut best = match self.propose(first, within, workspace) {
            Some(Found::Nearest(nearest)) if nearest.agrees() => return Found::Nearest(nearest),
            Some(Found::Nearest(nearest)) => nearest,
            Some(beyond) => return beyond,
            None => self.along(first),
        };
        for start in middle.into_iter().chain(DVec3::AXES).flat_map(|d| [d, -d]) {
            let found = self.propose(start, within, workspace);
            let nearest = match found {
                Some(Found::Nearest(nearest)) if nearest.agrees() => return Found::Nearest(nearest),
                Some(Found::Nearest(nearest)) => nearest,
                Some(beyond) => return beyond,
                None => self.along(start),
            };
            if nearest.gap > best.gap {
                best = nearest;
            }
        }
        let best = self.polished(best);
        match self.propose(best.normal, within, workspace) {
            Some(Found::Nearest(nearest)) if nearest.agrees() => Found::Nearest(nearest),
            _ => Found::Nearest(best),
        }
    }

    /// What GJK and EPA say from one start, if anything.
    fn propose(&self, start: DVec3, within: f64, workspace: &mut Workspace) -> Option<Found> {
        let Workspace { simplex, epa } = workspace;
        simplex.reset(CsoPoint::from_shapes(self.b_in_a, self.a, self.b, start));
        let (on_a, on_b, normal) = match closest_points(self.b_in_a, self.a, self.b, within, true, simplex) {
            GJKResult::ClosestPoints(on_a, on_b, normal) => (on_a, on_b, normal),
            GJKResult::Intersection => return Some(Found::Nearest(self.overlap(simplex, epa)?)),
            // It says so too where it gave up.
            GJKResult::NoIntersection(normal) if self.separation(normal) > within => {
                return Some(Found::Beyond(normal));
            }
            GJKResult::NoIntersection(_) | GJKResult::Proximity(_) => return None,
        };
        Some(Found::Nearest(self.proposed(on_a, on_b, normal)?))
    }

    /// A proposal with its separation, if it is one.
    fn proposed(&self, on_a: DVec3, on_b: DVec3, normal: DVec3) -> Option<Nearest> {
        let normal = normal.try_normalize()?;
        let gap = self.separation(normal);
        (on_a.is_finite() && on_b.is_finite()).then_some(Nearest { normal, gap, on_a, on_b })
    }

    /// What EPA says of cores that overlap.
    ///
    /// GJK may say so of cores that but touch, too. Then the origin is on the rim of the simplex that EPA begins with, and
    /// EPA may lose the face next to it to rounding: the next nearest, half a metre away, is as consistent as the right one
    /// is. But no normal separates by more than the right one does. So EPA begins twice where the simplex is flat, with its
    /// points in another order, and its answers are compared with the normals of the simplex itself.
    fn overlap(&self, simplex: &mut VoronoiSimplex, epa: &mut EPA) -> Option<Nearest> {
        let mut expand = |simplex: &VoronoiSimplex| {
            let (on_a, on_b, normal) = epa.closest_points(self.b_in_a, self.a, self.b, simplex)?;
            self.proposed(on_a, on_b, normal)
        };
        let mut best = expand(simplex);
        let touching = touching(simplex);
        if simplex.dimension() > 0 && touching.is_some() {
            simplex.swap(0, 1);
            best = wider(best, expand(simplex), 0.0);
        }
        for normal in normals(simplex) {
            let other = match touching {
                Some([on_a, on_b]) => self.proposed(on_a, on_b, normal),
                None => Some(self.along(normal)),
            };
            best = wider(best, other, AGREEMENT);
        }
        best
    }

    /// What a normal by itself says.
    fn along(&self, normal: DVec3) -> Nearest {
        let [on_a, on_b] = self.support(normal);
        Nearest { normal, gap: (on_b - on_a).dot(normal), on_a, on_b }
    }

    /// Turns the normal to where the cores are farthest apart.
    fn polished(&self, from: Nearest) -> Nearest {
        let mut best = from;
        let (mut step, mut failures) = (0.1, 0);
        for round in 0..POLISHING_MAX {
            if step < 1e-9 {
                break;
            }
            // Another cross of directions each time: along one that does not change, a ridge is not climbed.
            let (u, v) = best.normal.any_orthonormal_pair();
            let (sin, cos) = (f64::from(round) * GOLDEN_ANGLE).sin_cos();
            let (u, v) = (u * cos + v * sin, v * cos - u * sin);
            let better = [u, v, -u, -v].into_iter().find_map(|d| {
                let normal = (best.normal + step * d).normalize();
                let gap = self.separation(normal);
                (gap > best.gap).then_some(Nearest { normal, gap, ..best })
            });
            match better {
                Some(better) => (best, failures) = (better, 0),
                None => failures += 1,
            }
            if failures == TURNS {
                (step, failures) = (0.5 * step, 0);
            }
        }
        if best.normal == from.normal { from } else { self.along(best.normal) }
    }
}

/// The second of two answers where it is wider by more than `by`, m: no normal separates by more than the right one.
fn wider(first: Option<Nearest>, second: Option<Nearest>, by: f64) -> Option<Nearest> {
    match (first, second) {
        (Some(first), Some(second)) if second.gap > first.gap + by => Some(second),
        (first, second) => first.or(second),
    }
}

/// The points of both cores at the origin of a flat simplex, on which it lies.
fn touching(simplex: &VoronoiSimplex) -> Option<[DVec3; 2]> {
    let count = simplex.dimension() + 1;
    (count <= SIMPLEX_DIMENSION).then(|| {
        let mean = |of: fn(&CsoPoint) -> DVec3| (0..count).map(|i| of(simplex.point(i)) * simplex.proj_coord(i)).sum();
        [mean(|point| point.orig1), mean(|point| point.orig2)]
    })
}

/// Normals of a simplex's faces, both ways; of a line, some around it.
fn normals(simplex: &VoronoiSimplex) -> impl Iterator<Item = DVec3> {
    let point = |i: usize| simplex.point(i).point;
    let count = simplex.dimension() + 1;
    let corners = (2..count).flat_map(|k| (1..k).flat_map(move |j| (0..j).map(move |i| [i, j, k])));
    let faces = corners.filter_map(move |[i, j, k]| (point(j) - point(i)).cross(point(k) - point(i)).try_normalize());
    let line = if count == 2 { (point(1) - point(0)).try_normalize() } else { None };
    let around = line.into_iter().flat_map(|line| {
        let (u, v) = line.any_orthonormal_pair();
        (0..AROUND_A_LINE / 2).map(move |i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(AROUND_A_LINE)).sin_cos();
            u * cos + v * sin
        })
    });
    faces.chain(around).flat_map(|normal| [normal, -normal])
}

impl Nearest {
    /// Whether the points are as far apart as the cores are along the normal.
    fn agrees(&self) -> bool {
        let apart = self.on_b - self.on_a;
        let along = apart.dot(self.normal);
        let scale = self.on_a.abs().max(self.on_b.abs()).max_element();
        let tolerance = AGREEMENT + 1e-13 * scale;
        (along - self.gap).abs() < tolerance && (apart.length() - self.gap.abs()).abs() < tolerance
    }
}
