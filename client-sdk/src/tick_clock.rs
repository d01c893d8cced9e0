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
/// Fraction of each correction by which the length of a tick is corrected too: two clocks drift apart by a constant
/// share, and corrections that do not cancel out are drift. It is followed within about twenty seconds.
const DRIFT_GAIN: f64 = 0.002;
/// Two clocks differ by less, as a share; more is a server that cannot keep up, which may end at any time.
const DRIFT_MAX: f64 = 0.01;

/// Maps local time to the server's tick, as seen through the connection: the estimate at the arrival of snapshot `n`
/// is about `n`.
#[derive(Clone, Debug)]
pub struct TickClock {
    nominal_s: f64,
    /// Length of a tick by the local clock, s.
    period_s: f64,
    /// A tick that was observed, and when it was expected to arrive, s.
    reference: Option<(u64, f64)>,
}

impl TickClock {
    /// Clock of a server that runs at `tick_hz`.
    pub fn new(tick_hz: u16) -> Self {
        let nominal_s = 1.0 / f64::from(tick_hz.max(1));
        Self { nominal_s, period_s: nominal_s, reference: None }
    }

    /// Length of a tick by the local clock, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Takes into account that the snapshot of `tick` arrived at `at_s`; answers how much later than estimated, s.
    pub fn observe(&mut self, tick: u64, at_s: f64) -> f64 {
        let Some(expected_s) = self.expected_s(tick) else {
            self.reference = Some((tick, at_s));
            return 0.0;
        };
        let error = at_s - expected_s;
        let gain = match error {
            e if e.abs() > STEP_S => 1.0,
            e if e < 0.0 => EARLY_GAIN,
            _ => LATE_GAIN,
        };
        let correction = gain * error;
        self.reference = Some((tick, expected_s + correction));
        if gain < 1.0 {
            let (least, most) = (self.nominal_s * (1.0 - DRIFT_MAX), self.nominal_s * (1.0 + DRIFT_MAX));
            self.period_s = (self.period_s + DRIFT_GAIN * correction).clamp(least, most);
        }
        error
    }

    /// When the snapshot of `tick` is or was to be expected, s; `None` before the first snapshot.
    pub fn expected_s(&self, tick: u64) -> Option<f64> {
        let (reference, at_s) = self.reference?;
        Some(at_s + (tick as f64 - reference as f64) * self.period_s)
    }

    /// Estimated tick at `at_s`, fractional, not below zero; `None` before the first snapshot.
    pub fn tick_at(&self, at_s: f64) -> Option<f64> {
        let (reference, reference_s) = self.reference?;
        Some((reference as f64 + (at_s - reference_s) / self.period_s).max(0.0))
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

    #[test]
    fn learns_how_two_clocks_drift_apart() {
        for share in [-0.002, 0.002] {
            let mut clock = TickClock::new(HZ);
            let period_s = (1.0 + share) / f64::from(HZ);
            let jitter = |tick: u64| 0.01 * (tick as f64 * 0.618_034).fract();
            for tick in 0..3000 {
                clock.observe(tick, tick as f64 * period_s + jitter(tick));
            }
            let learnt = clock.period_s() * f64::from(HZ) - 1.0;
            assert!((learnt - share).abs() < 0.0007, "{learnt} instead of {share}");
        }
    }
}
