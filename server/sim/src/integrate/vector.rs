//! Vectors with an entry for every body of an island.

use super::block::{Entry, dot};

/// Scalar product of two vectors.
pub(super) fn inner<const D: usize>(a: &[Entry<D>], b: &[Entry<D>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(a, b)).sum()
}

/// y += a x.
pub(super) fn add_scaled<const D: usize>(y: &mut [Entry<D>], a: f64, x: &[Entry<D>]) {
    for (y, x) in y.iter_mut().zip(x) {
        for (y, x) in y.iter_mut().zip(x) {
            *y += a * x;
        }
    }
}

/// y ← a y + x.
pub(super) fn scale_and_add<const D: usize>(y: &mut [Entry<D>], a: f64, x: &[Entry<D>]) {
    for (y, x) in y.iter_mut().zip(x) {
        for (y, x) in y.iter_mut().zip(x) {
            *y = x + a * *y;
        }
    }
}

/// x ← a x.
pub(super) fn scale<const D: usize>(x: &mut [Entry<D>], a: f64) {
    x.iter_mut().flatten().for_each(|x| *x *= a);
}

/// y ← −x.
pub(super) fn negate<const D: usize>(x: &[Entry<D>], y: &mut Vec<Entry<D>>) {
    y.clear();
    y.extend(x.iter().map(|entry| entry.map(|v| -v)));
}
