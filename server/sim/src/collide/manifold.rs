//! Contact manifolds: up to four points that share a normal.

use arrayvec::ArrayVec;
use glam::DVec3;

/// Most points of a manifold.
pub(crate) const POINTS_MAX: usize = 4;

/// Most candidates that are looked at before the reduction.
const CANDIDATES_MAX: usize = 16;

/// Points of neighbouring triangles that are nearer to each other are one, m.
const SAME_PLACE: f64 = 1e-6;
/// Candidates whose gaps differ by less are chosen from by area, m.
const SPREAD: f64 = 0.01;

/// A candidate for a contact point.
#[derive(Clone, Copy, Debug)]
pub(super) struct ManifoldPoint {
    /// Half way between the two surfaces, m.
    pub position: DVec3,
    /// Distance of the surfaces along the normal, m; negative where they overlap.
    pub gap: f64,
    /// Names the features that touch, so that the point is found again next tick.
    pub feature: u32,
}

/// Candidate points of one pair with their common normal.
#[derive(Clone, Debug, Default)]
pub(super) struct Manifold {
    /// Unit vector from the pair's first body to its second.
    pub normal: DVec3,
    points: ArrayVec<ManifoldPoint, CANDIDATES_MAX>,
}

impl Manifold {
    /// Without candidates.
    pub fn along(normal: DVec3) -> Self {
        Self { normal, ..Self::default() }
    }

    /// Takes a candidate; where there are too many, the one with the widest gap goes.
    pub fn offer(&mut self, point: ManifoldPoint) {
        if self.points.try_push(point).is_err() {
            let widest = self.points.iter_mut().max_by(|a, b| a.gap.total_cmp(&b.gap));
            if let Some(widest) = widest.filter(|w| w.gap > point.gap) {
                *widest = point;
            }
        }
    }

    /// Takes a candidate unless there is one in its place.
    pub fn offer_new(&mut self, point: ManifoldPoint) {
        if self.points.iter().all(|other| other.position.distance_squared(point.position) > SAME_PLACE * SAME_PLACE) {
            self.offer(point);
        }
    }

    /// No candidates.
    pub fn clear(&mut self) {
        self.points.clear();
    }

    /// Reduces the candidates to four at most: the deepest, the one farthest from it, and the two that span the
    /// largest area to either side of that line.
    pub fn reduced(&mut self) -> &[ManifoldPoint] {
        if self.points.len() > POINTS_MAX {
            self.drop_far_points();
        }
        if self.points.len() > POINTS_MAX {
            let normal = self.normal;
            self.bring(0, |_, p| -p.gap);
            self.bring(1, |chosen, p| (p.position - chosen[0].position).length_squared());
            let side = |chosen: &[ManifoldPoint], p: &ManifoldPoint| {
                let line = chosen[1].position - chosen[0].position;
                line.cross(p.position - chosen[0].position).dot(normal)
            };
            self.bring(2, side);
            self.bring(3, |chosen, p| -side(chosen, p));
            self.points.truncate(POINTS_MAX);
        }
        &self.points
    }

    /// Drops what is farther than the fourth nearest by more than [`SPREAD`]: margins of fast bodies let in their far side,
    /// and a box does not stand on that.
    fn drop_far_points(&mut self) {
        let mut gaps: ArrayVec<f64, CANDIDATES_MAX> = self.points.iter().map(|p| p.gap).collect();
        gaps.sort_unstable_by(f64::total_cmp);
        let limit = gaps[POINTS_MAX - 1] + SPREAD;
        self.points.retain(|p| p.gap <= limit);
    }

    /// Swaps the best of the points from `place` on to `place`; ties go to the earlier candidate.
    fn bring(&mut self, place: usize, score: impl Fn(&[ManifoldPoint], &ManifoldPoint) -> f64) {
        let (chosen, rest) = self.points.split_at(place);
        let mut best = (place, f64::NEG_INFINITY);
        for (i, p) in rest.iter().enumerate() {
            let s = score(chosen, p);
            if s > best.1 {
                best = (place + i, s);
            }
        }
        self.points.swap(place, best.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_far_side_of_a_box_is_not_what_it_stands_on() {
        let mut manifold = Manifold { normal: DVec3::NEG_Y, ..Manifold::default() };
        for corner in 0..8u32 {
            let sign = |bit: u32| if corner & bit == 0 { -1.0 } else { 1.0 };
            let position = DVec3::new(sign(1), 2.0 + sign(2), sign(4));
            manifold.offer(ManifoldPoint { position, gap: position.y, feature: corner });
        }
        let mut kept: Vec<_> = manifold.reduced().iter().map(|p| p.feature).collect();
        kept.sort_unstable();
        assert_eq!(kept, [0, 1, 4, 5]);
    }

    #[test]
    fn eight_points_of_a_face_become_its_four_corners() {
        let mut manifold = Manifold { normal: DVec3::Y, ..Manifold::default() };
        for (feature, (x, z)) in
            (0..).zip([(-1., -1.), (0., -1.), (1., -1.), (1., 0.), (1., 1.), (0., 1.), (-1., 1.), (-1., 0.)])
        {
            let gap = if feature == 0 { -0.01 } else { 0.0 };
            manifold.offer(ManifoldPoint { position: DVec3::new(x, 0.0, z), gap, feature });
        }
        let mut kept: Vec<_> = manifold.reduced().iter().map(|p| p.feature).collect();
        kept.sort_unstable();
        assert_eq!(kept, [0, 2, 4, 6]);
    }
}
