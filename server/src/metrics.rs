//! What the daemon knows about how it does: records of ticks, percentiles, rates.
//!
//! Owned by the publishing thread, which feeds it from frames, and read by whoever reports. Pure: times come in.

use std::collections::VecDeque;

use pita_protocol::build_info::VERSION_AND_COMMIT;
use pita_protocol::message::{KINDS_MAX, KindStatus, Status, TICK_RECORDS_MAX, TickRecord, TickRecords};

use crate::frame::{Frame, KindFigures, Totals};
use crate::shared::Shared;
use crate::stopwatch;

/// Span of percentiles and rates, s.
const WINDOW_S: u64 = 10;
/// Distance of the samples that rates are taken from, ms.
const RATE_SAMPLE_MS: u64 = 500;
/// Characters of a kind's name that are told: 48 bytes, whatever they are.
const KIND_CHARS: usize = 12;
/// Inputs of which the wait is kept: ten seconds of 32 players at 30 Hz.
const INPUT_WAITS_MAX: usize = 9600;

/// Measurements of the last ticks.
pub struct Metrics {
    tick_hz: u16,
    records: VecDeque<TickRecord>,
    input_waits_us: VecDeque<u32>,
    rates: VecDeque<Traffic>,
    state_hash: u64,
    bodies: u32,
    totals: Totals,
    kinds: Vec<KindFigures>,
}

/// Payload so far at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traffic {
    /// When, ms.
    pub at_ms: u64,
    /// Sent since the start, bytes.
    pub sent: u64,
    /// Received since the start, bytes.
    pub received: u64,
}

impl Metrics {
    /// Nothing measured yet.
    pub fn new(tick_hz: u16) -> Self {
        Self {
            tick_hz,
            records: VecDeque::with_capacity(TICK_RECORDS_MAX),
            input_waits_us: VecDeque::with_capacity(INPUT_WAITS_MAX),
            rates: VecDeque::from([Traffic { at_ms: 0, sent: 0, received: 0 }]),
            state_hash: 0,
            bodies: 0,
            totals: Totals::default(),
            kinds: Vec::new(),
        }
    }

    /// Takes what a frame says, published to `clients`.
    pub fn add_frame(&mut self, frame: &Frame, clients: u16) {
        for record in &frame.records {
            if self.records.len() == TICK_RECORDS_MAX {
                self.records.pop_front();
            }
            self.records.push_back(TickRecord { clients, ..*record });
        }
        for &wait in &frame.input_waits_us {
            if self.input_waits_us.len() == INPUT_WAITS_MAX {
                self.input_waits_us.pop_front();
            }
            self.input_waits_us.push_back(wait);
        }
        (self.state_hash, self.bodies, self.totals) = (frame.state_hash, frame.bodies, frame.totals);
        self.kinds.clone_from(&frame.kinds);
    }

    /// Takes a sample of the traffic, unless the last one is fresh.
    pub fn add_traffic(&mut self, now: Traffic) {
        if self.rates.back().is_some_and(|last| now.at_ms < last.at_ms + RATE_SAMPLE_MS) {
            return;
        }
        self.rates.push_back(now);
        while self.rates.len() > 2 && self.rates[1].at_ms + WINDOW_S * 1000 <= now.at_ms {
            self.rates.pop_front();
        }
    }

    /// Records from tick `since` on, oldest first.
    pub fn records_since(&self, since: u64) -> TickRecords {
        let first = self.records.partition_point(|record| record.tick < since);
        TickRecords { records: self.records.iter().skip(first).copied().collect() }
    }

    /// Counts since the start.
    pub fn totals(&self) -> Totals {
        self.totals
    }

    /// What actors do, as it is told.
    fn kinds(&self) -> Vec<KindStatus> {
        let told = |figures: &KindFigures| {
            let kind = figures.kind.chars().take(KIND_CHARS).collect();
            KindStatus { kind, actors: figures.actors, sporadic: figures.sporadic }
        };
        self.kinds.iter().take(KINDS_MAX).map(told).collect()
    }

    /// Median and 99th percentile of the tick time over the last ten seconds, ms; zero before the first tick.
    fn tick_percentiles_ms(&self) -> (f64, f64) {
        let window = usize::from(self.tick_hz) * WINDOW_S as usize;
        percentiles_ms(self.records.iter().rev().take(window).map(|record| record.wall_us).collect())
    }

