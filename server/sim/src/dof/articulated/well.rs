//! A joint's own potentials, summed up over its rates.

use glam::{DMat3, DVec3};

use crate::eigen::positive_part;

/// Energy of a joint of one to three rates, with its derivatives with respect to their displacements. What a joint does
/// not have stays zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Well {
    /// J.
    pub energy: f64,
    /// Minus the force, N or N m.
    pub gradient: DVec3,
    /// Positive semidefinite.
    pub hessian: DMat3,
}

impl Well {
    /// Nothing acts.
    pub const FLAT: Self = Self { energy: 0.0, gradient: DVec3::ZERO, hessian: DMat3::ZERO };

    /// Adds a potential over all rates.
    pub fn add(&mut self, energy: f64, gradient: DVec3, hessian: DMat3) {
        self.energy += energy;
        self.gradient += gradient;
        self.hessian += hessian;
    }

    /// Adds a function of a number that is itself one of the rates' displacements: its slope and curvature there, and
    /// the number's gradient and Hessian. Of what bends the number, the positive part.
    pub fn add_bent(&mut self, [energy, slope, curvature]: [f64; 3], gradient: DVec3, bend: DMat3) {
        if slope != 0.0 {
            self.add_along(gradient, [energy, slope, curvature]);
            self.hessian += positive_part(bend * slope);
        }
    }

    /// Adds a function of a single number that the rates change along `direction`: its value, slope and curvature.
    pub fn add_along(&mut self, direction: DVec3, [energy, slope, curvature]: [f64; 3]) {
        self.energy += energy;
        self.gradient += direction * slope;
        self.hessian += crate::potential::outer(direction, direction) * curvature;
    }
}
