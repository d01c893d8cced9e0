//! State as integers: what the wire carries of Q and Q'.
//!
//! A slice is a row of [`Group`]s, each of one to three integers, in the order of its numbers. Quantisation knows
//! nothing of streams and baselines: a state has one set of integers, whoever receives it.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::hinge::Hinge;
use super::quaternion::{ONE, isqrt};
use crate::{WireError, codec::require};

/// What up to four numbers of a slice mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Group {
    /// Three coordinates of a point, m.
    Point = 0,
    /// A unit quaternion x y z w.
    Rotation = 1,
    /// One joint coordinate, m or rad.
    Scalar = 2,
    /// Three components of a velocity, m/s or rad/s.
    Rate = 3,
    /// A unit quaternion x y z w that is mostly a turn about its own z: how far that axis is tilted, and the angle about it.
    Hinge = 4,
}

impl Group {
    /// All groups, by their number on the wire.
    pub const ALL: [Self; 5] = [Self::Point, Self::Rotation, Self::Scalar, Self::Rate, Self::Hinge];

    /// Floating-point numbers that it stands for.
    pub fn numbers(self) -> usize {
        match self {
            Self::Point | Self::Rate => 3,
            Self::Rotation | Self::Hinge => 4,
            Self::Scalar => 1,
        }
    }

    /// Integers that it is coded as.
    pub fn components(self) -> usize {
        if self == Self::Scalar { 1 } else { 3 }
    }
}

/// How fine a stream is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Precision {
    /// Steps per m of points; 1 to 65536.
    pub point: u32,
    /// Steps per 1 of quaternion components; 64 to 8192. A step of 1/1000 is about 0.11 degrees. An angle about a hinge has
    /// the largest power of two of steps a turn that is no more than three times as many.
    pub rotation: u32,
    /// Steps per m or rad of joint coordinates; 1 to 65536.
    pub scalar: u32,
    /// Steps per m/s or rad/s; 1 to 65536.
    pub rate: u32,
}

impl Default for Precision {
    fn default() -> Self {
        Self { point: 1000, rotation: 1500, scalar: 1000, rate: 200 }
    }
}

impl Precision {
    pub(crate) fn check(&self) -> Result<(), WireError> {
        let fine = |steps| (1..=65_536).contains(&steps);
        require(fine(self.point) && fine(self.scalar) && fine(self.rate), "steps", "1 to 65536")?;
        require((64..=8192).contains(&self.rotation), "rotation steps", "64 to 8192")
    }

    /// How fine rotations are.
    pub(super) fn fineness(&self) -> Fineness {
        let steps = i64::from(self.rotation);
        let beyond_turn = i32::BITS - self.turn_bits();
        Fineness { steps, step: ONE / steps, square: steps.unsigned_abs().pow(2), beyond_turn }
    }

    /// Bits that count the steps of a turn about a hinge.
    fn turn_bits(&self) -> u32 {
        (3 * self.rotation).ilog2()
    }

    /// Steps per radian about a hinge.
    pub(super) fn hinge_steps(&self) -> f64 {
        f64::from(1u32 << self.turn_bits()) / TAU
    }

    pub(super) fn steps(&self, group: Group) -> f64 {
        f64::from(match group {
            Group::Point => self.point,
            Group::Rotation | Group::Hinge => self.rotation,
            Group::Scalar => self.scalar,
            Group::Rate => self.rate,
        })
    }
}

/// How fine rotations are, with what is worked out of it once for all.
#[derive(Clone, Copy, Debug)]
pub struct Fineness {
    /// Steps per 1 of a component.
    pub steps: i64,
    /// A step, of 2^30.
    pub step: i64,
    /// What squares of a rotation's steps add up to at most.
    square: u64,
    /// High bits of a hinge's angle that mean nothing: it comes round.
    beyond_turn: u32,
}

impl Fineness {
    /// High bits of the last component of a `group` that mean nothing.
    #[inline]
    pub fn beyond(&self, group: Group) -> u32 {
        if group == Group::Hinge { self.beyond_turn } else { 0 }
    }
}

/// Largest size of a quantised number, steps.
pub const STEPS_MAX: i32 = 1 << 26;

/// The integers of one group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantised {
    /// What they mean.
    pub group: Group,
    /// Of a rotation, the component that is left out because it is the largest: 0 to 3 for x y z w.
    pub largest: u8,
    /// Steps; of a rotation the three other components, the largest one being positive; of a hinge x and y of the tilt's
    /// quaternion, whose z is 0 and w positive, and the angle.
    pub steps: [i32; 3],
}

impl Quantised {
    /// The nearest steps to `numbers`, of which there are [`Group::numbers`]; what is not finite becomes 0.
    pub fn of(group: Group, numbers: &[f64], precision: &Precision) -> Self {
        let scale = precision.steps(group);
        let largest = 0;
        match group {
            Group::Rotation => Self::of_rotation(unit(numbers), scale),
            Group::Hinge => {
                let unit = unit(numbers);
                let hinge = Hinge::of(unit).map(|hinge| Self::of_hinge(hinge, precision));
                hinge.unwrap_or_else(|| Self::of_rotation(unit, scale))
            }
            Group::Scalar => Self { group, largest, steps: [step(numbers[0] * scale), 0, 0] },
            Group::Point | Group::Rate => Self { group, largest, steps: [0, 1, 2].map(|i| step(numbers[i] * scale)) },
        }
    }

    fn of_rotation(unit: [f64; 4], scale: f64) -> Self {
        let largest = (1..4).fold(0, |best, i| if unit[i].abs() > unit[best].abs() { i } else { best });
        let scale = scale * unit[largest].signum();
        let steps = others(largest).map(|i| step(unit[i] * scale));
        Self { group: Group::Rotation, largest: largest as u8, steps }
    }

