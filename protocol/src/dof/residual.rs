//! Entropy coding of one group: by how much it differs from what was expected.
//!
//! Owns the contexts. One symbol says of all components together whether they are off by 0, 1 or more steps; what is
//! likely is known from how wrong the guesses for this group were of late, and from the last group of its body. How much
//! more it is follows, and signs, which are as likely as not.

use super::ans::Coder;
use super::model::{Bit, Symbols};
use super::predict::{GroupState, Line, Track, Turn};
use super::quantise::{Fineness, Group, Quantised, others, within};
use crate::{WireError, codec::require};

const GROUPS: usize = Group::ALL.len();
const ERRORS: usize = 16;
const FAR_ERRORS: usize = 24;
const NEAR: usize = 3;

/// Patterns of up to three components of 0, 1, or 2 and more steps each; the first of them counts 1, the second 3.
const PATTERNS: usize = 27;
/// Patterns of groups, by their kind.
const PATTERNS_OF: [usize; GROUPS] = [27, 27, 3, 27, 27];
/// The classes of a pattern's components: 0, 1, or 2 and more steps.
const CLASSES: [[u32; 3]; PATTERNS] = {
    let mut classes = [[0; 3]; PATTERNS];
    let mut i = 0;
    while i < PATTERNS {
        classes[i] = [i as u32 % 3, i as u32 / 3 % 3, i as u32 / 9];
        i += 1;
    }
    classes
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
    pub ahead: i64,
    /// Size of the residual of its body's last group, steps; `None` for the first.
    pub sibling: Option<u32>,
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
    #[inline]
    pub fn group<C: Coder>(
        &mut self,
        coder: &mut C,
        state: &mut GroupState,
        next: &Next<'_>,
    ) -> Result<u32, WireError> {
        if state.value.group == Group::Rotation {
            return self.rotation(coder, state, next);
        }
        let track = Line::of(state, next.ahead);
        let mut expected = state.expected(&track, next.fineness);
        let pattern = self.first(coder, state, next, &expected);
        let size = self.residual(coder, state, next, pattern, &mut expected)?;
        state.follow(&track, expected, next.fineness);
        Ok(size)
    }

    /// The same of a rotation, whose first symbol may say that another component is left out.
    #[inline]
    fn rotation<C: Coder>(&mut self, coder: &mut C, state: &mut GroupState, next: &Next<'_>) -> Result<u32, WireError> {
        let track = Turn::of(state, next.ahead);
        let mut expected = state.expected(&track, next.fineness);
        let mut first = self.first(coder, state, next, &expected);
        if first >= PATTERNS {
            let others = others(expected.largest.into());
            require(first < PATTERNS + others.len(), "first symbol", "at most 29")?;
            expected = track.expected_without(others[first - PATTERNS], state, next.fineness);
            first = self.first(coder, state, next, &expected);
        }
        let size = self.residual(coder, state, next, first, &mut expected)?;
        state.follow(&track, expected, next.fineness);
        Ok(size)
    }

    #[inline]
    fn first<C: Coder>(&mut self, coder: &mut C, state: &GroupState, next: &Next<'_>, expected: &Quantised) -> usize {
        let error = error_bucket(state.expected_error()).min(ERRORS - 1);
        let near = next.sibling.map_or(0, |size| 1 + usize::from(size > 0));
        let context = (state.value.group as usize * ERRORS + error) * NEAR + near;
        self.first.code(coder, context, first_symbol(expected, next.value, next.fineness))
    }

    /// Adds to what was expected by how much it is off, by `pattern`: sizes, then signs. Answers the sum of sizes.
    #[inline]
    fn residual<C: Coder>(
        &mut self,
        coder: &mut C,
        state: &GroupState,
        next: &Next<'_>,
        pattern: usize,
        expected: &mut Quantised,
    ) -> Result<u32, WireError> {
        if pattern == 0 {
            return Ok(0);
        }
        let kind = expected.group as usize;
        require(pattern < PATTERNS_OF[kind], "first symbol", "a pattern of the group's components")?;
        let context = kind * FAR_ERRORS + error_bucket(state.expected_error()).min(FAR_ERRORS - 1);
        let residual = next.value.map_or([0; 3], |value| value.minus(expected, next.fineness));
        let mut sizes = CLASSES[pattern];
        for (size, residual) in sizes.iter_mut().zip(residual) {
            if *size > 1 {
                *size = self.size(coder, context, residual.unsigned_abs());
            }
        }
        let off = sizes.map(|size| u32::from(size > 0));
        let [a, b, c] = [0, 1, 2].map(|i| u32::from(residual[i] < 0) & off[i]);
        let mut signs = coder.few(a | (b | c << off[1]) << off[0], off[0] + off[1] + off[2]);
        for (i, step) in expected.steps.iter_mut().enumerate() {
            let size = sizes[i] as i32;
            *step += if signs & off[i] == 1 { -size } else { size };
            signs >>= off[i];
        }
        expected.steps[2] = within(expected.steps[2], next.fineness.beyond(expected.group));
        expected.check(next.fineness)?;
        Ok(sizes.iter().sum())
    }

    /// Codes a size of at least 2.
    fn size(&mut self, coder: &mut impl Coder, context: usize, size: u32) -> u32 {
        let more = size.saturating_sub(2);
        let far = more.saturating_sub(OWN_SYMBOL) + 2;
        let own = OWN_SYMBOL as usize;
        let symbol = if more < OWN_SYMBOL { more as usize } else { (own - 1 + far.ilog2() as usize).min(FAR) };
        let symbol = self.rest.code(coder, context, symbol);
        if symbol < own {
            return symbol as u32 + 2;
        }
        let mut bits = (symbol + 1 - own) as u32;
        if symbol == FAR {
            // Of at most 2^27 steps, which is more than two states can be apart.
            bits = coder.raw(far.ilog2(), 5).clamp(1, 27);
        }
        let low = coder.raw(far.wrapping_sub(1 << bits.min(far.ilog2())), bits);
        (1 << bits) + low + OWN_SYMBOL
    }
}

impl Default for Models {
    fn default() -> Self {
        Self::new()
    }
}

/// What an encoder's `value` is in the first symbol.
fn first_symbol(expected: &Quantised, value: Option<&Quantised>, fineness: &Fineness) -> usize {
    let Some(value) = value else { return 0 };
    if value.largest != expected.largest {
        let other = others(expected.largest.into()).into_iter().position(|other| other == usize::from(value.largest));
        return PATTERNS + other.unwrap_or(0);
    }
    let [a, b, c] = value.minus(expected, fineness).map(|steps| steps.unsigned_abs().min(2) as usize);
    a + 3 * b + 9 * c
}

/// Buckets, two to an octave from a quarter of a step on.
fn error_bucket(error: u16) -> usize {
    let x = usize::from(error);
    if x < 4 { x / 2 } else { (2 * x.ilog2() as usize + (x >> (x.ilog2() - 1) & 1)) - 2 }
}

/// 0, 1, 2 and more.
fn size_bucket(size: u32) -> usize {
    size.min(2) as usize
}
