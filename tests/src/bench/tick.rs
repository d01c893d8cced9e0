//! `tick`: what a tick of sixteen driven cars costs, stage by stage, and whether it allocates.

use std::time::Instant;

use hdrhistogram::Histogram;
use pita_game::{Arena, ArenaSettings, Command, Controls, Ports, Stage, pipeline};
use pita_protocol::message::STAGE_NAMES;
use pita_sim::StepReport;
use serde_json::{Value, json};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region};

use super::{EntryError, Options, Report};

const FLAT: &str = include_str!("../../../configs/arenas/flat.toml");
const CARS: u16 = 16;

/// Ticks until every buffer has its size and every car its speed.
const WARM_UP_TICKS: u32 = 300;
const TICKS: u32 = 1000;

/// Sixteen drivers, and a stopwatch.
struct Drivers {
    commands: Vec<Command>,
    marks: Vec<Instant>,
}

impl Ports for Drivers {
    fn begin(&mut self, _: Stage) {
        self.marks.push(Instant::now());
    }

    fn collect(&mut self, tick: u64, into: &mut Vec<Command>) {
        into.append(&mut self.commands);
        // Everybody drives an eight: left for four seconds, right for four.
        let steer = if (tick / 120).is_multiple_of(2) { 0.4 } else { -0.4 };
        let controls = Controls { throttle: 0.6, steer, ..Controls::default() };
        into.extend((0..CARS).map(|slot| Command::Drive { slot, controls }));
    }

    fn output(&mut self, _: &Arena) {}

    fn end(&mut self) {
        self.marks.push(Instant::now());
    }
}

/// Measures `options.ticks` ticks, 1000 by default.
pub fn run(options: &Options) -> Result<Report, EntryError> {
    let settings = ArenaSettings { tick_hz: 30, threads: options.threads.unwrap_or(1) };
    let mut arena = Arena::from_toml(FLAT, &settings)?;
    let commands = (0..CARS).map(|slot| Command::Enter { slot, name: format!("car {slot}") }).collect();
    let mut drivers = Drivers { commands, marks: Vec::with_capacity(8) };
    for _ in 0..WARM_UP_TICKS {
        drivers.marks.clear();
        pipeline::tick(&mut arena, &mut drivers);
    }
    let mut measured = Measured::new()?;
    let ticks = options.ticks.unwrap_or(TICKS);
    for _ in 0..ticks {
        drivers.marks.clear();
        let allocations = Region::new(&INSTRUMENTED_SYSTEM);
        pipeline::tick(&mut arena, &mut drivers);
        measured.allocations += allocations.change().allocations + allocations.change().reallocations;
        measured.add(&drivers.marks, arena.world().report())?;
    }
    Ok(measured.report(ticks, &arena))
}

/// Times of the five stages and of the whole tick, ns, and sums over all ticks.
struct Measured {
    times: Vec<Histogram<u64>>,
    allocations: usize,
    total: StepReport,
}

impl Measured {
    fn new() -> Result<Self, EntryError> {
        let times = (0..=STAGE_NAMES.len()).map(|_| Histogram::new(3)).collect::<Result<_, _>>()?;
        Ok(Self { times, allocations: 0, total: StepReport::default() })
    }

    fn add(&mut self, marks: &[Instant], tick: &StepReport) -> Result<(), EntryError> {
        let nanoseconds = |from: Instant, to: Instant| (to - from).as_nanos() as u64;
        for (histogram, pair) in self.times.iter_mut().zip(marks.windows(2)) {
            histogram.record(nanoseconds(pair[0], pair[1]))?;
        }
        self.times[STAGE_NAMES.len()].record(nanoseconds(marks[0], marks[STAGE_NAMES.len()]))?;
        self.total.contacts += tick.contacts;
        self.total.iterations += tick.iterations;
        self.total.linear_iterations += tick.linear_iterations;
        self.total.evaluations += tick.evaluations;
        self.total.unconverged_islands += tick.unconverged_islands;
        Ok(())
    }

    fn report(&self, ticks: u32, arena: &Arena) -> Report {
        let mut report = Report { header: vec!["", "p50", "p99", "max"], ..Report::default() };
        let names = STAGE_NAMES.into_iter().chain(["tick"]);
        for (name, times) in names.zip(&self.times) {
            let ms = [0.5, 0.99, 1.0].map(|q| times.value_at_quantile(q) as f64 * 1e-6);
            report.rows.push([vec![format!("{name}, ms")], ms.map(|ms| format!("{ms:.4}")).to_vec()].concat());
            for (quantile, ms) in ["p50", "p99", "max"].into_iter().zip(ms) {
                report.figures.insert(format!("{name}_{quantile}_ms"), json!(ms));
            }
        }
        let mean = |sum: usize| sum as f64 / f64::from(ticks);
        for (name, key, value) in [
            ("contacts a tick", "contacts_per_tick", mean(self.total.contacts)),
            ("Newton iterations a tick", "newton_iterations_per_tick", mean(self.total.iterations)),
            ("linear iterations a tick", "linear_iterations_per_tick", mean(self.total.linear_iterations)),
            ("residual evaluations a tick", "evaluations_per_tick", mean(self.total.evaluations)),
            ("unconverged islands a tick", "unconverged_islands_per_tick", mean(self.total.unconverged_islands)),
            ("allocations a tick", "allocations_per_tick", mean(self.allocations)),
        ] {
            report.rows.push(vec![name.to_owned(), format!("{value:.3}"), String::new(), String::new()]);
            report.figures.insert(key.to_owned(), json!(value));
        }
        report.figures.insert("cars".to_owned(), json!(CARS));
        report.figures.insert("ticks".to_owned(), json!(ticks));
        report.figures.insert("bodies".to_owned(), json!(arena.world().body_count()));
        let hash = format!("{:016x}", arena.world().state_hash());
        report.figures.insert("state_hash".to_owned(), Value::String(hash));
        report
    }
}
