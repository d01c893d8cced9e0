//! Contacts of a convex shape with a half-space: exact, and without GJK.

use glam::DVec3;

use super::manifold::{Manifold, ManifoldPoint};
use super::shape::Shape;
use crate::dof::Pose;

/// Collects the points of `shape` whose gap above the plane through `origin` with unit `normal` is below `margin`.
///
/// A point lies half way between shape and plane; the manifold's normal points from the shape into the ground.
pub(super) fn contacts(shape: &Shape, pose: Pose, origin: DVec3, normal: DVec3, margin: f64, out: &mut Manifold) {
    out.normal = -normal;
    let mut add = |core: DVec3, radius: f64, feature: u32| {
        let gap = (core - origin).dot(normal) - radius;
        if gap < margin {
            out.offer(ManifoldPoint { position: core - normal * (radius + gap / 2.0), gap, feature });
        }
    };
    match shape {
        // Neither moves.
        Shape::HalfSpace { .. } | Shape::Mesh(_) => {}
        Shape::Ball { radius } => add(pose.position, *radius, 0),
        Shape::Box { half } => {
            let reach = half.dot((pose.rotation.inverse() * normal).abs());
            let is_above = (pose.position - origin).dot(normal) - reach >= margin;
            if is_above {
                return;
            }
            for corner in 0..8u32 {
                let sign = |bit: u32| if corner & bit == 0 { -1.0 } else { 1.0 };
                add(pose.point(*half * DVec3::new(sign(1), sign(2), sign(4))), 0.0, corner);
            }
        }
        Shape::Capsule { half_length, radius } => {
            add(pose.point(DVec3::X * *half_length), *radius, 0);
            add(pose.point(DVec3::NEG_X * *half_length), *radius, 1);
        }
        Shape::Cylinder { half_length, radius, rounding } => {
            cylinder(pose, normal, half_length - rounding, radius - rounding, *rounding, &mut add);
        }
        Shape::Hull { points, radius } => {
            for (feature, &p) in (0..).zip(points) {
                add(pose.point(p), *radius, feature);
            }
        }
    }
}

/// Lowest point of either rim; where the cylinder lies on its flat side, four points of the lower rim.
fn cylinder(pose: Pose, normal: DVec3, half: f64, radius: f64, rounding: f64, add: &mut impl FnMut(DVec3, f64, u32)) {
    let axis = pose.rotation * DVec3::Z;
    let across = normal.dot(axis) * axis - normal;
    // Below this tilt the lowest point of a rim wanders through half a turn on rounding errors.
    if across.length_squared() > 1e-4 {
        let low = across.normalize() * radius;
        add(pose.position + axis * half + low, rounding, 0);
        add(pose.position - axis * half + low, rounding, 1);
        return;
    }
    for (feature, end) in [(2, half), (6, -half)] {
        for (quarter, spoke) in (0..).zip([DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y]) {
            add(pose.point(spoke * radius + DVec3::Z * end), rounding, feature + quarter);
        }
    }
}
