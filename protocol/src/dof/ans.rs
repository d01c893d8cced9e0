//! The entropy coder: choices of known probability as bytes, and back.
//!
//! Range asymmetric numeral systems, after Jarek Duda: one number of 64 bits holds all choices that are still to be read.
//! Reading one is a multiplication and no division. What is written first must be read first, so an encoder keeps all
//! choices and works them into the number from the last to the first; it begins with 0, and a decoder must end with it.
//! [`Coder`] is one face for both directions: what walks the state is written once and cannot disagree.

/// Probabilities are of 2^15.
pub const BITS: u32 = 15;
/// All of it.
pub const WHOLE: u32 = 1 << BITS;
/// A decoder whose number is below this reads four more bytes, where there are any.
const LEAST: u64 = 1 << 32;

/// One direction of the entropy coder.
pub trait Coder {
    /// Whether it is an encoder, which has to be told what to write.
    const WRITES: bool;

    /// Codes one of `N` symbols, a power of two; symbol i has what lies from `starts[i]`, 0 for the first, to
    /// `starts[i + 1]`, the [`WHOLE`] for the last. An encoder writes `symbol` and answers it; a decoder ignores `symbol`
    /// and answers what was written.
    fn symbol<const N: usize>(&mut self, symbol: usize, starts: &[i16; N]) -> usize;

    /// Codes one bit whose probability of being 1 is `p`, more than 0 and less than [`WHOLE`].
    fn bit(&mut self, bit: bool, p: u32) -> bool;

    /// Codes the low `count` bits of `value`, at most [`FEW`], each as likely as not.
    fn few(&mut self, value: u32, count: u32) -> u32;

    /// The same of at most 32 bits: the high [`FEW`] first, then the others.
    #[inline]
    fn raw(&mut self, value: u32, count: u32) -> u32 {
        if (1..=FEW).contains(&count) { self.few(value, count) } else { self.many(value, count) }
    }

    /// None, or any number of them.
    #[inline(never)]
    fn many(&mut self, value: u32, count: u32) -> u32 {
        let (mut read, mut left) = (0, count);
        while left > 0 {
            let part = left.min(FEW);
            left -= part;
            read = read << part | self.few(value >> left, part);
        }
        read
    }

    /// Whether a decoder has read everything, and nothing else: false for data that no encoder writes.
    fn is_finished(&self) -> bool;

    /// Bytes that an encoder has written, about.
    fn written(&self) -> usize;
}

/// What a symbol has of the [`WHOLE`].
#[inline]
fn interval<const N: usize>(symbol: usize, starts: &[i16; N]) -> (u32, u32) {
    let start = starts[symbol] as u32;
    let end = starts.get(symbol + 1).map_or(WHOLE, |&end| end as u32);
    (start, end - start)
}

/// Bits that are coded at once at most.
pub const FEW: u32 = 14;

/// Writes choices.
pub struct Encoder<'a> {
    /// Start and width of each, in order.
    choices: &'a mut Vec<(u16, u16)>,
    /// Bits that they take, and what is left over, of 2^32.
    bits: usize,
    part: u64,
}

impl<'a> Encoder<'a> {
    /// Takes `choices` as memory.
    pub fn new(choices: &'a mut Vec<(u16, u16)>) -> Self {
        choices.clear();
        Self { choices, bits: 0, part: 1 << 32 }
    }

    #[inline]
    fn choose(&mut self, (start, width): (u32, u32)) {
        // Widths are below the whole: nothing that is certain is coded.
        self.choices.push((start as u16, width as u16));
        self.part = (self.part * u64::from(width)) >> BITS;
        let lost = self.part.leading_zeros().saturating_sub(31);
        self.part <<= lost;
        self.bits += lost as usize;
    }

    /// Appends the bytes: the number without its leading zeros, then words of four bytes, big end first.
    pub fn finish(self, out: &mut Vec<u8>) {
        let mut state = 0u64;
        let mut words = Vec::with_capacity(self.bits / 32 + 1);
        for &(start, width) in self.choices.iter().rev() {
            let width = u64::from(width);
            if state >> 49 >= width {
                words.push(state as u32);
                state >>= 32;
            }
            state = ((state / width) << BITS) + state % width + u64::from(start);
        }
        let zeros = state.leading_zeros() as usize / 8;
        out.extend_from_slice(&state.to_be_bytes()[zeros..]);
        words.iter().rev().for_each(|word| out.extend_from_slice(&word.to_be_bytes()));
    }
}

impl Coder for Encoder<'_> {
    const WRITES: bool = true;

    #[inline]
    fn symbol<const N: usize>(&mut self, symbol: usize, starts: &[i16; N]) -> usize {
        self.choose(interval(symbol, starts));
        symbol
    }

    #[inline]
    fn bit(&mut self, bit: bool, p: u32) -> bool {
        self.choose(if bit { (WHOLE - p, p) } else { (0, WHOLE - p) });
        bit
    }

    #[inline]
    fn few(&mut self, value: u32, count: u32) -> u32 {
        let bits = value & ((1 << count) - 1);
        self.choose((bits << (BITS - count), WHOLE >> count));
        bits
    }

    fn is_finished(&self) -> bool {
        true
    }

    fn written(&self) -> usize {
        self.bits / 8
    }
}

