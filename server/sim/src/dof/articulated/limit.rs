//! Limits: what keeps a joint within a range.
//!
//! Beyond the range a spring pushes back whose stiffness is the engine's, chosen such that the author's tolerance is
//! kept: by the inertia that the joint feels, by the speed with which it arrives, and, where something heavier leans on
//! it, by a second and much stiffer spring over the second half of the tolerance.

use glam::{DQuat, DVec3};

use super::joint::JointKind;
use super::turning::{Turning, differentiate};
use super::well::Well;
use crate::autodiff::{Scalar, Vec3};
use crate::error::{SimError, require, require_vector};

/// What a limit keeps of a joint. Axes are those at rest, in the parent's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LimitRange {
    /// A coordinate of a hinge, slider or universal joint stays within `lower` to `upper`, rad or m.
    Coordinate {
        /// Which: 0, or 1 for the second angle of a universal joint.
        index: u8,
        /// Least.
        lower: f64,
        /// Most.
        upper: f64,
    },
    /// An axis of a ball joint's part stays within an angle of where it is at rest: a cone.
    Swing {
        /// Of the cone.
        axis: DVec3,
        /// Half of the cone's opening, rad.
        upper: f64,
    },
    /// A ball joint's part turns about an axis of its own by no more than `lower` to `upper`, rad within ±π.
    Twist {
        /// It turns about.
        axis: DVec3,
        /// Least.
        lower: f64,
        /// Most.
        upper: f64,
    },
}

/// A limit of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimit {
    /// What it keeps.
    pub range: LimitRange,
    /// How far beyond the range the joint may be at the end of a tick, rad or m.
    pub tolerance: f64,
}

/// Stiffness of a limit that is reached slowly, in inertias per dt².
const STIFFNESS: f64 = 100.0;

/// Stiffness of one that is reached fast, at most, in the same unit.
const STIFFEST: f64 = 4e4;

/// How much stiffer the second half of the tolerance is.
const HARDENING: f64 = 1e3;

/// Most that a tick takes back of what is beyond the limit, in tolerances: a joint that was put there does not leap.
const RECOVERY: f64 = 10.0;

impl JointLimit {
    /// A limit of a hinge or slider with a tolerance of 0.01 rad or m.
    pub fn range(lower: f64, upper: f64) -> Self {
        Self { range: LimitRange::Coordinate { index: 0, lower, upper }, tolerance: 0.01 }
    }

    pub(super) fn validate(&self, kind: JointKind) -> Result<(), SimError> {
        require((1e-6..1.0).contains(&self.tolerance), "tolerance of the limit", self.tolerance, "1e-6 to below 1")?;
        let ordered = |lower: f64, upper: f64| {
            require(lower.abs() < 1e6, "lower bound of the limit", lower, "finite and below 1e6")?;
            require(upper >= lower && upper < 1e6, "upper bound of the limit", upper, "the lower bound or more")
        };
        let axis = |axis: DVec3| {
            require_vector(axis, "axis of the limit")?;
            require(axis.length() > 1e-9, "length of the limit's axis", axis.length(), "above 0")
        };
        let coordinates = match kind {
            JointKind::Hinge { .. } | JointKind::Slider { .. } => 1,
            JointKind::Universal { .. } => 2,
            JointKind::Fixed | JointKind::Ball | JointKind::Free => 0,
        };
        match self.range {
            LimitRange::Coordinate { index, lower, upper } if index < coordinates => ordered(lower, upper),
            LimitRange::Swing { axis: a, upper } if kind == JointKind::Ball => {
                require((0.01..3.13).contains(&upper), "angle of the swing limit", upper, "0.01 to 3.13 rad")?;
                axis(a)
            }
            LimitRange::Twist { axis: a, lower, upper } if kind == JointKind::Ball => {
                let within = lower > -3.13 && upper < 3.13;
                require(within, "bound of the twist limit", if lower > -3.13 { upper } else { lower }, "within ±3.13")?;
                ordered(lower, upper)?;
                axis(a)
            }
            _ => Err(SimError::Unusable { what: "the joint has no such coordinate to limit" }),
        }
    }