    fn of_hinge(hinge: Hinge, precision: &Precision) -> Self {
        let [x, y] = hinge.tilt.map(|tilt| step(tilt * precision.steps(Group::Hinge)));
        let angle = step(hinge.angle * precision.hinge_steps());
        Self { group: Group::Hinge, largest: 0, steps: [x, y, within(angle, precision.fineness().beyond_turn)] }
    }

    /// Appends the numbers that the steps stand for.
    pub fn numbers(&self, precision: &Precision, out: &mut Vec<f64>) {
        let scale = precision.steps(self.group).recip();
        let parts = self.steps.map(|x| f64::from(x) * scale);
        match self.group {
            Group::Rotation => {
                let mut all = [0.0; 4];
                others(self.largest.into()).into_iter().zip(parts).for_each(|(i, x)| all[i] = x);
                let rest = 1.0 - parts.iter().map(|x| x * x).sum::<f64>();
                all[usize::from(self.largest)] = rest.max(0.0).sqrt();
                out.extend(unit(&all));
            }
            Group::Hinge => out.extend(unit(&self.hinge(precision).quaternion())),
            _ => out.extend_from_slice(&parts[..self.group.components()]),
        }
    }

    /// What the steps of a hinge stand for.
    pub(super) fn hinge(&self, precision: &Precision) -> Hinge {
        let [x, y, angle] = self.steps.map(f64::from);
        let scale = precision.steps(Group::Hinge);
        Hinge { tilt: [x / scale, y / scale], angle: angle / precision.hinge_steps() }
    }

    /// By how many steps it differs from `other`, of the same group and without the same component.
    #[inline]
    pub(super) fn minus(&self, other: &Self, fineness: &Fineness) -> [i32; 3] {
        let [a, b, c] = [0, 1, 2].map(|i| self.steps[i] - other.steps[i]);
        [a, b, within(c, fineness.beyond(self.group))]
    }

    /// # Errors
    /// [`WireError::Content`] for what no state has.
    #[inline]
    pub(super) fn check(&self, fineness: &Fineness) -> Result<(), WireError> {
        self.check_size()?;
        match self.group {
            Group::Rotation => {
                let square: u64 = self.steps.iter().map(|&s| u64::from(s.unsigned_abs()).pow(2)).sum();
                require(square <= fineness.square, "steps of a rotation", "at most a unit quaternion's")
            }
            Group::Hinge => {
                let angle = self.steps[2];
                require(angle == within(angle, fineness.beyond_turn), "angle of a hinge", "at most half a turn")
            }
            Group::Point | Group::Scalar | Group::Rate => Ok(()),
        }
    }

    /// # Errors
    /// [`WireError::Content`] for more steps than any state has.
    #[inline]
    pub(super) fn check_size(&self) -> Result<(), WireError> {
        let fits = self.steps.iter().all(|steps| (-STEPS_MAX..=STEPS_MAX).contains(steps));
        require(fits, "steps", "at most 2^26 in size")
    }

    /// The rotation's components of 2^30; see [`ONE`].
    #[inline]
    pub(super) fn components(&self, fineness: &Fineness) -> [i64; 4] {
        let sent = self.steps.map(|steps| i64::from(steps) * fineness.step);
        let mut all = [0; 4];
        others(self.largest.into()).into_iter().zip(sent).for_each(|(i, x)| all[i] = x);
        all[usize::from(self.largest) % 4] = isqrt(ONE * ONE - sent.iter().map(|x| x * x).sum::<i64>());
        all
    }
}

/// The nearest step. Casts saturate, and make nothing of what is not a number.
fn step(x: f64) -> i32 {
    (x.round() as i32).clamp(-STEPS_MAX, STEPS_MAX)
}

/// `x` without its `beyond` highest bits, as a signed number.
#[inline]
pub(super) fn within(x: i32, beyond: u32) -> i32 {
    x << beyond >> beyond
}

/// The first four of `numbers` as a quaternion of length 1; no rotation where they have no direction.
fn unit(numbers: &[f64]) -> [f64; 4] {
    let q = [numbers[0], numbers[1], numbers[2], numbers[3]];
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length.is_normal() { q.map(|x| x / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

/// The three components of a quaternion that are sent where `largest` is not.
pub(super) fn others(largest: usize) -> [usize; 3] {
    [0, 1, 2].map(|i| i + usize::from(i >= largest))
}

/// Body `q` (position and quaternion) as `parent` sees it: what attached bodies are coded as.
pub fn relative(parent: &[f64], q: &[f64]) -> [f64; 7] {
    let back = conjugate(rotation(parent));
    let offset = [q[0] - parent[0], q[1] - parent[1], q[2] - parent[2]];
    join(rotate(back, offset), product(back, rotation(q)))
}

/// The inverse of [`relative`].
pub fn absolute(parent: &[f64], q: &[f64]) -> [f64; 7] {
    let turn = rotation(parent);
    let offset = rotate(turn, [q[0], q[1], q[2]]);
    join([parent[0] + offset[0], parent[1] + offset[1], parent[2] + offset[2]], product(turn, rotation(q)))
}

fn rotation(q: &[f64]) -> [f64; 4] {
    [q[3], q[4], q[5], q[6]]
}

fn conjugate([x, y, z, w]: [f64; 4]) -> [f64; 4] {
    [-x, -y, -z, w]
}

fn join(p: [f64; 3], r: [f64; 4]) -> [f64; 7] {
    [p[0], p[1], p[2], r[0], r[1], r[2], r[3]]
}

fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// `v` turned by `q`.
pub fn rotate(q: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [rx, ry, rz, _] = product(product(q, [x, y, z, 0.0]), conjugate(q));
    [rx, ry, rz]
}
