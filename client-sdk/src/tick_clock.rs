//! Estimate of the server's tick from the arrival of snapshots.
//!
//! Pure: time is a parameter, in seconds since any fixed instant.

/// Fraction of an error that one early snapshot corrects: an early one carries less queueing than the estimate assumes.
const EARLY_GAIN: f64 = 0.5;
/// Fraction of an error that one late snapshot corrects: lateness is mostly jitter, and following it would shake
/// everything that is drawn. At 30 Hz a lasting change is followed within about a second.
const LATE_GAIN: f64 = 0.05;
/// Errors above this are no jitter (a server that paused, a machine that slept) and are taken over at once, s.
const STEP_S: f64 = 0.5;

/// Maps local time to the server's tick, as seen through the connection: the estimate at the arrival of snapshot `n`
/// is about `n`.
#[derive(Clone, Debug)]
pub struct TickClock {
    period_s: f64,
    origin_s: Option<f64>,
}

impl TickClock {
    /// Clock of a server that runs at `tick_hz`.
    pub fn new(tick_hz: u16) -> Self {
        Self { period_s: 1.0 / f64::from(tick_hz.max(1)), origin_s: None }
    }

    /// Length of a tick, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Takes into account that the snapshot of `tick` arrived at `at_s`.
    pub fn observe(&mut self, tick: u64, at_s: f64) {
        let seen = at_s - tick as f64 * self.period_s;
        let origin = self.origin_s.get_or_insert(seen);
        let error = seen - *origin;
        let gain = match error {
            e if e.abs() > STEP_S => 1.0,
            e if e < 0.0 => EARLY_GAIN,
            _ => LATE_GAIN,
        };
        *origin += gain * error;
    }

    /// Estimated tick at `at_s`, fractional, not below zero; `None` before the first snapshot.
    pub fn tick_at(&self, at_s: f64) -> Option<f64> {
        Some(((at_s - self.origin_s?) / self.period_s).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HZ: u16 = 30;

    #[test]
    fn knows_nothing_before_the_first_snapshot() {
        assert_eq!(TickClock::new(HZ).tick_at(1.0), None);
    }

    proptest! {
        /// With up to 20 ms of jitter the estimate stays within one tick of the truth.
        #[test]
        fn jitter_moves_the_estimate_by_less_than_a_tick(jitter_ms in prop::collection::vec(0.0..20.0f64, 60..200)) {
            let mut clock = TickClock::new(HZ);
            for (&jitter, tick) in jitter_ms.iter().zip(1000u64..) {
                let now = tick as f64 / f64::from(HZ);
                clock.observe(tick, now + jitter * 1e-3);
                let error = clock.tick_at(now).unwrap() - tick as f64;
                prop_assert!(error.abs() < 1.0, "{error} ticks");
            }
        }
    }

    #[test]
    fn follows_a_server_that_paused() {
        let mut clock = TickClock::new(HZ);
        clock.observe(10, 5.0);
        clock.observe(11, 8.0);
        assert!((clock.tick_at(8.0).unwrap() - 11.0).abs() < 1e-9);
    }

    #[test]
    fn follows_a_server_that_runs_slower_than_it_says() {
        let mut clock = TickClock::new(HZ);
        let mut worst = 0.0f64;
        for tick in 0..300u64 {
            let now = tick as f64 * 0.040;
            clock.observe(tick, now);
            worst = worst.max((clock.tick_at(now).unwrap() - tick as f64).abs());
        }
        assert!(worst < 5.0, "{worst} ticks ahead");
    }
}
