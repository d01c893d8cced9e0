//! Manifold of two convex shapes: from their nearest points, and the faces that look at each other there.

use glam::DVec3;
use parry3d_f64::math::Pose as ParryPose;
use parry3d_f64::query::ContactManifold;
use parry3d_f64::query::details::NormalConstraints;
use parry3d_f64::shape::{PackedFeatureId, PolygonalFeature, PolygonalFeatureMap};

use super::boxes;
use super::gjk::{Found, Nearest, Pair, Workspace};
use super::manifold::{Manifold, ManifoldPoint};

/// Name of a point whose features are not known.
pub(super) const NAMELESS: u32 = u32::MAX;

/// How much deeper than the nearest points a clipped point may be, m: rounding, and faces that are not quite flat.
const DEEPER: f64 = 1e-6;

/// Cosine of the least angle by which a constraint is said to turn a normal, 1.4 mrad.
const STRAIGHT: f64 = 1.0 - 1e-6;

/// A core at a place, with its extrusion radius, m.
#[derive(Clone, Copy)]
pub(super) struct Convex<'a> {
    pub core: &'a dyn PolygonalFeatureMap,
    /// Half extents where it is a box, m.
    pub half: Option<DVec3>,
    pub radius: f64,
    pub pose: ParryPose,
    /// Normals that a neighbouring triangle leaves, in the core's axes.
    pub constraints: Option<&'a dyn NormalConstraints>,
}

/// Finds manifolds; keeps its memory from pair to pair.
pub(super) struct Finder {
    workspace: Workspace,
    clipped: ContactManifold<(), ()>,
    faces: [PolygonalFeature; 2],
}

impl Default for Finder {
    fn default() -> Self {
        let faces = [PolygonalFeature::default(), PolygonalFeature::default()];
        Self { workspace: Workspace::default(), clipped: ContactManifold::new(), faces }
    }
}

impl Finder {
    /// Collects the points whose gap is below `margin`. `last` is the normal of last time in the axes of `a`; answers that
    /// of this time.
    pub fn contacts(
        &mut self,
        a: Convex,
        b: Convex,
        margin: f64,
        last: Option<DVec3>,
        out: &mut Manifold,
    ) -> Option<DVec3> {
        let b_in_a = a.pose.inv_mul(&b.pose);
        let radii = a.radius + b.radius;
        let pair = Pair { a: a.core, b: b.core, b_in_a: &b_in_a };
        if let Some(normal) = self.overlapping_boxes(&pair, [a, b], margin, out) {
            return Some(normal);
        }
        let nearest = match pair.nearest(margin + radii, last, &mut self.workspace) {
            Found::Beyond(direction) => return Some(direction),
            Found::Nearest(nearest) => nearest,
        };
        let Nearest { normal: free, gap, on_a, on_b } = nearest;
        let (mut normal, mut normal_b) = (free, b_in_a.rotation.inverse() * -free);
        if b.constraints.is_some_and(|c| !c.project_local_normal2(&b_in_a, &mut normal, &mut normal_b)) {
            return Some(free);
        }
        // Constraints round.
        let is_turned = normal.dot(free) < STRAIGHT;
        // What is nearest is not what looks along a normal that was turned.
        let hints = if is_turned { pair.support(normal) } else { [on_a, on_b] };
        self.clip(&pair, normal, normal_b, hints);
        out.normal = a.pose.rotation * normal;
        let sides = Sides { a, b, normal, margin };
        // Along a normal that was turned it may be deeper than along its own: in a crack, where a triangle ends at another
        // that faces it, the way out is beside it.
        let deepest = gap - if is_turned { margin } else { DEEPER };
        let mut offer = |on_a: DVec3, on_b: DVec3, along: f64, feature: u32| {
            if along >= deepest {
                sides.offer([on_a, on_b], along, feature, out);
            }
        };
        for point in &self.clipped.points {
            // On a surface a point slides from triangle to triangle and stays what it is.
            let feature = if b.constraints.is_some() { point.fid1.0 } else { name(point.fid1, point.fid2) };
            offer(point.local_p1, b_in_a * point.local_p2, point.dist, feature);
        }
        // What a constraint turned is no distance any more.
        if !is_turned {
            offer(on_a, on_b, gap, NAMELESS);
        }
        Some(free)
    }

    /// Boxes that overlap, where the faces that look at each other have a point as deep as they are: not where it is two
    /// edges that touch. Answers their normal.
    fn overlapping_boxes(
        &mut self,
        pair: &Pair,
        [a, b]: [Convex; 2],
        margin: f64,
        out: &mut Manifold,
    ) -> Option<DVec3> {
        let (normal, gap) = boxes::least_overlap([a.half?, b.half?], pair.b_in_a)?;
        self.clip(pair, normal, pair.b_in_a.rotation.inverse() * -normal, pair.support(normal));
        let points = || self.clipped.points.iter().filter(|point| point.dist >= gap - DEEPER);
        if points().all(|point| point.dist > gap + DEEPER) {
            return None;
        }
        out.normal = a.pose.rotation * normal;
        let sides = Sides { a, b, normal, margin };
        for point in points() {
            let places = [point.local_p1, *pair.b_in_a * point.local_p2];
            sides.offer(places, point.dist, name(point.fid1, point.fid2), out);
        }
        Some(normal)
    }

    /// Where the faces that look along the normal lie above each other, those near to two points.
    fn clip(&mut self, pair: &Pair, normal: DVec3, normal_b: DVec3, [on_a, on_b]: [DVec3; 2]) {
        self.clipped.points.clear();
        let [face_a, face_b] = &mut self.faces;
        let b_in_a = pair.b_in_a;
        pair.a.local_support_feature_toward(normal, on_a, face_a);
        pair.b.local_support_feature_toward(normal_b, b_in_a.inverse_transform_point(on_b), face_b);
        if face_a.num_vertices.min(face_b.num_vertices) > 1 {
            let (a_in_b, clipped) = (b_in_a.inverse(), &mut self.clipped);
            PolygonalFeature::contacts(b_in_a, &a_in_b, normal, normal_b, face_a, face_b, clipped, false);
        }
    }
}

/// Two sides of a manifold, and its normal in the first one's axes.
struct Sides<'a> {
    a: Convex<'a>,
    b: Convex<'a>,
    normal: DVec3,
    margin: f64,
}

impl Sides<'_> {
    /// Takes a point that is so far along the normal from the first core to the second, if the surfaces are within the
    /// margin there. Places are in the first one's axes.
    fn offer(&self, [on_a, on_b]: [DVec3; 2], along: f64, feature: u32, out: &mut Manifold) {
        let Self { a, b, normal, margin } = *self;
        // On the surfaces the two are nearer to each other, each by its own radius.
        let gap = along - a.radius - b.radius;
        if gap < margin {
            let middle = (on_a + on_b + normal * (a.radius - b.radius)) / 2.0;
            out.offer(ManifoldPoint { position: a.pose * middle, gap, feature });
        }
    }
}

fn name(a: PackedFeatureId, b: PackedFeatureId) -> u32 {
    if a == PackedFeatureId::UNKNOWN || b == PackedFeatureId::UNKNOWN {
        return NAMELESS;
    }
    // 28 bits of feature and two of kind each; folding keeps them apart well enough within one pair.
    a.0.rotate_left(16) ^ b.0
}
