//! Convex cores: what is extruded. Each answers its farthest point along a direction, which is all that GJK and EPA ask
//! for, and the face, edge or point there, of which manifolds are made.

use arrayvec::ArrayVec;
use glam::DVec3;
use parry3d_f64::shape::{
    ConvexPolyhedron, Cuboid, Cylinder, PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Segment, SupportMap,
};

use super::cloud::Cloud;

/// Most corners of a face that a manifold is made of.
const FACE_CORNERS_MAX: usize = 4;

/// A convex core in the axes in which parry knows it: cylinders stand along y.
#[derive(Clone, Debug)]
pub(super) enum Core {
    Point(Point),
    Segment(Segment),
    Box(Cuboid),
    Cylinder(Cylinder),
    Polytope(Polytope),
    Cloud(Cloud),
}

impl Core {
    pub fn map(&self) -> &dyn PolygonalFeatureMap {
        match self {
            Self::Point(point) => point,
            Self::Segment(segment) => segment,
            Self::Box(cuboid) => cuboid,
            Self::Cylinder(cylinder) => cylinder,
            Self::Polytope(polytope) => polytope,
            Self::Cloud(cloud) => cloud,
        }
    }

    /// Half extents of a box, m.
    pub fn half(&self) -> Option<DVec3> {
        match self {
            Self::Box(cuboid) => Some(cuboid.half_extents),
            _ => None,
        }
    }
}

/// The origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point;

impl SupportMap for Point {
    fn local_support_point(&self, _: DVec3) -> DVec3 {
        DVec3::ZERO
    }
}

impl PolygonalFeatureMap for Point {
    fn local_support_feature(&self, _: DVec3, out: &mut PolygonalFeature) {
        *out = PolygonalFeature { num_vertices: 1, ..PolygonalFeature::default() };
    }
}

/// The hull of points: a polyhedron, or a polygon, an edge or a point.
#[derive(Clone, Debug)]
pub(super) struct Polytope {
    points: Vec<DVec3>,
    faces: Vec<Face>,
}

/// Corners of a face, counterclockwise seen from outside; of a polygon there are two, of an edge or a point one.
#[derive(Clone, Debug)]
struct Face {
    /// Those of its corners that span the largest area.
    corners: ArrayVec<u32, FACE_CORNERS_MAX>,
    normal: DVec3,
}

impl Polytope {
    /// The hull of at least one point. All points are kept, in their order.
    pub fn new(points: Vec<DVec3>) -> Self {
        let faces = faces_of_solid(&points).unwrap_or_else(|| faces_of_flat(&points));
        Self { points, faces }
    }
}

impl SupportMap for Polytope {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        let (mut best, mut farthest) = (self.points[0], self.points[0].dot(direction));
        for &point in &self.points[1..] {
            let along = point.dot(direction);
            if along > farthest {
                (best, farthest) = (point, along);
            }
        }
        best
    }
}

impl PolygonalFeatureMap for Polytope {
    fn local_support_feature(&self, direction: DVec3, out: &mut PolygonalFeature) {
        let along = |face: &Face| face.normal.dot(direction);
        let Some(mut best) = self.faces.first() else { return };
        let mut id = 0;
        for (index, face) in (1..).zip(&self.faces[1..]) {
            if along(face) > along(best) {
                (best, id) = (face, index);
            }
        }
        let count = best.corners.len();
        for (i, &corner) in best.corners.iter().enumerate() {
            let next = best.corners[(i + 1) % count];
            out.vertices[i] = self.points[corner as usize];
            out.vids[i] = PackedFeatureId::vertex(corner);
            // Of fewer than 256 points each.
            out.eids[i] = PackedFeatureId::edge(corner.min(next) << 8 | corner.max(next));
        }
        out.fid = PackedFeatureId::face(id);
        out.num_vertices = count;
    }
}

/// Faces of points that span a volume.
fn faces_of_solid(points: &[DVec3]) -> Option<Vec<Face>> {
    let hull = ConvexPolyhedron::from_convex_hull(points)?;
    // The hull has its own copies of the points.
    let index = |p: DVec3| points.iter().position(|&q| q == p).map(|i| i as u32);
    let places: Vec<_> = hull.points().iter().map(|&p| index(p)).collect::<Option<_>>()?;
    let corners = hull.vertices_adj_to_face();
    let faces = hull.faces().iter().map(|face| {
        let start = face.first_vertex_or_edge as usize;
        let ring = &corners[start..start + face.num_vertices_or_edges as usize];
        let ring = ring.iter().map(|&corner| places[corner as usize]).collect();
        Face { corners: largest(points, ring, face.normal), normal: face.normal }
    });
    Some(faces.collect())
}

