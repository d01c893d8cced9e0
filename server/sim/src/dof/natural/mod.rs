//! Natural Cartesian coordinates (talk, "Natural Cartesian Coordinates"): "DOF are described by N points in space
//! connected by constraints, mostly −1 DOF rod constraints. No Angular anything". The sheep is 13 points and 24 rods: 39
//! DOF, of which the rods leave 15.
//!
//! A rigid part is embedded in four points: a place in it is Σ λᵢ qᵢ with its barycentric coordinates λ ("C = 0.4 q0 +
//! 0.1 q1 + 0.2 q2 + 0.3 q3"). So the mass matrix, integrated over the part's volume, is constant, and so is the
//! Jacobian of every place; six rods keep the shape. The part's rotation is that of the affine map of its points (by
//! polar decomposition). Two points carry a rod with mass along it, one point a point mass.
//!
//! # The scheme, and its decay
//! Linear momentum is exact to the solver's tolerance. Spin is not kept: a point on a rod about a fixed point turns by
//! tan θ' = sin θ / (2 − cos θ) a tick where it turned by θ in the one before. Of 10 rad/s 3.6 are left after one
//! second: right for a sheep, wrong for a wheel. Energy falls with every turn; it never rises but by what the solver's
//! tolerance leaves.
//!
//! Owns kinematics, inertia and rods of such figures; the rods' potential is [`rod`](crate::potential). Knows nothing of
//! worlds and islands.

mod desc;
mod embedding;
#[cfg(test)]
mod tests;

use glam::{DQuat, DVec3};

pub use desc::{NaturalDesc, NaturalPart, POINTS_MAX, RODS_MAX};

use super::interface::{BlockSize, Columns, Dof, Inertia, PartPoint, PointMasses, PointRod};
use super::{DofKind, Frame, Mount};
use crate::error::{SimError, require};
use embedding::Embedding;

/// A figure in natural coordinates.
#[derive(Clone, Debug)]
pub struct Natural {
    desc: NaturalDesc,
    /// One for every part.
    embeddings: Vec<Embedding>,
    masses: PointMasses,
    blocks: Vec<BlockSize>,
}

impl Natural {
    /// A figure of these points, rods and parts.
    ///
    /// # Errors
    /// [`SimError::Named`] with the point, rod or part that is wrong, [`SimError`] where there are too many.
    pub fn new(desc: NaturalDesc) -> Result<Self, SimError> {
        desc.validate()?;
        let (embeddings, masses) = desc.embed()?;
        let blocks = vec![BlockSize { positions: 3, rates: 3 }; desc.points.len()];
        Ok(Self { desc, embeddings, masses, blocks })
    }

    /// Its points, rods and parts, as they were described.
    pub fn description(&self) -> &NaturalDesc {
        &self.desc
    }

    /// Q with the figure's frame at `position`, m, turned by `rotation`, as described otherwise.
    pub fn placed(&self, position: DVec3, rotation: DQuat) -> Vec<f64> {
        self.desc.points.iter().flat_map(|&point| (position + rotation * point).to_array()).collect()
    }

    /// Q' of a rigid motion from `q`: `velocity` of the point at `centre`, m/s, and `spin` about it, rad/s.
    pub fn moving(&self, q: &[f64], centre: DVec3, velocity: DVec3, spin: DVec3) -> Vec<f64> {
        let rate = |point: &[f64]| (velocity + spin.cross(DVec3::from_slice(point) - centre)).to_array();
        q.chunks_exact(3).flat_map(rate).collect()
    }

    /// Place or velocity of a part's points in Q or Q'.
    fn of_points<'a>(&'a self, part: u32, numbers: &'a [f64]) -> impl Fn(usize) -> DVec3 + 'a {
        let points = &self.desc.parts[part as usize].points;
        move |i| DVec3::from_slice(&numbers[3 * points[i] as usize..])
    }

    /// Tells `visit` of a part's points by their numbers among all.
    fn numbered(&self, part: u32, visit: &mut dyn FnMut(usize, &Columns)) -> impl FnMut(usize, &Columns) {
        let points = &self.desc.parts[part as usize].points;
        move |i, columns| visit(points[i] as usize, columns)
    }
}

impl Dof for Natural {
    fn kind(&self) -> DofKind {
        DofKind::Natural
    }

    /// Rods that are off by more than half of their length are not the figure that was described.
    fn check(&self, q: &[f64], _v: &[f64]) -> Result<(), SimError> {
        for (i, rod) in self.desc.rods.iter().enumerate() {
            let [a, b] = rod.points.map(|point| DVec3::from_slice(&q[3 * point as usize..]));
            let ratio = a.distance(b) / rod.length;
            require((0.5..1.5).contains(&ratio), "distance of its points over its length", ratio, "0.5 to 1.5")
                .map_err(|reason| reason.of(format!("rod {i} (points {} and {})", rod.points[0], rod.points[1])))?;
        }
        Ok(())
    }

    fn blocks(&self) -> &[BlockSize] {
        &self.blocks
    }

    fn parts(&self) -> u32 {
        self.embeddings.len() as u32
    }

    fn frame(&self, at: PartPoint, q: &[f64], v: &[f64]) -> Frame<f64> {
        self.embeddings[at.part as usize].frame(at.point, self.of_points(at.part, q), self.of_points(at.part, v))
    }

    fn jacobian(&self, at: PartPoint, q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
        let embedding = &self.embeddings[at.part as usize];
        embedding.jacobian(at.point, self.of_points(at.part, q), self.numbered(at.part, visit));
    }

    fn frame_and_jacobian(
        &self,
        at: PartPoint,
        q: &[f64],
        v: &[f64],
        visit: &mut dyn FnMut(usize, &Columns),
    ) -> Frame<f64> {
        let (q, v) = (self.of_points(at.part, q), self.of_points(at.part, v));
        self.embeddings[at.part as usize].frame_and_jacobian(at.point, q, v, self.numbered(at.part, visit))
    }

    fn point(&self, at: PartPoint, q: &[f64], v: &[f64]) -> [DVec3; 2] {
        self.embeddings[at.part as usize].point(at.point, self.of_points(at.part, q), self.of_points(at.part, v))
    }

    fn is_linear(&self, at: PartPoint) -> bool {
        self.embeddings[at.part as usize].is_linear()
    }

    fn place_jacobian(&self, at: PartPoint, q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
        let embedding = &self.embeddings[at.part as usize];
        embedding.place_jacobian(at.point, self.of_points(at.part, q), self.numbered(at.part, visit));
    }

    fn mount(&self, at: PartPoint) -> Option<Mount> {
        let points = &self.desc.parts[at.part as usize].points;
        Some(self.embeddings[at.part as usize].mount(at.point, points))
    }

    fn inertia(&self) -> Inertia<'_> {
        Inertia::Points(&self.masses)
    }

    fn rods(&self) -> &[PointRod] {
        &self.desc.rods
    }
}
