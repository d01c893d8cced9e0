//! Free-form deformation (talk, "Code: FFD": "can bend, twist, stretch, scale; procedural or key-framed"; Barr, "Global and
//! Local Deformations of Solid Primitives", 1984).
//!
//! Owns maps from points to points: [`FreeForm`] is one about an axis, a slice of them is one after the other, [`Warp`] is
//! one as a few numbers that can be animated, sent and drawn, [`KeyFrames`] gives such numbers over time, [`AppearanceDof`]
//! makes DOF of them. Any mesh or hull
//! is deformed by its points; nothing is inverted. The formula is the engine's [`RestShape`]: where a body is to follow
//! with dynamics of its own, the same numbers steer a [`Lattice`](pita_sim::Lattice), whose nodes are DOF.
//! Knows nothing of actors and arenas.

mod dof;
mod key_frames;
mod warp;

use glam::{DQuat, DVec3};
use pita_sim::{RestShape, Shape};

pub use dof::AppearanceDof;
pub use key_frames::{KEYS_MAX, KeyFrames};
pub use warp::{Appearance, Warp};

/// What a deformation goes along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Its lower end, which stays where it is, m.
    pub base: DVec3,
    /// Turns y to the axis, and x to where it bends.
    pub rotation: DQuat,
}

impl Axis {
    /// Up from `base`, m; bends towards x.
    pub fn up_from(base: DVec3) -> Self {
        Self { base, rotation: DQuat::IDENTITY }
    }
}

/// A deformation about an axis: first scaled, then twisted, then bent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeForm {
    /// Along what.
    pub axis: Axis,
    /// How.
    pub shape: RestShape,
}

impl FreeForm {
    /// Scales by `factors` along the axes of `axis`: volumes by their product.
    pub fn scale(axis: Axis, factors: DVec3) -> Self {
        Self { axis, shape: RestShape { scale: factors, ..RestShape::default() } }
    }

    /// Stretches by `factor` along `axis` and takes the volume from across, as a cartoon does; below 1 it squashes.
    pub fn stretch(axis: Axis, factor: f64) -> Self {
        let across = factor.sqrt().recip();
        Self::scale(axis, DVec3::new(across, factor, across))
    }

    /// Turns sections about `axis` by `rate` rad with each metre along it.
    pub fn twist(axis: Axis, rate: f64) -> Self {
        Self { axis, shape: RestShape { twist: rate, ..RestShape::default() } }
    }

    /// Makes `axis` an arc of `curvature` rad/m; sections stay plane and at right angles to it.
    pub fn bend(axis: Axis, curvature: f64) -> Self {
        Self { axis, shape: RestShape { bend: curvature, ..RestShape::default() } }
    }

    /// Where a point goes, m.
    pub fn apply(&self, point: DVec3) -> DVec3 {
        let Axis { base, rotation } = self.axis;
        base + rotation * self.shape.map(rotation.inverse() * (point - base))
    }
}

/// Deforms points, by one deformation after the other.
pub fn deform(deformations: &[FreeForm], points: &mut [DVec3]) {
    for point in points {
        *point = deformations.iter().fold(*point, |at, deformation| deformation.apply(at));
    }
}

/// The convex hull of the deformed points of a box or hull, with its extrusion; `None` for shapes without corners.
///
/// What bends is convex no more: its hull is that of its corners.
pub fn deform_shape(deformations: &[FreeForm], shape: &Shape) -> Option<Shape> {
    let (mut points, radius) = match shape {
        Shape::Box { half } => (corners(*half).to_vec(), 0.0),
        Shape::Hull { points, radius } => (points.clone(), *radius),
        _ => return None,
    };
    deform(deformations, &mut points);
    Some(Shape::Hull { points, radius })
}

fn corners(half: DVec3) -> [DVec3; 8] {
    let sign = |corner: usize, bit: usize| if corner & bit == 0 { -1.0 } else { 1.0 };
    std::array::from_fn(|corner| half * DVec3::new(sign(corner, 1), sign(corner, 2), sign(corner, 4)))
}
