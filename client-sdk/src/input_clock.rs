//! When to send the input of a tick, so that it arrives just before the server collects for it.
//!
//! The server says of each input how much time it had to spare. From that follows at what moment it would have had to
//! leave at the latest; the clock keeps to the least of those of the last seconds, so that jitter as it was lately makes
//! none late, and goes on at the pace of the server's ticks. Pure: time is a parameter, in seconds since any fixed
//! instant.

use std::collections::VecDeque;

/// How long a measurement counts, s: jitter comes back within that, and drift is nothing.
const WINDOW_S: f64 = 4.0;
/// Measurements that may be beaten, as a share: one stall must not slow everything for seconds.
const OUTLIERS: f64 = 0.01;
/// Kept to spare beyond what was measured, s: timers and threads that wake late.
const MARGIN_S: f64 = 0.004;
/// Lead before anything was measured, s.
const FIRST_LEAD_S: f64 = 0.1;
/// Measurements after which the lead shrinks slowly.
const SETTLED: usize = 8;
/// Share of a tick by which the lead shrinks in a tick: inputs come a little closer together, and none is left out.
const SHRINK: f64 = 0.05;
/// Share of a tick by which an input may leave after it was due and still be meant for its tick: timers wake late, and
/// to leave a tick out for that costs more than the risk that one is late.
const OVERDUE: f64 = 0.25;
/// Inputs that wait for their measurement.
const SENT_MAX: usize = 256;

/// Maps the server's ticks to the local times at which their inputs leave.
#[derive(Clone, Debug)]
pub struct InputClock {
    /// When the input of tick 0 would have left, s; `None` before the first snapshot.
    origin_s: Option<f64>,
    /// Sequence, tick and time of inputs on their way.
    sent: VecDeque<(u32, u64, f64)>,
    /// When it was measured, and the latest origin that would have done, s.
    measured: VecDeque<(f64, f64)>,
    newest_measured: u32,
    last_tick: u64,
}

impl InputClock {
    /// Nothing known.
    pub fn new() -> Self {
        Self {
            origin_s: None,
            sent: VecDeque::with_capacity(SENT_MAX),
            measured: VecDeque::new(),
            newest_measured: 0,
            last_tick: 0,
        }
    }

    /// A snapshot arrived at `now_s`: the newest tick that the server can be known to have reached follows from `seen_s`,
    /// when tick 0 would have been seen here. Ticks take `period_s`.
    pub fn follow(&mut self, seen_s: f64, period_s: f64, now_s: f64) {
        let Some(origin) = self.origin_s else {
            self.origin_s = Some(seen_s - FIRST_LEAD_S);
            return;
        };
        while self.measured.front().is_some_and(|(at, _)| at + WINDOW_S < now_s) {
            self.measured.pop_front();
        }
        let Some(latest) = self.latest() else {
            // Where nothing comes back the server's ticks are all there is to go by.
            self.origin_s = Some(origin.min(seen_s));
            return;
        };
        let wanted = latest - MARGIN_S;
        let is_settled = self.measured.len() >= SETTLED;
        self.origin_s = Some(if is_settled { wanted.min(origin + SHRINK * period_s) } else { wanted });
    }

    /// An input left.
    pub fn note_sent(&mut self, sequence: u32, tick: u64, at_s: f64) {
        if self.sent.len() == SENT_MAX {
            self.sent.pop_front();
        }
        self.sent.push_back((sequence, tick, at_s));
        self.last_tick = self.last_tick.max(tick);
    }

    /// The server says that the input of `sequence` had `slack_s` to spare; known at `now_s`.
    pub fn note_slack(&mut self, sequence: u32, slack_s: f64, period_s: f64, now_s: f64) {
        if sequence <= self.newest_measured {
            return;
        }
        while let Some((sent, tick, at_s)) = self.sent.pop_front_if(|(sent, ..)| *sent <= sequence) {
            if sent == sequence {
                self.newest_measured = sequence;
                self.measured.push_back((now_s, at_s + slack_s - tick as f64 * period_s));
            }
        }
    }

    /// When the input after the last one is due, s; `None` before the first snapshot.
    pub fn next_due_s(&self, period_s: f64) -> Option<f64> {
        Some(self.origin_s? + (self.last_tick + 1) as f64 * period_s)
    }

    /// Fractional tick whose input is due at `now_s`; `None` before the first snapshot.
    #[cfg(feature = "prediction")]
    pub fn phase(&self, now_s: f64, period_s: f64) -> Option<f64> {
        Some((now_s - self.origin_s?) / period_s)
    }

    /// Tick for which an input is that leaves at `now_s`: the first that it can reach, and none before that of the last
    /// input. `None` before the first snapshot.
    pub fn tick_at(&self, now_s: f64, period_s: f64) -> Option<u64> {
        let reached = ((now_s - self.origin_s?) / period_s - OVERDUE).ceil().max(0.0);
        Some((reached as u64).max(self.last_tick))
    }

