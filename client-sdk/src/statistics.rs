//! What a session counts.
//!
//! Everything is cumulative since the session began; [`Statistics::since`] gives an interval as a difference.

use hdrhistogram::Histogram;

/// Longest duration that a histogram tells apart, µs; longer ones count as this.
const DURATION_MAX_US: u64 = 60_000_000;

/// Durations in µs, to two significant digits (30 KB each: there may be hundreds of sessions in a process).
pub type Durations = Histogram<u64>;

/// An empty histogram of durations from 1 µs to 60 s.
pub fn durations() -> Durations {
    // The bounds are constants that the constructor accepts; the tests construct one.
    Histogram::new_with_bounds(1, DURATION_MAX_US, 2).expect("constant bounds")
}

/// Counts of one session, or the sum over several.
#[derive(Clone, Debug)]
pub struct Statistics {
    /// Snapshots of distinct ticks.
    pub snapshots_received: u64,
    /// Ticks between the first and the newest snapshot for which none arrived.
    pub snapshots_missed: u64,
    /// Snapshots that were repeated or too old to be of use.
    pub snapshots_stale: u64,
    /// Snapshots for another session of the same slot.
    pub snapshots_foreign: u64,
    /// Snapshots of cells.
    pub cells_received: u64,
    /// Snapshots of cells that came to nothing, because a keyframe before them had not arrived.
    pub cells_unreadable: u64,
    /// Keyframes of cells that were asked for, by newcomers and after a loss.
    pub keyframes_fetched: u64,
    /// Times that a cell said nothing for three seconds while the session's own snapshots came. It was subscribed to anew.
    pub cells_fallen_silent: u64,
    /// Events that were new.
    pub events_received: u64,
    /// Events that were announced and did not arrive; the roster was read again after each gap.
    pub events_missed: u64,
    /// Messages from the server that were dropped because they could not be used.
    pub malformed: u64,
    /// Input packets sent.
    pub inputs_sent: u64,
    /// Inputs of which the server said that it applied them at the tick that they were meant for.
    pub inputs_in_time: u64,
    /// Applied at a later tick.
    pub inputs_late: u64,
    /// Not applied, because a newer one was.
    pub inputs_superseded: u64,
    /// Refused as meant for a tick too far ahead.
    pub inputs_early: u64,
    /// Never arrived there.
    pub inputs_missing: u64,
    /// Payload of everything received, bytes.
    pub received_bytes: u64,
    /// Payload of everything sent, bytes.
    pub sent_bytes: u64,
    /// From the send of an input to the arrival of the first snapshot that contains its effect, µs.
    pub latency_us: Durations,
    /// How far snapshots arrived from when they were expected, µs.
    pub jitter_us: Durations,
    /// By how much the newest prediction of the own vehicle moved for each snapshot, µm.
    pub correction_um: Durations,
    /// From the newest state seen to the tick that an input is meant for, when it is sent, µs.
    pub lead_us: Durations,
}

impl Default for Statistics {
    fn default() -> Self {
        Self {
            snapshots_received: 0,
            snapshots_missed: 0,
            snapshots_stale: 0,
            snapshots_foreign: 0,
            cells_received: 0,
            cells_unreadable: 0,
            keyframes_fetched: 0,
            cells_fallen_silent: 0,
            events_received: 0,
            events_missed: 0,
            malformed: 0,
            inputs_sent: 0,
            inputs_in_time: 0,
            inputs_late: 0,
            inputs_superseded: 0,
            inputs_early: 0,
            inputs_missing: 0,
            received_bytes: 0,
            sent_bytes: 0,
            latency_us: durations(),
            jitter_us: durations(),
            lead_us: durations(),
            correction_um: durations(),
        }
    }
}

impl Statistics {
    /// What was counted after `earlier`, an earlier state of the same counts.
    pub fn since(&self, earlier: &Self) -> Self {
        let mut interval = self.clone();
        for (count, before) in interval.counts().into_iter().zip(earlier.clone().counts()) {
            *count = count.saturating_sub(*before);
        }
        for (durations, before) in interval.durations().into_iter().zip(earlier.clone().durations()) {
            // Fails only where `earlier` holds more than `self`, which it does not by its meaning.
            let _ = durations.subtract(&*before);
        }
        interval
    }

    /// Adds the counts of another session.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.counts().into_iter().zip(other.clone().counts()) {
            *count += *more;
        }
        for (durations, more) in self.durations().into_iter().zip(other.clone().durations()) {
            // All histograms here have the same bounds.
            let _ = durations.add(&*more);
        }
    }

    fn durations(&mut self) -> [&mut Durations; 4] {
        [&mut self.latency_us, &mut self.jitter_us, &mut self.lead_us, &mut self.correction_um]
    }

    fn counts(&mut self) -> [&mut u64; 19] {
        [
            &mut self.snapshots_received,
            &mut self.snapshots_missed,
            &mut self.snapshots_stale,
            &mut self.snapshots_foreign,
            &mut self.cells_received,
            &mut self.cells_unreadable,
            &mut self.keyframes_fetched,
            &mut self.cells_fallen_silent,
            &mut self.events_received,
            &mut self.events_missed,
            &mut self.malformed,
            &mut self.inputs_sent,
            &mut self.inputs_in_time,
            &mut self.inputs_late,
            &mut self.inputs_superseded,
            &mut self.inputs_early,
            &mut self.inputs_missing,
            &mut self.received_bytes,
            &mut self.sent_bytes,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(n: u64) -> Statistics {
        let mut statistics = Statistics { snapshots_received: 2 * n, sent_bytes: 100 * n, ..Statistics::default() };
        (0..n).for_each(|i| statistics.latency_us.saturating_record(1000 + i));
        statistics
    }

    #[test]
    fn an_interval_is_the_difference_and_a_sum_the_sum() {
        let interval = counted(10).since(&counted(4));
        assert_eq!((interval.snapshots_received, interval.sent_bytes, interval.latency_us.len()), (12, 600, 6));
        let mut sum = counted(4);
        sum.add(&interval);
        assert_eq!((sum.snapshots_received, sum.sent_bytes, sum.latency_us.len()), (20, 1000, 10));
    }

    #[test]
    fn durations_beyond_the_bounds_are_kept_as_the_bound() {
        let mut durations = durations();
        durations.saturating_record(u64::MAX);
        assert!(durations.max() >= DURATION_MAX_US);
    }
}
