//! Dense D×D blocks, the entries of the sparse system: D is 3 where every body is a particle, else 6.

/// A block, row major.
pub(crate) type Block<const D: usize> = [[f64; D]; D];

/// A body's share of a vector.
pub(crate) type Entry<const D: usize> = [f64; D];

/// Zero.
pub(crate) const fn zero<const D: usize>() -> Block<D> {
    [[0.0; D]; D]
}

/// Aᵀ.
#[inline]
pub(crate) fn transpose<const D: usize>(a: &Block<D>) -> Block<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Scalar product.
#[inline]
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
#[inline]
pub(crate) fn product_sub<const D: usize>(a: &Block<D>, b: &Block<D>, c: &mut Block<D>) {
    // Along rows of Bᵀ, so that neighbours in memory are worked on together; sums keep the order of a scalar product.
    let b = transpose(b);
    for (a, c) in a.iter().zip(c) {
        let mut sums = [0.0; D];
        for (a, b) in a.iter().zip(&b) {
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
        for (c, sum) in c.iter_mut().zip(sums) {
            *c -= sum;
        }
    }
}

/// Cholesky factor L of a symmetric block, A = L Lᵀ, with the reciprocals of its pivots on the diagonal: what is divided by
/// them later is multiplied. The strict upper triangle is zero. `None` where a pivot is not above `floor` times its diagonal
/// entry.
#[expect(clippy::needless_range_loop, reason = "by iterators it takes twice the instructions")]
pub(crate) fn cholesky<const D: usize>(a: &Block<D>, floor: f64) -> Option<Block<D>> {
    let mut l = zero();
    for i in 0..D {
        for j in 0..i {
            let mut left = a[i][j];
            for k in 0..j {
                left -= l[i][k] * l[j][k];
            }
            l[i][j] = left * l[j][j];
        }
        let mut pivot = a[i][i];
        for k in 0..i {
            pivot -= l[i][k] * l[i][k];
        }
        let positive = pivot > floor * a[i][i] && a[i][i] > 0.0;
        if !positive {
            return None;
        }
        l[i][i] = pivot.sqrt().recip();
    }
    Some(l)
}

/// X ← X L⁻ᵀ, L a factor from [`cholesky`]: every row of X is a right-hand side.
#[inline]
pub(crate) fn forward_substitute_rows<const D: usize>(l: &Block<D>, x: &mut Block<D>) {
    // As columns, so that all right-hand sides are worked on together.
    let mut columns = transpose(x);
    for (i, row) in l.iter().enumerate() {
        let (done, rest) = columns.split_at_mut(i);
        let column = &mut rest[0];
        for (&factor, known) in row.iter().zip(&*done) {
            for (x, known) in column.iter_mut().zip(known) {
                *x -= factor * known;
            }
        }
        column.iter_mut().for_each(|x| *x *= row[i]);
    }
    *x = transpose(&columns);
}

/// x ← L⁻¹ x, L a factor from [`cholesky`].
pub(crate) fn forward_substitute<const D: usize>(l: &Block<D>, x: &mut Entry<D>) {
    for i in 0..D {
        let mut s = x[i];
        for k in 0..i {
            s -= l[i][k] * x[k];
        }
        x[i] = s * l[i][i];
    }
}

/// x ← L⁻ᵀ x, L a factor from [`cholesky`].
pub(crate) fn backward_substitute<const D: usize>(l: &Block<D>, x: &mut Entry<D>) {
    for i in (0..D).rev() {
        let mut s = x[i];
        for k in i + 1..D {
            s -= l[k][i] * x[k];
        }
        x[i] = s * l[i][i];
    }
}
