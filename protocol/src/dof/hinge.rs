//! Rotations of what turns about an axis of its own: the tilt of that axis, and the angle about it.
//!
//! A wheel's rotation as its car sees it is a turn about the wheel's z, which hardly tilts. So a quaternion is taken apart
//! into the one about z and a tilt without any turn about z: `q = tilt · turn`. Two of the three numbers rest, and the third
//! goes round at a steady rate, which a line predicts as well as a track of quaternions, and for much less work.
//!
//! Floating point, outside of what both sides have to agree on.

/// Tilt and angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// x and y of the tilt's quaternion, whose z is 0 and w positive.
    pub tilt: [f64; 2],
    /// rad, −π to π.
    pub angle: f64,
}

/// Below the least w of a tilt, the root of a half but for rounding.
const LEAST_UPRIGHT: f64 = 0.5;

impl Hinge {
    /// The unit quaternion x y z w; `None` where the axis is tilted by more than a right angle, where the angle about it
    /// means little.
    pub fn of([x, y, z, w]: [f64; 4]) -> Option<Self> {
        let upright = z.hypot(w);
        let tilt = [(x * w - y * z) / upright, (x * z + y * w) / upright];
        // Either sign of a quaternion is the same rotation: its turn is at most half a one.
        let sign = if w < 0.0 { -1.0 } else { 1.0 };
        (upright * upright >= 0.5).then(|| Self { tilt, angle: 2.0 * (sign * z).atan2(sign * w) })
    }

    /// The unit quaternion x y z w.
    pub fn quaternion(&self) -> [f64; 4] {
        let ([x, y], upright) = (self.tilt, self.upright());
        let (sine, cosine) = (0.5 * self.angle).sin_cos();
        [x * cosine + y * sine, y * cosine - x * sine, upright * sine, upright * cosine]
    }

    /// Angular velocity in the axes of its world, where the tilt and the angle change by `tilt` and `angle` a second. Bounded
    /// for tilts that no rotation has, too.
    pub fn angular_velocity(&self, tilt: [f64; 2], angle: f64) -> [f64; 3] {
        let ([x, y], w) = (self.tilt, self.upright());
        let [dx, dy] = tilt;
        let dw = -(x * dx + y * dy) / w.max(LEAST_UPRIGHT);
        // Twice the tilt's derivative times its conjugate, and the turn about the axis as it is tilted.
        [
            2.0 * (dx * w - dw * x) + 2.0 * w * y * angle,
            2.0 * (dy * w - dw * y) - 2.0 * w * x * angle,
            2.0 * (dy * x - dx * y) + (1.0 - 2.0 * (x * x + y * y)) * angle,
        ]
    }

    /// w of the tilt's quaternion.
    fn upright(&self) -> f64 {
        let [x, y] = self.tilt;
        (1.0 - x * x - y * y).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    }

    fn apart(a: [f64; 4], b: [f64; 4]) -> f64 {
        let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        a.iter().zip(b).map(|(a, b)| (a - dot.signum() * b).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn rotations_come_back_unless_the_axis_is_tilted_too_far(raw in prop::array::uniform4(-1.0f64..1.0)) {
            let length = raw.iter().map(|x| x * x).sum::<f64>().sqrt();
            prop_assume!(length > 0.01);
            let q = raw.map(|x| x / length);
            // How far z points along z still.
            let upright = 1.0 - 2.0 * (q[0] * q[0] + q[1] * q[1]);
            prop_assume!(upright.abs() > 1e-9);
            let hinge = Hinge::of(q);
            prop_assert_eq!(hinge.is_some(), upright > 0.0);
            if let Some(hinge) = hinge {
                prop_assert!(apart(hinge.quaternion(), q) < 1e-12);
                prop_assert!(hinge.angle.abs() <= std::f64::consts::PI);
            }
        }

        #[test]
        fn the_angular_velocity_is_what_differences_say(
            tilt in prop::array::uniform2(-0.45f64..0.45),
            angle in -3.0f64..3.0,
            rates in prop::array::uniform3(-2.0f64..2.0),
        ) {
            let hinge = Hinge { tilt, angle };
            let [dx, dy, turn] = rates;
            let h = 1e-5;
            let later = Hinge { tilt: [tilt[0] + h * dx, tilt[1] + h * dy], angle: angle + h * turn };
            let before = Hinge { tilt: [tilt[0] - h * dx, tilt[1] - h * dy], angle: angle - h * turn };
            let [x, y, z, w] = before.quaternion();
            let by = product(later.quaternion(), [-x, -y, -z, w]);
            let velocity = hinge.angular_velocity([dx, dy], turn);
            for i in 0..3 {
                prop_assert!((velocity[i] - by[i] * by[3].signum() / h).abs() < 1e-6, "{velocity:?} and {by:?}");
            }
        }
    }
}
