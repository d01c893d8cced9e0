//! Which tick is shown when: far enough behind the newest that the next state is there in time, no further, and without
//! jumps.
//!
//! The delay follows from how late states came lately, lost ones counted as late as the next that came. Pure: time is a
//! parameter, in seconds since any fixed instant.

use std::collections::VecDeque;

/// How long a measurement counts, s.
const WINDOW_S: f64 = 4.0;
/// Share of states that may come too late: those are carried on along Q', which shows little for a tick.
const TOO_LATE: f64 = 0.02;
/// What is shown runs faster or slower by at most this share to come to its delay.
const RATE_CHANGE_MAX: f64 = 0.1;
/// Share of the distance to the right delay that is made up for in a second.
const GAIN_PER_S: f64 = 2.0;
/// Further off than this it jumps, s.
const JUMP_S: f64 = 1.0;

/// The clock of what is shown.
#[derive(Clone, Debug)]
pub struct Playback {
    period_s: f64,
    least_s: f64,
    most_s: f64,
    /// When it was measured, and how late the state was, s.
    lateness: VecDeque<(f64, f64)>,
    /// The delay that they ask for, s.
    delay_s: f64,
    /// What was shown last, and when, s.
    shown: Option<(f64, f64)>,
}

impl Playback {
    /// For ticks of `period_s`, with a delay of `least_s` to `most_s`.
    pub fn new(period_s: f64, least_s: f64, most_s: f64) -> Self {
        let most_s = most_s.max(least_s);
        Self { period_s, least_s, most_s, lateness: VecDeque::new(), delay_s: least_s, shown: None }
    }

    /// The delay now, s.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// The first state after the newest before it came at `now_s`, so much later than expected.
    pub fn observe(&mut self, late_s: f64, now_s: f64) {
        self.lateness.push_back((now_s, late_s));
        while self.lateness.front().is_some_and(|(at, _)| at + WINDOW_S < now_s) {
            self.lateness.pop_front();
        }
        let mut late: Vec<f64> = self.lateness.iter().map(|(_, late)| *late).collect();
        let rank = ((1.0 - TOO_LATE) * late.len() as f64) as usize;
        let rank = rank.min(late.len() - 1);
        let usual = *late.select_nth_unstable_by(rank, f64::total_cmp).1;
        // Between two states: the later one has to be there.
        self.delay_s = (usual + self.period_s).clamp(self.least_s, self.most_s);
    }

    /// The fractional tick to show at `now_s`, while the newest state is estimated to be that of `newest`.
    pub fn tick(&mut self, newest: f64, now_s: f64) -> f64 {
        let wanted = newest - self.delay_s / self.period_s;
        let tick = match self.shown {
            Some((tick, at_s)) => {
                let elapsed_s = (now_s - at_s).max(0.0);
                let straight = tick + elapsed_s / self.period_s;
                let off = wanted - straight;
                if off.abs() * self.period_s > JUMP_S {
                    wanted
                } else {
                    let most = RATE_CHANGE_MAX * elapsed_s / self.period_s;
                    straight + (off * (GAIN_PER_S * elapsed_s).min(1.0)).clamp(-most, most)
                }
            }
            None => wanted,
        };
        // A caller may ask for an instant before the last one.
        if self.shown.is_none_or(|(_, at_s)| now_s > at_s) {
            self.shown = Some((tick, now_s));
        }
        tick.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1.0 / 30.0;

    #[test]
    fn the_delay_is_what_lateness_asks_for_and_within_its_bounds() {
        let mut playback = Playback::new(PERIOD_S, 0.03, 0.2);
        assert_eq!(playback.delay_s(), 0.03);
        (0..100).for_each(|i| playback.observe(0.02 * f64::from(i % 11) / 10.0, f64::from(i) * PERIOD_S));
        assert!((playback.delay_s() - 0.02 - PERIOD_S).abs() < 0.003, "{}", playback.delay_s());
        (100..200).for_each(|i| playback.observe(5.0, f64::from(i) * PERIOD_S));
        assert_eq!(playback.delay_s(), 0.2);
        (200..500).for_each(|i| playback.observe(-1.0, f64::from(i) * PERIOD_S));
        assert_eq!(playback.delay_s(), 0.03);
    }

    #[test]
    fn what_is_shown_never_leaps_nor_goes_back() {
        let mut playback = Playback::new(PERIOD_S, 0.05, 0.3);
        let mut last = playback.tick(100.0, 0.0);
        for step in 1..600 {
            let now = f64::from(step) * 0.01;
            if step == 100 {
                (0..50).for_each(|_| playback.observe(0.15, now));
            }
            // The estimate of the newest shakes by a third of a tick.
            let newest = 100.0 + now / PERIOD_S + 0.3 * (f64::from(step) * 0.618).fract();
            let tick = playback.tick(newest, now);
            let ticks = tick - last;
            let real = 0.01 / PERIOD_S;
            assert!((ticks - real).abs() <= RATE_CHANGE_MAX * real + 1e-9, "{ticks} ticks in {real}");
            last = tick;
        }
        let delay = (100.0 + 5.99 / PERIOD_S + 0.15 - last) * PERIOD_S;
        assert!((delay - playback.delay_s()).abs() < 0.02, "{delay} s");
    }

    #[test]
    fn a_server_that_paused_is_followed_at_once() {
        let mut playback = Playback::new(PERIOD_S, 0.05, 0.3);
        playback.tick(100.0, 0.0);
        assert!((playback.tick(1000.0, 0.1) - 998.5).abs() < 1e-9);
    }
}
