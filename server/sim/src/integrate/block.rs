//! Dense D×D blocks, the entries of the sparse system: D is 3 where every body is a particle, else 6.

/// A block, row major.
pub(crate) type Block<const D: usize> = [[f64; D]; D];

/// A body's share of a vector.
pub(crate) type Entry<const D: usize> = [f64; D];

/// Zero.
pub(crate) const fn zero<const D: usize>() -> Block<D> {
    [[0.0; D]; D]
}

/// Scalar product.
pub(crate) fn dot<const D: usize>(a: &Entry<D>, b: &Entry<D>) -> f64 {
    (0..D).map(|i| a[i] * b[i]).sum()
}

/// y += A x.
pub(crate) fn multiply_add<const D: usize>(a: &Block<D>, x: &Entry<D>, y: &mut Entry<D>) {
    for i in 0..D {
        y[i] += dot(&a[i], x);
    }
}

/// y += Aᵀ x.
pub(crate) fn transposed_multiply_add<const D: usize>(a: &Block<D>, x: &Entry<D>, y: &mut Entry<D>) {
    for i in 0..D {
        for j in 0..D {
            y[j] += a[i][j] * x[i];
        }
    }
}

/// y −= A x.
pub(crate) fn multiply_sub<const D: usize>(a: &Block<D>, x: &Entry<D>, y: &mut Entry<D>) {
    for i in 0..D {
        y[i] -= dot(&a[i], x);
    }
}

/// y −= Aᵀ x.
pub(crate) fn transposed_multiply_sub<const D: usize>(a: &Block<D>, x: &Entry<D>, y: &mut Entry<D>) {
    for i in 0..D {
        for j in 0..D {
            y[j] -= a[i][j] * x[i];
        }
    }
}

/// C −= A Bᵀ.
pub(crate) fn product_sub<const D: usize>(a: &Block<D>, b: &Block<D>, c: &mut Block<D>) {
    for i in 0..D {
        for j in 0..D {
            c[i][j] -= dot(&a[i], &b[j]);
        }
    }
}

/// Cholesky factor L of a symmetric block, A = L Lᵀ; the strict upper triangle of the result is zero.
/// `None` where a pivot is not above `floor` times its diagonal entry.
pub(crate) fn cholesky<const D: usize>(a: &Block<D>, floor: f64) -> Option<Block<D>> {
    let mut l = zero();
    for i in 0..D {
        for j in 0..=i {
            let (row_i, row_j): (&Entry<D>, &Entry<D>) = (&l[i], &l[j]);
            let s = row_i[..j].iter().zip(row_j).fold(a[i][j], |s, (x, y)| s - x * y);
            if i == j {
                let positive = s > floor * a[i][i] && a[i][i] > 0.0;
                if !positive {
                    return None;
                }
                l[i][i] = s.sqrt();
            } else {
                l[i][j] = s / l[j][j];
            }
        }
    }
    Some(l)
}

/// x ← L⁻¹ x, L lower triangular.
pub(crate) fn forward_substitute<const D: usize>(l: &Block<D>, x: &mut Entry<D>) {
    for i in 0..D {
        let mut s = x[i];
        for k in 0..i {
            s -= l[i][k] * x[k];
        }
        x[i] = s / l[i][i];
    }
}

/// x ← L⁻ᵀ x, L lower triangular.
pub(crate) fn backward_substitute<const D: usize>(l: &Block<D>, x: &mut Entry<D>) {
    for i in (0..D).rev() {
        let mut s = x[i];
        for k in i + 1..D {
            s -= l[k][i] * x[k];
        }
        x[i] = s / l[i][i];
    }
}
