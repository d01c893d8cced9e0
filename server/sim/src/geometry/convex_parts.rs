//! Convex decomposition at load: what moves is convex, so a shape with hollows becomes several hulls.

use std::collections::BTreeSet;

use glam::DVec3;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};

use super::Geometry;
use crate::collide::{HULL_POINTS_MAX, Shape};
use crate::error::{SimError, require};

/// Turn from one direction to the next that spreads them evenly, rad.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// How finely to decompose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvexPartsDesc {
    /// Most parts, 1 to 256.
    pub parts_max: u32,
    /// Cells along the longest side, 8 to 256: hollows narrower than two cells are filled.
    pub resolution: u32,
    /// How hollow a part may stay, as a fraction of its volume, 0 to 1.
    pub concavity: f64,
    /// Extrusion radius of the hulls, m; they grow by it.
    pub radius: f64,
}

impl Default for ConvexPartsDesc {
    fn default() -> Self {
        Self { parts_max: 16, resolution: 48, concavity: 0.02, radius: 0.0 }
    }
}

impl Geometry {
    /// Hulls that together are about the solid inside the surface, in the surface's frame (by V-HACD: cells, cut along
    /// planes where that makes parts more convex). They are up to a cell too large all around.
    ///
    /// # Errors
    /// [`SimError`] for a setting out of range, a surface that is refused, and where nothing is left that has a volume.
    pub fn convex_parts(&self, desc: &ConvexPartsDesc) -> Result<Vec<Shape>, SimError> {
        let ConvexPartsDesc { parts_max, resolution, concavity, radius } = *desc;
        require((1..=256).contains(&parts_max), "parts_max", parts_max.into(), "1 to 256")?;
        require((8..=256).contains(&resolution), "resolution", resolution.into(), "8 to 256 cells")?;
        require((0.0..=1.0).contains(&concavity), "concavity", concavity, "0 to 1")?;
        let surface = self.surface()?;
        let settings = VHACDParameters {
            max_convex_hulls: parts_max,
            resolution,
            concavity,
            // Hulls of few points, from the cells.
            convex_hull_downsampling: 4,
            ..VHACDParameters::default()
        };
        let cells = VHACD::decompose(&settings, surface.vertices(), surface.triangles(), false);
        let hulls = cells.compute_convex_hulls(settings.convex_hull_downsampling).into_iter();
        let shapes = hulls.map(|(points, _)| Shape::Hull { points: thinned(points), radius });
        let shapes: Vec<_> = shapes.filter(|shape| shape.validate().is_ok()).collect();
        if shapes.is_empty() {
            return Err(SimError::Unusable { what: "the surface encloses no volume that cells of this size see" });
        }
        Ok(shapes)
    }
}

/// Not more points than a hull may have: those that reach farthest in evenly spread directions.
fn thinned(points: Vec<DVec3>) -> Vec<DVec3> {
    if points.len() <= HULL_POINTS_MAX {
        return points;
    }
    let directions = (0..HULL_POINTS_MAX).map(|i| {
        let height = (2 * i + 1) as f64 / HULL_POINTS_MAX as f64 - 1.0;
        let (sin, cos) = (i as f64 * GOLDEN_ANGLE).sin_cos();
        let across = (1.0 - height * height).sqrt();
        DVec3::new(across * cos, height, across * sin)
    });
    let farthest = |d: DVec3| {
        let along = |i: &usize| points[*i].dot(d);
        (0..points.len()).max_by(|i, j| along(i).total_cmp(&along(j))).unwrap_or(0)
    };
    let kept: BTreeSet<usize> = directions.map(farthest).collect();
    kept.into_iter().map(|i| points[i]).collect()
}
