//! When ticks begin: on a grid of periods, without drift, and what happens when they fall behind it.
//!
//! Pure: times come in as nanoseconds of a monotonic clock, decisions go out. It neither sleeps nor reads a clock.

use crate::config::WhenBehind;

const NS_PER_S: u64 = 1_000_000_000;

/// Holds the grid of ticks.
///
/// Tick number n is due at `origin + n / tick_hz`, computed anew for each n, so that rounding never adds up.
#[derive(Debug)]
pub struct Pacer {
    tick_hz: u64,
    when_behind: WhenBehind,
    behind_ticks_max: u64,
    /// Time of grid point 0, ns.
    origin_ns: u64,
    /// Grid point of the coming tick.
    next: u64,
    begun_ns: u64,
    overruns: u64,
    skipped: u64,
    given_up_ns: u64,
}

/// How a tick begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Begin {
    /// Ticks left out just before this one.
    pub skipped: u64,
    /// How much later than due it begins, before anything was left out or given up, ns.
    pub late_ns: u64,
}

impl Pacer {
    /// A pacer whose first tick is due at `now_ns`.
    ///
    /// # Panics
    /// Where `tick_hz` is 0.
    pub fn new(tick_hz: u16, when_behind: WhenBehind, behind_ticks_max: u32, now_ns: u64) -> Self {
        assert!(tick_hz > 0, "a tick has a length");
        Self {
            tick_hz: tick_hz.into(),
            when_behind,
            behind_ticks_max: behind_ticks_max.into(),
            origin_ns: now_ns,
            next: 0,
            begun_ns: now_ns,
            overruns: 0,
            skipped: 0,
            given_up_ns: 0,
        }
    }

    /// When the coming tick is due, ns.
    pub fn due_ns(&self) -> u64 {
        self.origin_ns + self.offset_ns(self.next)
    }

    /// The coming tick begins at `now_ns`: says how late it is, after leaving out or giving up what the policy says.
    pub fn begin(&mut self, now_ns: u64) -> Begin {
        let late_ns = self.late_ns(now_ns);
        let mut skipped = 0;
        if self.when_behind == WhenBehind::Skip {
            let missed = late_ns * self.tick_hz / NS_PER_S;
            skipped = missed.min(self.behind_ticks_max);
            self.next += skipped;
            self.skipped += skipped;
        }
        let bound_ns = match self.when_behind {
            WhenBehind::SlowDown => self.offset_ns(self.behind_ticks_max),
            // What could not be skipped is not caught up either; less than a period is.
            WhenBehind::Skip => self.offset_ns(1),
        };
        let excess_ns = self.late_ns(now_ns).saturating_sub(bound_ns);
        self.origin_ns += excess_ns;
        self.given_up_ns += excess_ns;
        self.begun_ns = now_ns;
        Begin { skipped, late_ns }
    }

    /// The tick that began last ended at `now_ns`.
    pub fn end(&mut self, now_ns: u64) {
        let took_ns = now_ns.saturating_sub(self.begun_ns);
        self.overruns += u64::from(took_ns > self.offset_ns(1));
        self.next += 1;
    }

    /// Ticks that took longer than a period.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Ticks that were left out.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// By how much the world fell behind the clock for good, ns.
    pub fn given_up_ns(&self) -> u64 {
        self.given_up_ns
    }

    fn late_ns(&self, now_ns: u64) -> u64 {
        now_ns.saturating_sub(self.due_ns())
    }

    /// Time of `ticks` periods, ns. Exact to the nanosecond for 19 years at 30 Hz.
    fn offset_ns(&self, ticks: u64) -> u64 {
        ticks * NS_PER_S / self.tick_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Runs ticks of the given lengths on a fake clock; answers when each began, ns since the start.
    fn begins(pacer: &mut Pacer, start: u64, lengths: &[u64]) -> Vec<u64> {
        let mut now = start;
        let one = |length: &u64| {
            now = now.max(pacer.due_ns());
            pacer.begin(now);
            let begun = now - start;
            now += length;
            pacer.end(now);
            begun
        };
        lengths.iter().map(one).collect()
    }

    #[test]
    fn the_grid_does_not_drift() {
        let start = 7;
        let mut pacer = Pacer::new(30, WhenBehind::SlowDown, 6, start);
        let times = begins(&mut pacer, start, &[3 * MS; 3001]);
        assert_eq!(times[30], 1_000 * MS);
        assert_eq!(times[3000], 100_000 * MS);
        assert_eq!((pacer.overruns(), pacer.given_up_ns()), (0, 0));
    }

    #[test]
    fn slow_down_catches_up_within_its_bound() {
        let mut pacer = Pacer::new(25, WhenBehind::SlowDown, 3, 0);
        // 130 ms for one tick, then short ones: 40, 80 and 120 were missed, and are run one after the other.
        let times = begins(&mut pacer, 0, &[130 * MS, 5 * MS, 5 * MS, 5 * MS, 5 * MS]);
        assert_eq!(times, [0, 130 * MS, 135 * MS, 140 * MS, 160 * MS]);
        assert_eq!((pacer.overruns(), pacer.skipped(), pacer.given_up_ns()), (1, 0, 0));
    }

    #[test]
    fn slow_down_gives_up_what_is_beyond_its_bound() {
        let mut pacer = Pacer::new(25, WhenBehind::SlowDown, 1, 0);
        let times = begins(&mut pacer, 0, &[200 * MS, 5 * MS, 5 * MS, 5 * MS]);
        // Due at 40, begun at 200: 160 late, of which 40 may be caught up and 120 are given up.
        assert_eq!(times, [0, 200 * MS, 205 * MS, 240 * MS]);
        assert_eq!(pacer.given_up_ns(), 120 * MS);
        // Sustained overload: no tick is skipped, and each begins when the last one ended.
        let mut pacer = Pacer::new(25, WhenBehind::SlowDown, 0, 0);
        assert_eq!(begins(&mut pacer, 0, &[50 * MS; 4]), [0, 50 * MS, 100 * MS, 150 * MS]);
        assert_eq!(pacer.overruns(), 4);
    }

    #[test]
    fn skip_leaves_out_missed_ticks_up_to_its_bound() {
        let mut pacer = Pacer::new(25, WhenBehind::Skip, 10, 0);
        pacer.begin(0);
        pacer.end(130 * MS);
        // Grid points 1 (40) and 2 (80) are a whole period late, 3 (120) is not.
        assert_eq!(pacer.begin(130 * MS), Begin { skipped: 2, late_ns: 90 * MS });
        pacer.end(135 * MS);
        assert_eq!(pacer.due_ns(), 160 * MS);
        assert_eq!((pacer.skipped(), pacer.given_up_ns()), (2, 0));

        let mut pacer = Pacer::new(25, WhenBehind::Skip, 1, 0);
        pacer.begin(0);
        pacer.end(400 * MS);
        assert_eq!(pacer.begin(400 * MS), Begin { skipped: 1, late_ns: 360 * MS });
        assert_eq!(pacer.given_up_ns(), 280 * MS);
    }
}
