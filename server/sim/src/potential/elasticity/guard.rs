//! The energy as a function of the principal stretches, for every stretch that a mesh can get itself into.
//!
//! Saint Venant-Kirchhoff loses its strength at a stretch of 1/√3 and pulls an element that is turned inside out towards
//! its mirror image. Below [`GUARD`] a cubic is added to each stretch, with which pressure keeps stiffening; below zero
//! the strain stays that of zero, so that nothing but the cubic is left, which pushes back however the element is
//! stretched otherwise. The sum is C2 but for the strain at zero, which is C1.

use glam::{DMat3, DVec3};

use super::Elastic;
use crate::eigen::positive_part;

/// Stretch below which compression is guarded. At 0.7 a bar still has a quarter of its stiffness; what is squeezed less
/// is Saint Venant-Kirchhoff to the last bit.
pub const GUARD: f64 = 0.7;

/// Least sum of two stretches by which the stiffness against turning them is divided. It counts only where an element
/// turned inside out is as long as it is wide, on the ridge where either way back is as good.
const LEAST_SUM: f64 = 0.1;

/// The smallest number that may be divided by.
const TINY: f64 = 1e-300;

/// Energy density as a function of principal stretches, and its derivatives.
pub(super) struct Stretched<'a> {
    material: &'a Elastic,
    stretches: [f64; 3],
    /// Green strain ½(σ² − 1) of each, held below zero.
    strains: [f64; 3],
    /// Their sum.
    trace: f64,
}

impl<'a> Stretched<'a> {
    pub fn new(material: &'a Elastic, stretches: DVec3) -> Self {
        let stretches = stretches.to_array();
        let strains = stretches.map(|s| 0.5 * (s.max(0.0).powi(2) - 1.0));
        Self { material, stretches, strains, trace: strains.iter().sum() }
    }

    /// J/m³.
    pub fn energy(&self) -> f64 {
        let Elastic { lambda, mu } = self.material;
        let squares: f64 = self.strains.iter().map(|e| e * e).sum();
        let guard: f64 = self.stretches.iter().map(|&s| beyond(s).powi(3)).sum();
        0.5 * lambda * self.trace * self.trace + mu * squares + self.guard_stiffness() * guard
    }

    /// Principal stresses: derivatives with respect to the stretches, Pa.
    pub fn stresses(&self) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|i| self.stress(i)))
    }

    fn stress(&self, i: usize) -> f64 {
        let s = self.stretches[i];
        self.pressure(i) * s.max(0.0) - 3.0 * self.guard_stiffness() * beyond(s).powi(2)
    }

    /// Second Piola-Kirchhoff stress without the guard.
    fn pressure(&self, i: usize) -> f64 {
        self.material.lambda * self.trace + 2.0 * self.material.mu * self.strains[i]
    }

    /// Half the stiffness against squeezing from all sides, which loses most: with it pressure stiffens from the guard on
    /// at any Poisson ratio, Pa.
    fn guard_stiffness(&self) -> f64 {
        1.5 * self.material.lambda + self.material.mu
    }

    /// Second derivatives with respect to the stretches, without their negative part.
    pub fn stretch_stiffness(&self) -> DMat3 {
        let slopes = DVec3::from_array(self.stretches).max(DVec3::ZERO);
        let own = |i: usize| {
            let s = self.stretches[i];
            let curved = if s > 0.0 { self.pressure(i) } else { 0.0 };
            curved + 2.0 * self.material.mu * slopes[i] * slopes[i] + 6.0 * self.guard_stiffness() * beyond(s)
        };
        let coupled = slopes * self.material.lambda;
        let whole = DMat3::from_cols(slopes * coupled.x, slopes * coupled.y, slopes * coupled.z)
            + DMat3::from_diagonal(DVec3::new(own(0), own(1), own(2)));
        if is_positive(whole) { whole } else { positive_part(whole) }
    }

    /// Stiffness against shearing the plane of two principal directions symmetrically ("flip") and against turning it
    /// ("twist"), without their negative part (Smith, De Goes and Kim 2019, section 4).
    pub fn shear_stiffness(&self, i: usize, j: usize) -> (f64, f64) {
        let (a, b) = (self.stretches[i], self.stretches[j]);
        // The difference quotient of the stresses, without a difference of nearly equal numbers.
        let (p, q) = (a.max(0.0), b.max(0.0));
        let apart = (a - b).abs().max(TINY);
        let share = if p > 0.0 && q > 0.0 { 1.0 } else { (p - q).abs() / apart };
        let Elastic { lambda, mu } = self.material;
        let plain = (lambda * self.trace + mu * (p * p + p * q + q * q - 1.0)) * share;
        let (u, w) = (beyond(a), beyond(b));
        let guard = if u > 0.0 && w > 0.0 { u + w } else { u.max(w) * (u.max(w) / apart) };
        let flip = plain + 3.0 * self.guard_stiffness() * guard;
        let twist = (self.stress(i) + self.stress(j)) / (a + b).max(LEAST_SUM);
        (flip.max(0.0), twist.max(0.0))
    }
}

/// How far a stretch is beyond the guard.
fn beyond(stretch: f64) -> f64 {
    (GUARD - stretch).max(0.0)
}

/// Whether a symmetric matrix is positive definite (Sylvester).
pub(super) fn is_positive(m: DMat3) -> bool {
    let minor = m.x_axis.x * m.y_axis.y - m.x_axis.y * m.x_axis.y;
    m.x_axis.x > 0.0 && minor > 0.0 && m.determinant() > 0.0
}
