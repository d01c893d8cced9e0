//! Limits: what keeps a distance, or a hinge's angle, within a range. Within it they do nothing; beyond it a penalty
//! grows from zero, whose stiffness the engine chooses.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};

use super::hold::{Hold, Joint, Memory, Scale, TOLERANCE, require_tolerance};
use super::{Anchor, FrameIndex, HingeId, PairBlocks, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::Frame;
use crate::error::{SimError, require, require_vector};

slotmap::new_key_type! {
    /// Handle of a distance limit.
    pub struct DistanceLimitId;
    /// Handle of an angle limit.
    pub struct AngleLimitId;
}

/// A limit of the distance between two points, to be added: a rope (at most), a stop (at least), or both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceLimitDesc {
    /// One end.
    pub a: Anchor,
    /// Other end.
    pub b: Anchor,
    /// m; 0 for none.
    pub at_least: f64,
    /// m; infinite for none.
    pub at_most: f64,
    /// How far beyond the range the distance may be at the end of a tick, m.
    pub tolerance: f64,
}

impl DistanceLimitDesc {
    /// A rope: no longer than `length`, m, to a millimetre.
    pub fn rope(a: Anchor, b: Anchor, length: f64) -> Self {
        Self { a, b, at_least: 0.0, at_most: length, tolerance: TOLERANCE }
    }

    /// A stop: no nearer than `distance`, m, to a millimetre.
    pub fn stop(a: Anchor, b: Anchor, distance: f64) -> Self {
        Self { a, b, at_least: distance, at_most: f64::INFINITY, tolerance: TOLERANCE }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require((0.0..1e9).contains(&self.at_least), "at_least", self.at_least, "0 to below 1e9 m")?;
        let above = self.at_most >= self.at_least.max(1e-6);
        if !above {
            let allowed = "at_least or more, and 1e-6 m or more";
            return Err(SimError::OutOfRange { what: "at_most", value: self.at_most, allowed });
        }
        require_tolerance(self.tolerance)
    }
}

/// A limit of a hinge's angle, to be added. It goes when the hinge goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleLimitDesc {
    /// The hinge; its angle was 0 when it was added.
    pub hinge: HingeId,
    /// Least angle, rad, above −2π.
    pub lower: f64,
    /// Largest angle, rad, less than a full turn above `lower`.
    pub upper: f64,
    /// How far beyond the range the angle may be at the end of a tick, rad.
    pub tolerance: f64,
}

impl AngleLimitDesc {
    /// A limit that is held to a milliradian.
    pub fn new(hinge: HingeId, lower: f64, upper: f64) -> Self {
        Self { hinge, lower, upper, tolerance: TOLERANCE }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require(self.lower.abs() < TAU, "lower", self.lower, "within 2 π rad")?;
        let within = self.upper >= self.lower && self.upper - self.lower < TAU;
        require(within, "upper", self.upper, "lower to less than 2 π rad above it")?;
        require((1e-6..=1.0).contains(&self.tolerance), "tolerance", self.tolerance, "1e-6 to 1 rad")
    }
}

/// How far `value` is beyond `lower` to `upper`, with its sign.
pub(super) fn excess<S: Scalar>(value: S, [lower, upper]: [f64; 2]) -> S {
    if value.below(lower) {
        value - lower
    } else if value.below(upper) {
        S::ZERO
    } else {
        value - upper
    }
}

/// Angle of a hinge, the second end against the first, −π to π rad, given its axis and zero direction in both frames.
pub(crate) fn hinge_angle([[axis, _], [zero_a, zero_b]]: [[DVec3; 2]; 2], at: [&Frame<f64>; 2]) -> f64 {
    Angle { zero: [zero_a, axis.cross(zero_a)], turned: zero_b }.measure(at).0
}

/// An angle about an axis of the first frame.
#[derive(Clone, Copy, Debug)]
struct Angle {
    /// In the first frame: the direction of angle 0, and that of a right angle.
    zero: [DVec3; 2],
    /// In the second frame: the direction whose angle it is.
    turned: DVec3,
}

impl Angle {
    /// The angle, rad, and its gradient with respect to turns of the second frame; the first has the opposite.
    fn measure<S: Scalar>(&self, [a, b]: [&Frame<S>; 2]) -> (S, Vec3<S>) {
        let ([x, y], turned) = (self.zero.map(|zero| a.arm(zero)), b.arm(self.turned));
        let (cosine, sine) = (x.dot(turned), y.dot(turned));
        let square = cosine * cosine + sine * sine;
        if square.value() == 0.0 {
            return (S::ZERO, Vec3::ZERO);
        }
        (sine.atan2(cosine), turned.cross(y.scale(cosine) - x.scale(sine)).scale(S::ONE / square))
    }
}

/// An angle limit in an island: energy ½ k excess².
#[derive(Clone, Debug)]
pub(crate) struct AngleLimitTerm {
    frames: [FrameIndex; 2],
    /// From the middle of the range.
    angle: Angle,
    /// Largest angle to both sides, rad.
    half: f64,
    hold: Hold,
}

impl AngleLimitTerm {
    /// `axes` are the hinge's axis and its zero direction, in both frames.
    pub fn new(
        frames: [FrameIndex; 2],
        [[axis, _], [zero_a, zero_b]]: [[DVec3; 2]; 2],
        desc: &AngleLimitDesc,
        scale: Scale,
        memory: Memory,
    ) -> Self {
        let middle = DQuat::from_axis_angle(axis, (desc.lower + desc.upper) / 2.0) * zero_a;
        let angle = Angle { zero: [middle, axis.cross(middle)], turned: zero_b };
        // Beyond half a turn the far side is nearer.
        let half = ((desc.upper - desc.lower) / 2.0).min(PI);
        Self { frames, angle, half, hold: Hold::new(scale, desc.tolerance, memory.turn_stiffening) }
    }

    fn excess<S: Scalar>(&self, at: [&Frame<S>; 2]) -> (S, Vec3<S>) {
        let (angle, gradient) = self.angle.measure(at);
        (excess(angle, [-self.half, self.half]), gradient)
    }
}

impl Joint for AngleLimitTerm {
    fn gap(&self, _at: [&Frame<f64>; 2]) -> f64 {
        0.0
    }

    fn tilt(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.excess(at).0.abs()
    }

    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool {
        self.hold.is_open(self.tilt(at))
    }

    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory {
        Memory { turn_stiffening: self.hold.remember(self.tilt(at)), ..Memory::default() }
    }
}

impl Term for AngleLimitTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        self.frames
    }

    fn evaluate<S: Scalar>(&self, _dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (excess, gradient) = self.excess(at);
        let slope = excess * self.hold.stiffness;
        let torque = gradient.scale(slope);
        (excess * slope * 0.5, [Wrench { torque: -torque, ..Wrench::ZERO }, Wrench { torque, ..Wrench::ZERO }])
    }

    fn hessian(&self, _dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let (excess, gradient) = self.excess(at);
        let stiffness = if excess == 0.0 { 0.0 } else { self.hold.stiffness };
        let gradient = DVec3::from(gradient);
        let mut blocks = PairBlocks::of_points(DMat3::ZERO, DVec3::ZERO, DVec3::ZERO);
        blocks.add_rotation(outer(gradient, gradient) * stiffness);
        blocks
    }

    fn stiffen(&mut self, _dt: f64, at: [&Frame<f64>; 2]) -> bool {
        let tilt = self.tilt(at);
        self.hold.stiffen(tilt)
    }
}
