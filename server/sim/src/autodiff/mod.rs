//! Forward-mode automatic differentiation (talk, "The Hessian"): potentials are written once over a [`Scalar`] and
//! evaluated with plain numbers, or with [`Dual`] numbers that carry derivatives along.
//!
//! The gradient of a potential evaluated with `Dual<1>` frames that move along v has H v as its tangent: the talk's
//! "procedural representation of the Hessian", exact and without a matrix.

mod vector;

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

pub use vector::{Mat3, Vec3};

/// A real number, or one with derivatives.
pub trait Scalar:
    Copy
    + std::fmt::Debug
    + PartialEq
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;

    /// The number without its derivatives.
    fn value(self) -> f64;

    /// Applies a function with value `y` and derivative `slope` at this number.
    #[must_use]
    fn chain(self, y: f64, slope: f64) -> Self;

    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, 0.5 / root)
    }

    /// Sine.
    #[must_use]
    fn sin(self) -> Self {
        self.chain(self.value().sin(), self.value().cos())
    }

    /// Cosine.
    #[must_use]
    fn cos(self) -> Self {
        self.chain(self.value().cos(), -self.value().sin())
    }

    /// Magnitude.
    #[must_use]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// Angle of the vector (`x`, `self`), rad.
    #[must_use]
    fn atan2(self, x: Self) -> Self {
        let (a, b) = (self.value(), x.value());
        let square = a * a + b * b;
        // d atan2 = (x dy − y dx) / (x² + y²); the values of both products cancel.
        let turned = self * (b / square) - x * (a / square);
        turned + (a.atan2(b) - turned.value())
    }

    /// Whether the value is below `other`.
    fn below(self, other: f64) -> bool {
        self.value().partial_cmp(&other) == Some(Ordering::Less)
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn value(self) -> f64 {
        self
    }

    fn chain(self, y: f64, _slope: f64) -> Self {
        y
    }

    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
}

/// A number with N directional derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The number.
    pub value: f64,
    /// Its derivatives.
    pub tangent: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// `value`, the `i`th of the variables.
    pub fn variable(value: f64, i: usize) -> Self {
        let mut tangent = [0.0; N];
        tangent[i] = 1.0;
        Self { value, tangent }
    }

    fn map(self, value: f64, f: impl Fn(f64) -> f64) -> Self {
        Self { value, tangent: self.tangent.map(f) }
    }

    fn zip(self, other: Self, value: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        Self { value, tangent: std::array::from_fn(|i| f(self.tangent[i], other.tangent[i])) }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const ZERO: Self = Self { value: 0.0, tangent: [0.0; N] };
    const ONE: Self = Self { value: 1.0, tangent: [0.0; N] };

    fn value(self) -> f64 {
        self.value
    }

    fn chain(self, y: f64, slope: f64) -> Self {
        self.map(y, |t| slope * t)
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self { value, tangent: [0.0; N] }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.map(-self.value, |t| -t)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.zip(other, self.value + other.value, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.zip(other, self.value - other.value, |a, b| a - b)
    }
}

// The rules of derivatives mix operators, which clippy takes for slips of the pen.
#[allow(clippy::suspicious_arithmetic_impl)]
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.zip(other, self.value * other.value, |a, b| a * other.value + b * self.value)
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.zip(other, quotient, |a, b| (a - quotient * b) / other.value)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        Self { value: self.value - other, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.map(self.value * factor, |t| t * factor)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    fn div(self, divisor: f64) -> Self {
        self.map(self.value / divisor, |t| t / divisor)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Every operation at once: f(x, y) with a kink only where it is not tested.
    fn busy<S: Scalar>(x: S, y: S) -> S {
        let root = (x * x + y * y * 2.0 + 1.0).sqrt();
        (x.sin() * y.cos() - root / (y.abs() + 0.5)) * 3.0 + y.atan2(x + 4.0) - (-x) / 2.0 - 1.0
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_finite_differences(x in -3.0..3.0f64, y in 0.1..3.0f64) {
            let dual = busy(Dual::<2>::variable(x, 0), Dual::variable(y, 1));
            let h = 1e-6;
            let by_x = (busy(x + h, y) - busy(x - h, y)) / (2.0 * h);
            let by_y = (busy(x, y + h) - busy(x, y - h)) / (2.0 * h);
            prop_assert!((dual.value - busy(x, y)).abs() < 1e-12);
            prop_assert!((dual.tangent[0] - by_x).abs() < 1e-6 && (dual.tangent[1] - by_y).abs() < 1e-6, "{dual:?}");
        }
    }
}