    /// Bytes sent and received over the last ten seconds, bytes/s.
    fn rates_per_s(&self) -> (f64, f64) {
        let (Some(first), Some(last)) = (self.rates.front(), self.rates.back()) else { return (0.0, 0.0) };
        if last.at_ms == first.at_ms {
            return (0.0, 0.0);
        }
        let seconds = (last.at_ms - first.at_ms) as f64 / 1000.0;
        ((last.sent - first.sent) as f64 / seconds, (last.received - first.received) as f64 / seconds)
    }
}

/// Median and 99th percentile of times in µs, ms; zero of none.
fn percentiles_ms(mut times_us: Vec<u32>) -> (f64, f64) {
    times_us.sort_unstable();
    let rank = |share: f64| {
        let index = (share * times_us.len() as f64).ceil() as usize;
        times_us.get(index.saturating_sub(1)).map_or(0.0, |&us| f64::from(us) / 1000.0)
    };
    (rank(0.5), rank(0.99))
}

/// How the daemon does now.
pub fn status(shared: &Shared) -> Status {
    let clients = shared.sessions().count() as u32;
    let metrics = shared.metrics();
    let newest = metrics.records.back().copied().unwrap_or_default();
    let (tick_p50_ms, tick_p99_ms) = metrics.tick_percentiles_ms();
    let (input_wait_p50_ms, input_wait_p99_ms) = percentiles_ms(metrics.input_waits_us.iter().copied().collect());
    let (sent_bytes_per_s, received_bytes_per_s) = metrics.rates_per_s();
    Status {
        version: VERSION_AND_COMMIT.to_owned(),
        arena: shared.keys.arena().to_owned(),
        tick: newest.tick,
        tick_hz: metrics.tick_hz,
        uptime_s: shared.clock.seconds(),
        tick_p50_ms,
        tick_p99_ms,
        overruns: metrics.totals.overruns,
        skipped_ticks: metrics.totals.skipped_ticks,
        clients,
        bodies: metrics.bodies,
        dof_awake: newest.dof_awake,
        contacts: newest.contacts,
        quarantined: metrics.totals.quarantined,
        sent_bytes_per_s,
        received_bytes_per_s,
        memory_bytes: stopwatch::resident_bytes(),
        cpu_s: stopwatch::process_cpu_s(),
        inputs: metrics.totals.inputs,
        input_wait_p50_ms,
        input_wait_p99_ms,
        refused: shared.counters.refused(),
        kinds: metrics.kinds(),
        state_hash: metrics.state_hash,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(ticks: std::ops::RangeInclusive<u64>, wall_us: impl Fn(u64) -> u32) -> Frame {
        let records = ticks.map(|tick| TickRecord { tick, wall_us: wall_us(tick), ..TickRecord::default() }).collect();
        let mut frame = Frame::default();
        frame.records = records;
        frame
    }

    #[test]
    fn percentiles_are_of_the_last_ten_seconds() {
        let mut metrics = Metrics::new(30);
        assert_eq!(metrics.tick_percentiles_ms(), (0.0, 0.0));
        metrics.add_frame(&frame(1..=500, |_| 90_000), 3);
        metrics.add_frame(&frame(501..=800, |tick| (tick - 500) as u32 * 10), 3);
        assert_eq!(metrics.tick_percentiles_ms(), (1.5, 2.97));
    }

    #[test]
    fn records_are_a_bounded_ring() {
        let mut metrics = Metrics::new(30);
        metrics.add_frame(&frame(1..=5000, |_| 1), 3);
        let kept = metrics.records_since(0).records;
        assert_eq!((kept.len(), kept[0].tick), (TICK_RECORDS_MAX, 5001 - TICK_RECORDS_MAX as u64));
        assert_eq!(metrics.records_since(4999).records.iter().map(|r| r.tick).collect::<Vec<_>>(), [4999, 5000]);
        assert!(metrics.records_since(u64::MAX).records.is_empty());
    }

    #[test]
    fn rates_are_of_the_last_ten_seconds() {
        let mut metrics = Metrics::new(30);
        assert_eq!(metrics.rates_per_s(), (0.0, 0.0));
        for at_ms in (0..=60_000).step_by(33) {
            let sent = if at_ms < 40_000 { at_ms * 9 } else { 360_000 + (at_ms - 40_000) };
            metrics.add_traffic(Traffic { at_ms, sent, received: 2 * at_ms });
        }
        assert_eq!(metrics.rates_per_s(), (1000.0, 2000.0));
        assert!(metrics.rates.len() <= 23);
    }
}
