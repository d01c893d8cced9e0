//! What a step of the load test comes to: order statistics over its tick records. Pure.

use pita_protocol::message::{STAGE_NAMES, TickRecord};
use serde::Serialize;

/// Tick time of a 60 Hz display frame, ms: what leaves room in a tick for other work.
pub const FRAME_60_HZ_MS: f64 = 1000.0 / 60.0;

/// Tick time at which a 30 Hz server has no time left, ms.
pub const TICK_30_HZ_MS: f64 = 1000.0 / 30.0;

/// Order statistics of one quantity, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50_ms: f64,
    /// 95th percentile.
    pub p95_ms: f64,
    /// 99th percentile.
    pub p99_ms: f64,
    /// Maximum.
    pub max_ms: f64,
}

impl Quantiles {
    /// Exact statistics (nearest rank) of `samples_us`, given in µs; zeros where there are none.
    pub fn of_us(samples_us: impl IntoIterator<Item = u32>) -> Self {
        let mut sorted: Vec<u32> = samples_us.into_iter().collect();
        sorted.sort_unstable();
        let at = |quantile: f64| {
            let rank = (quantile * sorted.len() as f64).ceil() as usize;
            sorted.get(rank.saturating_sub(1)).map_or(0.0, |&us| f64::from(us) / 1000.0)
        };
        Self { p50_ms: at(0.50), p95_ms: at(0.95), p99_ms: at(0.99), max_ms: at(1.0) }
    }
}

/// What the ticks of one step cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TickFigures {
    /// Ticks measured.
    pub ticks: usize,
    /// Tick numbers between the first and the last without a record: left out by the server.
    pub skipped_ticks: u64,
    /// Ticks longer than the tick period.
    pub overruns: usize,
    /// Bodies, median.
    pub bodies: u32,
    /// Unknowns, median.
    pub dof_awake: u32,
    /// Contact points, median.
    pub contacts: u32,
    /// Newton iterations summed over islands, median.
    pub newton_iterations: u32,
    /// From a tick's start to its end.
    pub tick: Quantiles,
    /// CPU time of the tick's thread.
    pub cpu: Quantiles,
    /// Time that the tick's thread was ready and waited for a core.
    pub wait: Quantiles,
    /// How late ticks began.
    pub late: Quantiles,
    /// The five stages, in order.
    pub stages: [StageFigures; 5],
}

/// Cost of one stage of the pipeline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageFigures {
    /// Its name.
    pub name: &'static str,
    /// Its order statistics.
    #[serde(flatten)]
    pub wall: Quantiles,
}

impl TickFigures {
    /// Figures of `records`, which ascend in tick, of a server of `tick_hz` ticks a second.
    pub fn of(records: &[TickRecord], tick_hz: u16) -> Self {
        let period_us = 1_000_000 / u32::from(tick_hz.max(1));
        let column = |of: fn(&TickRecord) -> u32| Quantiles::of_us(records.iter().map(of));
        let span = records.first().zip(records.last()).map_or(0, |(first, last)| last.tick - first.tick + 1);
        Self {
            ticks: records.len(),
            skipped_ticks: span.saturating_sub(records.len() as u64),
            overruns: records.iter().filter(|record| record.wall_us > period_us).count(),
            bodies: median(records.iter().map(|record| record.bodies)),
            dof_awake: median(records.iter().map(|record| record.dof_awake)),
            contacts: median(records.iter().map(|record| record.contacts)),
            newton_iterations: median(records.iter().map(|record| record.newton_iterations)),
            tick: column(|record| record.wall_us),
            cpu: column(|record| record.cpu_us),
            wait: column(|record| record.wait_us),
            late: column(|record| record.late_us),
            stages: std::array::from_fn(|stage| StageFigures {
                name: STAGE_NAMES[stage],
                wall: Quantiles::of_us(records.iter().map(|record| record.stage_us[stage])),
            }),
        }
    }
}

fn median(values: impl Iterator<Item = u32>) -> u32 {
    let mut values: Vec<u32> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() { 0 } else { *values.select_nth_unstable(middle).1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_exact_by_nearest_rank() {
        let q = Quantiles::of_us((1..=1000).rev());
        assert_eq!(q, Quantiles { p50_ms: 0.5, p95_ms: 0.95, p99_ms: 0.99, max_ms: 1.0 });
        let one = Quantiles::of_us([7000]);
        assert_eq!(one, Quantiles { p50_ms: 7.0, p95_ms: 7.0, p99_ms: 7.0, max_ms: 7.0 });
        assert_eq!(Quantiles::of_us([]), Quantiles::default());
    }

    #[test]
    fn one_bad_tick_in_a_thousand_is_the_maximum_and_not_the_p99() {
        let q = Quantiles::of_us((0..1000).map(|i| if i == 500 { 90_000 } else { 1000 }));
        assert_eq!((q.p99_ms, q.max_ms), (1.0, 90.0));
    }

    #[test]
    fn overruns_depend_on_the_tick_rate_and_gaps_are_skipped_ticks() {
        let record =
            |tick, wall_us| TickRecord { tick, wall_us, bodies: 80, stage_us: [1, 2, 3, 4, 5], ..Default::default() };
        let records = [record(10, 33_000), record(11, 34_000), record(14, 39_999), record(15, 40_001)];
        let at_30 = TickFigures::of(&records, 30);
        assert_eq!((at_30.ticks, at_30.overruns, at_30.skipped_ticks, at_30.bodies), (4, 3, 2, 80));
        assert_eq!(TickFigures::of(&records, 25).overruns, 1);
        assert_eq!(at_30.stages.map(|stage| stage.wall.p50_ms), [0.001, 0.002, 0.003, 0.004, 0.005]);
        assert_eq!(at_30.stages.map(|stage| stage.name), STAGE_NAMES);
        assert_eq!(TickFigures::of(&[], 30).ticks, 0);
    }
}
