//! What the load test says: tables and a verdict for people, one object for machines. Pure.

use pita_protocol::build_info;
use pita_protocol::message::{STAGE_NAMES, Status};
use serde::{Deserialize, Serialize};

use super::figures::{FRAME_60_HZ_MS, TICK_30_HZ_MS, TickFigures};
use super::options::Counted;
use crate::table::table;

/// One step of the ramp.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Step {
    /// The number that was tried, of what the report says.
    pub count: usize,
    /// Clients asked for.
    pub clients: usize,
    /// What the ticks cost.
    pub ticks: TickFigures,
    /// CPU time of the server process over wall time, cores.
    pub server_cpu_cores: f64,
    /// Resident memory of the server at the step's end, bytes.
    pub server_memory_bytes: u64,
    /// The bots' side.
    pub bots: BotFigures,
    /// The bots were later than [`STARVED_LATENESS_TICKS`](super::STARVED_LATENESS_TICKS): the step tells little about
    /// more clients than that on cores of their own.
    pub bots_starved: bool,
}

/// How the bots of one step did.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct BotFigures {
    /// CPU time of the bots' process over wall time, cores.
    pub cpu_cores: f64,
    /// How late a bot sent its input after it meant to, 99th percentile, ms; `None` where none was sent.
    pub late_p99_ms: Option<f64>,
    /// From sending an input to the first snapshot that has its effect, median, ms; `None` where none was seen.
    pub effect_p50_ms: Option<f64>,
    /// The same, 99th percentile, ms.
    pub effect_p99_ms: Option<f64>,
    /// Shortest path that a bot's car drove, m.
    pub distance_min_m: f64,
    /// Payload from the server, bytes/s a client.
    pub received_bytes_per_s_per_client: f64,
    /// Payload to the server, bytes/s a client.
    pub sent_bytes_per_s_per_client: f64,
    /// Snapshots received, all bots together.
    pub snapshots: u64,
    /// Snapshots that never came, all bots together.
    pub missed_snapshots: u64,
    /// Bots whose session ended before the step did.
    pub lost: usize,
}

/// A whole run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version and commit of this program.
    pub version: &'static str,
    /// Version and commit of the server.
    pub server_version: String,
    /// Arena of the server.
    pub arena: String,
    /// Ticks a second of the server.
    pub tick_hz: u16,
    /// Cores that this machine gives this program.
    pub cores: usize,
    /// Cores that the server was pinned to; `None` for a server that ran already.
    pub server_cores: Option<Vec<usize>>,
    /// What the numbers are of.
    pub counted: Counted,
    /// Limit of the p99 tick time that the run looked for, ms.
    pub until_ms: Option<f64>,
    /// Largest number below every one that passed it.
    pub within_until: Option<usize>,
    /// The steps, in the order in which they ran.
    pub steps: Vec<Step>,
    /// Why the ramp ended before its last step.
    pub failure: Option<String>,
    /// First number at which the p99 tick time passed 16.7 ms.
    pub p99_over_16_7_ms_at: Option<usize>,
    /// First number at which the p99 tick time passed 33.3 ms.
    pub p99_over_33_3_ms_at: Option<usize>,
}

impl Report {
    /// A report of no steps yet.
    pub fn new(server: &Status, counted: Counted, server_cores: Option<Vec<usize>>, until_ms: Option<f64>) -> Self {
        Self {
            version: build_info::VERSION_AND_COMMIT,
            server_version: server.version.clone(),
            arena: server.arena.clone(),
            tick_hz: server.tick_hz,
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            server_cores,
            counted,
            until_ms,
            within_until: None,
            steps: Vec::new(),
            failure: None,
            p99_over_16_7_ms_at: None,
            p99_over_33_3_ms_at: None,
        }
    }

    /// Adds the next step.
    pub fn push(&mut self, step: Step) {
        self.steps.push(step);
        self.p99_over_16_7_ms_at = self.first_over(FRAME_60_HZ_MS).map(|step| step.count);
        self.p99_over_33_3_ms_at = self.first_over(TICK_30_HZ_MS).map(|step| step.count);
        self.within_until = self.until_ms.and_then(|limit| self.largest_within(limit));
    }

