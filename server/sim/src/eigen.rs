//! Eigenvalues of symmetric 3×3 matrices by cyclic Jacobi rotations.
//!
//! The closed-form solver that comes with parry loses eigenvectors of small matrices (its thresholds are absolute) and
//! half of the digits where eigenvalues nearly meet, and principal axes of regular solids always nearly meet.

use glam::{DMat3, DVec3};

/// Most sweeps over the three off-diagonal pairs. Convergence is quadratic: five are usual.
const SWEEPS_MAX: usize = 12;

/// Eigenvalues and a rotation whose columns are the eigenvectors: `m = R diag(values) Rᵀ`.
///
/// Nothing is sorted, so that a diagonal matrix keeps its axes. Only the upper triangle is read.
pub(crate) fn symmetric_eigen(m: DMat3) -> (DVec3, DMat3) {
    let mut a = m.to_cols_array_2d();
    let mut vectors = [DVec3::X, DVec3::Y, DVec3::Z];
    for _ in 0..SWEEPS_MAX {
        let off = a[1][0] * a[1][0] + a[2][0] * a[2][0] + a[2][1] * a[2][1];
        let on = a[0][0] * a[0][0] + a[1][1] * a[1][1] + a[2][2] * a[2][2];
        if off <= f64::EPSILON * f64::EPSILON * on || !off.is_finite() {
            break;
        }
        for (p, q, other) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            rotate(&mut a, &mut vectors, p, q, other);
        }
    }
    (DVec3::new(a[0][0], a[1][1], a[2][2]), DMat3::from_cols(vectors[0], vectors[1], vectors[2]))
}

/// A symmetric matrix without its negative eigenvalues.
pub(crate) fn positive_part(m: DMat3) -> DMat3 {
    let (values, axes) = symmetric_eigen(m);
    axes * DMat3::from_diagonal(values.max(DVec3::ZERO)) * axes.transpose()
}

/// Makes element (p, q) zero by a rotation in that plane (Golub and Van Loan, 8.5.2). `a[column][row]`, upper triangle.
fn rotate(a: &mut [[f64; 3]; 3], vectors: &mut [DVec3; 3], p: usize, q: usize, other: usize) {
    let apq = a[q][p];
    if apq == 0.0 {
        return;
    }
    let tau = (a[q][q] - a[p][p]) / (2.0 * apq);
    // Where τ² overflows there is nothing to turn, and the square root is infinite; `hypot` was a fifth of a flock's tick.
    let tangent = 1.0f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = tangent * cosine;
    a[p][p] -= tangent * apq;
    a[q][q] += tangent * apq;
    a[q][p] = 0.0;
    let (rp, rq) = (ordered(other, p), ordered(other, q));
    let (arp, arq) = (a[rp.1][rp.0], a[rq.1][rq.0]);
    a[rp.1][rp.0] = cosine * arp - sine * arq;
    a[rq.1][rq.0] = sine * arp + cosine * arq;
    let (vp, vq) = (vectors[p], vectors[q]);
    vectors[p] = vp * cosine - vq * sine;
    vectors[q] = vp * sine + vq * cosine;
}

fn ordered(i: usize, j: usize) -> (usize, usize) {
    (i.min(j), i.max(j))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_matrix_is_put_together_again(
            values in proptest::array::uniform3(-3.0..3.0f64),
            axis in proptest::array::uniform3(-3.0..3.0f64),
            scale in -12..12i32,
            twins in any::<bool>(),
        ) {
            let mut values = DVec3::from_array(values) * 10f64.powi(scale);
            if twins {
                values.y = values.x * (1.0 + 1e-13);
            }
            let r = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_array(axis)));
            let m = r * DMat3::from_diagonal(values) * r.transpose();
            let (found, vectors) = symmetric_eigen(m);
            let again = vectors * DMat3::from_diagonal(found) * vectors.transpose();
            let size = values.abs().max_element();
            prop_assert!((again - m).to_cols_array().iter().all(|x| x.abs() < 1e-14 * size));
            prop_assert!((vectors.determinant() - 1.0).abs() < 1e-14);
            let unit = vectors.transpose() * vectors - DMat3::IDENTITY;
            prop_assert!(unit.to_cols_array().iter().all(|x| x.abs() < 1e-14));
        }
    }

    #[test]
    fn diagonal_matrices_keep_their_axes_and_bad_ones_end() {
        let values = DVec3::new(3.0, 1.0, 2.0);
        assert_eq!(symmetric_eigen(DMat3::from_diagonal(values)), (values, DMat3::IDENTITY));
        let _ = symmetric_eigen(DMat3::from_cols(DVec3::NAN, DVec3::INFINITY, DVec3::ONE));
    }
}
