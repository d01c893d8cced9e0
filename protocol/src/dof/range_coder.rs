//! The binary arithmetic coder: bits with given probabilities as bytes, and back.
//!
//! Carryless, after Ilya Muravyov's fpaq: an interval `lo..=hi` of 32 bits is cut in proportion to the probability, and
//! leading bytes that both ends share are shifted out. The end of the data reads as zeros, so trailing zeros are never
//! sent. [`Coder`] is one face for both directions: what walks the state is written once and cannot disagree.

/// A probability of a 1, of 2^16.
pub type Probability = u16;

/// Bytes that a decoder may read behind the end of its data before it counts as exhausted.
const READ_AHEAD: usize = 8;

/// One direction of the arithmetic coder.
pub trait Coder {
    /// Codes one bit whose probability of being 1 is `p` of 2^16. An encoder writes `bit` and answers it; a decoder
    /// ignores `bit` and answers what was written.
    fn bit(&mut self, bit: bool, p: Probability) -> bool;

    /// Whether a decoder has read far behind the end of its data: what it answers is made up.
    fn is_exhausted(&self) -> bool {
        false
    }

    /// Bytes that an encoder has written, but for those that later bits may still change.
    fn written(&self) -> usize {
        0
    }

    /// Codes the low `count` bits of `value`, at most 32, highest first, each as likely as not.
    fn raw(&mut self, value: u32, count: u32) -> u32 {
        (0..count).rev().fold(0, |read, i| read << 1 | u32::from(self.bit(value >> i & 1 == 1, 1 << 15)))
    }
}

/// Where the interval is cut: 1 lies at or below, 0 above.
fn cut(lo: u32, hi: u32, p: Probability) -> u32 {
    // A probability of 0 would leave nothing to a 1.
    let p = u64::from(p.max(1));
    lo + ((u64::from(hi - lo) * p) >> 16) as u32
}

/// Writes bits.
pub struct Encoder<'a> {
    lo: u32,
    hi: u32,
    start: usize,
    out: &'a mut Vec<u8>,
}

impl<'a> Encoder<'a> {
    /// Appends to `out`.
    pub fn new(out: &'a mut Vec<u8>) -> Self {
        Self { lo: 0, hi: u32::MAX, start: out.len(), out }
    }

    /// Writes what is needed to tell the last bits, which are the fewest bytes that do.
    pub fn finish(self) {
        // The number of the interval with the most zero bytes at its end.
        let short = [24, 16, 8].into_iter().find_map(|zeros| {
            let rounded = self.lo.checked_add((1u32 << zeros) - 1)? >> zeros << zeros;
            (rounded <= self.hi).then_some(rounded)
        });
        let mut last = if self.lo == 0 { 0 } else { short.unwrap_or(self.lo) };
        while last != 0 {
            self.out.push((last >> 24) as u8);
            last <<= 8;
        }
        while self.out.len() > self.start && self.out.last() == Some(&0) {
            self.out.pop();
        }
    }
}

impl Coder for Encoder<'_> {
    #[inline]
    fn bit(&mut self, bit: bool, p: Probability) -> bool {
        let at = cut(self.lo, self.hi, p);
        if bit {
            self.hi = at
        } else {
            self.lo = at + 1
        }
        while (self.lo ^ self.hi) >> 24 == 0 {
            self.out.push((self.lo >> 24) as u8);
            self.lo <<= 8;
            self.hi = self.hi << 8 | 0xff;
        }
        bit
    }

    fn written(&self) -> usize {
        self.out.len() - self.start
    }
}

/// Reads bits.
pub struct Decoder<'a> {
    lo: u32,
    hi: u32,
    code: u32,
    bytes: &'a [u8],
    read: usize,
}

impl<'a> Decoder<'a> {
    /// Reads `bytes`, all of them.
    pub fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { lo: 0, hi: u32::MAX, code: 0, bytes, read: 0 };
        (0..4).for_each(|_| decoder.shift());
        decoder
    }

    fn shift(&mut self) {
        self.code = self.code << 8 | u32::from(self.bytes.get(self.read).copied().unwrap_or(0));
        self.read += 1;
    }
}

impl Coder for Decoder<'_> {
    #[inline]
    fn bit(&mut self, _: bool, p: Probability) -> bool {
        let at = cut(self.lo, self.hi, p);
        let bit = self.code <= at;
        if bit {
            self.hi = at
        } else {
            self.lo = at + 1
        }
        while (self.lo ^ self.hi) >> 24 == 0 {
            self.shift();
            self.lo <<= 8;
            self.hi = self.hi << 8 | 0xff;
        }
        bit
    }

    fn is_exhausted(&self) -> bool {
        self.read > self.bytes.len() + READ_AHEAD
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_written_is_read(bits in prop::collection::vec((any::<bool>(), any::<u16>()), 0..2000)) {
            let mut bytes = vec![7];
            let mut encoder = Encoder::new(&mut bytes);
            for &(bit, p) in &bits {
                encoder.bit(bit, p);
            }
            encoder.finish();
            prop_assert_eq!(bytes[0], 7);
            let mut decoder = Decoder::new(&bytes[1..]);
            for &(bit, p) in &bits {
                prop_assert_eq!(decoder.bit(false, p), bit);
            }
            prop_assert!(!decoder.is_exhausted());
        }
    }

    #[test]
    fn likely_bits_cost_next_to_nothing_and_the_end_is_noticed() {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes);
        for _ in 0..10_000 {
            encoder.bit(false, 16);
        }
        encoder.finish();
        assert!(bytes.len() <= 1, "{} bytes", bytes.len());
        let mut decoder = Decoder::new(&bytes);
        for _ in 0..20 {
            decoder.raw(0, 32);
        }
        assert!(decoder.is_exhausted());
    }
}