    /// Bots lost in all steps together.
    pub fn lost(&self) -> usize {
        self.steps.iter().map(|step| step.bots.lost).sum()
    }

    /// Notes that the run went no further, and why; the first reason counts.
    pub fn fail(&mut self, why: String) {
        self.failure.get_or_insert(why);
    }

    /// Whether every step was measured and no client lost.
    pub fn is_good(&self) -> bool {
        self.failure.is_none() && self.lost() == 0
    }

    /// Tables and verdict.
    pub fn text(&self) -> String {
        let mut text = format!(
            "\nTick time, ms\n{}\n\nStages, p50 / p99 ms, and the tick's thread\n{}\n\nProcesses\n{}\n",
            self.tick_table(),
            self.stage_table(),
            self.process_table()
        );
        text += &self.verdict(FRAME_60_HZ_MS);
        text += &self.verdict(TICK_30_HZ_MS);
        text += &self.until_ms.map_or_else(String::new, |limit| self.how_far(limit));
        if self.steps.iter().any(|step| step.bots_starved) {
            text += "* the bots starved for a core in this step: its figures are those of the shared machine\n";
        }
        if self.lost() > 0 {
            text += &format!("{} clients were lost\n", self.lost());
        }
        if let Some(why) = &self.failure {
            text += &format!("the run ended early: {why}\n");
        }
        text
    }

    /// The smallest number at which the limit was passed.
    fn first_over(&self, limit_ms: f64) -> Option<&Step> {
        let over = self.steps.iter().filter(|step| step.ticks.tick.p99_ms > limit_ms);
        over.min_by_key(|step| step.count)
    }

    /// The largest number below all at which the limit was passed.
    fn largest_within(&self, limit_ms: f64) -> Option<usize> {
        let end = self.first_over(limit_ms).map_or(usize::MAX, |step| step.count);
        self.steps.iter().map(|step| step.count).filter(|&count| count < end).max()
    }

    fn how_far(&self, limit_ms: f64) -> String {
        let what = self.counted.name();
        let beyond = self.first_over(limit_ms).map(|step| step.count);
        match (self.largest_within(limit_ms), beyond) {
            (Some(within), Some(beyond)) => {
                format!("it goes as far as {within} {what}: p99 within {limit_ms} ms there, not at {beyond}\n")
            }
            (Some(within), None) => {
                format!("it goes farther than was tried: p99 within {limit_ms} ms at {within} {what}\n")
            }
            (None, _) => format!("p99 was within {limit_ms} ms at no number of {what} that was tried\n"),
        }
    }

    /// A line about one limit. Where a tick's own work is within the limit it says so: the machine was shared.
    fn verdict(&self, limit_ms: f64) -> String {
        let what = self.counted.name();
        let Some(step) = self.first_over(limit_ms) else {
            return format!("p99 stays within {limit_ms:.1} ms up to {} {what}\n", self.count_max());
        };
        let (count, cpu_ms, wait_ms) = (step.count, step.ticks.cpu.p99_ms, step.ticks.wait.p99_ms);
        let waited = if cpu_ms <= limit_ms {
            format!("; its thread's CPU time does not: p99 {} ms, wait for a core {} ms", ms(cpu_ms), ms(wait_ms))
        } else {
            String::new()
        };
        format!("p99 first passes {limit_ms:.1} ms at {count} {what}{waited}\n")
    }

    fn count_max(&self) -> usize {
        self.steps.iter().map(|step| step.count).max().unwrap_or(0)
    }

    fn tick_table(&self) -> comfy_table::Table {
        let header = [
            self.counted.name(),
            "ticks",
            "bodies",
            "DOF",
            "contacts",
            "p50",
            "p95",
            "p99",
            "max",
            "late p99",
            "overruns",
            "skipped",
        ];
        table(
            &header,
            self.steps.iter().map(|step| {
                let ticks = &step.ticks;
                let mut row = vec![step.marked_count()];
                row.extend([ticks.ticks, ticks.bodies as usize, ticks.dof_awake as usize].map(|n| n.to_string()));
                row.push(ticks.contacts.to_string());
                row.extend([ticks.tick.p50_ms, ticks.tick.p95_ms, ticks.tick.p99_ms, ticks.tick.max_ms].map(ms));
                row.extend([ms(ticks.late.p99_ms), ticks.overruns.to_string(), ticks.skipped_ticks.to_string()]);
                row
            }),
        )
    }

