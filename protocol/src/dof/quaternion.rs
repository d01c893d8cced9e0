//! Quaternions of rotations in integers: the same bits on every machine.
//!
//! Components are of 2^30 (`ONE`). Products are exact in 64 bits and rounded down to 2^30 once.

/// 1.0.
pub const ONE: i64 = 1 << 30;
const BITS: u32 = 30;

/// x y z w, of 2^30.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quaternion(pub [i64; 4]);

impl Quaternion {
    /// No rotation.
    pub const NONE: Self = Self([0, 0, 0, ONE]);

    /// The component of largest size, the first of equals.
    #[inline]
    pub fn largest(&self) -> usize {
        (1..4).fold(0, |best, i| if self.0[i].abs() > self.0[best].abs() { i } else { best })
    }

    /// x, y and z.
    #[inline]
    pub fn axis(self) -> [i64; 3] {
        let [x, y, z, _] = self.0;
        [x, y, z]
    }

    /// The rotation backwards.
    #[inline]
    pub fn conjugate(self) -> Self {
        let [x, y, z, w] = self.0;
        Self([-x, -y, -z, w])
    }

    /// First `other`, then this.
    #[inline]
    pub fn times(self, other: Self) -> Self {
        let ([ax, ay, az, aw], [bx, by, bz, bw]) = (self.0, other.0);
        Self([
            (aw * bx + ax * bw + ay * bz - az * by) >> BITS,
            (aw * by - ax * bz + ay * bw + az * bx) >> BITS,
            (aw * bz + ax * by - ay * bx + az * bw) >> BITS,
            (aw * bw - ax * bx - ay * by - az * bz) >> BITS,
        ])
    }

    /// The rotation twice.
    #[inline]
    fn squared(self) -> Self {
        let [x, y, z, w] = self.0;
        let [tx, ty, tz] = [x, y, z].map(|c| (2 * w * c) >> BITS);
        Self([tx, ty, tz, (w * w - x * x - y * y - z * z) >> BITS])
    }

    /// The rotation `n` times.
    #[inline]
    pub fn power(self, n: u32) -> Self {
        let mut power = if n & 1 == 1 { self } else { Self::NONE };
        let (mut left, mut doubled) = (n >> 1, self);
        while left > 0 {
            doubled = doubled.squared();
            if left & 1 == 1 {
                power = doubled.times(power);
            }
            left >>= 1;
        }
        power
    }

    /// The same rotation with w ≥ 0.
    #[inline]
    pub fn upright(self) -> Self {
        // Either sign is as likely: no branch.
        let sign = self.0[3] >> 63;
        Self(self.0.map(|c| (c ^ sign) - sign))
    }

    /// Nearly the rotation by the rotation vector twice `half`, rad of 2^30, at most half a radian in each component.
    #[inline]
    pub fn small([x, y, z]: [i64; 3]) -> Self {
        Self([x, y, z, ONE - ((x * x + y * y + z * z) >> (BITS + 1))])
    }

    /// Nearer to length 1, which it is not far from.
    #[inline]
    pub fn normalised(self) -> Self {
        let square = self.0.iter().map(|c| c * c).sum::<i64>() >> BITS;
        let factor = (3 * ONE - square) >> 1;
        Self(self.0.map(|c| (c * factor) >> BITS))
    }
}

/// The integer part of the square root; 0 for what is negative. At most 2^62.
#[inline]
pub fn isqrt(x: i64) -> i64 {
    let x = x.max(0);
    // Within 1 of it, by whatever floating point; what follows is exact.
    let root = (x as f64).sqrt() as i64;
    let root = root - i64::from(root * root > x);
    root + i64::from((root + 1) * (root + 1) <= x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The rotation by the rotation vector `v`, rad.
    fn rotation(v: [f64; 3]) -> Quaternion {
        let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
        let (sine, cosine) = (0.5 * angle).sin_cos();
        let [x, y, z] = v.map(|x| x / angle * sine);
        Quaternion([x, y, z, cosine].map(|c| (c * ONE as f64).round() as i64))
    }

    fn apart(a: Quaternion, b: Quaternion) -> i64 {
        a.0.iter().zip(b.0).map(|(a, b)| (a - b).abs()).max().unwrap_or(0)
    }

    proptest! {
        #[test]
        fn powers_are_repeated_products(v in prop::array::uniform3(-2.0f64..2.0), n in 0u32..=128) {
            let q = rotation(v);
            let product = (0..n).fold(Quaternion::NONE, |product, _| q.times(product));
            prop_assert!(apart(product, q.power(n)) < 2000);
            let turned = v.map(|x| x * f64::from(n));
            let (power, whole) = (q.power(n).upright(), rotation(turned).upright());
            prop_assert!(apart(power, whole).min(apart(power, Quaternion(whole.0.map(|c| -c)))) < 2000);
        }

        #[test]
        fn small_turns_are_rotations(v in prop::array::uniform3(-0.02f64..0.02)) {
            let half = v.map(|x| (0.5 * x * ONE as f64) as i64);
            prop_assert!(apart(Quaternion::small(half), rotation(v)) < 1000);
            prop_assert_eq!(rotation(v).times(rotation(v).conjugate()).0.map(|c| (c + 8) >> 4), [0, 0, 0, ONE >> 4]);
        }

        /// What a track adds up is a rotation to within 2^-20 after any miss, and nothing overflows on the way.
        #[test]
        fn corrections_keep_the_length(v in prop::array::uniform3(-2.0f64..2.0), half in prop::array::uniform3(-ONE / 2..=ONE / 2)) {
            let mut turn = rotation(v);
            for _ in 0..100 {
                turn = Quaternion::small(half).times(turn).normalised();
                prop_assert!(turn.0.iter().all(|c| c.abs() <= ONE + ONE / 8), "{turn:?}");
                let _ = turn.power(127);
            }
            for _ in 0..8 {
                turn = turn.normalised();
            }
            let square: i64 = turn.0.iter().map(|c| c * c).sum::<i64>() >> BITS;
            prop_assert!((square - ONE).abs() < ONE >> 20, "{square}");
        }

        #[test]
        fn the_root_is_exact(x in 0i64..=1 << 62) {
            prop_assert_eq!(isqrt(x), x.isqrt());
        }
    }

    #[test]
    fn roots_next_to_squares_are_exact() {
        for root in [0, 1, 2, 46_341, (1 << 30) - 1, 1 << 30, (1 << 31) - 1] {
            for x in [root * root - 1, root * root, root * root + 1].into_iter().filter(|&x| x >= 0) {
                assert_eq!(isqrt(x), x.isqrt(), "{x}");
            }
        }
        assert_eq!(isqrt(-1), 0);
    }
}