    /// The limit with an axis of length 1.
    pub(super) fn normalized(self) -> Self {
        let range = match self.range {
            LimitRange::Swing { axis, upper } => LimitRange::Swing { axis: axis.normalize(), upper },
            LimitRange::Twist { axis, lower, upper } => LimitRange::Twist { axis: axis.normalize(), lower, upper },
            range => range,
        };
        Self { range, ..self }
    }

    /// Adds the limit's potential for a joint that was at `q0` and is at `q1`.
    pub(super) fn add(&self, start: &Start, q0: &[f64], q1: &[f64], well: &mut Well) {
        match self.range {
            LimitRange::Coordinate { index, lower, upper } => {
                let (i, axis) = (usize::from(index), DVec3::AXES[usize::from(index)]);
                well.add_along(axis, self.wall(start, q0[i] - upper, q1[i] - upper));
                well.add_along(-axis, self.wall(start, lower - q0[i], lower - q1[i]));
            }
            LimitRange::Swing { axis, upper } => {
                let rotation = DQuat::from_slice(q0);
                let (before, ..) = swing(&Turning::new(rotation, Vec3::<f64>::ZERO), axis);
                let (now, gradient, bend) =
                    differentiate(start.turn, |turn| swing(&Turning::new(rotation, turn), axis));
                well.add_bent(self.wall(start, before - upper, now - upper), gradient, bend);
            }
            LimitRange::Twist { axis, lower, upper } => {
                let rotation = DQuat::from_slice(q0);
                let (before, ..) = twist(&Turning::new(rotation, Vec3::<f64>::ZERO), axis);
                let (now, gradient, bend) =
                    differentiate(start.turn, |turn| twist(&Turning::new(rotation, turn), axis));
                well.add_bent(self.wall(start, before - upper, now - upper), gradient, bend);
                well.add_bent(self.wall(start, lower - before, lower - now), -gradient, -bend);
            }
        }
    }

    /// Energy, slope and curvature at a depth beyond a bound.
    fn wall<S: Scalar>(&self, start: &Start, before: f64, now: S) -> [S; 3] {
        let depth = now - (before - RECOVERY * self.tolerance).max(0.0);
        if depth.below(f64::MIN_POSITIVE) {
            return [S::ZERO; 3];
        }
        let half = self.tolerance / 2.0;
        let stiffness =
            start.inertia / (start.dt * start.dt) * (start.speed * start.dt / half).clamp(STIFFNESS, STIFFEST);
        let soft = spring(depth, stiffness);
        if depth.below(half) {
            return soft;
        }
        let hard = spring(depth - half, HARDENING * stiffness);
        [soft[0] + hard[0], soft[1] + hard[1], soft[2] + hard[2]]
    }
}

/// What a limit knows of the start of the tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// s.
    pub dt: f64,
    /// What the joint feels, kg or kg m².
    pub inertia: f64,
    /// Of the joint's rates.
    pub speed: f64,
    /// Of a ball joint since the start, a rotation vector in the parent's axes.
    pub turn: DVec3,
}

fn spring<S: Scalar>(depth: S, stiffness: f64) -> [S; 3] {
    [depth * depth * (0.5 * stiffness), depth * stiffness, S::from(stiffness)]
}

/// How far an axis has swung, and the derivative with respect to the turn.
fn swing<S: Scalar>(rotation: &Turning<S>, axis: DVec3) -> (S, Vec3<S>) {
    let swung = rotation.apply(axis);
    let across = Vec3::constant(axis).cross(swung);
    let sine = across.length();
    // Straight ahead, or straight back, it swings about any axis.
    let direction =
        if sine.below(1e-9) { Vec3::constant(axis.any_orthonormal_vector()) } else { across.scale(S::ONE / sine) };
    (sine.atan2(swung.along(axis)), rotation.pull_back(direction))
}

