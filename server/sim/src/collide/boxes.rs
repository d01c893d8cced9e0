//! Overlapping boxes: the axis along which they overlap least is one of fifteen, and is found without GJK and EPA.
//!
//! Boxes that rest on one another overlap by fractions of a millimetre in every tick, where GJK ends in EPA; the fifteen
//! axes take a fraction of that (Gottschalk, Lin and Manocha, "OBBTree", 1996). Where the boxes are apart, the largest
//! separation is no distance, and GJK it is.

use glam::{DMat3, DVec3};
use parry3d_f64::math::Pose as ParryPose;

/// Sines below this are those of parallel edges, whose cross product is rounding.
const PARALLEL: f64 = 1e-6;

/// An axis of two edges has to separate by so much more than one of a face, m: where they are alike, a face has an area.
const PREFERRED: f64 = 1e-7;

/// Normal from the first box to the second, in the first one's axes, and their separation along it, m, where that is
/// negative along every axis. `half` are their half extents.
pub(super) fn least_overlap(half: [DVec3; 2], b_in_a: &ParryPose) -> Option<(DVec3, f64)> {
    let turn = DMat3::from_quat(b_in_a.rotation);
    let (back, offset) = (turn.transpose(), b_in_a.translation);
    let separation = |axis: DVec3| offset.dot(axis).abs() - half[0].dot(axis.abs()) - half[1].dot((back * axis).abs());
    let mut best = (DVec3::ZERO, f64::NEG_INFINITY);
    let faces = DVec3::AXES.into_iter().chain([turn.x_axis, turn.y_axis, turn.z_axis]);
    for axis in faces {
        let along = separation(axis);
        if along >= 0.0 {
            return None;
        }
        if along > best.1 {
            best = (axis, along);
        }
    }
    best.1 += PREFERRED;
    for edge_a in DVec3::AXES {
        for edge_b in [turn.x_axis, turn.y_axis, turn.z_axis] {
            let cross = edge_a.cross(edge_b);
            let sine = cross.length();
            if sine < PARALLEL {
                continue;
            }
            let along = separation(cross / sine);
            if along >= 0.0 {
                return None;
            }
            if along > best.1 {
                best = (cross / sine, along);
            }
        }
    }
    let normal = if best.0.dot(offset) < 0.0 { -best.0 } else { best.0 };
    Some((normal, separation(normal)))
}

#[cfg(test)]
mod tests {
    use super::super::core::Core;
    use super::super::gjk::{Found, Pair, Workspace};
    use super::*;
    use glam::DQuat;
    use parry3d_f64::shape::Cuboid;
    use proptest::prelude::*;

    proptest! {
        /// What EPA finds, the axes find.
        #[test]
        fn depths_are_those_of_epa(
            sizes in prop::array::uniform6(0.05..1.0f64),
            place in prop::array::uniform3(-1.0..1.0f64),
            turn in prop::array::uniform3(-1.5..1.5f64),
            is_turned in any::<bool>(),
        ) {
            let half = [DVec3::from_slice(&sizes), DVec3::from_slice(&sizes[3..])];
            let turn = if is_turned { DVec3::from_array(turn) } else { DVec3::ZERO };
            let b_in_a = ParryPose::from_parts(DVec3::from_array(place), DQuat::from_scaled_axis(turn));
            let cores = half.map(|half| Core::Box(Cuboid::new(half)));
            let pair = Pair { a: cores[0].map(), b: cores[1].map(), b_in_a: &b_in_a };
            let Found::Nearest(nearest) = pair.nearest(10.0, None, &mut Workspace::default()) else { unreachable!() };
            match least_overlap(half, &b_in_a) {
                Some((_, gap)) => prop_assert!((gap - nearest.gap).abs() < 1e-6, "{gap} {}", nearest.gap),
                None => prop_assert!(nearest.gap > -1e-6, "{}", nearest.gap),
            }
        }
    }
}
