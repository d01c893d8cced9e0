//! Elasticity (talk, "Elasticity"): a Saint Venant-Kirchhoff material, E(F) = ½λ tr(D)² + µ tr(D²), D = ½(FᵀF − 1).
//!
//! Owns the material and one linear tetrahedron of it: energy, forces, stiffness. `guard` says what happens where the
//! law of the talk gives way: under strong compression and inside out. Pure functions; which elements share which nodes
//! is the business of [`dof`](crate::dof).

mod guard;
mod principal;
mod tangent;
#[cfg(test)]
mod tests;
mod tetrahedron;

use glam::{DMat3, DVec3};

pub use guard::GUARD;
pub use tangent::{Carried, Tangent};
pub use tetrahedron::{Curvature, NODE_PAIRS, NodeBlocks, Tetrahedron};

use crate::autodiff::{Mat3, Scalar};
use crate::error::{SimError, require};
use guard::{Stretched, is_positive};
pub(crate) use principal::Principal;

/// A Saint Venant-Kirchhoff material by its Lamé constants, Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// First.
    pub lambda: f64,
    /// Second: the shear modulus.
    pub mu: f64,
}

impl Elastic {
    /// By Young's modulus, Pa, and Poisson's ratio.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] naming either.
    pub fn new(young: f64, poisson: f64) -> Result<Self, SimError> {
        require((1.0..1e12).contains(&young), "young", young, "1 to below 1e12 Pa")?;
        // Linear tetrahedra lock long before.
        require((0.0..=0.49).contains(&poisson), "poisson", poisson, "0 to 0.49")?;
        let mu = young / (2.0 * (1.0 + poisson));
        Ok(Self { lambda: 2.0 * mu * poisson / (1.0 - 2.0 * poisson), mu })
    }

    /// `Err` unless the constants are those of a solid that resists both squeezing and shearing.
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require((0.1..1e12).contains(&self.mu), "mu of the material", self.mu, "0.1 to below 1e12 Pa")?;
        let least = -2.0 / 3.0 * self.mu;
        let resists = self.lambda > least && self.lambda < 1e14;
        require(resists, "lambda of the material", self.lambda, "above -2/3 of mu, below 1e14 Pa")
    }

    /// The talk's energy density, J/m³, and its derivative, the first Piola-Kirchhoff stress F (λ tr(D) + 2µ D), Pa, at a
    /// deformation gradient: nothing guarded.
    pub fn energy_and_stress<S: Scalar>(&self, f: &Mat3<S>) -> (S, Mat3<S>) {
        let strain = green_strain(f);
        let second = self.second_stress(&strain);
        let work = (0..3).fold(S::ZERO, |sum, i| sum + strain.columns[i].dot(second.columns[i]));
        (work * 0.5, Mat3 { columns: second.columns.map(|column| f.multiply(column)) })
    }

    /// Energy density, J/m³, and first Piola-Kirchhoff stress, Pa, guarded: those of the talk where no stretch is below
    /// [`GUARD`].
    pub fn guarded_energy_and_stress(&self, f: DMat3) -> (f64, DMat3) {
        let plain = Mat3::constant(f);
        if is_safe(f, green_strain(&plain).value()) {
            let (energy, stress) = self.energy_and_stress(&plain);
            return (energy, stress.value());
        }
        let Principal { u, stretches, v } = Principal::of(f);
        let stretched = Stretched::new(self, stretches);
        let stress = u * DMat3::from_diagonal(stretched.stresses()) * v.transpose();
        (stretched.energy(), stress)
    }

    /// What damping takes, J/m³, on the way from deformation gradient `before` to `f`, and its derivative at `f`, Pa. `self`
    /// is the material times the damping's time constant over the tick, of whose energy this is the one of the change of
    /// strain: a potential, nothing for turns, and not guarded, because whatever the change, it is resisted.
    pub fn damping_energy_and_stress(&self, before: DMat3, f: DMat3) -> (f64, DMat3) {
        let (change, stress) = self.damping_stress(before, f);
        let work: f64 = (0..3).map(|i| change.columns[i].dot(stress.columns[i])).sum();
        (0.5 * work, f * stress.value())
    }

    /// Change of strain, and the second Piola-Kirchhoff stress that it makes, Pa.
    fn damping_stress(&self, before: DMat3, f: DMat3) -> (Mat3<f64>, Mat3<f64>) {
        let [then, now] = [before, f].map(|f| green_strain::<f64>(&Mat3::constant(f)));
        let change = Mat3 { columns: [0, 1, 2].map(|i| now.columns[i] - then.columns[i]) };
        (change, self.second_stress(&change))
    }

    /// Second Piola-Kirchhoff stress by the strain D, Pa.
    fn second_stress<S: Scalar>(&self, strain: &Mat3<S>) -> Mat3<S> {
        let [x, y, z] = strain.columns.map(|column| column * (2.0 * self.mu));
        let pressure = (strain.columns[0].x + strain.columns[1].y + strain.columns[2].z) * self.lambda;
        let [px, py, pz] = Mat3::<S>::IDENTITY.columns.map(|axis| axis.scale(pressure));
        Mat3 { columns: [x + px, y + py, z + pz] }
    }
}

/// D = ½(FᵀF − 1).
fn green_strain<S: Scalar>(f: &Mat3<S>) -> Mat3<S> {
    let column = |i: usize| (f.transposed_multiply(f.columns[i]) - Mat3::<S>::IDENTITY.columns[i]) * 0.5;
    Mat3 { columns: [column(0), column(1), column(2)] }
}

/// Whether no stretch of F is below the guard. Exact, and cheaper than the stretches.
fn is_safe(f: DMat3, strain: DMat3) -> bool {
    let above = strain * 2.0 + DMat3::from_diagonal(DVec3::splat(1.0 - GUARD * GUARD));
    is_positive(above) && f.determinant() > 0.0
}