    fn stage_table(&self) -> comfy_table::Table {
        let mut header = vec![self.counted.name()];
        header.extend(STAGE_NAMES);
        header.extend(["CPU", "wait for a core"]);
        table(
            &header,
            self.steps.iter().map(|step| {
                let thread = [step.ticks.cpu, step.ticks.wait];
                let cells = step.ticks.stages.iter().map(|stage| stage.wall).chain(thread);
                let cells = cells.map(|q| format!("{} / {}", ms(q.p50_ms), ms(q.p99_ms)));
                std::iter::once(step.marked_count()).chain(cells).collect()
            }),
        )
    }

    fn process_table(&self) -> comfy_table::Table {
        let header = [
            self.counted.name(),
            "server CPU %",
            "server MiB",
            "kB/s to a client",
            "kB/s from it",
            "bots CPU %",
            "bots late p99 ms",
            "effect p50 / p99 ms",
            "missed snapshots",
            "lost",
        ];
        table(
            &header,
            self.steps.iter().map(|step| {
                let bots = &step.bots;
                vec![
                    step.marked_count(),
                    format!("{:.0}", 100.0 * step.server_cpu_cores),
                    format!("{:.0}", step.server_memory_bytes as f64 / f64::from(1 << 20)),
                    format!("{:.1}", bots.received_bytes_per_s_per_client / 1000.0),
                    format!("{:.1}", bots.sent_bytes_per_s_per_client / 1000.0),
                    format!("{:.0}", 100.0 * bots.cpu_cores),
                    measured_ms(bots.late_p99_ms),
                    format!("{} / {}", measured_ms(bots.effect_p50_ms), measured_ms(bots.effect_p99_ms)),
                    format!("{} of {}", bots.missed_snapshots, bots.snapshots + bots.missed_snapshots),
                    bots.lost.to_string(),
                ]
            }),
        )
    }
}

impl Step {
    /// The step on one line, while the ramp goes on.
    pub fn line(&self, counted: Counted) -> String {
        let (tick, late) = (&self.ticks.tick, self.bots.late_p99_ms);
        let (p50, p99, max) = (ms(tick.p50_ms), ms(tick.p99_ms), ms(tick.max_ms));
        let (count, what) = (self.marked_count(), counted.name());
        format!("{count:>4} {what}: tick p50 {p50} p99 {p99} max {max} ms; bots late p99 {} ms", measured_ms(late))
    }

    fn marked_count(&self) -> String {
        format!("{}{}", self.count, if self.bots_starved { "*" } else { "" })
    }
}

/// Milliseconds with three significant digits.
fn ms(value: f64) -> String {
    let decimals = if value < 10.0 { 2 } else { 1 };
    format!("{value:.decimals$}")
}

/// The same of what may not have been measured.
fn measured_ms(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), ms)
}

#[cfg(test)]
mod tests {
    use pita_protocol::message::TickRecord;

    use super::super::{figures::Quantiles, plot};
    use super::*;

    fn step(count: usize, p99_ms: f64) -> Step {
        let tick = Quantiles { p50_ms: p99_ms / 2.0, p95_ms: p99_ms, p99_ms, max_ms: 2.0 * p99_ms };
        Step {
            count,
            clients: count,
            ticks: TickFigures { ticks: 1000, tick, cpu: tick, ..Default::default() },
            ..Default::default()
        }
    }

    fn report(steps: impl IntoIterator<Item = Step>) -> Report {
        let server = Status { arena: "proving-ground".into(), tick_hz: 30, ..Status::default() };
        let mut report = Report::new(&server, Counted::Clients, Some(vec![0, 1]), Some(16.5));
        steps.into_iter().for_each(|step| report.push(step));
        report
    }