/// Reads choices.
pub struct Decoder<'a> {
    state: u64,
    words: &'a [u8],
}

impl<'a> Decoder<'a> {
    /// Reads `bytes`, all of them.
    pub fn new(bytes: &'a [u8]) -> Self {
        // The number has up to 8 bytes; more than 4 of them where words follow.
        let head = if bytes.len() <= 8 { bytes.len() } else { (bytes.len() - 1) % 4 + 5 };
        let (head, words) = bytes.split_at(head);
        Self { state: head.iter().fold(0, |state, &byte| state << 8 | u64::from(byte)), words }
    }

    #[inline]
    fn slot(&self) -> u32 {
        self.state as u32 & (WHOLE - 1)
    }

    #[inline]
    fn take(&mut self, (start, width): (u32, u32)) {
        self.state = u64::from(width) * (self.state >> BITS) + u64::from(self.slot() - start);
        self.refill();
    }

    #[inline]
    fn refill(&mut self) {
        if self.state < LEAST
            && let Some((word, rest)) = self.words.split_first_chunk()
        {
            self.state = self.state << 32 | u64::from(u32::from_be_bytes(*word));
            self.words = rest;
        }
    }
}

impl Coder for Decoder<'_> {
    const WRITES: bool = false;

    #[inline]
    fn symbol<const N: usize>(&mut self, _: usize, starts: &[i16; N]) -> usize {
        const { assert!(N.is_power_of_two()) };
        let slot = self.slot() as i16;
        // The first start is beyond no slot. To count those that are, all at once, is faster than to search; their signs
        // add up faster than what comparing answers.
        let beyond = starts.iter().fold(0i16, |sum, &start| sum - (slot.wrapping_sub(start) >> 15));
        let symbol = (N - 1).wrapping_sub(beyond as usize) % N;
        self.take(interval(symbol, starts));
        symbol
    }

    #[inline]
    fn bit(&mut self, _: bool, p: u32) -> bool {
        let bit = self.slot() >= WHOLE - p;
        self.take(if bit { (WHOLE - p, p) } else { (0, WHOLE - p) });
        bit
    }

    #[inline]
    fn few(&mut self, _: u32, count: u32) -> u32 {
        let (slot, rest) = (self.slot(), BITS - count);
        self.state = (self.state >> BITS << rest) + u64::from(slot & ((1 << rest) - 1));
        self.refill();
        slot >> rest
    }

    fn is_finished(&self) -> bool {
        self.state == 0 && self.words.is_empty()
    }

    fn written(&self) -> usize {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_written_is_read(
            bits in prop::collection::vec((any::<bool>(), 1u32..WHOLE, any::<u32>(), 0u32..=32, 0usize..4), 0..600),
        ) {
            let starts = [0, 1, 700, 32_000];
            let (mut choices, mut bytes) = (vec![(1, 1)], vec![7]);
            let mut encoder = Encoder::new(&mut choices);
            for &(bit, p, value, count, symbol) in &bits {
                encoder.bit(bit, p);
                encoder.raw(value, count);
                encoder.symbol(symbol, &starts);
            }
            let written = encoder.written();
            encoder.finish(&mut bytes);
            prop_assert_eq!(bytes[0], 7);
            prop_assert!(bytes.len().abs_diff(written + 1) <= 4 + written / 100, "{} and {}", bytes.len(), written);
            let mut decoder = Decoder::new(&bytes[1..]);
            for &(bit, p, value, count, symbol) in &bits {
                prop_assert_eq!(decoder.bit(false, p), bit);
                prop_assert_eq!(decoder.raw(0, count), (u64::from(value) & ((1u64 << count) - 1)) as u32);
                prop_assert_eq!(decoder.symbol(0, &starts), symbol);
            }
            prop_assert!(decoder.is_finished());
        }
    }

    #[test]
    fn likely_choices_cost_next_to_nothing_and_the_end_is_known() {
        let (mut choices, mut bytes) = (Vec::new(), Vec::new());
        let mut encoder = Encoder::new(&mut choices);
        for _ in 0..10_000 {
            encoder.bit(false, 8);
        }
        encoder.bit(true, 8);
        encoder.finish(&mut bytes);
        assert!(bytes.len() <= 6, "{} bytes", bytes.len());
        let mut decoder = Decoder::new(&bytes);
        (0..10_000).for_each(|_| assert!(!decoder.bit(false, 8)));
        assert!(!decoder.is_finished());
        assert!(decoder.bit(false, 8) && decoder.is_finished());
        bytes.push(0);
        assert!(!Decoder::new(&bytes).is_finished());
    }
}
