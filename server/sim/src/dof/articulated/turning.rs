//! A ball joint's rotation as a function of how it turns within a tick, over a scalar: limits and springs of ball joints
//! are true functions of the joint's rates, so that what they add to the system is symmetric.

use glam::{DMat3, DQuat, DVec3};

use crate::autodiff::{Dual, Scalar, Vec3};

/// A rotation that was `start` and turned by the rotation vector `turn` since.
pub(super) struct Turning<S> {
    turn: Vec3<S>,
    /// Real and imaginary part.
    pub w: S,
    pub v: Vec3<S>,
}

/// Squared angle below which series take the place of quotients, rad².
const SMALL: f64 = 1e-3;

impl<S: Scalar> Turning<S> {
    pub fn new(start: DQuat, turn: Vec3<S>) -> Self {
        let square = turn.dot(turn);
        let half = square / 4.0;
        // cos and sin x / x of half the angle.
        let (cosine, sinc) = if square.below(SMALL) {
            (
                series(half, [1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0]),
                series(half, [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0]),
            )
        } else {
            let angle = half.sqrt();
            (angle.cos(), angle.sin() / angle)
        };
        let (u, v0) = (turn.scale(sinc) * 0.5, start.xyz());
        let w = cosine * start.w - u.along(v0);
        let v = u * start.w + Vec3::constant(v0).scale(cosine) + u.cross(Vec3::constant(v0));
        Self { turn, w, v }
    }

    /// Where the rotation takes a vector.
    pub fn apply(&self, a: DVec3) -> Vec3<S> {
        let a = Vec3::constant(a);
        let across = self.v.cross(a) * 2.0;
        a + across.scale(self.w) + self.v.cross(across)
    }

    /// A derivative with respect to small turns of the rotation as it is, made one with respect to `turn`: the transposed
    /// left Jacobian of the exponential map times it.
    pub fn pull_back(&self, gradient: Vec3<S>) -> Vec3<S> {
        let square = self.turn.dot(self.turn);
        let (first, second) = if square.below(SMALL) {
            (
                series(square, [1.0 / 2.0, -1.0 / 24.0, 1.0 / 720.0, 0.0]),
                series(square, [1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0, 0.0]),
            )
        } else {
            let angle = square.sqrt();
            ((-angle.cos() + 1.0) / square, (angle - angle.sin()) / (square * angle))
        };
        let once = gradient.cross(self.turn);
        gradient + once.scale(first) + once.cross(self.turn).scale(second)
    }
}

fn series<S: Scalar>(x: S, [a, b, c, d]: [f64; 4]) -> S {
    ((x * d + c) * x + b) * x + a
}

/// Value, gradient and Hessian with respect to `turn` of a function that answers value and gradient.
pub(super) fn differentiate(
    turn: DVec3,
    function: impl Fn(Vec3<Dual<3>>) -> (Dual<3>, Vec3<Dual<3>>),
) -> (f64, DVec3, DMat3) {
    let [x, y, z] = [0, 1, 2].map(|i| Dual::variable(turn[i], i));
    let (value, gradient) = function(Vec3 { x, y, z });
    let rows = [gradient.x, gradient.y, gradient.z].map(|g| DVec3::from_array(g.tangent));
    (value.value, gradient.value(), DMat3::from_cols(rows[0], rows[1], rows[2]))
}
