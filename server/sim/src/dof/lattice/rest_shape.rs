//! Rest shapes by formula: what a lattice is to look like when nothing pulls at it (Barr, "Global and Local Deformations
//! of Solid Primitives", 1984).

use glam::{DMat3, DVec3};

use crate::error::{SimError, require};

/// Least and largest stretch.
const SCALES: std::ops::RangeInclusive<f64> = 0.1..=10.0;

/// Largest twist and bend, rad/m.
const STEEPEST: f64 = 100.0;

/// A deformation of the rest shape about the axis along y from the middle of the lattice's lower side: first stretched,
/// then twisted, then bent. Its numbers, in this order, are the controls of a [`Lattice`](super::Lattice).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestShape {
    /// Stretch along x, y and z, 0.1 to 10.
    pub scale: DVec3,
    /// Turn about the axis with each metre along it, rad/m.
    pub twist: f64,
    /// Curvature of the axis towards x, rad/m.
    pub bend: f64,
}

impl RestShape {
    /// The controls that ask for it.
    pub fn numbers(&self) -> [f64; 5] {
        [self.scale.x, self.scale.y, self.scale.z, self.twist, self.bend]
    }

    /// As controls have it.
    pub(super) fn of_numbers(numbers: &[f64]) -> Self {
        match *numbers {
            [x, y, z, twist, bend] => Self { scale: DVec3::new(x, y, z), twist, bend },
            _ => Self::default(),
        }
    }

    pub(super) fn validate(&self) -> Result<(), SimError> {
        for scale in self.scale.to_array() {
            require(SCALES.contains(&scale), "scale of the rest shape", scale, "0.1 to 10")?;
        }
        require(self.twist.abs() <= STEEPEST, "twist of the rest shape", self.twist, "-100 to 100 rad/m")?;
        require(self.bend.abs() <= STEEPEST, "bend of the rest shape", self.bend, "-100 to 100 rad/m")
    }

    /// Where a point goes, both from the lower end of the axis, m: what a lattice is pulled to, and a free-form deformation
    /// of points by itself.
    pub fn map(&self, point: DVec3) -> DVec3 {
        let stretched = self.scale * point;
        let height = stretched.y;
        let twisted = DMat3::from_rotation_y(self.twist * height) * stretched;
        // The axis becomes an arc of this angle and of radius 1 / bend; sections turn with it.
        let angle = self.bend * height;
        let (sin, cos) = angle.sin_cos();
        // sin(a) / a and (1 − cos(a)) / a, which are harmless at 0.
        let (along, aside) = if angle.abs() < 1e-4 { (1.0, angle / 2.0) } else { (sin / angle, (1.0 - cos) / angle) };
        DVec3::new(height * aside + twisted.x * cos, height * along - twisted.x * sin, twisted.z)
    }
}

impl Default for RestShape {
    /// As it was described.
    fn default() -> Self {
        Self { scale: DVec3::ONE, twist: 0.0, bend: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_mapped() {
        let near = |a: DVec3, b: DVec3| (a - b).length() < 1e-9;
        let point = DVec3::new(0.3, 2.0, -0.1);
        assert!(near(RestShape::default().map(point), point));
        let scaled = RestShape { scale: DVec3::new(1.0, 2.0, 3.0), ..RestShape::default() };
        assert!(near(scaled.map(point), DVec3::new(0.3, 4.0, -0.3)));
        let quarter = std::f64::consts::FRAC_PI_2;
        let twisted = RestShape { twist: quarter / 2.0, ..RestShape::default() };
        assert!(near(twisted.map(point), DVec3::new(-0.1, 2.0, -0.3)));
        // A quarter of a circle of radius 4/π: up becomes towards x.
        let bent = RestShape { bend: quarter / 2.0, ..RestShape::default() };
        let radius = 2.0 / quarter;
        assert!(near(bent.map(point), DVec3::new(radius, radius - 0.3, -0.1)));
        let (straight, hardly) = (RestShape::default(), RestShape { bend: 1e-6, ..RestShape::default() });
        assert!((straight.map(point) - hardly.map(point)).length() < 1e-5);
        assert!(RestShape { bend: f64::NAN, ..straight }.validate().is_err());
        assert!(RestShape { scale: DVec3::ZERO, ..straight }.validate().is_err());
        assert_eq!(RestShape::of_numbers(&bent.numbers()), bent);
    }
}
