//! Entropy coding of one group: by how much it differs from what was expected.
//!
//! Owns the contexts. Every decision asks three models, one by how wrong the guesses for this group were of late, one by
//! what has already been seen of this body in this snapshot, one by how far the guesses are apart, and mixes them.

use super::model::{Bit, Mixer};
use super::predict::{GroupState, Prediction};
use super::quantise::{Group, Precision, Quantised};
use super::range_coder::Coder;
use crate::WireError;

const GROUPS: usize = 4;
const ERRORS: usize = 16;
const SPREADS: usize = 8;
const NEAR: usize = 8;
/// Decisions of a magnitude: is it 0, then one for each doubling; the last stands for all further ones.
const DECISIONS: usize = 12;

/// Where each kind of context starts in [`Models::bits`].
mod at {
    use super::{DECISIONS, ERRORS, GROUPS, NEAR, SPREADS};

    pub const STILL_BY_ERROR: usize = 0;
    pub const STILL_BY_HISTORY: usize = STILL_BY_ERROR + GROUPS * ERRORS;
    pub const STILL_BY_SPREAD: usize = STILL_BY_HISTORY + GROUPS * 24;
    pub const BY_ERROR: usize = STILL_BY_SPREAD + GROUPS * 24;
    pub const BY_NEAR: usize = BY_ERROR + GROUPS * 3 * ERRORS * DECISIONS;
    pub const BY_SPREAD: usize = BY_NEAR + GROUPS * NEAR * 4 * DECISIONS;
    pub const SIGN: usize = BY_SPREAD + GROUPS * 3 * SPREADS * DECISIONS;
    pub const HALF: usize = SIGN + GROUPS * 9;
    pub const LARGEST: usize = HALF + GROUPS * DECISIONS;
    pub const OTHER_LARGEST: usize = LARGEST + 16;
    pub const NUMBER: usize = OTHER_LARGEST + 2;
    pub const FLAG: usize = NUMBER + 8 * 32;
    pub const END: usize = FLAG + 8;
}

/// All adaptive state of a stream. It is part of every snapshot's frame: the models travel with the baseline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Models {
    bits: Vec<Bit>,
    /// For each group one whether it is still, then one for each decision of a magnitude.
    mixers: Vec<Mixer>,
}

/// What is known of the surroundings of a group before it is coded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surroundings {
    /// Size of the last group's residual in this body, steps; `None` for the first.
    pub sibling: Option<u32>,
    /// Size of the residuals of the body before, steps.
    pub neighbour: u32,
}

impl Models {
    /// Models that know nothing.
    pub fn new() -> Self {
        Self { bits: vec![Bit::NEW; at::END], mixers: vec![Mixer::NEW; GROUPS * (DECISIONS + 1)] }
    }

    /// Codes a flag; `use_`, below 8, chooses its model.
    pub fn flag(&mut self, coder: &mut impl Coder, use_: usize, flag: bool) -> bool {
        self.bits[at::FLAG + use_].code(coder, flag)
    }

    /// Codes a whole number: the bits of `n + 1`, their count in unary.
    pub fn number(&mut self, coder: &mut impl Coder, use_: usize, n: u32) -> u32 {
        let n = u64::from(n) + 1;
        let length = n.ilog2();
        let mut read = 0;
        while read < 31 && self.bits[at::NUMBER + 32 * use_ + read as usize].code(coder, length > read) {
            read += 1;
        }
        let low = coder.raw((n - (1 << length)) as u32, read);
        ((1u64 << read) + u64::from(low) - 1) as u32
    }

    /// Codes a signed number, in zigzag order: 0, −1, 1, −2.
    pub fn signed(&mut self, coder: &mut impl Coder, use_: usize, n: i32) -> i32 {
        let zigzag = self.number(coder, use_, (n << 1 ^ n >> 31) as u32);
        (zigzag >> 1) as i32 ^ -((zigzag & 1) as i32)
    }

    /// Codes the state of a group that is predicted from `base`; `value` is what an encoder has. Answers the state and
    /// the size of its residual.
    ///
    /// # Errors
    /// [`WireError::Content`] for a number that no state has.
    pub fn group(
        &mut self,
        coder: &mut impl Coder,
        base: &GroupState,
        prediction: &Prediction,
        around: &Surroundings,
        value: Option<&Quantised>,
        precision: &Precision,
    ) -> Result<(Quantised, u32), WireError> {
        let kind = base.value.group;
        let g = kind as usize;
        let mut expected = prediction.expected(None, precision);
        let spread = prediction.spread();
        let error = error_bucket(base.expected_error());
        let widest = spread_bucket(spread.into_iter().max().unwrap_or(0));
        let near = match around.sibling {
            None => 0,
            Some(size) => 1 + size_bucket(size).min(2),
        };

        let opinions = [
            at::STILL_BY_ERROR + g * ERRORS + error,
            at::STILL_BY_HISTORY + g * 24 + usize::from(base.fitted().min(5)) * 4 + near,
            at::STILL_BY_SPREAD + g * 24 + widest * 3 + size_bucket(around.neighbour).min(2),
        ];
        let still = value.is_none_or(|value| *value == expected);
        if self.mixers[g * (DECISIONS + 1)].code(coder, &mut self.bits, opinions, still) {
            return Ok((expected, 0));
        }

        if kind == Group::Rotation {
            let largest = self.largest(coder, &expected, value, precision);
            expected = prediction.expected(Some(largest), precision);
        }
        let direction = prediction.direction(&expected);
        let mut steps = [0; 3];
        let mut seen = 0;
        let count = kind.components();
        for i in 0..count {
            let residual = value.map_or(0, |value| value.steps[i] - expected.steps[i]);
            let place = Place { g, i, error, near, spread: spread_bucket(spread[i]), seen, sign: direction[i] };
            let coded = self.component(coder, &place, residual);
            steps[i] = expected.steps[i].saturating_add(coded);
            seen = coded.unsigned_abs().saturating_add(seen);
        }
        let value = Quantised { steps, ..expected };
        value.check(precision)?;
        Ok((value, seen))
    }

