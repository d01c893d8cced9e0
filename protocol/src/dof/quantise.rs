//! State as integers: what the wire carries of Q and Q'.
//!
//! A slice is a row of [`Group`]s, each of one to three integers, in the order of its numbers. Quantisation knows
//! nothing of streams and baselines: a state has one set of integers, whoever receives it.

use serde::{Deserialize, Serialize};

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
}

impl Group {
    /// All groups, by their number on the wire.
    pub const ALL: [Self; 4] = [Self::Point, Self::Rotation, Self::Scalar, Self::Rate];

    /// Floating-point numbers that it stands for.
    pub fn numbers(self) -> usize {
        match self {
            Self::Point | Self::Rate => 3,
            Self::Rotation => 4,
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
    /// Steps per 1 of quaternion components; 64 to 8192. A step of 1/1000 is about 0.11 degrees.
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
        Fineness { steps, step: ONE / steps, square: steps.unsigned_abs().pow(2) }
    }

    pub(super) fn steps(&self, group: Group) -> f64 {
        f64::from(match group {
            Group::Point => self.point,
            Group::Rotation => self.rotation,
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
    /// Steps; of a rotation the three other components, the largest one being positive.
    pub steps: [i32; 3],
}

impl Quantised {
    /// The nearest steps to `numbers`, of which there are [`Group::numbers`]; what is not finite becomes 0.
    pub fn of(group: Group, numbers: &[f64], precision: &Precision) -> Self {
        let scale = precision.steps(group);
        // Casts saturate, and make nothing of what is not a number.
        let step = |x: f64| ((x * scale).round() as i32).clamp(-STEPS_MAX, STEPS_MAX);
        let mut steps = [0; 3];
        let mut largest = 0;
        if group == Group::Rotation {
            let unit = unit([numbers[0], numbers[1], numbers[2], numbers[3]]);
            largest = (1..4).fold(0, |best, i| if unit[i].abs() > unit[best].abs() { i } else { best });
            let sign = unit[largest].signum();
            steps = others(largest).map(|i| step(sign * unit[i]));
        } else {
            steps.iter_mut().zip(numbers).for_each(|(to, &x)| *to = step(x));
        }
        Self { group, largest: largest as u8, steps }
    }

    /// Appends the numbers that the steps stand for.
    pub fn numbers(&self, precision: &Precision, out: &mut Vec<f64>) {
        let scale = precision.steps(self.group).recip();
        let parts = self.steps.map(|x| f64::from(x) * scale);
        if self.group != Group::Rotation {
            out.extend_from_slice(&parts[..self.group.components()]);
            return;
        }
        let mut all = [0.0; 4];
        others(self.largest.into()).into_iter().zip(parts).for_each(|(i, x)| all[i] = x);
        let rest = 1.0 - parts.iter().map(|x| x * x).sum::<f64>();
        all[usize::from(self.largest)] = rest.max(0.0).sqrt();
        out.extend(unit(all));
    }

    /// # Errors
    /// [`WireError::Content`] for what no state has.
    #[inline]
    pub(super) fn check(&self, fineness: &Fineness) -> Result<(), WireError> {
        require(self.steps.iter().all(|s| s.unsigned_abs() <= STEPS_MAX as u32), "steps", "at most 2^26 in size")?;
        let square: u64 = self.steps.iter().map(|&s| u64::from(s.unsigned_abs()).pow(2)).sum();
        let is_unit = self.group != Group::Rotation || square <= fineness.square;
        require(is_unit, "steps of a rotation", "at most a unit quaternion's")
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

/// `q` of length 1; no rotation where it has no direction.
fn unit(q: [f64; 4]) -> [f64; 4] {
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