/// Faces of points in a plane, in a line or in one place.
fn faces_of_flat(points: &[DVec3]) -> Vec<Face> {
    let farthest_from = |p: DVec3| {
        let far = |i: &usize, j: &usize| points[*i].distance_squared(p).total_cmp(&points[*j].distance_squared(p));
        (0..points.len()).max_by(far).unwrap_or(0)
    };
    let a = farthest_from(points[0]);
    let b = farthest_from(points[a]);
    let along = points[b] - points[a];
    let across = |i: usize| (points[i] - points[a]).reject_from(along).length();
    if along == DVec3::ZERO {
        return vec![Face { corners: [0].into_iter().collect(), normal: DVec3::ZERO }];
    }
    let c = (0..points.len()).max_by(|&i, &j| across(i).total_cmp(&across(j))).unwrap_or(0);
    if across(c) <= 1e-9 * along.length() {
        return vec![Face { corners: [a as u32, b as u32].into_iter().collect(), normal: DVec3::ZERO }];
    }
    let normal = along.cross(points[c] - points[a]).normalize();
    let ring = ring(points, a, normal);
    let front = Face { corners: largest(points, ring, normal), normal };
    let back = Face { corners: front.corners.iter().rev().copied().collect(), normal: -normal };
    vec![front, back]
}

/// The hull of points in a plane, counterclockwise about `normal`, from one of its corners on: gift wrapping.
fn ring(points: &[DVec3], start: usize, normal: DVec3) -> Vec<u32> {
    let mut ring = vec![start as u32];
    let mut last = start;
    loop {
        let mut next = start;
        for candidate in 0..points.len() {
            let (to_next, to_candidate) = (points[next] - points[last], points[candidate] - points[last]);
            let turn = to_next.cross(to_candidate).dot(normal);
            let farther = turn == 0.0 && to_candidate.length_squared() > to_next.length_squared();
            if to_candidate != DVec3::ZERO && (next == last || turn < 0.0 || farther) {
                next = candidate;
            }
        }
        // Rounding may lead past the start: no corner comes twice.
        if ring.contains(&(next as u32)) {
            return ring;
        }
        ring.push(next as u32);
        last = next;
    }
}

/// Up to four corners of a convex ring that span a large area: the two farthest apart, and the farthest on either side.
fn largest(points: &[DVec3], ring: Vec<u32>, normal: DVec3) -> ArrayVec<u32, FACE_CORNERS_MAX> {
    if ring.len() <= FACE_CORNERS_MAX {
        return ring.into_iter().collect();
    }
    let at = |i: usize| points[ring[i] as usize];
    let pairs = (0..ring.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
    let apart = |&(i, j): &(usize, usize)| at(i).distance_squared(at(j));
    let (i, j) = pairs.max_by(|p, q| apart(p).total_cmp(&apart(q))).unwrap_or((0, 1));
    let side = normal.cross(at(j) - at(i));
    let height = |k: &usize| (at(*k) - at(i)).dot(side);
    let left = (0..ring.len()).max_by(|p, q| height(p).total_cmp(&height(q))).unwrap_or(0);
    let right = (0..ring.len()).min_by(|p, q| height(p).total_cmp(&height(q))).unwrap_or(0);
    let mut kept = [i, j, left, right];
    kept.sort_unstable();
    let mut corners: ArrayVec<u32, FACE_CORNERS_MAX> = kept.into_iter().map(|k| ring[k]).collect();
    let mut last = None;
    corners.retain(|corner| last.replace(*corner) != Some(*corner));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(polytope: &Polytope, direction: DVec3) -> usize {
        let mut feature = PolygonalFeature::default();
        polytope.local_support_feature(direction, &mut feature);
        feature.num_vertices
    }

    #[test]
    fn points_without_volume_have_faces_too() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Z, DVec3::Z, DVec3::new(0.5, 0.0, 0.4)];
        assert_eq!(feature(&Polytope::new(square.to_vec()), DVec3::Y), 4);
        assert_eq!(feature(&Polytope::new(square.to_vec()), DVec3::NEG_Y), 4);
        let line = vec![DVec3::ZERO, DVec3::X, DVec3::X * 0.5, DVec3::X];
        assert_eq!(feature(&Polytope::new(line), DVec3::Y), 2);
        assert_eq!(feature(&Polytope::new(vec![DVec3::ONE; 3]), DVec3::Y), 1);
    }
}
