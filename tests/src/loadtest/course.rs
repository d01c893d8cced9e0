//! Which numbers a load test tries: those that it was given, and with `--until` what lies beyond and between. Pure.

use super::options::COUNT_MAX;

/// The search ends where the first number beyond the limit is at most this share of itself above the last one within.
const PRECISION: f64 = 1.0 / 16.0;

/// The numbers that are still to be tried.
#[derive(Debug)]
pub struct Course {
    /// In reverse.
    given: Vec<u16>,
    until_ms: Option<f64>,
    /// The number that is being measured.
    current: u16,
    /// The largest one within the limit, and the smallest beyond.
    within: u16,
    beyond: Option<u16>,
}

impl Course {
    /// Begins with `given`. `until_ms` limits the p99 of a tick.
    pub fn new(mut given: Vec<u16>, until_ms: Option<f64>) -> Self {
        given.reverse();
        Self { given, until_ms, current: 0, within: 0, beyond: None }
    }

    /// The next number; `None` where it is known how far it goes, or nobody asked.
    pub fn advance(&mut self) -> Option<u16> {
        let next = match (self.given.last(), self.beyond, self.until_ms) {
            (Some(&given), None, _) | (Some(&given), Some(_), None) => {
                self.given.pop();
                Some(given)
            }
            (_, _, None) => None,
            (None, None, Some(_)) => self.within.checked_mul(2).map(|n| n.min(COUNT_MAX)).filter(|&n| n > self.within),
            (_, Some(beyond), Some(_)) => {
                let gap = beyond.saturating_sub(self.within);
                (gap > 1 && f64::from(gap) > PRECISION * f64::from(beyond)).then(|| self.within + gap / 2)
            }
        };
        self.current = next.unwrap_or(self.current);
        next
    }

    /// Hears the p99 of a tick at the number that [`Course::advance`] answered last, ms.
    pub fn saw(&mut self, p99_ms: f64) {
        if self.until_ms.is_some_and(|limit| p99_ms > limit) {
            self.beyond = Some(self.beyond.map_or(self.current, |beyond| beyond.min(self.current)));
        } else if self.beyond.is_none_or(|beyond| self.current < beyond) {
            self.within = self.within.max(self.current);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers that are tried where a tick takes a millisecond a piece.
    fn tried(given: &[u16], until_ms: Option<f64>) -> Vec<u16> {
        let mut course = Course::new(given.to_vec(), until_ms);
        let mut tried = Vec::new();
        while let Some(n) = course.advance() {
            assert!(tried.len() < 50, "no end: {tried:?}");
            course.saw(f64::from(n));
            tried.push(n);
        }
        tried
    }

    #[test]
    fn without_a_limit_all_are_tried_that_were_given() {
        assert_eq!(tried(&[64, 1, 8], None), [64, 1, 8]);
        assert_eq!(tried(&[], None), [0u16; 0]);
    }

    #[test]
    fn a_limit_is_looked_for_beyond_and_between() {
        assert_eq!(tried(&[16, 32], Some(100.0)), [16, 32, 64, 128, 96, 112, 104, 100]);
        assert_eq!(tried(&[1, 4, 8, 16, 32, 64], Some(5.5)), [1, 4, 8, 6, 5]);
        assert_eq!(tried(&[8], Some(1.5)), [8, 4, 2, 1]);
    }

    #[test]
    fn the_search_ends_at_the_most_that_is_allowed() {
        assert_eq!(tried(&[400], Some(5000.0)), [400, 800, 1000]);
        assert_eq!(tried(&[1], Some(0.5)), [1]);
    }

    /// A slow measurement below a number that was fast is taken as it came.
    #[test]
    fn noise_does_not_turn_the_search_round() {
        let mut course = Course::new(vec![8, 4], Some(10.0));
        assert_eq!(course.advance(), Some(8));
        course.saw(9.0);
        assert_eq!(course.advance(), Some(4));
        course.saw(11.0);
        assert_eq!(course.advance(), None);
    }
}
