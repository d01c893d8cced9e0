//! Contact points of a convex shape with a surface of triangles: those of every triangle, thinned out to a few patches of
//! about the same normal.

use arrayvec::ArrayVec;
use glam::DVec3;
use parry3d_f64::math::Pose as ParryPose;
use parry3d_f64::shape::Triangle;

use super::convex::{Convex, Finder};
use super::manifold::{Manifold, ManifoldPoint};
use super::passing::Flyby;
use super::shape::Shape;
use super::triangle_mesh::TriangleMesh;
use crate::dof::Pose;

/// Most patches of a pair.
pub(super) const PATCHES_MAX: usize = 8;

/// Most points that are looked at: what a body covers of a very fine surface costs no more.
const CANDIDATES_MAX: usize = 4096;

/// Cosine of the widest angle between normals of a patch.
const SAME_NORMAL: f64 = 0.999;

/// How much wider than the deepest gap of a patch its others are at most, m: steps make a patch each.
const SAME_HEIGHT: f64 = 0.02;

/// Directions in the plane of a patch along which its outermost points are kept.
const DIRECTIONS: u32 = 8;

/// A point and its normal, which points into the surface.
#[derive(Clone, Copy)]
struct Candidate {
    point: ManifoldPoint,
    normal: DVec3,
    /// It would stop what flies at its plane.
    is_ahead: bool,
}

/// Points of a pair; keeps its memory from pair to pair.
#[derive(Default)]
pub(super) struct Patches {
    candidates: Vec<Candidate>,
    scratch: Manifold,
    found: ArrayVec<Manifold, PATCHES_MAX>,
}

impl Patches {
    /// Finds the patches of a shape that are nearer than `margin` to a surface, without those of what it only passes.
    pub fn find(
        &mut self,
        (shape, body, at): (&Shape, Convex, Pose),
        (mesh, pose): (&TriangleMesh, Pose),
        margin: f64,
        finder: &mut Finder,
        mut flyby: Option<Flyby>,
    ) -> &[Manifold] {
        self.candidates.clear();
        let to_mesh = pose.rotation.inverse();
        let middle = to_mesh * (at.position - pose.position);
        let to_shape = at.rotation.inverse() * pose.rotation;
        let ends = DVec3::AXES.map(|axis| shape.interval(to_shape * axis));
        let min = middle + DVec3::from_array(ends.map(|(low, _)| low)) - margin;
        let max = middle + DVec3::from_array(ends.map(|(_, high)| high)) + margin;
        let surface = ParryPose::from_parts(pose.position, pose.rotation);
        let mut is_stopped = false;
        for (triangle, normals) in mesh.in_box(min, max) {
            let piece = Convex { core: &triangle, half: None, radius: 0.0, pose: surface, constraints: Some(&normals) };
            self.scratch.clear();
            finder.contacts(body, piece, margin, None, &mut self.scratch);
            let is_ahead = flyby.as_ref().is_some_and(|flyby| flyby.stops(piece, &mut self.scratch));
            is_stopped |= is_ahead;
            let normal = self.scratch.normal;
            let points = self.scratch.reduced().iter().map(|&point| Candidate { point, normal, is_ahead });
            self.candidates.extend(points.take(CANDIDATES_MAX - self.candidates.len()));
        }
        if let Some(flyby) = flyby.as_mut().filter(|_| is_stopped) {
            let comes_to = |(triangle, _): (Triangle, _)| {
                let piece = Convex { core: &triangle, half: None, radius: 0.0, pose: surface, constraints: None };
                let outward = triangle.normal().map_or(DVec3::ZERO, |normal| pose.rotation * normal);
                flyby.comes_to(piece, outward, finder)
            };
            if !mesh.in_box(min, max).any(comes_to) {
                self.candidates.retain(|candidate| !candidate.is_ahead);
            }
        }
        self.group();
        &self.found
    }

    /// What [`Patches::find`] found last.
    pub fn found(&mut self) -> &mut [Manifold] {
        &mut self.found
    }

    /// Makes patches of the candidates, the deepest first.
    fn group(&mut self) {
        self.found.clear();
        while !self.candidates.is_empty() && !self.found.is_full() {
            let gap = |candidate: &&Candidate| candidate.point.gap;
            let Some(deepest) = self.candidates.iter().min_by(|a, b| gap(a).total_cmp(&gap(b))).copied() else {
                return;
            };
            let in_patch = |candidate: &Candidate| {
                let parallel = candidate.normal.dot(deepest.normal) > SAME_NORMAL;
                parallel && candidate.point.gap <= deepest.point.gap + SAME_HEIGHT
            };
            let mut patch = Manifold::along(deepest.normal);
            patch.offer(deepest.point);
            let (u, v) = deepest.normal.any_orthonormal_pair();
            for k in 0..DIRECTIONS {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(DIRECTIONS)).sin_cos();
                let along = |candidate: &Candidate| candidate.point.position.dot(u * cos + v * sin);
                let members = self.candidates.iter().filter(|candidate| in_patch(candidate));
                if let Some(outermost) = members.max_by(|a, b| along(a).total_cmp(&along(b))) {
                    patch.offer_new(outermost.point);
                }
            }
            self.found.push(patch);
            self.candidates.retain(|candidate| !in_patch(candidate));
        }
    }
}
