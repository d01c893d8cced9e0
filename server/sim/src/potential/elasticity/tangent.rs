//! Second derivative of the energy density at a place, as it acts between shape functions.

use glam::{DMat3, DVec3};

use super::guard::Stretched;
use super::principal::Principal;
use super::tetrahedron::Curvature;
use super::{Elastic, green_strain, is_safe};
use crate::autodiff::Mat3;
use crate::potential::outer;

/// Second derivative at a deformation gradient F.
#[derive(Clone, Copy, Debug)]
pub enum Tangent {
    /// As it is.
    Plain {
        /// Lamé's constants, Pa.
        material: Elastic,
        /// Second Piola-Kirchhoff, Pa.
        stress: DMat3,
        /// F.
        deformation: DMat3,
        /// µ F Fᵀ.
        around: DMat3,
    },
    /// Its positive part, from its eigenvectors in principal axes: three stretches, three flips, three twists.
    Definite {
        /// Between stretches along two axes.
        along: DMat3,
        /// Of shears, by direction and side.
        own: DMat3,
        /// Between a shear and its counterpart.
        crossed: DMat3,
        /// Principal directions in the world.
        u: DMat3,
        /// The same at rest, as rows.
        v: DMat3,
    },
}

/// A shape function's gradient as a [`Tangent`] needs it.
#[derive(Clone, Copy, Debug)]
pub struct Carried {
    gradient: DVec3,
    /// F times it.
    image: DVec3,
}

impl Tangent {
    /// Of the guarded energy.
    pub fn of(material: &Elastic, f: DMat3, curvature: Curvature) -> Self {
        let strain = green_strain::<f64>(&Mat3::constant(f));
        if curvature == Curvature::Natural && is_safe(f, strain.value()) {
            Self::plain(material, f, material.second_stress(&strain).value())
        } else {
            Self::definite(material, f)
        }
    }

    /// Of what damping takes, see [`Elastic::damping_energy_and_stress`].
    pub fn of_damping(viscosity: &Elastic, before: DMat3, f: DMat3, curvature: Curvature) -> Self {
        let stress = match curvature {
            Curvature::Natural => viscosity.damping_stress(before, f).1.value(),
            // What is left without the stress is positive semidefinite.
            Curvature::Definite => DMat3::ZERO,
        };
        Self::plain(viscosity, f, stress)
    }

    fn plain(material: &Elastic, f: DMat3, stress: DMat3) -> Self {
        let around = f * f.transpose() * material.mu;
        Self::Plain { material: *material, stress, deformation: f, around }
    }

    fn definite(material: &Elastic, f: DMat3) -> Self {
        let Principal { u, stretches, v } = Principal::of(f);
        let stretched = Stretched::new(material, stretches);
        let shears = [(1, 2), (0, 2), (0, 1)].map(|(i, j)| stretched.shear_stiffness(i, j));
        // What a shear of one direction does to itself and to its counterpart.
        let own = of_planes(shears.map(|(flip, twist)| (flip + twist) / 2.0));
        let crossed = of_planes(shears.map(|(flip, twist)| (flip - twist) / 2.0));
        Self::Definite { along: stretched.stretch_stiffness(), own, crossed, u, v: v.transpose() }
    }

    /// Prepares a shape function's gradient in rest coordinates.
    pub fn carry(&self, gradient: DVec3) -> Carried {
        match self {
            Self::Plain { deformation, .. } => Carried { gradient, image: *deformation * gradient },
            Self::Definite { v, .. } => Carried { gradient: *v * gradient, image: DVec3::ZERO },
        }
    }

    /// Second derivative with respect to what two shape functions multiply, Pa/m².
    ///
    /// Plain, with S the second Piola-Kirchhoff stress and f = F g:
    /// (gaᵀ S gb) 1 + λ fa fbᵀ + µ fb faᵀ + µ (ga·gb) F Fᵀ.
    pub fn block(&self, a: &Carried, b: &Carried) -> DMat3 {
        let (ga, gb) = (a.gradient, b.gradient);
        match self {
            Self::Plain { material: Elastic { lambda, mu }, stress, around, .. } => {
                let material = outer(a.image, b.image * *lambda) + outer(b.image, a.image * *mu) + *around * ga.dot(gb);
                material + DMat3::from_diagonal(DVec3::splat(ga.dot(*stress * gb)))
            }
            Self::Definite { along, own, crossed, u, .. } => {
                let block = times(*along, outer(ga, gb)) + times(*crossed, outer(gb, ga));
                *u * (block + DMat3::from_diagonal(*own * (ga * gb))) * u.transpose()
            }
        }
    }
}

/// Symmetric, zero on the diagonal, off it by the axis that is in neither row nor column.
fn of_planes([x, y, z]: [f64; 3]) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, z, y), DVec3::new(z, 0.0, x), DVec3::new(y, x, 0.0))
}

/// Element by element.
fn times(m: DMat3, n: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis * n.x_axis, m.y_axis * n.y_axis, m.z_axis * n.z_axis)
}