/// Turn about an axis, within ±π, and the derivative with respect to the turn.
fn twist<S: Scalar>(rotation: &Turning<S>, axis: DVec3) -> (S, Vec3<S>) {
    let (v, w) = (rotation.v, rotation.w);
    let along = v.along(axis);
    let size = along * along + w * w;
    if size.below(1e-12) {
        // Swung by half a turn: there is no telling twist from swing.
        return (S::ZERO, Vec3::ZERO);
    }
    let axis = Vec3::constant(axis);
    let direction = ((axis.scale(w) + v.cross(axis)).scale(w) + v.scale(along)).scale(S::ONE / size);
    let sign = if w.below(0.0) { -1.0 } else { 1.0 };
    ((along * sign).atan2(w * sign) * 2.0, rotation.pull_back(direction))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::autodiff::Dual;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
    }

    fn variables(turn: DVec3) -> Vec3<Dual<3>> {
        let [x, y, z] = [0, 1, 2].map(|i| Dual::variable(turn[i], i));
        Vec3 { x, y, z }
    }

    proptest! {
        /// Slope and curvature of a limit, as written, are those by automatic differentiation and by differences.
        #[test]
        fn walls_derive(now in -0.1..0.1f64, before in -0.2..0.2f64, speed in 0.0..100.0f64) {
            let limit = JointLimit::range(0.0, 1.0);
            let start = Start { dt: 1.0 / 30.0, inertia: 2.0, speed, turn: DVec3::ZERO };
            let at = |now: f64| limit.wall(&start, before, Dual::<1>::variable(now, 0));
            let [energy, slope, curvature] = at(now);
            let largest = STIFFEST * HARDENING * start.inertia / (start.dt * start.dt);
            prop_assert!((energy.tangent[0] - slope.value).abs() <= 1e-12 * largest);
            prop_assert!((slope.tangent[0] - curvature.value).abs() <= 1e-12 * largest);
            let h = 1e-6;
            let (above, below) = (at(now + h), at(now - h));
            let kink = above[2].value != below[2].value;
            let difference = |i: usize| (above[i].value - below[i].value) / (2.0 * h);
            prop_assert!((difference(0) - slope.value).abs() <= 1e-6 * (curvature.value + above[2].value));
            prop_assert!(kink || (difference(1) - curvature.value).abs() <= 1e-6 * curvature.value);
        }
    }

    proptest! {
        /// The derivatives of swing and twist, as written, are those by automatic differentiation of their values, and by
        /// differences; and so are their second derivatives.
        #[test]
        fn swing_and_twist_derive(start in vector(), turn in vector(), axis in vector()) {
            prop_assume!(axis.length() > 0.1);
            let (start, axis) = (DQuat::from_scaled_axis(start * 1.5), axis.normalize());
            type Measure = fn(&Turning<Dual<3>>, DVec3) -> (Dual<3>, Vec3<Dual<3>>);
            for (name, measure) in [("swing", swing as Measure), ("twist", twist)] {
                let at = |turn: DVec3| measure(&Turning::new(start, variables(turn)), axis);
                let (value, gradient) = at(turn);
                // Off the kinks: straight ahead, straight back, and half a turn.
                prop_assume!(value.value.abs() > 1e-2 && value.value.abs() < 3.0 && gradient.value().length() < 20.0);
                let automatic = DVec3::from_array(value.tangent);
                prop_assert!((automatic - gradient.value()).length() < 1e-9, "{}: {} {}", name, automatic, gradient.value());
                let (_, _, bend) = differentiate(turn, |turn| measure(&Turning::new(start, turn), axis));
                for (i, axis) in DVec3::AXES.into_iter().enumerate() {
                    let h = 1e-6;
                    let (above, below) = (at(turn + axis * h), at(turn - axis * h));
                    let slope = (above.0.value - below.0.value) / (2.0 * h);
                    prop_assert!((slope - automatic[i]).abs() < 1e-6, "{}: {} {}", name, slope, automatic);
                    let column = (above.1.value() - below.1.value()) / (2.0 * h);
                    prop_assert!((column - bend.col(i)).length() < 1e-4, "{}: {} {}", name, column, bend.col(i));
                }
            }
        }
    }
}
