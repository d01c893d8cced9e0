//! Mass properties of solids by analytic integration of the volume (talk, "Inertia"): "at each point in the sheep you
//! take the infinitesimal bit of volume, multiply it by the sheep's density at that point in space, and project it onto
//! the DOF that move the point".
//!
//! Everything here is exact up to rounding, density varying over the solid included: densities are affine in position,
//! so every integrand is a polynomial. `solids` has the closed forms of [`Shape`](crate::Shape), `polyhedron` closed
//! surfaces and hulls, `rounding` what an extrusion radius adds to a hull, and `embedded` the mass matrices of points
//! in which a solid is embedded. Pure functions; knows nothing of worlds and bodies.

mod embedded;
mod integrals;
mod polyhedron;
mod rounding;
mod solids;
#[cfg(test)]
mod tests;

use glam::{DMat3, DQuat, DVec3};

pub(crate) use embedded::trilinear;
pub use embedded::{embedded_mass, lattice_cell_mass, tetrahedron_mass};
pub use polyhedron::Polyhedron;

use crate::eigen::symmetric_eigen;
use crate::error::{LARGEST, SimError, require, require_vector};
use crate::potential::outer;
use integrals::Integrals;

/// Least mass of a solid, kg: below, products of its numbers vanish.
const LEAST_MASS: f64 = 1e-30;

/// Mass that a solid must be below, kg: above, products of its numbers overflow.
const LARGEST_MASS: f64 = 1e30;

/// Density of a solid, kg/m³: constant, or affine in position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// At the origin of the solid's frame, kg/m³.
    pub at_origin: f64,
    /// Its change with position, kg/m⁴.
    pub gradient: DVec3,
}

impl Density {
    /// The same everywhere.
    pub fn constant(density: f64) -> Self {
        Self { at_origin: density, gradient: DVec3::ZERO }
    }

    /// At a point of the solid's frame, kg/m³.
    pub fn at(self, point: DVec3) -> f64 {
        self.at_origin + self.gradient.dot(point)
    }

    /// `Err` unless the density is above 0 at `lowest`, the point of the solid farthest against the gradient, which is
    /// given along the unit gradient, m.
    fn require_positive(self, lowest: f64) -> Result<(), SimError> {
        require_vector(self.gradient, "gradient of the density")?;
        let least = self.at_origin + self.gradient.length() * lowest;
        require(least > 0.0 && least < LARGEST, "density", least, "above 0 everywhere in the solid, below 1e9 kg/m³")
    }

    /// Unit gradient; any direction where there is none.
    fn direction(self) -> DVec3 {
        self.gradient.try_normalize().unwrap_or(DVec3::X)
    }
}

/// Mass, centre of mass and second moments of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// kg, above 0.
    pub mass: f64,
    /// Centre of mass in the solid's frame, m.
    pub centre: DVec3,
    /// ∫ρ (x − centre)(x − centre)ᵀ, kg m², symmetric.
    pub moments: DMat3,
}

impl MassProperties {
    /// Of a point mass.
    ///
    /// # Errors
    /// [`SimError`] where the mass is out of range, or the point not finite.
    pub fn of_point(mass: f64, at: DVec3) -> Result<Self, SimError> {
        require_vector(at, "position of a point mass")?;
        Self { mass, centre: at, moments: DMat3::ZERO }.checked()
    }

    /// Of several solids taken together; where they overlap, both count.
    ///
    /// # Errors
    /// [`SimError::Unusable`] where there is none, [`SimError::OutOfRange`] where the sum is.
    pub fn combined(parts: impl IntoIterator<Item = Self>) -> Result<Self, SimError> {
        let mut parts = parts.into_iter();
        let first = parts.next().ok_or(SimError::Unusable { what: "a body of no parts has no mass" })?;
        parts.fold(first, Self::with).checked()
    }

    /// Of both together. Differences of centres only: nothing is lost far from the origin.
    fn with(self, other: Self) -> Self {
        let mass = self.mass + other.mass;
        let apart = other.centre - self.centre;
        let between = outer(apart, apart) * (self.mass * other.mass / mass);
        let centre = self.centre + apart * (other.mass / mass);
        Self { mass, centre, moments: self.moments + other.moments + between }
    }

    /// Of the solid turned about its frame's origin, then moved.
    #[must_use]
    pub fn moved(self, position: DVec3, rotation: DQuat) -> Self {
        let turn = DMat3::from_quat(rotation);
        let moments = turn * self.moments * turn.transpose();
        Self { mass: self.mass, centre: position + turn * self.centre, moments }
    }

    /// Of the same solid with every density multiplied such that it weighs `mass` kg.
    ///
    /// # Errors
    /// [`SimError`] where `mass` is out of range.
    pub fn scaled_to(self, mass: f64) -> Result<Self, SimError> {
        Self { mass, centre: self.centre, moments: self.moments * (mass / self.mass) }.checked()
    }

    /// Tensor of inertia about the centre of mass, kg m².
    pub fn inertia(&self) -> DMat3 {
        inertia_of(self.moments)
    }

    /// Tensor of inertia about a point of the solid's frame, kg m² (parallel axes).
    pub fn inertia_about(&self, point: DVec3) -> DMat3 {
        let arm = self.centre - point;
        inertia_of(self.moments + outer(arm, arm) * self.mass)
    }

    /// Principal moments of inertia, kg m², and the rotation that turns principal axes into the solid's.
    ///
    /// Where the solid's axes are principal they stay as they are.
    pub fn principal(&self) -> (DVec3, DQuat) {
        let (moments, axes) = symmetric_eigen(self.moments);
        let sums = DVec3::new(moments.y + moments.z, moments.x + moments.z, moments.x + moments.y);
        (sums, DQuat::from_mat3(&axes).normalize())
    }

    fn from_integrals(about: DVec3, integrals: Integrals) -> Result<Self, SimError> {
        let Integrals { mass, first, second } = integrals;
        let arm = first / mass;
        Self { mass, centre: about + arm, moments: second - outer(arm, arm) * mass }.checked()
    }

    /// `Err` where numbers have overflown, or are so small that nothing is left of them.
    fn checked(self) -> Result<Self, SimError> {
        require((LEAST_MASS..LARGEST_MASS).contains(&self.mass), "mass", self.mass, "1e-30 to below 1e30 kg")?;
        require(self.centre.is_finite(), "centre of mass", self.centre.length(), "finite")?;
        let sum: f64 = self.moments.to_cols_array().iter().map(|moment| moment.abs()).sum();
        require(sum.is_finite(), "second moments", sum, "finite")?;
        Ok(self)
    }
}

/// tr(S) − S.
fn inertia_of(moments: DMat3) -> DMat3 {
    let trace = moments.x_axis.x + moments.y_axis.y + moments.z_axis.z;
    DMat3::from_diagonal(DVec3::splat(trace)) - moments
}
