//! Entropy coding of one group: by how much it differs from what was expected.
//!
//! Owns the contexts. One symbol says of all components together whether they are off by 0, 1 or more steps; what is
//! likely is known from how wrong the guesses for this group were of late, and from the last group of its body. How much
//! more it is follows, and signs, which are as likely as not.

use super::ans::Coder;
use super::model::{Bit, Symbols};
use super::predict::{Ahead, GroupState, Line, Track, Turn};
use super::quantise::{Fineness, Group, Quantised, others};
use crate::{WireError, codec::require};

const GROUPS: usize = Group::ALL.len();
const ERRORS: usize = 16;
const FAR_ERRORS: usize = 24;
const NEAR: usize = 3;

/// Patterns of up to three components of 0, 1, or 2 and more steps each; the first of them counts 1, the second 3.
const PATTERNS: usize = 27;
/// Patterns of groups, by their kind.
const PATTERNS_OF: [usize; GROUPS] = [27, 27, 3, 27, 27];

/// What a pattern says.
#[derive(Clone, Copy)]
struct Pattern {
    /// 0, 1, or 2 and more steps, by component.
    sizes: [u32; 3],
    /// How many components are off: each of them has a sign.
    signs: u32,
    /// By how many bits the signs have to go left for that of a component to come to bit 31. Where it has none, whichever
    /// bit comes there: no steps are none either way.
    to_sign: [u32; 3],
}

/// By pattern.
static PATTERN: [Pattern; PATTERNS] = {
    let mut patterns = [Pattern { sizes: [0; 3], signs: 0, to_sign: [31; 3] }; PATTERNS];
    let mut i = 0;
    while i < 3 * PATTERNS {
        let (pattern, component) = (&mut patterns[i / 3], i % 3);
        let size = i / 3 / [1, 3, 9][component] % 3;
        pattern.sizes[component] = size as u32;
        pattern.to_sign[component] = 31 - pattern.signs;
        pattern.signs += (size > 0) as u32;
        i += 1;
    }
    patterns
};
/// A group's first symbol: a pattern, or, from [`PATTERNS`] on, which other component of a rotation is left out.
type First = Symbols<32, { GROUPS * ERRORS * NEAR }>;
/// How much more than 2 a component is off: below 8 as it is, then by the number of its bits.
type Rest = Symbols<16, { GROUPS * FAR_ERRORS }>;
/// Sizes that have a symbol of their own.
const OWN_SYMBOL: u32 = 8;
/// The symbol of all sizes that are larger than others have.
const FAR: usize = 15;

/// Contexts of [`Bit`]s.
mod at {
    pub const NUMBER: usize = 0;
    pub const FLAG: usize = NUMBER + 9 * 32;
    pub const CALM: usize = FLAG + 8;
    pub const END: usize = CALM + 3;
}

/// All adaptive state of a stream. It is part of every snapshot's frame: the models travel with the baseline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Models {
    first: First,
    rest: Rest,
    bits: [Bit; at::END],
}

/// What is known of a group that goes on, beside its state.
pub struct Next<'a> {
    /// Ticks since that.
    pub ahead: Ahead,
    /// 0 for a body's first group; 1 where the one before was as expected, 2 where it was not.
    pub near: usize,
    /// What an encoder has; `None` when decoding.
    pub value: Option<&'a Quantised>,
    /// How fine rotations are.
    pub fineness: &'a Fineness,
}

impl Models {
    /// Models that know nothing.
    pub fn new() -> Self {
        Self { first: First::NEW, rest: Rest::NEW, bits: [Bit::NEW; at::END] }
    }

    /// Codes a flag; `use_`, below 8, chooses its model.
    pub fn flag(&mut self, coder: &mut impl Coder, use_: usize, flag: bool) -> bool {
        self.bits[at::FLAG + use_].code(coder, flag)
    }

