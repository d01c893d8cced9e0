//! Alignment: turns of two frames against each other, held by a penalty whose stiffness the engine chooses. With the place
//! of a joint beside it, it makes a hinge (one direction that the frames have in common), a fixed joint or a slider
//! (three), or a universal joint (two directions at right angles).

use glam::{DMat3, DVec3};

use super::hold::{Hold, Joint, Memory, Scale};
use super::{FrameIndex, PairBlocks, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::{Frame, Twist};
use crate::error::{SimError, require};

/// Default of the largest tilt, rad: a millimetre at a metre.
pub(crate) const TILT: f64 = 1e-3;

/// `Err` unless a tilt is one that can be held.
pub(crate) fn require_tilt(tilt: f64) -> Result<(), SimError> {
    require((1e-6..=1.0).contains(&tilt), "tilt", tilt, "1e-6 to 1 rad")
}

/// A joint as its author described it, with what its ends have in common since it was added.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Captured<Desc, const N: usize> {
    pub desc: Desc,
    /// Pairs of unit vectors, in the frames of the first and the second end, that coincided.
    pub axes: [[DVec3; 2]; N],
}

/// N pairs of directions held together: ½ k |a − b|² for one, which leaves the turn about it free; half of the sum for
/// three, which is ½ k tilt² in the limit too.
#[derive(Clone, Debug)]
pub(crate) struct Alignment<const N: usize> {
    axes: [[DVec3; 2]; N],
    hold: Hold,
    /// Axis of a wheel at the start of the tick.
    wheel_axis: Option<DVec3>,
}

impl<const N: usize> Alignment<N> {
    const WEIGHT: f64 = if N == 1 { 1.0 } else { 0.5 };

    /// `axes` are unit vectors in both frames; `tilt` is the tolerance, rad.
    pub fn new(axes: [[DVec3; 2]; N], tilt: f64, scale: Scale, memory: Memory) -> Self {
        Self { axes, hold: Hold::new(scale, tilt, memory.turn_stiffening), wheel_axis: None }
    }

    /// The same for a direction about which one of the frames spins, `axis` at the start of the tick. Where that goes is a
    /// function of the turn across it alone (see `Node`), so there is no torque about it: the part about it that an
    /// unconverged plane's would have makes wheels spin away.
    pub fn of_wheel(self, axis: DVec3) -> Self {
        Self { wheel_axis: Some(axis), ..self }
    }

    fn directions<S: Scalar>(&self, at: [&Frame<S>; 2]) -> [[Vec3<S>; 2]; N] {
        self.axes.map(|[a, b]| [at[0].arm(a), at[1].arm(b)])
    }
}

/// A potential of the turn between two frames that holds it to a tolerance, rad.
pub(crate) trait Turns {
    /// Turn that should not be, rad.
    fn tilt(&self, at: [&Frame<f64>; 2]) -> f64;

    /// Energy, and its gradient with respect to turns of the second frame; the first has the opposite.
    fn evaluate<S: Scalar>(&self, at: [&Frame<S>; 2]) -> (S, Vec3<S>);

    /// Positive semidefinite second derivative, N m.
    fn stiffness(&self, at: [&Frame<f64>; 2]) -> DMat3;

    /// Its stiffness and tolerance.
    fn hold(&self) -> &Hold;

    /// To be stiffened.
    fn hold_mut(&mut self) -> &mut Hold;
}

impl<const N: usize> Turns for Alignment<N> {
    fn tilt(&self, at: [&Frame<f64>; 2]) -> f64 {
        let squared = |[a, b]: [Vec3<f64>; 2]| (a - b).dot(a - b);
        let chord = (Self::WEIGHT * self.directions(at).map(squared).iter().sum::<f64>()).sqrt();
        2.0 * (chord / 2.0).min(1.0).asin()
    }

    fn evaluate<S: Scalar>(&self, at: [&Frame<S>; 2]) -> (S, Vec3<S>) {
        let (mut energy, mut torque) = (S::ZERO, Vec3::ZERO);
        for [a, b] in self.directions(at) {
            energy += (a - b).dot(a - b);
            torque += a.cross(b);
        }
        if let Some(axis) = self.wheel_axis {
            torque = torque - Vec3::constant(axis).scale(torque.along(axis));
        }
        let stiffness = Self::WEIGHT * self.hold.stiffness;
        (energy * (0.5 * stiffness), torque * stiffness)
    }

    /// Exact where the directions coincide. What an angle between them adds is second order in it, but for a part that
    /// is not symmetric.
    fn stiffness(&self, at: [&Frame<f64>; 2]) -> DMat3 {
        let across = |[a, b]: [Vec3<f64>; 2]| {
            let middle = self.wheel_axis.unwrap_or_else(|| DVec3::from(a + b).normalize_or_zero());
            DMat3::IDENTITY - outer(middle, middle)
        };
        let sum = self.directions(at).map(across).into_iter().fold(DMat3::ZERO, |sum, k| sum + k);
        sum * (Self::WEIGHT * self.hold.stiffness)
    }

    fn hold(&self) -> &Hold {
        &self.hold
    }

    fn hold_mut(&mut self) -> &mut Hold {
        &mut self.hold
    }
}

/// A joint that holds its points by `place` and its turns by `turns`.
#[derive(Clone, Debug)]
pub(crate) struct Aligned<Place, T> {
    pub place: Place,
    pub turns: T,
}

impl<Place: Joint, T: Turns> Joint for Aligned<Place, T> {
    fn gap(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.place.gap(at)
    }

    fn tilt(&self, at: [&Frame<f64>; 2]) -> f64 {
        self.turns.tilt(at)
    }

    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool {
        self.place.is_open(at) || self.turns.hold().is_open(self.tilt(at))
    }

    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory {
        Memory { turn_stiffening: self.turns.hold().remember(self.tilt(at)), ..self.place.remember(at) }
    }
}

impl<Place: Joint, T: Turns> Term for Aligned<Place, T> {
    const BENDS: bool = Place::BENDS;

    fn frames(&self) -> [FrameIndex; 2] {
        self.place.frames()
    }

    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (energy, [a, b]) = self.place.evaluate(dt, at);
        let (turned, torque) = self.turns.evaluate(at);
        let wrenches = [Wrench { torque: a.torque - torque, ..a }, Wrench { torque: b.torque + torque, ..b }];
        (energy + turned, wrenches)
    }

    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let mut blocks = self.place.hessian(dt, at);
        blocks.add_rotation(self.turns.stiffness(at));
        blocks
    }

    fn relinearise(&mut self, dt: f64, at: [&Frame<f64>; 2]) {
        self.place.relinearise(dt, at);
    }

    fn propose(&mut self, step: [Twist; 2]) {
        self.place.propose(step);
    }

    fn stiffen(&mut self, dt: f64, at: [&Frame<f64>; 2]) -> bool {
        let tilt = self.tilt(at);
        // Both, whatever the first answers.
        self.place.stiffen(dt, at) | self.turns.hold_mut().stiffen(tilt)
    }
}
