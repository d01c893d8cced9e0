//! A linear tetrahedron: F is constant in it, so that forces and stiffness are those of one place times the volume.

use glam::{DMat3, DVec3};

use super::guard::Stretched;
use super::principal::Principal;
use super::{Elastic, green_strain, is_safe};
use crate::autodiff::Mat3;
use crate::error::SimError;
use crate::mesh::is_upright;
use crate::potential::outer;

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
        let f = self.deformation(x);
        let strain = green_strain::<f64>(&Mat3::constant(f));
        if curvature == Curvature::Natural && is_safe(f, strain.value()) {
            self.unguarded_stiffness(material, f, material.second_stress(&strain).value())
        } else {
            self.definite_stiffness(material, f)
        }
    }

    /// Gradients of the nodes' shape functions in rest coordinates, 1/m.
    pub fn gradients(&self) -> [DVec3; 4] {
        let [b, c, d] = self.gradients;
        [-(b + c + d), b, c, d]
    }

    /// What damping takes on the way from nodes at `before` to nodes at `x`, J, and its gradient at `x`, N: the energy of
    /// the change of strain in `viscosity`, the material times the damping's time constant over the tick. It is a
    /// potential of `x`, nothing for turns, and not guarded: whatever the change of strain, it is resisted.
    pub fn damping_and_gradient(&self, viscosity: &Elastic, before: [DVec3; 4], x: [DVec3; 4]) -> (f64, [DVec3; 4]) {
        let (f, change) = self.change_of_strain(before, x);
        let stress = viscosity.second_stress(&change);
        let work: f64 = (0..3).map(|i| change.columns[i].dot(stress.columns[i])).sum();
        let (energy, stress) = (0.5 * work * self.volume, f * stress.value());
        let [b, c, d] = self.gradients.map(|g| stress * g * self.volume);
        (energy, [-(b + c + d), b, c, d])
    }

    /// Second derivative of that energy, N/m.
    pub fn damping_stiffness(
        &self,
        viscosity: &Elastic,
        before: [DVec3; 4],
        x: [DVec3; 4],
        curvature: Curvature,
    ) -> NodeBlocks {
        let (f, change) = self.change_of_strain(before, x);
        let stress = match curvature {
            Curvature::Natural => viscosity.second_stress(&change).value(),
            // What is left without the stress is positive semidefinite.
            Curvature::Definite => DMat3::ZERO,
        };
        self.unguarded_stiffness(viscosity, f, stress)
    }

    fn change_of_strain(&self, before: [DVec3; 4], x: [DVec3; 4]) -> (DMat3, Mat3<f64>) {
        let f = self.deformation(x);
        let (now, then) = (green_strain(&Mat3::constant(f)), green_strain(&Mat3::constant(self.deformation(before))));
        (f, Mat3 { columns: [0, 1, 2].map(|i| now.columns[i] - then.columns[i]) })
    }

    /// Deformation gradient with nodes at `x`.
    pub(super) fn deformation(&self, x: [DVec3; 4]) -> DMat3 {
        let [a, b, c] = [x[1] - x[0], x[2] - x[0], x[3] - x[0]];
        let [f, g, h] = self.gradients;
        let column = |f: f64, g: f64, h: f64| a * f + b * g + c * h;
        DMat3::from_cols(column(f.x, g.x, h.x), column(f.y, g.y, h.y), column(f.z, g.z, h.z))
    }

    /// With a, b nodes, g their gradients, S the second Piola-Kirchhoff stress and f = F g:
    /// (gaᵀ S gb) 1 + λ fa fbᵀ + µ fb faᵀ + µ (ga·gb) F Fᵀ.
    fn unguarded_stiffness(&self, material: &Elastic, f: DMat3, stress: DMat3) -> NodeBlocks {
        let (lambda, mu) = (material.lambda * self.volume, material.mu * self.volume);
        let stress = stress * self.volume;
        let (around, carried) = (f * f.transpose() * mu, self.gradients.map(|g| f * g));
        self.spread(|a, b| {
            let (ga, gb) = (self.gradients[a], self.gradients[b]);
            let (fa, fb) = (carried[a], carried[b]);
            let material = outer(fa, fb * lambda) + outer(fb, fa * mu) + around * ga.dot(gb);
            material + DMat3::from_diagonal(DVec3::splat(ga.dot(stress * gb)))
        })
    }

    /// The derivative's positive part, from its eigenvectors in principal axes: three stretches, three flips, three
    /// twists.
    fn definite_stiffness(&self, material: &Elastic, f: DMat3) -> NodeBlocks {
        let Principal { u, stretches, v } = Principal::of(f);
        let stretched = Stretched::new(material, stretches);
        let along = stretched.stretch_stiffness();
        let shears = [(1, 2), (0, 2), (0, 1)].map(|(i, j)| stretched.shear_stiffness(i, j));
        // What a shear of one direction does to itself and to its counterpart.
        let [x, y, z] = shears.map(|(flip, twist)| self.volume * (flip + twist) / 2.0);
        let crossed = shears.map(|(flip, twist)| self.volume * (flip - twist) / 2.0);
        let own = DMat3::from_cols(DVec3::new(0.0, z, y), DVec3::new(z, 0.0, x), DVec3::new(y, x, 0.0));
        let crossed = DMat3::from_cols(
            DVec3::new(0.0, crossed[2], crossed[1]),
            DVec3::new(crossed[2], 0.0, crossed[0]),
            DVec3::new(crossed[1], crossed[0], 0.0),
        );
        let along = along * self.volume;
        let gradients = self.gradients.map(|g| v.transpose() * g);
        self.spread(|a, b| {
            let (ga, gb) = (gradients[a], gradients[b]);
            let block = times(along, outer(ga, gb)) + times(crossed, outer(gb, ga));
            u * (block + DMat3::from_diagonal(own * (ga * gb))) * u.transpose()
        })
    }

    /// All blocks from those of the last three nodes: moving all four by the same changes nothing.
    fn spread(&self, block: impl Fn(usize, usize) -> DMat3) -> NodeBlocks {
        let [bb, cb, cc] = [block(0, 0), block(1, 0), block(1, 1)];
        let [db, dc, dd] = [block(2, 0), block(2, 1), block(2, 2)];
        let ba = -(bb + cb.transpose() + db.transpose());
        let ca = -(cb + cc + dc.transpose());
        let da = -(db + dc + dd);
        let aa = -(ba + ca + da);
        [aa, ba, bb, ca, cb, cc, da, db, dc, dd]
    }
}

/// Element by element.
fn times(m: DMat3, n: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis * n.x_axis, m.y_axis * n.y_axis, m.z_axis * n.z_axis)
}
