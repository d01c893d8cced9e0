//! Pairs that keep still need not be looked at again: what the fine phase found of them is carried along.
//!
//! Contacts are linear about the start of the tick anyway. A pair that has hardly moved against itself since it was last
//! looked at keeps its normal and its points, gaps changed by how far the points have moved. That is wrong by second order,
//! and by what a turn of 40 µrad makes of corners that were not among the points: 40 µm for a metre. Most of what rests,
//! rests like this.

use arrayvec::ArrayVec;
use glam::DVec3;

use super::manifold::{Manifold, ManifoldPoint, POINTS_MAX};
use crate::dof::Pose;

/// How far a pair may have moved against itself since it was looked at, m and rad.
const SHIFT: f64 = 2e-5;
const TURN: f64 = 4e-5;

/// How much wider the margin may have become, m.
const WIDER: f64 = 1e-3;

/// A pair as it was when it was looked at, in the frame of its first body.
#[derive(Clone, Debug)]
pub(super) struct Still {
    /// Where the second one was.
    second: Pose,
    margin: f64,
    normal: DVec3,
    points: ArrayVec<ManifoldPoint, POINTS_MAX>,
}

/// Where `b` is as `a` sees it.
fn seen_from(a: Pose, b: Pose) -> Pose {
    let to_a = a.rotation.inverse();
    Pose { position: to_a * (b.position - a.position), rotation: to_a * b.rotation }
}

impl Still {
    /// Keeps what was found of two bodies within `margin`, m.
    pub fn keep(manifold: &mut Manifold, [a, b]: [Pose; 2], margin: f64) -> Self {
        let to_a = a.rotation.inverse();
        let inward = |p: &ManifoldPoint| ManifoldPoint { position: to_a * (p.position - a.position), ..*p };
        let points = manifold.reduced().iter().map(inward).collect();
        Self { second: seen_from(a, b), margin, normal: to_a * manifold.normal, points }
    }

    /// Writes what was found, carried along to where the two bodies are now. Answers whether they kept still; if not,
    /// nothing is written.
    pub fn carry(&self, [a, b]: [Pose; 2], margin: f64, manifold: &mut Manifold) -> bool {
        let now = seen_from(a, b);
        let shift = now.position - self.second.position;
        let turned = now.rotation * self.second.rotation.inverse();
        let turn = 2.0 * turned.w.signum() * DVec3::new(turned.x, turned.y, turned.z);
        let keeps_still = shift.length_squared() < SHIFT * SHIFT && turn.length_squared() < TURN * TURN;
        if !keeps_still || margin > self.margin + WIDER {
            return false;
        }
        manifold.normal = a.rotation * self.normal;
        for &ManifoldPoint { position, gap, feature } in &self.points {
            let moved = shift + turn.cross(position - self.second.position);
            let position = a.position + a.rotation * (position + moved / 2.0);
            manifold.offer(ManifoldPoint { position, gap: gap + self.normal.dot(moved), feature });
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::convex::Finder;
    use crate::collide::shape::{Collider, Shape};
    use glam::DQuat;
    use proptest::prelude::*;

    fn find(poses: [Pose; 2]) -> Manifold {
        let collider = Collider::new(Shape::Box { half: DVec3::new(0.5, 0.4, 0.3) }, 0.5);
        let [a, b] = poses.map(|pose| collider.convex(pose).unwrap());
        let mut manifold = Manifold::default();
        Finder::default().contacts(a, b, 0.02, None, &mut manifold);
        manifold
    }

    proptest! {
        /// What is carried along is what another look finds, wherever the pair as a whole has gone.
        #[test]
        fn what_is_carried_is_what_is_there(
            (yaw, lift) in (0.0..1.5f64, -1e-3..5e-3f64),
            shift in prop::array::uniform3(-1e-5..1e-5f64),
            turn in prop::array::uniform3(-2e-5..2e-5f64),
            carried in prop::array::uniform3(-3.0..3.0f64),
        ) {
            let below = Pose::IDENTITY;
            let above = Pose { position: DVec3::Y * (0.8 + lift), rotation: DQuat::from_rotation_y(yaw) };
            let still = Still::keep(&mut find([below, above]), [below, above], 0.02);
            let whole = Pose { position: DVec3::from(carried), rotation: DQuat::from_scaled_axis(DVec3::from(carried)) };
            let moved = Pose {
                position: whole.position + whole.rotation * (above.position + DVec3::from(shift)),
                rotation: whole.rotation * DQuat::from_scaled_axis(DVec3::from(turn)) * above.rotation,
            };
            let mut kept = Manifold::default();
            prop_assert!(still.carry([whole, moved], 0.02, &mut kept));
            let mut anew = find([whole, moved]);
            prop_assert!((kept.normal - anew.normal).length() < 1e-4);
            let depth = |manifold: &mut Manifold| {
                manifold.reduced().iter().map(|p| p.gap).fold(f64::INFINITY, f64::min)
            };
            // Of eight corners four were kept, and a turn may have made others the deepest.
            let reach = 2.0 * DVec3::from(turn).length() * above.position.length();
            prop_assert!((depth(&mut kept) - depth(&mut anew)).abs() < reach + 1e-6);
        }
    }

    #[test]
    fn what_moved_is_looked_at_again() {
        let (below, above) = (Pose::IDENTITY, Pose { position: DVec3::Y * 0.8, rotation: DQuat::IDENTITY });
        let still = Still::keep(&mut find([below, above]), [below, above], 0.02);
        let carries = |shift: f64, turn: f64, margin: f64| {
            let rotation = DQuat::from_rotation_x(turn);
            let above = Pose { position: above.position + DVec3::X * shift, rotation };
            still.carry([below, above], margin, &mut Manifold::default())
        };
        assert!(carries(0.9 * SHIFT, 0.9 * TURN, 0.02));
        assert!(!carries(1.1 * SHIFT, 0.0, 0.02) && !carries(0.0, 1.1 * TURN, 0.02) && !carries(0.0, 0.0, 0.022));
    }
}