    /// Which component of a rotation is left out.
    fn largest(
        &mut self,
        coder: &mut impl Coder,
        expected: &Quantised,
        value: Option<&Quantised>,
        p: &Precision,
    ) -> u8 {
        let others = super::quantise::others(expected.largest.into());
        let second =
            (1..3).fold(0, |best, i| if expected.steps[i].abs() > expected.steps[best].abs() { i } else { best });
        let close = (expected.steps[second].unsigned_abs() * 20 / p.rotation).min(15) as usize;
        let largest = value.map_or(0, |value| value.largest);
        if self.bits[at::LARGEST + close].code(coder, largest == expected.largest) {
            return expected.largest;
        }
        if self.bits[at::OTHER_LARGEST].code(coder, usize::from(largest) == others[second]) {
            return others[second] as u8;
        }
        let rest = [others[(second + 1) % 3], others[(second + 2) % 3]];
        let choice = self.bits[at::OTHER_LARGEST + 1].code(coder, usize::from(largest) == rest[1]);
        rest[usize::from(choice)] as u8
    }

    /// One component's residual.
    fn component(&mut self, coder: &mut impl Coder, p: &Place, residual: i32) -> i32 {
        let near = (size_bucket(p.seen) + usize::from(p.i > 0)).min(NEAR - 1);
        let by_error = at::BY_ERROR + ((p.g * 3 + p.i) * ERRORS + p.error) * DECISIONS;
        let by_near = at::BY_NEAR + ((p.g * NEAR + near) * 4 + p.near) * DECISIONS;
        let by_spread = at::BY_SPREAD + ((p.g * 3 + p.i) * SPREADS + p.spread) * DECISIONS;
        let size = u64::from(residual.unsigned_abs());
        // 0 is 0; above, one more than the exponent.
        let class = if size == 0 { 0 } else { size.ilog2() + 1 };
        let mut read = 0;
        while read < 28 {
            let d = (read as usize).min(DECISIONS - 1);
            let opinions = [by_error + d, by_near + d, by_spread + d];
            if !self.mixers[p.g * (DECISIONS + 1) + 1 + d].code(coder, &mut self.bits, opinions, class > read) {
                break;
            }
            read += 1;
        }
        if read == 0 {
            return 0;
        }
        let mut size_read = 1u32;
        for i in (0..read - 1).rev() {
            let bit = size >> i & 1 == 1;
            let first = i + 2 == read;
            let bit = if first {
                self.bits[at::HALF + p.g * DECISIONS + (read as usize).min(DECISIONS - 1)].code(coder, bit)
            } else {
                coder.bit(bit, 1 << 15)
            };
            size_read = size_read << 1 | u32::from(bit);
        }
        let negative = self.bits[at::SIGN + (p.g * 3 + p.i) * 3 + (p.sign + 1) as usize].code(coder, residual < 0);
        if negative { -(size_read as i32) } else { size_read as i32 }
    }
}

impl Default for Models {
    fn default() -> Self {
        Self::new()
    }
}

/// Contexts of a component.
struct Place {
    g: usize,
    i: usize,
    error: usize,
    near: usize,
    spread: usize,
    seen: u32,
    sign: i32,
}

/// 16 buckets, two to an octave from a quarter of a step on.
fn error_bucket(error: u16) -> usize {
    let x = usize::from(error);
    let bucket = if x < 4 { x / 2 } else { (2 * x.ilog2() as usize + (x >> (x.ilog2() - 1) & 1)) - 2 };
    (bucket).min(ERRORS - 1)
}

/// 0, 1, 2, 3, 4..=5, 6..=8, ... in eight buckets.
fn spread_bucket(spread: u32) -> usize {
    match spread {
        0..=2 => spread as usize,
        3..=4 => 3,
        5..=8 => 4,
        9..=16 => 5,
        17..=40 => 6,
        _ => 7,
    }
}

/// 0, 1, 2, 3..=4, 5..=8, 9..=16, more.
fn size_bucket(size: u32) -> usize {
    match size {
        0..=2 => size as usize,
        3..=4 => 3,
        5..=8 => 4,
        9..=16 => 5,
        _ => 6,
    }
}
