//! Unit quaternions and rotation vectors in integers: the same bits on every machine.
//!
//! Components are of 2^30 (`ONE`). Products are exact in 64 bits and rounded down to 2^30 once.

/// 1.0.
pub const ONE: i64 = 1 << 30;
const BITS: u32 = 30;

/// x y z w, of 2^30.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quaternion(pub [i64; 4]);

impl Quaternion {
    /// The rotation backwards.
    pub fn conjugate(self) -> Self {
        let [x, y, z, w] = self.0;
        Self([-x, -y, -z, w])
    }

    /// First `other`, then this.
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
    fn squared(self) -> Self {
        let [x, y, z, w] = self.0;
        let [tx, ty, tz] = [x, y, z].map(|c| (2 * w * c) >> BITS);
        Self([tx, ty, tz, (w * w - x * x - y * y - z * z) >> BITS])
    }

    /// The rotation by the rotation vector `v`, rad of 2^24, each component at most 2^31 in size.
    pub fn exp(v: [i64; 3]) -> Self {
        // Half the angle, of 2^30: the vector part's direction.
        let mut h = v.map(|x| x << 5);
        let mut squarings = 0;
        // Below a quarter of a radian these terms suffice; it is at most 2^36, which takes eight halvings.
        while h.iter().any(|x| x.abs() > ONE >> 2) {
            h = h.map(|x| x >> 1);
            squarings += 1;
        }
        let square = h.iter().map(|x| x * x).sum::<i64>() >> BITS;
        let fourth = (square * square) >> BITS;
        let sixth = (fourth * square) >> BITS;
        let sine = ONE - square / 6 + fourth / 120 - sixth / 5040;
        let cosine = ONE - square / 2 + fourth / 24 - sixth / 720;
        let [x, y, z] = h.map(|x| (x * sine) >> BITS);
        (0..squarings).fold(Self([x, y, z, cosine]), |q, _| q.squared())
    }

    /// The rotation vector, rad of 2^24, of at most half a turn.
    pub fn log(self) -> [i64; 3] {
        let [mut x, mut y, mut z, mut w] = self.0;
        if w < 0 {
            [x, y, z, w] = [-x, -y, -z, -w];
        }
        // Halves the angle until its sine is below 1/4: the square root is (q + 1) normalised.
        let mut doublings = 0;
        while x * x + y * y + z * z > (ONE * ONE) >> 4 {
            let length = isqrt(2 * ONE * (ONE + w)).max(1);
            [x, y, z] = [x, y, z].map(|c| (c << BITS) / length);
            w = ((ONE + w) << BITS) / length;
            doublings += 1;
        }
        // asin(s) / s = 1 + s²/6 + 3 s⁴/40 + ...
        let square = (x * x + y * y + z * z) >> BITS;
        let fourth = (square * square) >> BITS;
        let factor = ONE + square / 6 + fourth * 3 / 40 + ((fourth * square) >> BITS) * 5 / 112;
        // Twice the half angle, from 2^30 to 2^24.
        [x, y, z].map(|c| ((c * factor) >> BITS) << doublings >> 5)
    }
}

/// The integer part of the square root; 0 for what is negative.
pub fn isqrt(x: i64) -> i64 {
    x.max(0).isqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn float(q: Quaternion) -> [f64; 4] {
        q.0.map(|x| x as f64 / ONE as f64)
    }

    proptest! {
        #[test]
        fn exp_is_the_exponential(v in prop::array::uniform3(-4.0f64..4.0)) {
            let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (s, c) = (0.5 * angle).sin_cos();
            let q = float(Quaternion::exp(v.map(|x| (x * f64::from(1 << 24)) as i64)));
            for i in 0..3 {
                prop_assert!((q[i] - v[i] / angle * s).abs() < 1e-6, "{v:?} {q:?}");
            }
            prop_assert!((q[3] - c).abs() < 1e-6);
        }

        #[test]
        fn log_undoes_exp(v in prop::array::uniform3(-1.7f64..1.7)) {
            let fixed = v.map(|x| (x * f64::from(1 << 24)) as i64);
            let back = Quaternion::exp(fixed).log();
            for i in 0..3 {
                prop_assert!((back[i] - fixed[i]).abs() < 200, "{fixed:?} {back:?}");
            }
        }

        #[test]
        fn nothing_overflows(v in prop::array::uniform3(-(1i64 << 31)..1 << 31)) {
            let q = Quaternion::exp(v);
            let norm: i64 = q.0.iter().map(|x| (x * x) >> BITS).sum();
            prop_assert!((norm - ONE).abs() < ONE >> 8, "{norm}");
            let _ = q.log();
        }
    }
}
