//! Adaptive models: what probability the next bit has.
//!
//! A [`Bit`] counts one context. A [`Mixer`] joins the opinions of several in the logistic domain, after Matt Mahoney's
//! lpaq, with weights that learn. All arithmetic is on integers, so both sides agree to the last bit.

use super::range_coder::{Coder, Probability};

/// How fast a fresh model learns: the step of the n-th observation, of 2^16.
const STEP: [u16; 16] =
    [32768, 21845, 16384, 13107, 10923, 9362, 8192, 7282, 6554, 5958, 5461, 5041, 4681, 4369, 4096, 3277];
/// Probabilities stay this far from 0 and 1, of 2^16.
const EDGE: i32 = 24;

/// The probability of a 1 in one context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bit {
    p: u16,
    seen: u8,
}

impl Bit {
    /// Knows nothing yet.
    pub const NEW: Self = Self { p: 1 << 15, seen: 0 };

    fn learn(&mut self, bit: bool, limit: u8) {
        let target = if bit { 65536 - EDGE } else { EDGE };
        let step = i32::from(STEP[usize::from(self.seen)]);
        // The product takes 32 bits: the difference has 17 and the step 16.
        let learnt = (i64::from(target - i32::from(self.p)) * i64::from(step)) >> 16;
        self.p = (i32::from(self.p) + learnt as i32) as u16;
        self.seen = (self.seen + 1).min(limit);
    }

    /// Codes a bit by this context alone.
    pub fn code(&mut self, coder: &mut impl Coder, bit: bool) -> bool {
        let bit = coder.bit(bit, self.p);
        self.learn(bit, STEP.len() as u8 - 1);
        bit
    }
}

/// Opinions that a mixer joins.
pub const INPUTS: usize = 3;

/// Weights of [`INPUTS`] opinions, of 2^16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mixer {
    weights: [i32; INPUTS],
}

impl Mixer {
    /// All opinions count alike, and a little more than an average.
    pub const NEW: Self = Self { weights: [26_000; INPUTS] };

    /// Codes a bit by the joined opinion of `opinions`, which are indices of `bits`, and lets all learn.
    #[inline]
    pub fn code(&mut self, coder: &mut impl Coder, bits: &mut [Bit], opinions: [usize; INPUTS], bit: bool) -> bool {
        let stretched = opinions.map(|at| stretch(bits[at].p));
        let dot: i64 = (0..INPUTS).map(|i| i64::from(self.weights[i]) * i64::from(stretched[i])).sum();
        let p = squash((dot >> 16).clamp(-2047, 2047) as i32);
        let bit = coder.bit(bit, (p << 4) as Probability);
        let error = ((i32::from(bit) << 12) - p) * RATE;
        for (weight, st) in self.weights.iter_mut().zip(stretched) {
            *weight = (*weight + ((st * error + (1 << 9)) >> 10)).clamp(-(1 << 20), 1 << 20);
        }
        opinions.into_iter().for_each(|at| bits[at].learn(bit, STEP.len() as u8 - 1));
        bit
    }
}

/// How fast weights learn.
const RATE: i32 = 6;

/// 4096 / (1 + e^(−x/256)) for x = −2048, −1920, ..., 2048, within 1 to 4095.
const SQUASH: [i32; 33] = [
    1, 2, 3, 6, 10, 16, 27, 45, 73, 120, 194, 310, 488, 747, 1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785, 3901,
    3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094,
];

/// From the logistic domain, −2047 to 2047, to a probability of 4096.
const fn squash(x: i32) -> i32 {
    let (at, part) = (((x >> 7) + 16) as usize, x & 127);
    (SQUASH[at] * (128 - part) + SQUASH[at + 1] * part + 64) >> 7
}

/// The inverse of [`squash`]: the least x whose probability is not below.
static STRETCH: [i16; 4096] = {
    let mut table = [2047i16; 4096];
    let (mut x, mut p) = (-2047, 0);
    while x <= 2047 {
        let up_to = squash(x);
        while p <= up_to {
            table[p as usize] = x as i16;
            p += 1;
        }
        x += 1;
    }
    table
};

fn stretch(p: u16) -> i32 {
    i32::from(STRETCH[usize::from(p >> 4)])
}
