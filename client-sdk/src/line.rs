//! Whether the line takes what the session asks for: where snapshots come later and later, they wait in a queue somewhere,
//! and the session takes fewer layers of cells until they do not.
//!
//! Pure. The server sees the same by acknowledgements and grants less, but its word waits in that queue, too; to subscribe
//! to less takes one way to the server.

/// How late snapshots may come, against the earliest of late, s. Jitter stays below.
const LATE_S: f64 = 0.25;
/// Less than this is no queue, s.
const PROMPT_S: f64 = 0.1;
/// From one layer less to the next, s: what was done about it takes time to show.
const PATIENCE_S: f64 = 0.5;
/// For so long snapshots have to be prompt before one more layer is tried, s.
const CALM_S: f64 = 5.0;
/// By how much the earliest may grow in a second, s: clocks drift, routes change.
const DRIFT: f64 = 2e-3;

/// What is known of the line.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    /// Of the earliest snapshot, its arrival less what its tick says, and when that was, s.
    earliest_s: Option<(f64, f64)>,
    /// Layers of each cell that are not taken.
    dropped: u8,
    /// When that changed last.
    changed_s: f64,
    /// When a snapshot was not prompt last.
    queued_s: f64,
}

impl Line {
    /// The snapshot of `tick` arrived at `now_s`; a tick takes `period_s`. `most` layers are granted of any cell.
    pub fn observe(&mut self, tick: u64, now_s: f64, period_s: f64, most: u8) {
        let offset_s = now_s - tick as f64 * period_s;
        let (earliest_s, at_s) = self.earliest_s.unwrap_or((offset_s, now_s));
        let earliest_s = (earliest_s + DRIFT * (now_s - at_s).max(0.0)).min(offset_s);
        self.earliest_s = Some((earliest_s, now_s));
        let late_s = offset_s - earliest_s;
        if late_s > PROMPT_S {
            self.queued_s = now_s;
        }
        if late_s > LATE_S && now_s - self.changed_s > PATIENCE_S && self.dropped + 1 < most {
            (self.dropped, self.changed_s) = (self.dropped + 1, now_s);
        } else if self.dropped > 0 && now_s - self.queued_s.max(self.changed_s) > CALM_S {
            (self.dropped, self.changed_s) = (self.dropped - 1, now_s);
        }
    }

    /// How many of the `granted` layers of a cell to take: the first always.
    pub fn layers(&self, granted: u8) -> u8 {
        granted.saturating_sub(self.dropped).max(1).min(granted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1.0 / 30.0;

    /// A queue that takes `bytes_per_s`, filled by a session that takes all layers it wants of 32 kB/s. Answers the longest
    /// wait in it, s, and the layers taken in the end.
    fn fill(bytes_per_s: f64, seconds: u64) -> (f64, u8) {
        let (mut line, mut queue, mut worst) = (Line::default(), 0.0f64, 0.0f64);
        for tick in 0..30 * seconds {
            let now_s = tick as f64 * PERIOD_S;
            queue =
                (queue + 32_000.0 * PERIOD_S / f64::from(1 << (4 - line.layers(4))) - bytes_per_s * PERIOD_S).max(0.0);
            let wait_s = queue / bytes_per_s;
            worst = worst.max(wait_s);
            line.observe(tick, now_s + wait_s, PERIOD_S, 4);
        }
        (worst, line.layers(4))
    }

    #[test]
    fn what_waits_is_bounded_and_a_good_line_takes_everything() {
        assert_eq!(fill(40_000.0, 60), (0.0, 4));
        for bytes_per_s in [6_000.0, 9_000.0, 20_000.0] {
            let (worst, layers) = fill(bytes_per_s, 60);
            assert!(worst < 2.5 && layers < 4, "{worst} s, {layers} layers at {bytes_per_s} bytes/s");
        }
    }

    #[test]
    fn jitter_is_no_queue_and_calm_brings_layers_back() {
        let mut line = Line::default();
        (0..300).for_each(|i| line.observe(i, i as f64 * PERIOD_S + 0.06 * (i % 3) as f64, PERIOD_S, 4));
        assert_eq!(line.layers(4), 4);
        (300..360).for_each(|i| line.observe(i, i as f64 * PERIOD_S + 0.4, PERIOD_S, 4));
        assert!(line.layers(4) < 4);
        assert_eq!((line.layers(1), line.layers(0)), (1, 0));
        (360..1000).for_each(|i| line.observe(i, i as f64 * PERIOD_S, PERIOD_S, 4));
        assert_eq!(line.layers(4), 4);
    }
}