    #[test]
    fn the_verdict_names_the_first_count_over_each_limit() {
        let report = report([step(8, 9.0), step(16, 17.0), step(32, 16.0), step(64, 20.0)]);
        assert_eq!(report.p99_over_16_7_ms_at, Some(16));
        assert_eq!(report.p99_over_33_3_ms_at, None);
        let text = report.text();
        assert!(text.contains("p99 first passes 16.7 ms at 16 clients"), "{text}");
        assert!(text.contains("p99 stays within 33.3 ms up to 64 clients"), "{text}");
        assert!(!text.contains("starved") && !text.contains("lost\n"), "{text}");
    }

    #[test]
    fn the_verdict_says_how_far_it_goes() {
        let report = report([step(16, 9.0), step(32, 17.0), step(64, 16.0), step(24, 16.4)]);
        assert_eq!(report.within_until, Some(24));
        assert!(
            report.text().contains("as far as 24 clients: p99 within 16.5 ms there, not at 32"),
            "{}",
            report.text()
        );
    }

    #[test]
    fn vehicles_are_called_so() {
        let counted = Counted::Vehicles { clients: 1 };
        let mut report = Report::new(&Status::default(), counted, None, None);
        report.push(Step { clients: 1, ..step(128, 12.0) });
        let text = report.text();
        assert!(text.contains("up to 128 vehicles") && !text.contains("clients\n"), "{text}");
    }

    #[test]
    fn the_verdict_tells_work_from_waiting() {
        assert!(!report([step(16, 17.0)]).text().contains("CPU time"));
        let mut shared = step(16, 17.0);
        shared.ticks.cpu.p99_ms = 4.0;
        let text = report([shared]).text();
        assert!(text.contains("at 16 clients; its thread's CPU time does not: p99 4.00 ms"), "{text}");
    }

    #[test]
    fn starved_steps_are_marked_and_lost_clients_counted() {
        let starved = Step { bots_starved: true, ..step(32, 9.0) };
        let lossy = Step { bots: BotFigures { lost: 3, ..Default::default() }, ..step(64, 9.0) };
        let report = report([starved, lossy]);
        assert!(report.lost() == 3 && !report.is_good());
        let text = report.text();
        assert!(
            text.contains("32*") && text.contains("bots starved") && text.contains("3 clients were lost"),
            "{text}"
        );
    }

    #[test]
    fn a_failure_keeps_what_was_measured_and_is_told() {
        let mut report = report([step(8, 9.0)]);
        assert!(report.is_good());
        report.fail("16 clients: the bots ended".into());
        report.fail("the server failed".into());
        assert!(!report.is_good() && report.steps.len() == 1);
        let text = report.text();
        assert!(text.contains("the run ended early: 16 clients: the bots ended") && text.contains("- / -"), "{text}");
    }

    #[test]
    fn json_has_units_in_its_keys() {
        let ticks = TickFigures::of(&[TickRecord { wall_us: 1500, ..Default::default() }], 30);
        let json = serde_json::to_value(report([Step { clients: 4, ticks, ..Default::default() }])).unwrap();
        let step = &json["steps"][0];
        assert_eq!(step["clients"], 4);
        assert_eq!(step["ticks"]["tick"]["p99_ms"], 1.5);
        assert_eq!(step["ticks"]["stages"][3]["name"], "integration");
        assert!(step["ticks"]["stages"][3]["p50_ms"].is_number());
    }

    #[test]
    fn the_plot_has_both_limits_and_every_step() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plot.svg");
        let starved = Step { bots_starved: true, ..step(64, 50.0) };
        plot::draw(&[step(1, 2.0), step(16, 17.0), starved], Counted::Clients, "Tick time", &path).unwrap();
        let svg = std::fs::read_to_string(&path).unwrap();
        assert!(svg.contains("16.7 ms") && svg.contains("33.3 ms") && svg.contains("bots starved"));
        assert_eq!(svg.matches("<circle").count(), 6);
        plot::draw(&[], Counted::Clients, "nothing", &path).unwrap();
    }
}
