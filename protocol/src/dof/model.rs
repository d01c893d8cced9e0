//! Adaptive models: what probability the next choice has.
//!
//! A [`Bit`] counts one context of yes and no, [`Symbols`] one of a small alphabet, as bounds that move towards what was
//! seen. All arithmetic is on integers, of [`Symbols`] as many side by side as a processor has lanes, and both sides agree
//! to the last bit.

use super::ans::{Coder, WHOLE};

/// How fast a fresh bit learns: the step of the n-th observation, of 2^16.
const STEP: [u16; 16] =
    [32768, 21845, 16384, 13107, 10923, 9362, 8192, 7282, 6554, 5958, 5461, 5041, 4681, 4369, 4096, 3277];
/// Probabilities of a bit stay this far from 0 and 1, of 2^16.
const EDGE: i32 = 24;

/// The probability of a 1 in one context, of 2^16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bit {
    p: u16,
    seen: u8,
}

impl Bit {
    /// Knows nothing yet.
    pub const NEW: Self = Self { p: 1 << 15, seen: 0 };

    /// Codes a bit in this context.
    pub fn code(&mut self, coder: &mut impl Coder, bit: bool) -> bool {
        let bit = coder.bit(bit, u32::from(self.p >> 1).max(1));
        let target = if bit { 65536 - EDGE } else { EDGE };
        // The product takes 33 bits: the difference has 17 and the step 16.
        let learnt = (i64::from(target - i32::from(self.p)) * i64::from(STEP[usize::from(self.seen)])) >> 16;
        self.p = (i32::from(self.p) + learnt as i32) as u16;
        self.seen = (self.seen + 1).min(STEP.len() as u8 - 1);
        bit
    }
}

/// Probabilities of `N` symbols in each of `K` contexts: where each symbol ends, of 2^15. The last one ends with the whole,
/// for which the largest number of 16 bits stands.
#[derive(Clone, Debug, PartialEq, Eq)]
#[repr(align(64))]
pub struct Symbols<const N: usize, const K: usize> {
    bounds: [[i16; N]; K],
    /// How often each context was used, as far as that matters.
    seen: [u8; K],
}

/// What no symbol's probability falls below but for rounding, of 2^15.
const FLOOR: usize = 1;
/// How slowly a context learns that was used so often: it takes over 2^-n of what it sees.
const SLOWNESS: [u8; 32] =
    [1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 6];

impl<const N: usize, const K: usize> Symbols<N, K> {
    /// All symbols alike.
    pub const NEW: Self = {
        let mut bounds = [i16::MAX; N];
        let mut i = 0;
        while i < N - 1 {
            bounds[i] = (WHOLE as usize * (i + 1) / N) as i16;
            i += 1;
        }
        Self { bounds: [bounds; K], seen: [0; K] }
    };

    /// Where the bounds go when a symbol is seen, by symbol.
    const TARGETS: [[i16; N]; N] = {
        let mut targets = [[i16::MAX; N]; N];
        let mut at = 0;
        while at < N * (N - 1) {
            let (symbol, i) = (at / (N - 1), at % (N - 1));
            let bound = if i < symbol { FLOOR * (i + 1) } else { WHOLE as usize - FLOOR * (N - 1 - i) };
            targets[symbol][i] = bound as i16;
            at += 1;
        }
        targets
    };

    /// Codes a symbol in a context.
    #[inline]
    pub fn code(&mut self, coder: &mut impl Coder, context: usize, symbol: usize) -> usize {
        let (bounds, seen) = (&mut self.bounds[context], &mut self.seen[context]);
        let symbol = coder.symbol(symbol, bounds);
        let slowness = SLOWNESS[usize::from(*seen)] & 15;
        for (bound, target) in bounds.iter_mut().zip(&Self::TARGETS[symbol]) {
            *bound += (target - *bound) >> slowness;
        }
        *seen = (*seen + 1).min(SLOWNESS.len() as u8 - 1);
        symbol
    }
}
