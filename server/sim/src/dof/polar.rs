//! Polar decomposition of a deformation gradient, F = R S: how what is embedded in nodes is turned, and what turns it.
//!
//! Where the deformation is moderate Newton's iteration finds R in two to five inverses (Higham, "Computing the polar
//! decomposition — with applications", 1986): parts that rods keep in shape are a few steps off a rotation. What is flat,
//! needle-shaped or inside out is taken apart into principal stretches, at ten times the work.

use glam::{DMat3, DVec3};

use crate::potential::elasticity::Principal;

/// Least sum of two stretches by which a turn is divided: where an element that is inside out is as long as it is wide,
/// its axes may turn at any speed.
pub(super) const LEAST_SUM: f64 = 0.1;

/// Most steps of Newton's iteration: enough for stretches of 0.1 to 10.
const STEPS_MAX: usize = 9;

/// The iteration ends with a step whose square is below this: its error squares with every step.
const CLOSE: f64 = 1e-18;

/// A deformation gradient's rotation.
pub(super) struct Polar {
    /// R.
    pub rotation: DMat3,
    /// (tr(P) − P)⁻¹, P = F Rᵀ: makes an angular velocity of Σ (R ∇Nᵢ) × vᵢ. It follows from R' = [ω]× R and the symmetry
    /// of P.
    pub yielding: DMat3,
}

impl Polar {
    /// Never fails.
    pub fn of(f: DMat3) -> Self {
        Self::by_iteration(f).unwrap_or_else(|| Self::by_stretches(f))
    }

    /// `None` where that would take long, or where a sum of two stretches may be too small to divide by.
    fn by_iteration(f: DMat3) -> Option<Self> {
        // σ₂ + σ₃ ≥ 2 √(σ₂ σ₃) ≥ 2 √(det F / |F|).
        let moderate = f.determinant() > 0.25 * LEAST_SUM * LEAST_SUM * squares(f).sqrt();
        if !moderate {
            return None;
        }
        let mut rotation = f;
        for _ in 0..STEPS_MAX {
            let next = (rotation + rotation.inverse().transpose()) * 0.5;
            let step = squares(next - rotation);
            rotation = next;
            if step < CLOSE {
                let stretch = f * rotation.transpose();
                let trace = stretch.x_axis.x + stretch.y_axis.y + stretch.z_axis.z;
                let sums = DMat3::from_diagonal(DVec3::splat(trace)) - stretch;
                return Some(Self { rotation, yielding: sums.inverse() });
            }
        }
        None
    }

    /// In principal axes, where the inverse divides by sums of two stretches.
    fn by_stretches(f: DMat3) -> Self {
        let Principal { u, stretches: s, v } = Principal::of(f);
        let sums = DVec3::new(s.y + s.z, s.z + s.x, s.x + s.y).max(DVec3::splat(LEAST_SUM));
        Self { rotation: u * v.transpose(), yielding: u * DMat3::from_diagonal(sums.recip()) * u.transpose() }
    }
}

/// Sum of the squares of all entries.
fn squares(m: DMat3) -> f64 {
    m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;

    fn rotation(axis: [f64; 3]) -> DMat3 {
        DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_array(axis)))
    }

    proptest! {
        /// The short way leads to where the long one does, and is taken by all that is not far off its shape.
        #[test]
        fn both_ways_agree(
            axes in proptest::array::uniform2(proptest::array::uniform3(-3.0..3.0f64)),
            stretches in proptest::array::uniform3(0.05..4.0f64),
        ) {
            let [u, v] = axes.map(rotation);
            let f = u * DMat3::from_diagonal(DVec3::from_array(stretches)) * v.transpose();
            let slow = Polar::by_stretches(f);
            let Some(quick) = Polar::by_iteration(f) else {
                prop_assert!(stretches.iter().any(|&s| s < 0.2));
                return Ok(());
            };
            let apart = squares(quick.rotation - slow.rotation).sqrt();
            prop_assert!(apart < 1e-12 && (quick.rotation - u * v.transpose()).abs_diff_eq(DMat3::ZERO, 1e-12));
            prop_assert!(squares(quick.yielding - slow.yielding).sqrt() < 1e-11 * squares(slow.yielding).sqrt());
        }
    }

    #[test]
    fn what_has_no_rotation_of_its_own_gets_one() {
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
        let inside_out = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
        for f in [DMat3::ZERO, flat, inside_out, DMat3::from_diagonal(DVec3::new(1e12, 1.0, 1.0))] {
            let Polar { rotation, yielding } = Polar::of(f);
            assert!((rotation.determinant() - 1.0).abs() < 1e-12, "{f}");
            assert!(yielding.is_finite() && squares(yielding) < 3.0 / (LEAST_SUM * LEAST_SUM) + 1e-9, "{f}");
        }
    }
}