    /// The latest origin that was in time but for outliers.
    fn latest(&self) -> Option<f64> {
        let mut origins: Vec<f64> = self.measured.iter().map(|(_, origin)| *origin).collect();
        let beaten = (OUTLIERS * origins.len() as f64) as usize;
        (!origins.is_empty()).then(|| *origins.select_nth_unstable_by(beaten, f64::total_cmp).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1.0 / 30.0;

    /// Plays `ticks` against a server whose clock is ours, over ways of `one_way_s(tick)` s, with timers that wake up to
    /// 2 ms late; answers the slack of every input of the second half.
    fn play(ticks: u64, one_way_s: impl Fn(u64) -> f64) -> Vec<f64> {
        let mut clock = InputClock::new();
        let mut slacks = Vec::new();
        // When inputs arrive at the server, their sequence and slack.
        let mut arrivals: VecDeque<(f64, u32, f64)> = VecDeque::new();
        let (mut next_snapshot, mut sequence, mut newest) = (0, 0, (0, 0.0));
        let mut now = 0.0;
        while next_snapshot < ticks {
            now += 0.0005;
            let ticked = next_snapshot as f64 * PERIOD_S;
            if now >= ticked + one_way_s(next_snapshot) {
                while let Some((_, sequence, slack)) = arrivals.pop_front_if(|(at, ..)| *at <= ticked) {
                    newest = (sequence, slack);
                }
                clock.note_slack(newest.0, newest.1, PERIOD_S, now);
                clock.follow(one_way_s(0), PERIOD_S, now);
                next_snapshot += 1;
            }
            let late = 0.002 * (f64::from(sequence) * 0.754_877).fract();
            if clock.next_due_s(PERIOD_S).is_some_and(|due| now >= due + late) {
                let is_settled = next_snapshot > ticks / 2;
                let meant = clock.tick_at(now, PERIOD_S).unwrap();
                assert!(!is_settled || meant == clock.last_tick + 1, "tick {meant} after {}", clock.last_tick);
                sequence += 1;
                clock.note_sent(sequence, meant, now);
                let arrived = now + one_way_s(meant + 7);
                let slack = meant as f64 * PERIOD_S - arrived;
                arrivals.push_back((arrived, sequence, slack));
                if is_settled {
                    slacks.push(slack);
                }
            }
        }
        slacks
    }

    #[test]
    fn inputs_come_to_arrive_just_in_time() {
        for one_way in [0.0, 0.02, 0.05, 0.2] {
            let slacks = play(400, |_| one_way);
            let (least, most) = slacks.iter().fold((1.0f64, -1.0f64), |(a, b), &x| (a.min(x), b.max(x)));
            assert!(least >= 0.0 && most < MARGIN_S + 1e-3, "{one_way} s one way: slack {least} to {most} s");
        }
    }

    #[test]
    fn with_jitter_few_are_late_and_none_is_much_too_early() {
        // 50 ± 20 ms, from a fixed sequence without a pattern of a tick.
        let one_way = |n: u64| 0.05 + 0.02 * (2.0 * ((n as f64 * 0.618_034).fract()) - 1.0);
        let slacks = play(2000, one_way);
        let late = slacks.iter().filter(|&&slack| slack < 0.0).count();
        assert!(late * 100 <= slacks.len(), "{late} of {} late", slacks.len());
        assert!(slacks.iter().all(|&slack| slack < 0.054), "{:?}", slacks.iter().copied().fold(0.0, f64::max));
    }

    #[test]
    fn a_longer_way_is_followed_at_once_and_a_shorter_one_without_leaving_a_tick_out() {
        let slacks = play(900, |n| if n < 400 { 0.02 } else { 0.08 });
        assert!(slacks.iter().all(|&slack| slack > -1e-9));
        let slacks = play(1200, |n| if n < 700 { 0.08 } else { 0.02 });
        assert!(slacks.last().unwrap() < &(MARGIN_S + 1e-3), "{:?}", slacks.last());
    }

    #[test]
    fn ticks_never_go_back_and_memory_is_bounded() {
        let mut clock = InputClock::new();
        assert_eq!((clock.tick_at(1.0, PERIOD_S), clock.next_due_s(PERIOD_S)), (None, None));
        clock.follow(0.0, PERIOD_S, 0.0);
        clock.note_sent(1, 500, 0.0);
        assert_eq!(clock.tick_at(1.0, PERIOD_S), Some(500));
        (2..2000).for_each(|sequence| clock.note_sent(sequence, 500, 0.0));
        assert_eq!(clock.sent.len(), SENT_MAX);
    }
}
