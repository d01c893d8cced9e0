//! A linear tetrahedron: F is constant in it, so that forces and stiffness are those of one place times the volume.

use glam::{DMat3, DVec3};

use super::{Elastic, Tangent};
use crate::error::SimError;
use crate::mesh::is_upright;

/// Which second derivative of an energy is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// The derivative itself where no stretch is below [`GUARD`](super::GUARD), its positive part elsewhere. Compressed
    /// elements are unstable against turning, but their neighbours and inertia make the sum definite in all but violent
    /// motion. Newton needs a fifth fewer iterations with it, and it costs a fifth as much.
    Natural,
    /// The positive part of the derivative in every element, for where the sum turned out to be indefinite.
    Definite,
}

/// Pairs of an element's nodes, in the order of [`NodeBlocks`].
pub const NODE_PAIRS: [(usize, usize); 10] =
    [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (3, 0), (3, 1), (3, 2), (3, 3)];

/// Second derivative of an element's energy with respect to its nodes, row by row up to the diagonal, N/m: the block of
/// nodes (i, j) for each of [`NODE_PAIRS`]; that of (j, i) is its transpose.
pub type NodeBlocks = [DMat3; 10];

/// A tetrahedron at rest.
#[derive(Clone, Copy, Debug)]
pub struct Tetrahedron {
    /// Its nodes.
    pub nodes: [u32; 4],
    /// Gradients of the last three nodes' shape functions; the first one's is minus their sum. 1/m.
    gradients: [DVec3; 3],
    /// At rest, m³.
    volume: f64,
}

impl Tetrahedron {
    /// An element whose nodes lie at `corners` when it is at rest.
    ///
    /// # Errors
    /// [`SimError::Unusable`] where the corners lie in a plane or are in mirrored order.
    pub fn new(nodes: [u32; 4], corners: [DVec3; 4]) -> Result<Self, SimError> {
        is_upright(corners).map_err(|what| SimError::Unusable { what })?;
        let [a, b, c, d] = corners;
        let edges = DMat3::from_cols(b - a, c - a, d - a);
        let rows = edges.inverse().transpose();
        let gradients = [rows.x_axis, rows.y_axis, rows.z_axis];
        Ok(Self { nodes, gradients, volume: edges.determinant() / 6.0 })
    }

    /// At rest, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Energy, J, and its gradient on each node (minus the force), N, with the nodes at `x`.
    pub fn energy_and_gradient(&self, material: &Elastic, x: [DVec3; 4]) -> (f64, [DVec3; 4]) {
        let (energy, stress) = material.guarded_energy_and_stress(self.deformation(x));
        let [b, c, d] = self.gradients.map(|g| stress * g * self.volume);
        (energy * self.volume, [-(b + c + d), b, c, d])
    }

    /// Second derivative of the energy with the nodes at `x`, N/m.
    pub fn stiffness(&self, material: &Elastic, x: [DVec3; 4], curvature: Curvature) -> NodeBlocks {
        self.spread(&Tangent::of(material, self.deformation(x), curvature))
    }

    /// Gradients of the nodes' shape functions in rest coordinates, 1/m.
    pub fn gradients(&self) -> [DVec3; 4] {
        let [b, c, d] = self.gradients;
        [-(b + c + d), b, c, d]
    }

    /// What damping takes on the way from nodes at `before` to nodes at `x`, J, and its gradient at `x`, N; see
    /// [`Elastic::damping_energy_and_stress`].
    pub fn damping_and_gradient(&self, viscosity: &Elastic, before: [DVec3; 4], x: [DVec3; 4]) -> (f64, [DVec3; 4]) {
        let (energy, stress) = viscosity.damping_energy_and_stress(self.deformation(before), self.deformation(x));
        let [b, c, d] = self.gradients.map(|g| stress * g * self.volume);
        (energy * self.volume, [-(b + c + d), b, c, d])
    }

    /// Second derivative of that, N/m.
    pub fn damping_stiffness(
        &self,
        viscosity: &Elastic,
        before: [DVec3; 4],
        x: [DVec3; 4],
        curvature: Curvature,
    ) -> NodeBlocks {
        let [before, f] = [before, x].map(|x| self.deformation(x));
        self.spread(&Tangent::of_damping(viscosity, before, f, curvature))
    }

    /// Deformation gradient with nodes at `x`.
    pub(super) fn deformation(&self, x: [DVec3; 4]) -> DMat3 {
        let [a, b, c] = [x[1] - x[0], x[2] - x[0], x[3] - x[0]];
        let [f, g, h] = self.gradients;
        let column = |f: f64, g: f64, h: f64| a * f + b * g + c * h;
        DMat3::from_cols(column(f.x, g.x, h.x), column(f.y, g.y, h.y), column(f.z, g.z, h.z))
    }

    /// All blocks from those of the last three nodes: moving all four by the same changes nothing.
    fn spread(&self, tangent: &Tangent) -> NodeBlocks {
        let carried = self.gradients.map(|g| tangent.carry(g));
        let block = |a: usize, b: usize| tangent.block(&carried[a], &carried[b]) * self.volume;
        let [bb, cb, cc] = [block(0, 0), block(1, 0), block(1, 1)];
        let [db, dc, dd] = [block(2, 0), block(2, 1), block(2, 2)];
        let ba = -(bb + cb.transpose() + db.transpose());
        let ca = -(cb + cc + dc.transpose());
        let da = -(db + dc + dd);
        let aa = -(ba + ca + da);
        [aa, ba, bb, ca, cb, cc, da, db, dc, dd]
    }
}
