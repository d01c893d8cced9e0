//! Vectors and matrices of three over a [`Scalar`]; glam's are over plain numbers only.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use glam::{DMat3, DVec3};

use super::Scalar;

/// Three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<S> {
    /// First.
    pub x: S,
    /// Second.
    pub y: S,
    /// Third.
    pub z: S,
}

impl<S: Scalar> Vec3<S> {
    /// Zero.
    pub const ZERO: Self = Self { x: S::ZERO, y: S::ZERO, z: S::ZERO };

    /// A constant: its derivatives are zero.
    pub fn constant(v: DVec3) -> Self {
        Self { x: v.x.into(), y: v.y.into(), z: v.z.into() }
    }

    /// The numbers without their derivatives.
    pub fn value(self) -> DVec3 {
        DVec3::new(self.x.value(), self.y.value(), self.z.value())
    }

    /// Scalar product.
    pub fn dot(self, other: Self) -> S {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Scalar product with a constant.
    pub fn along(self, other: DVec3) -> S {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Vector product.
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// Length; its derivatives are those of zero at zero.
    pub fn length(self) -> S {
        let square = self.dot(self);
        if square.value() == 0.0 { S::ZERO } else { square.sqrt() }
    }

    /// Every number times `factor`.
    #[must_use]
    pub fn scale(self, factor: S) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    /// In its own direction with length 1; zero for zero.
    #[must_use]
    pub fn normalize_or_zero(self) -> Self {
        let length = self.length();
        if length.value() > 0.0 { self.scale(S::ONE / length) } else { Self::ZERO }
    }
}

impl From<DVec3> for Vec3<f64> {
    fn from(v: DVec3) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vec3<f64>> for DVec3 {
    fn from(v: Vec3<f64>) -> Self {
        DVec3::new(v.x, v.y, v.z)
    }
}

impl<S: Scalar> Add for Vec3<S> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Scalar> Sub for Vec3<S> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<S: Scalar> Neg for Vec3<S> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<S: Scalar> Mul<f64> for Vec3<S> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

impl<S: Scalar> AddAssign for Vec3<S> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Scalar> SubAssign for Vec3<S> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// Three columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<S> {
    /// Images of the axes.
    pub columns: [Vec3<S>; 3],
}

impl<S: Scalar> Mat3<S> {
    /// The identity.
    pub const IDENTITY: Self = Self {
        columns: [
            Vec3 { x: S::ONE, y: S::ZERO, z: S::ZERO },
            Vec3 { x: S::ZERO, y: S::ONE, z: S::ZERO },
            Vec3 { x: S::ZERO, y: S::ZERO, z: S::ONE },
        ],
    };

    /// A constant: its derivatives are zero.
    pub fn constant(m: DMat3) -> Self {
        Self { columns: [m.x_axis, m.y_axis, m.z_axis].map(Vec3::constant) }
    }

    /// The numbers without their derivatives.
    pub fn value(self) -> DMat3 {
        let [x, y, z] = self.columns.map(Vec3::value);
        DMat3::from_cols(x, y, z)
    }

    /// The matrix times a constant vector.
    pub fn apply(&self, v: DVec3) -> Vec3<S> {
        let [a, b, c] = self.columns;
        a * v.x + b * v.y + c * v.z
    }

    /// The matrix times a vector.
    pub fn multiply(&self, v: Vec3<S>) -> Vec3<S> {
        let [a, b, c] = self.columns;
        a.scale(v.x) + b.scale(v.y) + c.scale(v.z)
    }

    /// The transposed matrix times a vector: the inverse where it is a rotation.
    pub fn transposed_multiply(&self, v: Vec3<S>) -> Vec3<S> {
        let [a, b, c] = self.columns;
        Vec3 { x: a.dot(v), y: b.dot(v), z: c.dot(v) }
    }
}
