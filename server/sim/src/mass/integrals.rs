//! Integrals of polynomials over pieces of volume.

use std::iter::Sum;
use std::ops::{Add, AddAssign};

use glam::{DMat3, DVec3};

use crate::potential::outer;

/// ∫ρ, ∫ρ x and ∫ρ x xᵀ over a piece of a solid, x from some point: kg, kg m, kg m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Integrals {
    pub mass: f64,
    pub first: DVec3,
    pub second: DMat3,
}

impl Integrals {
    pub const ZERO: Self = Self { mass: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };

    /// The same piece, x from a point from which the old one lies at `offset`.
    pub fn seen_from(self, offset: DVec3) -> Self {
        let mixed = outer(self.first, offset) + outer(offset, self.first);
        Self {
            mass: self.mass,
            first: self.first + offset * self.mass,
            second: self.second + mixed + outer(offset, offset) * self.mass,
        }
    }
}

impl Add for Integrals {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (mass, first) = (self.mass + other.mass, self.first + other.first);
        Self { mass, first, second: self.second + other.second }
    }
}

impl AddAssign for Integrals {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sum for Integrals {
    fn sum<I: Iterator<Item = Self>>(pieces: I) -> Self {
        pieces.fold(Self::ZERO, Add::add)
    }
}

/// Moments of a piece of bare volume about a point: V, ∫x, ∫x xᵀ and ∫(g·x) x xᵀ, g the gradient of the density.
pub(super) struct VolumeMoments {
    pub volume: f64,
    pub first: DVec3,
    pub second: DMat3,
    pub third: DMat3,
}

impl VolumeMoments {
    /// With density ρ = `density` + `gradient`·x.
    pub fn weighed(&self, density: f64, gradient: DVec3) -> Integrals {
        Integrals {
            mass: self.volume * density + self.first.dot(gradient),
            first: self.first * density + self.second * gradient,
            second: self.second * density + self.third,
        }
    }
}

/// Signed volume; positive where the last three corners turn counterclockwise seen from outside.
pub(super) fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Integrals over a tetrahedron, signed as its volume, by its densities at the corners.
///
/// With barycentric coordinates λ, ∫λi λj λk = V/120 (1 + δij + δjk + δki + 2 δij δjk).
pub(super) fn tetrahedron(corners: [DVec3; 4], densities: [f64; 4]) -> Integrals {
    let volume = volume(corners);
    let (mut mass, mut sum, mut weighed) = (0.0, DVec3::ZERO, DVec3::ZERO);
    let (mut squares, mut weighed_squares) = (DMat3::ZERO, DMat3::ZERO);
    for (corner, density) in corners.into_iter().zip(densities) {
        let square = outer(corner, corner);
        mass += density;
        sum += corner;
        weighed += corner * density;
        squares += square;
        weighed_squares += square * density;
    }
    let mixed = outer(sum, weighed) + outer(weighed, sum);
    let second = (outer(sum, sum) + squares) * mass + mixed + weighed_squares * 2.0;
    Integrals {
        mass: mass * volume / 4.0,
        first: (sum * mass + weighed) * (volume / 20.0),
        second: second * (volume / 120.0),
    }
}

/// A prism between two triangles as three tetrahedra; positive where `low` turns counterclockwise seen from `high`.
pub(super) fn prism([a, b, c]: [DVec3; 3], [d, e, f]: [DVec3; 3]) -> [[DVec3; 4]; 3] {
    [[a, b, c, d], [b, c, d, e], [c, d, e, f]]
}
