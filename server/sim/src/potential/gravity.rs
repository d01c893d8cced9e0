//! Gravity: the same acceleration everywhere.
//!
//! Its energy −m g · x is linear, so its force does not depend on where a tick ends, and implicit Euler takes it exactly
//! before anything is solved: it is part of the free flight from which every residual is measured, and no term of an
//! island. Bodies that nothing else touches need no solver.

use glam::DVec3;

/// A uniform field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gravity {
    /// m/s².
    pub acceleration: DVec3,
}

impl Gravity {
    /// What it adds to every velocity in a tick of `dt`, m/s.
    pub fn fall(self, dt: f64) -> DVec3 {
        self.acceleration * dt
    }

    /// Energy of what has the first moment `moment` (mass times centre of mass, kg m), J; 0 at the origin.
    pub fn energy(self, moment: DVec3) -> f64 {
        -self.acceleration.dot(moment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autodiff::{Dual, Vec3};

    /// The energy's derivative, automatic and by differences, is minus what a tick gives to the momentum.
    #[test]
    fn the_fall_is_the_energys() {
        let gravity = Gravity { acceleration: DVec3::new(1.0, -9.81, 0.5) };
        let (mass, dt, at) = (3.0, 1.0 / 30.0, DVec3::new(2.0, 7.0, -1.0));
        let impulse = gravity.fall(dt) * mass;
        for (i, axis) in DVec3::AXES.into_iter().enumerate() {
            let h = 1e-3;
            let energy = |x: f64| gravity.energy((at + axis * x) * mass);
            let difference = (energy(h) - energy(-h)) / (2.0 * h);
            let x = Vec3 { x: Dual::variable(at.x, 0), y: Dual::variable(at.y, 1), z: Dual::<3>::variable(at.z, 2) };
            let automatic = (-x.along(gravity.acceleration) * mass).tangent[i];
            assert!((difference * dt + impulse[i]).abs() < 1e-9 && (automatic * dt + impulse[i]).abs() < 1e-12);
        }
    }
}