    /// Codes whether a calm body moves; `neighbour` is how much the one before did.
    pub fn stirs(&mut self, coder: &mut impl Coder, neighbour: u32, stirs: bool) -> bool {
        self.bits[at::CALM + size_bucket(neighbour)].code(coder, stirs)
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

    /// Codes a group that goes on from `state`. Answers the size of its residual, steps.
    ///
    /// # Errors
    /// [`WireError::Content`] for a number that no state has.
    #[inline(always)]
    pub fn group<C: Coder>(
        &mut self,
        coder: &mut C,
        state: &mut GroupState,
        next: &Next<'_>,
    ) -> Result<u32, WireError> {
        if state.value.group == Group::Rotation {
            return self.rotation(coder, state, next);
        }
        self.line(coder, state, next)
    }

    #[inline(never)]
    fn line<C: Coder>(&mut self, coder: &mut C, state: &mut GroupState, next: &Next<'_>) -> Result<u32, WireError> {
        let track = Line::of(state, next.ahead, next.fineness);
        let mut expected = track.expected(state);
        let error = error_bucket(state.expected_error());
        let pattern = self.first(coder, next, error, &expected);
        let mut size = 0;
        if pattern > 0 {
            size = self.residual(coder, next, error, pattern, &mut expected)?;
            track.bound(&mut expected)?;
        }
        state.follow(&track, expected);
        Ok(size)
    }

    /// The same of a rotation, whose first symbol may say that another component is left out.
    #[inline(never)]
    fn rotation<C: Coder>(&mut self, coder: &mut C, state: &mut GroupState, next: &Next<'_>) -> Result<u32, WireError> {
        let track = Turn::of(state, next.ahead, next.fineness);
        let mut expected = track.expected(state);
        let error = error_bucket(state.expected_error());
        let mut first = self.first(coder, next, error, &expected);
        if first >= PATTERNS {
            let others = others(expected.largest.into());
            require(first < PATTERNS + others.len(), "first symbol", "at most 29")?;
            expected = track.expected_without(others[first - PATTERNS], state);
            first = self.first(coder, next, error, &expected);
        }
        let mut size = 0;
        if first > 0 {
            size = self.residual(coder, next, error, first, &mut expected)?;
            expected.check(next.fineness)?;
        }
        state.follow(&track, expected);
        Ok(size)
    }

    /// Codes the first symbol of a group whose guess was wrong by `error` of late.
    #[inline]
    fn first<C: Coder>(&mut self, coder: &mut C, next: &Next<'_>, error: usize, expected: &Quantised) -> usize {
        let context = (expected.group as usize * ERRORS + error.min(ERRORS - 1)) * NEAR + next.near;
        let value = next.value.filter(|_| C::WRITES);
        self.first.code(coder, context, value.map_or(0, |value| first_symbol(expected, value, next.fineness)))
    }

    /// Adds to what was expected by how much it is off, by `pattern`: sizes, then signs. Answers the sum of sizes.
    #[inline(always)]
    fn residual<C: Coder>(
        &mut self,
        coder: &mut C,
        next: &Next<'_>,
        error: usize,
        pattern: usize,
        expected: &mut Quantised,
    ) -> Result<u32, WireError> {
        let kind = expected.group as usize;
        require(pattern < PATTERNS_OF[kind], "first symbol", "a pattern of the group's components")?;
        let context = kind * FAR_ERRORS + error.min(FAR_ERRORS - 1);
        let value = next.value.filter(|_| C::WRITES);
        let residual = value.map_or([0; 3], |value| value.minus(expected, next.fineness));
        let pattern = &PATTERN[pattern];
        let mut sizes = pattern.sizes;
        for (size, residual) in sizes.iter_mut().zip(residual) {
            if *size > 1 {
                *size = self.size(coder, context, residual.unsigned_abs());
            }
        }
        let sign = |i: usize| u32::from(residual[i] < 0 && sizes[i] > 0) << (31 - pattern.to_sign[i]);
        let signs = coder.few(sign(0) | sign(1) | sign(2), pattern.signs);
        for (i, step) in expected.steps.iter_mut().enumerate() {
            let sign = (signs << pattern.to_sign[i]) as i32 >> 31;
            *step += (sizes[i] as i32 ^ sign) - sign;
        }
        Ok(sizes.iter().sum())
    }

    /// Codes a size of at least 2.
    #[inline]
    fn size<C: Coder>(&mut self, coder: &mut C, context: usize, size: u32) -> u32 {
        let symbol = if C::WRITES { size_symbol(size) } else { 0 };
        let symbol = self.rest.code(coder, context, symbol);
        if symbol < OWN_SYMBOL as usize { symbol as u32 + 2 } else { far_size(coder, symbol, size) }
    }
}

/// The symbol of a size of at least 2.
fn size_symbol(size: u32) -> usize {
    let more = size.saturating_sub(2);
    let bits = far(size).ilog2() as usize;
    if more < OWN_SYMBOL { more as usize } else { (OWN_SYMBOL as usize - 1 + bits).min(FAR) }
}

/// What is coded of a size that has no symbol of its own: a number of at least 2.
fn far(size: u32) -> u32 {
    size.saturating_sub(2 + OWN_SYMBOL) + 2
}

/// Codes a size that has no symbol of its own.
#[inline(never)]
fn far_size(coder: &mut impl Coder, symbol: usize, size: u32) -> u32 {
    let far = far(size);
    let mut bits = (symbol + 1) as u32 - OWN_SYMBOL;
    if symbol == FAR {
        // Of at most 2^27 steps, which is more than two states can be apart.
        bits = coder.raw(far.ilog2(), 5).clamp(1, 27);
    }
    let low = coder.raw(far.wrapping_sub(1 << bits.min(far.ilog2())), bits);
    (1 << bits) + low + OWN_SYMBOL
}

impl Default for Models {
    fn default() -> Self {
        Self::new()
    }
}

/// What an encoder's `value` is in the first symbol.
fn first_symbol(expected: &Quantised, value: &Quantised, fineness: &Fineness) -> usize {
    if value.largest != expected.largest {
        let other = others(expected.largest.into()).into_iter().position(|other| other == usize::from(value.largest));
        return PATTERNS + other.unwrap_or(0);
    }
    let [a, b, c] = value.minus(expected, fineness).map(|steps| steps.unsigned_abs().min(2) as usize);
    a + 3 * b + 9 * c
}

/// Buckets, two to an octave from a quarter of a step on.
fn error_bucket(error: u16) -> usize {
    let halves = usize::from(error / 2);
    let octave = (halves | 2).ilog2();
    2 * octave as usize + (halves >> (octave - 1)) - 2
}

/// 0, 1, 2 and more.
fn size_bucket(size: u32) -> usize {
    size.min(2) as usize
}
