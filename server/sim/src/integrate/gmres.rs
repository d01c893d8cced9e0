//! Generalised minimal residuals for systems that are not symmetric (Saad and Schultz, "GMRES", 1986), without restarts:
//! for systems that differ from one already solved by a matrix of low rank.

use super::block::Entry;
use super::vector::{add_scaled, inner, scale};

/// Most iterations: more contacts than this that slide at once in an island are left to the next Newton iteration.
const ITERATIONS_MAX: usize = 12;

/// A direction that grows by no more than this share of what was there is rounding.
const ROUNDING: f64 = 1e-14;

/// The method's vectors, kept from call to call.
#[derive(Default)]
pub(super) struct Gmres<const D: usize> {
    basis: Vec<Vec<Entry<D>>>,
    product: Vec<Entry<D>>,
}

/// A rotation in a plane: cosine and sine.
#[derive(Clone, Copy, Default)]
struct Givens(f64, f64);

impl Givens {
    /// The one that turns (a, b) into (r, 0), and r.
    fn eliminating(a: f64, b: f64) -> (Self, f64) {
        let r = a.hypot(b);
        (if r > 0.0 { Self(a / r, b / r) } else { Self(1.0, 0.0) }, r)
    }

    fn apply(self, a: &mut f64, b: &mut f64) {
        (*a, *b) = (self.0 * *a + self.1 * *b, self.0 * *b - self.1 * *a);
    }
}

impl<const D: usize> Gmres<D> {
    /// `x` ← A⁻¹ `x`, until the residual has shrunk to `forcing`. `multiply` adds to its second argument, zero before,
    /// what A makes of the first. Answers the number of iterations; `x` is left alone where it is zero or not finite.
    pub fn solve(
        &mut self,
        x: &mut [Entry<D>],
        forcing: f64,
        mut multiply: impl FnMut(&[Entry<D>], &mut Vec<Entry<D>>),
    ) -> usize {
        let norm = inner(x, x).sqrt();
        if !(norm > 0.0 && norm.is_finite()) {
            return 0;
        }
        self.extend_basis(0, x, norm);
        // The triangle that the Hessenberg matrix is turned into, by columns, and the rotations that do it.
        let mut triangle = [[0.0; ITERATIONS_MAX]; ITERATIONS_MAX];
        let mut rotations = [Givens::default(); ITERATIONS_MAX];
        let mut right = [0.0; ITERATIONS_MAX + 1];
        right[0] = norm;
        let mut used = 0;
        while used < ITERATIONS_MAX {
            let Self { basis, product } = self;
            product.clear();
            product.resize(x.len(), [0.0; D]);
            multiply(&basis[used], product);
            let column = &mut triangle[used];
            for (direction, along) in basis.iter().zip(column.iter_mut()).take(used + 1) {
                *along = inner(product, direction);
                add_scaled(product, -*along, direction);
            }
            let rest = inner(product, product).sqrt();
            let is_rounding = rest <= ROUNDING * norm;
            for (i, rotation) in rotations.iter().enumerate().take(used) {
                let (above, below) = column.split_at_mut(i + 1);
                rotation.apply(&mut above[i], &mut below[0]);
            }
            let (rotation, length) = Givens::eliminating(column[used], rest);
            (rotations[used], column[used]) = (rotation, length);
            let (above, below) = right.split_at_mut(used + 1);
            rotation.apply(&mut above[used], &mut below[0]);
            used += 1;
            if is_rounding || right[used].abs() <= forcing * norm || used == ITERATIONS_MAX {
                break;
            }
            let grown = std::mem::take(&mut self.product);
            self.extend_basis(used, &grown, rest);
            self.product = grown;
        }
        self.combine(x, &triangle, &mut right, used);
        used
    }

    /// Makes `direction` over its length a vector of the basis.
    fn extend_basis(&mut self, place: usize, direction: &[Entry<D>], length: f64) {
        if self.basis.len() == place {
            self.basis.push(Vec::new());
        }
        let vector = &mut self.basis[place];
        vector.clear();
        vector.extend_from_slice(direction);
        scale(vector, 1.0 / length);
    }

    /// Solves the triangle, and sums up the basis.
    fn combine(
        &self,
        x: &mut [Entry<D>],
        triangle: &[[f64; ITERATIONS_MAX]; ITERATIONS_MAX],
        right: &mut [f64; ITERATIONS_MAX + 1],
        used: usize,
    ) {
        for i in (0..used).rev() {
            for j in i + 1..used {
                right[i] -= triangle[j][i] * right[j];
            }
            // A singular system has no answer in this direction.
            right[i] = if triangle[i][i] == 0.0 { 0.0 } else { right[i] / triangle[i][i] };
        }
        x.fill([0.0; D]);
        for (direction, &share) in self.basis.iter().zip(right.iter()).take(used) {
            add_scaled(x, share, direction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The identity plus a matrix of rank r takes r + 1 iterations at most.
        #[test]
        fn low_rank_ends_early(
            us in prop::collection::vec(prop::array::uniform9(-1.0..1.0f64), 0..5),
            vs in prop::collection::vec(prop::array::uniform9(-1.0..1.0f64), 5),
            x in prop::array::uniform9(-1.0..1.0f64),
        ) {
            let entries = |x: &[f64; 9]| [[x[0], x[1], x[2]], [x[3], x[4], x[5]], [x[6], x[7], x[8]]];
            let multiply = |x: &[Entry<3>], y: &mut Vec<Entry<3>>| {
                y.copy_from_slice(x);
                for (u, v) in us.iter().zip(&vs) {
                    add_scaled(y, 0.2 * inner(&entries(v), x), &entries(u));
                }
            };
            let mut right = vec![[0.0; 3]; 3];
            multiply(&entries(&x), &mut right);
            let iterations = Gmres::default().solve(&mut right, 1e-12, multiply);
            prop_assert!(iterations <= us.len() + 1);
            let error = right.iter().flatten().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            prop_assert!(error < 1e-6, "{error}");
        }
    }

    #[test]
    fn nothing_and_nonsense_stay_as_they_are() {
        for x in [0.0, f64::NAN, f64::INFINITY] {
            let mut right = [[x; 3]];
            assert_eq!(Gmres::default().solve(&mut right, 0.1, |x, y| y.copy_from_slice(x)), 0);
            assert_eq!(right[0][0].to_bits(), x.to_bits());
        }
    }
}
