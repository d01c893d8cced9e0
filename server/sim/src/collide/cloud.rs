//! The hull of points that move from tick to tick: faces are found where they are asked for.

use arrayvec::ArrayVec;
use glam::{DVec2, DVec3};
use parry3d_f64::shape::{PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, SupportMap};

/// Slope up to which points beside the farthest one are of the same face: what deforms is not quite flat.
const FLAT: f64 = 0.1;

/// Most points of a face that are looked at; a manifold is made of four.
const POINTS_MAX: usize = 24;

/// Most corners of a face that a manifold is made of.
const CORNERS_MAX: usize = 4;

/// At least one point.
#[derive(Clone, Debug)]
pub(super) struct Cloud {
    points: Vec<DVec3>,
}

/// A point of a face: its index, and where it is in the face's plane.
type OfFace = (u32, DVec2);

impl Cloud {
    pub fn new(points: Vec<DVec3>) -> Self {
        Self { points }
    }

    /// Moves all points.
    pub fn deform(&mut self, points: impl Iterator<Item = DVec3>) {
        self.points.clear();
        self.points.extend(points);
    }

    fn farthest(&self, direction: DVec3) -> u32 {
        let (mut best, mut farthest) = (0, f64::NEG_INFINITY);
        for (index, point) in (0..).zip(&self.points) {
            let along = point.dot(direction);
            if along > farthest {
                (best, farthest) = (index, along);
            }
        }
        best
    }

    /// Points of the face that looks along a unit vector, the farthest one first.
    fn face(&self, direction: DVec3) -> ArrayVec<OfFace, POINTS_MAX> {
        let first = self.farthest(direction);
        let origin = self.points[first as usize];
        let (x, y) = direction.any_orthonormal_pair();
        let mut face = ArrayVec::from_iter([(first, DVec2::ZERO)]);
        for (index, &point) in (0..).zip(&self.points) {
            let arm = point - origin;
            let place = DVec2::new(arm.dot(x), arm.dot(y));
            if index != first && -arm.dot(direction) <= FLAT * place.length() && !face.is_full() {
                face.push((index, place));
            }
        }
        face
    }
}

impl SupportMap for Cloud {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        self.points[self.farthest(direction) as usize]
    }
}

impl PolygonalFeatureMap for Cloud {
    fn local_support_feature(&self, direction: DVec3, out: &mut PolygonalFeature) {
        let corners = reduced(ring(&self.face(direction)));
        let count = corners.len();
        for (i, &(corner, _)) in corners.iter().enumerate() {
            let next = corners[(i + 1) % count].0;
            out.vertices[i] = self.points[corner as usize];
            out.vids[i] = PackedFeatureId::vertex(corner);
            // Of fewer than 256 points each.
            out.eids[i] = PackedFeatureId::edge(corner.min(next) << 8 | corner.max(next));
        }
        out.fid =
            PackedFeatureId::face(corners.iter().map(|&(corner, _)| corner).fold(0, |id, corner| id << 6 ^ corner));
        out.num_vertices = count;
    }
}

/// The hull of points in a plane, counterclockwise: gift wrapping, from the one farthest to the right.
fn ring(points: &[OfFace]) -> ArrayVec<OfFace, POINTS_MAX> {
    let right = |p: &&OfFace, q: &&OfFace| p.1.x.total_cmp(&q.1.x).then(p.1.y.total_cmp(&q.1.y));
    let mut ring = ArrayVec::<OfFace, POINTS_MAX>::new();
    let Some(&start) = points.iter().max_by(right) else { return ring };
    ring.push(start);
    let mut last = start;
    while !ring.is_full() {
        let mut next = last;
        for &candidate in points {
            let (to_next, to_candidate) = (next.1 - last.1, candidate.1 - last.1);
            let turn = to_next.perp_dot(to_candidate);
            let farther = turn == 0.0 && to_candidate.length_squared() > to_next.length_squared();
            if turn < 0.0 || farther {
                next = candidate;
            }
        }
        // Rounding may lead past the start: no corner comes twice.
        if ring.iter().any(|corner| corner.0 == next.0) {
            break;
        }
        ring.push(next);
        last = next;
    }
    ring
}

/// Up to four corners of a convex ring, in its order: those that go make the smallest triangles with their neighbours.
fn reduced(mut ring: ArrayVec<OfFace, POINTS_MAX>) -> ArrayVec<OfFace, POINTS_MAX> {
    while ring.len() > CORNERS_MAX {
        let count = ring.len();
        let area = |i: usize| {
            let [before, at, after] = [ring[(i + count - 1) % count].1, ring[i].1, ring[(i + 1) % count].1];
            (at - before).perp_dot(after - at).abs()
        };
        let least = (0..count).min_by(|&i, &j| area(i).total_cmp(&area(j))).unwrap_or(0);
        ring.remove(least);
    }
    ring
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(points: Vec<DVec3>, direction: DVec3) -> PolygonalFeature {
        let mut feature = PolygonalFeature::default();
        Cloud::new(points).local_support_feature(direction, &mut feature);
        feature
    }

    #[test]
    fn faces_are_those_of_a_box_bent_a_little() {
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let mut points: Vec<_> = (0..8).map(corner).collect();
        points[2].y += 0.03;
        points.push(DVec3::new(0.5, 1.0, 0.5));
        let top = feature(points.clone(), DVec3::Y);
        let mut corners: Vec<_> = top.vids[..4].iter().map(|id| id.unpack().unwrap_vertex()).collect();
        // Counterclockwise seen from outside.
        let normal = (top.vertices[1] - top.vertices[0]).cross(top.vertices[2] - top.vertices[1]);
        assert!(normal.y > 0.0);
        corners.sort_unstable();
        assert_eq!((top.num_vertices, corners), (4, vec![2, 3, 6, 7]));
        let edge = feature(points, (DVec3::X + DVec3::NEG_Y).normalize());
        assert_eq!(edge.num_vertices, 2);
        assert_eq!(feature(vec![DVec3::ONE; 3], DVec3::Y).num_vertices, 1);
    }
}
