//! Adaptive models: what probability the next choice has.
//!
//! A [`Bit`] counts one context of yes and no, [`Symbols`] one of a small alphabet, as starts that move towards what was
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
    #[inline]
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

/// Probabilities of `N` symbols in each of `K` contexts: where each symbol starts, of 2^15; the first one at 0.
#[derive(Clone, Debug, PartialEq, Eq)]
#[repr(align(64))]
pub struct Symbols<const N: usize, const K: usize> {
    starts: [[i16; N]; K],
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
        let mut starts = [0; N];
        let mut i = 0;
        while i < N {
            starts[i] = (WHOLE as usize * i / N) as i16;
            i += 1;
        }
        Self { starts: [starts; K], seen: [0; K] }
    };

    /// Where the starts go when a symbol is seen, by symbol.
    const TARGETS: [[i16; N]; N] = {
        let mut targets = [[0; N]; N];
        let mut at = 0;
        while at < N * N {
            let (symbol, i) = (at / N, at % N);
            let start = if i <= symbol { FLOOR * i } else { WHOLE as usize - FLOOR * (N - i) };
            targets[symbol][i] = start as i16;
            at += 1;
        }
        targets
    };

    /// Codes a symbol in a context.
    #[inline]
    pub fn code(&mut self, coder: &mut impl Coder, context: usize, symbol: usize) -> usize {
        let (starts, seen) = (&mut self.starts[context], &mut self.seen[context]);
        let symbol = coder.symbol(symbol, starts);
        let slowness = SLOWNESS[usize::from(*seen) % SLOWNESS.len()] & 15;
        for (start, target) in starts.iter_mut().zip(&Self::TARGETS[symbol]) {
            *start += (target - *start) >> slowness;
        }
        *seen += u8::from(usize::from(*seen) < SLOWNESS.len() - 1);
        symbol
    }
}
