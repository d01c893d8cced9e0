//! Polyhedra: closed surfaces of triangles, and convex hulls.

use glam::DVec3;
use parry3d_f64::transformation::try_convex_hull;

use super::integrals::{Integrals, tetrahedron, volume};
use super::{Density, MassProperties};
use crate::error::{SimError, require, require_vector};

const FLAT: &str = "points of a hull lie in a plane";

/// Least volume, as a fraction of the cube of the surface's extent: below it the integrals are rounding errors.
const SMALLEST_VOLUME: f64 = 1e-12;

/// A solid inside a closed surface of triangles, in its own frame, m.
#[derive(Clone, Debug)]
pub struct Polyhedron {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// A point amid the points: integrals are taken from here.
    middle: DVec3,
}

impl Polyhedron {
    /// The convex hull of points.
    ///
    /// # Errors
    /// [`SimError`] where a point is not finite or all lie in a plane.
    pub fn of_hull(points: &[DVec3]) -> Result<Self, SimError> {
        points.iter().try_for_each(|&p| require_vector(p, "points"))?;
        let flat = |_| SimError::Unusable { what: FLAT };
        let (points, triangles) = try_convex_hull(points).map_err(flat)?;
        Self::closed(points, triangles, FLAT)
    }

    /// The inside of a surface, which need not be convex. Triangles turn counterclockwise seen from outside.
    ///
    /// # Errors
    /// [`SimError`] where a point is not finite, a corner names no point, an edge has not one triangle on either side,
    /// or the volume is not above 0.
    pub fn of_surface(points: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, SimError> {
        points.iter().try_for_each(|&p| require_vector(p, "points"))?;
        for &corner in triangles.iter().flatten() {
            let exists = (corner as usize) < points.len();
            require(exists, "corner of a triangle", f64::from(corner), "the index of a point")?;
        }
        Self::closed(points, triangles, "a surface encloses no volume: its triangles must face outwards")
    }

    fn closed(points: Vec<DVec3>, triangles: Vec<[u32; 3]>, empty: &'static str) -> Result<Self, SimError> {
        let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let polyhedron = Self { points, triangles, middle };
        let extent = polyhedron.points.iter().map(|&p| (p - middle).length()).fold(0.0, f64::max);
        if polyhedron.volume().partial_cmp(&(SMALLEST_VOLUME * extent.powi(3))) != Some(std::cmp::Ordering::Greater) {
            return Err(SimError::Unusable { what: empty });
        }
        polyhedron.edges().map(|_| polyhedron)
    }

    /// m³.
    pub fn volume(&self) -> f64 {
        self.tetrahedra().map(volume).sum()
    }

    /// Tetrahedra whose signed sum is the solid: the positive ones overlap what negative ones take away again.
    pub fn tetrahedra(&self) -> impl Iterator<Item = [DVec3; 4]> + '_ {
        self.faces().map(|[a, b, c]| [self.middle, a, b, c])
    }

    /// Mass properties with a density that is above 0 at every point of the surface.
    ///
    /// # Errors
    /// [`SimError`] naming the density.
    pub fn mass_properties(&self, density: Density) -> Result<MassProperties, SimError> {
        self.require_positive(density)?;
        MassProperties::from_integrals(self.middle, self.integrals(density))
    }

    /// `Err` unless the density is positive at every point.
    pub(super) fn require_positive(&self, density: Density) -> Result<(), SimError> {
        let along = self.points.iter().map(|p| p.dot(density.direction()));
        density.require_positive(along.fold(f64::INFINITY, f64::min))
    }

    /// From [`Polyhedron::middle`].
    pub(super) fn integrals(&self, density: Density) -> Integrals {
        let pieces = self.tetrahedra().map(|corners| {
            let densities = corners.map(|p| density.at(p));
            tetrahedron(corners.map(|p| p - self.middle), densities)
        });
        pieces.sum()
    }

    /// A point amid the points.
    pub(super) fn middle(&self) -> DVec3 {
        self.middle
    }

    pub(super) fn point(&self, i: u32) -> DVec3 {
        self.points[i as usize]
    }

    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corners of every triangle.
    pub(super) fn faces(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|i| self.point(i)))
    }

    /// Start and end of every directed edge and the triangle to its left, in order.
    ///
    /// # Errors
    /// [`SimError::Unusable`] unless every edge has one triangle on either side.
    pub(super) fn edges(&self) -> Result<Vec<(u32, u32, u32)>, SimError> {
        let sides = |(t, &[a, b, c]): (u32, &[u32; 3])| [(a, b, t), (b, c, t), (c, a, t)];
        let mut edges: Vec<_> = (0..).zip(&self.triangles).flat_map(sides).collect();
        edges.sort_unstable();
        let twice = edges.windows(2).any(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1));
        if twice || edges.iter().any(|&(a, b, _)| a == b || left_of(&edges, b, a).is_none()) {
            return Err(SimError::Unusable { what: "a surface is not closed: an edge has not two triangles" });
        }
        Ok(edges)
    }
}

/// The triangle to the left of the edge from `a` to `b`, among edges in order.
pub(super) fn left_of(edges: &[(u32, u32, u32)], a: u32, b: u32) -> Option<u32> {
    let place = edges.partition_point(|edge| (edge.0, edge.1) < (a, b));
    edges.get(place).filter(|edge| (edge.0, edge.1) == (a, b)).map(|edge| edge.2)
}
