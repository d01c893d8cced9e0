//! When messages arrive that meet given conditions. Pure: time is a parameter, in seconds since the start.

use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::Conditions;

/// What would wait longer for a throttled link is lost, s.
const QUEUE_MAX_S: f64 = 0.5;

/// What a loss means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// The message is gone; others may overtake it.
    Datagrams,
    /// It is sent again, and everything behind it waits.
    Stream,
}

/// Decides on each message of one direction.
#[derive(Debug)]
pub struct Schedule {
    conditions: Conditions,
    delivery: Delivery,
    random: StdRng,
    /// Until then the throttled link is busy, s.
    busy_until_s: f64,
    /// When the last message of a stream arrives, s.
    last_s: f64,
}

impl Schedule {
    /// Everything random follows from `seed`.
    pub fn new(conditions: Conditions, delivery: Delivery, seed: u64) -> Self {
        Self { conditions, delivery, random: StdRng::seed_from_u64(seed), busy_until_s: 0.0, last_s: 0.0 }
    }

    /// When a message of `bytes` arrives that is sent at `now_s`: not at all, once or twice.
    pub fn admit(&mut self, now_s: f64, bytes: usize) -> [Option<f64>; 2] {
        match self.delivery {
            Delivery::Datagrams => self.admit_datagram(now_s, bytes),
            Delivery::Stream => [Some(self.admit_to_stream(now_s, bytes)), None],
        }
    }

    fn admit_datagram(&mut self, now_s: f64, bytes: usize) -> [Option<f64>; 2] {
        let sent_s = self.throttled(now_s, bytes);
        if sent_s - now_s > QUEUE_MAX_S || self.chance(self.conditions.loss) {
            return [None, None];
        }
        self.busy_until_s = sent_s;
        let again = self.chance(self.conditions.duplicate);
        [Some(self.arrival(sent_s)), again.then(|| self.arrival(sent_s))]
    }

    fn admit_to_stream(&mut self, now_s: f64, bytes: usize) -> f64 {
        let mut sent_s = self.throttled(now_s, bytes);
        self.busy_until_s = sent_s;
        // Noticed and sent again after a round trip, for as long as it is lost.
        let mut tries = 0;
        while self.chance(self.conditions.loss) && tries < 8 {
            tries += 1;
            sent_s += 2.0 * self.conditions.latency.as_secs_f64();
        }
        self.last_s = self.arrival(sent_s).max(self.last_s);
        self.last_s
    }

    /// When a throttled link has sent it.
    fn throttled(&self, now_s: f64, bytes: usize) -> f64 {
        let takes_s = self.conditions.rate.map_or(0.0, |rate| bytes as f64 / rate.max(1) as f64);
        self.busy_until_s.max(now_s) + takes_s
    }

    fn arrival(&mut self, sent_s: f64) -> f64 {
        let (latency, jitter) = (self.conditions.latency.as_secs_f64(), self.conditions.jitter.as_secs_f64());
        let takes_s = match self.chance(self.conditions.reorder) {
            true => 0.0,
            false => (latency + jitter * self.random.random_range(-1.0..=1.0)).max(0.0),
        };
        self.thawed(sent_s + takes_s)
    }

    /// `at_s`, or the end of the freeze that it falls in.
    fn thawed(&self, at_s: f64) -> f64 {
        let Some(freeze) = self.conditions.freeze else { return at_s };
        let (every, lasting) = (freeze.every.as_secs_f64(), freeze.lasting.as_secs_f64());
        let into = at_s.rem_euclid(every);
        if into >= every - lasting { at_s - into + every } else { at_s }
    }

    fn chance(&mut self, share: f64) -> bool {
        share > 0.0 && self.random.random_range(0.0..1.0) < share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conditioner::Freeze;
    use std::time::Duration;

    const MS: Duration = Duration::from_millis(1);

    /// When messages arrive of 100 bytes, sent every 10 ms.
    fn played(conditions: Conditions, delivery: Delivery, seed: u64, count: usize) -> Vec<[Option<f64>; 2]> {
        let mut schedule = Schedule::new(conditions, delivery, seed);
        (0..count).map(|i| schedule.admit(i as f64 * 0.01, 100)).collect()
    }

    #[test]
    fn without_conditions_everything_arrives_at_once() {
        let arrivals = played(Conditions::default(), Delivery::Datagrams, 1, 10);
        assert!((0..10).all(|i| arrivals[i] == [Some(i as f64 * 0.01), None]));
    }

    #[test]
    fn shares_and_delays_are_as_asked_and_follow_from_the_seed() {
        let conditions = Conditions {
            latency: 50 * MS,
            jitter: 20 * MS,
            loss: 0.05,
            duplicate: 0.1,
            reorder: 0.02,
            ..Conditions::default()
        };
        let arrivals = played(conditions, Delivery::Datagrams, 7, 10_000);
        assert_eq!(arrivals, played(conditions, Delivery::Datagrams, 7, 10_000));
        assert_ne!(arrivals, played(conditions, Delivery::Datagrams, 8, 10_000));
        let share = |is: &dyn Fn(usize) -> bool| (0..10_000).filter(|&i| is(i)).count() as f64 / 10_000.0;
        let takes = |i: usize| arrivals[i][0].map(|at| at - i as f64 * 0.01);
        assert!((share(&|i| arrivals[i][0].is_none()) - 0.05).abs() < 0.01);
        assert!((share(&|i| arrivals[i][1].is_some()) - 0.095).abs() < 0.015);
        assert!((share(&|i| takes(i).is_some_and(|s| s < 1e-9)) - 0.019).abs() < 0.006);
        let delayed = |i: usize| takes(i).is_none_or(|s| s < 1e-9 || (0.0299..=0.0701).contains(&s));
        assert!((0..10_000).all(delayed));
    }

    #[test]
    fn a_throttled_link_carries_its_rate_and_never_what_is_old() {
        let conditions = Conditions { rate: Some(5_000), ..Conditions::default() };
        let arrivals = played(conditions, Delivery::Datagrams, 1, 1000);
        let arrived = arrivals.iter().flatten().flatten().count() as f64;
        assert!((arrived * 100.0 / 10.0 - 5_000.0).abs() < 300.0, "{arrived} messages in 10 s");
        let oldest = (0..1000).filter_map(|i| Some(arrivals[i][0]? - i as f64 * 0.01)).fold(0.0, f64::max);
        assert!(oldest <= QUEUE_MAX_S + 1e-9, "{oldest} s");
    }

    #[test]
    fn a_frozen_link_delivers_when_it_thaws() {
        let freeze = Freeze { every: Duration::from_secs(1), lasting: 300 * MS };
        let arrivals =
            played(Conditions { freeze: Some(freeze), ..Conditions::default() }, Delivery::Datagrams, 1, 100);
        assert!((arrivals[69][0].unwrap() - 0.69).abs() < 1e-9);
        assert!((71..100).all(|i| (arrivals[i][0].unwrap() - 1.0).abs() < 1e-9));
    }

    #[test]
    fn a_stream_loses_nothing_and_keeps_its_order() {
        let conditions = Conditions { latency: 50 * MS, jitter: 20 * MS, loss: 0.2, ..Conditions::default() };
        let arrivals: Vec<f64> =
            played(conditions, Delivery::Stream, 3, 1000).iter().map(|[at, _]| at.unwrap()).collect();
        assert!(arrivals.is_sorted());
        assert!(arrivals.iter().zip(0..).any(|(at, i)| at - i as f64 * 0.01 > 0.13), "a loss costs a round trip");
    }
}
