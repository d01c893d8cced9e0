//! Principal stretches of a deformation: F = U diag(σ) Vᵀ with U and V rotations.

use glam::{DMat3, DVec3};

use crate::eigen::symmetric_eigen;

/// A deformation gradient taken apart.
pub(crate) struct Principal {
    /// Rotation: principal directions in the world.
    pub u: DMat3,
    /// Stretches, largest first. The last, smallest in magnitude, is negative where the element is turned inside out.
    pub stretches: DVec3,
    /// Rotation: principal directions at rest.
    pub v: DMat3,
}

impl Principal {
    /// Never fails: flat, needle-shaped and collapsed elements get some of the rotations that fit.
    pub fn of(f: DMat3) -> Self {
        let (squares, axes) = symmetric_eigen(f.transpose() * f);
        let v = descending(squares, axes);
        let (b1, b2, b3) = (f * v.x_axis, f * v.y_axis, f * v.z_axis);
        let u1 = b1.try_normalize().unwrap_or(DVec3::X);
        let u2 = (b2 - u1 * u1.dot(b2)).try_normalize().unwrap_or_else(|| u1.any_orthonormal_vector());
        let u3 = u1.cross(u2);
        let stretches = DVec3::new(u1.dot(b1), u2.dot(b2), u3.dot(b3));
        Self { u: DMat3::from_cols(u1, u2, u3), stretches, v }
    }
}

/// The axes in the order of their squares, largest first, still a rotation.
fn descending(squares: DVec3, axes: DMat3) -> DMat3 {
    let mut order = [(squares.x, axes.x_axis), (squares.y, axes.y_axis), (squares.z, axes.z_axis)];
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let [x, y] = [order[0].1, order[1].1];
    DMat3::from_cols(x, y, x.cross(y))
}
