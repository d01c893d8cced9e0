//! Numbers over time through key-frames, with continuous rates.

use pita_sim::SimError;

/// Most key-frames.
pub const KEYS_MAX: usize = 256;

/// Key-frames of N numbers each, and the cubic through them whose rate at a key is the slope between its neighbours
/// (Catmull and Rom, 1974, for keys at any distance): value and rate are continuous, the numbers reach every key.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyFrames<const N: usize> {
    /// Time, s, and numbers; in order of time, never empty.
    keys: Vec<(f64, [f64; N])>,
    /// Where it goes round, for how long, s.
    period: Option<f64>,
}

/// Ends of a stretch between two keys: time, numbers and rates.
type End<const N: usize> = (f64, [f64; N], [f64; N]);

impl<const N: usize> KeyFrames<N> {
    /// Numbers that stay as the first key has them before it, and as the last one has them after it; with a `period`, s,
    /// the first key follows the last one and it goes round.
    ///
    /// # Errors
    /// [`SimError`] where there is no key, or more than [`KEYS_MAX`], or times do not rise, or what is not finite.
    pub fn new(keys: Vec<(f64, [f64; N])>, period: Option<f64>) -> Result<Self, SimError> {
        if keys.is_empty() || keys.len() > KEYS_MAX {
            return Err(SimError::OutOfRange { what: "key-frames", value: keys.len() as f64, allowed: "1 to 256" });
        }
        let finite = |(time, numbers): &(f64, [f64; N])| time.is_finite() && numbers.iter().all(|x| x.is_finite());
        if !keys.iter().all(finite) {
            return Err(SimError::Unusable { what: "a key-frame is not finite" });
        }
        if keys.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return Err(SimError::Unusable { what: "times of key-frames must rise from each to the next" });
        }
        let lasts = keys[keys.len() - 1].0 - keys[0].0;
        match period {
            Some(period) if !(period > lasts && period.is_finite()) => {
                Err(SimError::Unusable { what: "the period must be longer than from the first key-frame to the last" })
            }
            _ => Ok(Self { keys, period }),
        }
    }

    /// The numbers at `time`, s.
    pub fn at(&self, time: f64) -> [f64; N] {
        let ((from, a, rate_a), (to, b, rate_b)) = self.stretch(time);
        let span = to - from;
        let s = if span > 0.0 { ((self.wrapped(time) - from) / span).clamp(0.0, 1.0) } else { 0.0 };
        // Hermite's basis.
        let (s2, s3) = (s * s, s * s * s);
        let (at_b, out_a, out_b) = (3.0 * s2 - 2.0 * s3, s3 - 2.0 * s2 + s, s3 - s2);
        std::array::from_fn(|i| a[i] + (b[i] - a[i]) * at_b + span * (rate_a[i] * out_a + rate_b[i] * out_b))
    }

    fn wrapped(&self, time: f64) -> f64 {
        let first = self.keys[0].0;
        self.period.map_or(time, |period| first + (time - first).rem_euclid(period))
    }

    /// The stretch in which `time` is.
    fn stretch(&self, time: f64) -> (End<N>, End<N>) {
        let time = self.wrapped(time);
        let next = self.keys.partition_point(|key| key.0 <= time) as isize;
        // Before the first key and after the last one, both ends are that key.
        let end = |index: isize| {
            let (time, numbers) = self.key(index);
            (time, numbers, self.rate(index))
        };
        (end(next - 1), end(next))
    }

    /// The key of an index that may lie before the first or after the last.
    fn key(&self, index: isize) -> (f64, [f64; N]) {
        let count = self.keys.len() as isize;
        match self.period {
            Some(period) => {
                let (time, numbers) = self.keys[index.rem_euclid(count) as usize];
                (time + period * index.div_euclid(count) as f64, numbers)
            }
            None => self.keys[index.clamp(0, count - 1) as usize],
        }
    }

    /// Slope from the key before to the key after; none where it ends.
    fn rate(&self, index: isize) -> [f64; N] {
        let is_end = self.period.is_none() && (index <= 0 || index >= self.keys.len() as isize - 1);
        let ((before, a), (after, b)) = (self.key(index - 1), self.key(index + 1));
        std::array::from_fn(|i| if is_end { 0.0 } else { (b[i] - a[i]) / (after - before) })
    }
}
