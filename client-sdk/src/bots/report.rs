//! What a run of bots comes to: a table for a person, JSON for a machine, and a verdict.

use std::{collections::BTreeMap, time::Duration};

use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use serde_json::{Value, json};

use super::{BotTally, FleetTally};
use crate::{SessionEnd, statistics::Durations};

/// A car that drove less than this has gone nowhere, m.
const NOWHERE_M: f64 = 5.0;
/// The length of a run for which [`NOWHERE_M`] holds; for shorter ones it is scaled down.
const NOWHERE_S: f64 = 10.0;
/// The result of one run.
#[derive(Clone, Debug)]
pub struct Report {
    tally: FleetTally,
    problems: Vec<String>,
}

impl Report {
    /// Judges a run for which `asked` bots were asked.
    pub fn new(tally: FleetTally, asked: usize) -> Self {
        let total = tally.total();
        let mut problems = Vec::new();
        if total.connected < asked {
            problems.push(format!("{} of {asked} bots did not join", asked - total.connected));
        }
        let joined = total.connected;
        problems
            .extend(reasons(&total.lost).into_iter().map(|(why, bots)| format!("{bots} of {joined} bots lost: {why}")));
        let least_m = least_m(tally.elapsed);
        let nowhere = total.distances_m.iter().filter(|&&distance| distance < least_m).count();
        if nowhere > 0 {
            problems.push(format!("{nowhere} of {joined} cars went nowhere: less than {least_m:.1} m"));
        }
        Self { tally, problems }
    }

    /// What went wrong, for a person; empty for a good run.
    pub fn problems(&self) -> &[String] {
        &self.problems
    }

    /// A table with a row a script and one for all.
    pub fn table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(UTF8_FULL_CONDENSED);
        table.set_header([
            "script",
            "bots",
            "lost",
            "snapshots",
            "missed",
            "min m",
            "mean m",
            "effect p50 ms",
            "p99 ms",
            "late p50 ms",
            "p99 ms",
            "in kB/s",
            "out kB/s",
        ]);
        // The sum over one script would say the same twice.
        let rows = if self.tally.scripts.len() == 1 { 1 } else { usize::MAX };
        for (name, tally) in self.rows().into_iter().take(rows) {
            table.add_row(cells(name, &tally, self.tally.elapsed));
        }
        table.column_iter_mut().skip(1).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
        table
    }

    /// The same figures, with their units in the names.
    pub fn json(&self) -> Value {
        let rows = self.rows().into_iter();
        let rows = rows.map(|(name, tally)| (name.to_owned(), figures(&tally, self.tally.elapsed)));
        json!({
            "version": pita_protocol::build_info::VERSION_AND_COMMIT,
            "elapsed_s": self.tally.elapsed.as_secs_f64(),
            "ok": self.problems.is_empty(),
            "problems": self.problems,
            "scripts": rows.collect::<serde_json::Map<_, _>>(),
        })
    }

    fn rows(&self) -> Vec<(&'static str, BotTally)> {
        let scripts = self.tally.scripts.iter().map(|(script, tally)| (script.name(), tally.clone()));
        scripts.chain([("all", self.tally.total())]).collect()
    }
}

/// How many were lost for which reason.
fn reasons(lost: &[SessionEnd]) -> BTreeMap<String, usize> {
    let mut reasons = BTreeMap::new();
    lost.iter().for_each(|end| *reasons.entry(end.to_string()).or_default() += 1);
    reasons
}

fn least_m(elapsed: Duration) -> f64 {
    NOWHERE_M * (elapsed.as_secs_f64() / NOWHERE_S).min(1.0)
}

fn cells(name: &str, tally: &BotTally, elapsed: Duration) -> [String; 13] {
    let session = &tally.session;
    let rate = |bytes| format!("{:.1}", per_second(bytes, elapsed) / 1e3);
    [
        name.to_owned(),
        tally.connected.to_string(),
        tally.lost.len().to_string(),
        session.snapshots_received.to_string(),
        session.snapshots_missed.to_string(),
        format!("{:.1}", tally.distance_min_m()),
        format!("{:.1}", tally.distance_mean_m()),
        milliseconds(&session.latency_us, 0.5),
        milliseconds(&session.latency_us, 0.99),
        milliseconds(&tally.lateness_us, 0.5),
        milliseconds(&tally.lateness_us, 0.99),
        rate(session.received_bytes),
        rate(session.sent_bytes),
    ]
}

fn figures(tally: &BotTally, elapsed: Duration) -> Value {
    let session = &tally.session;
    json!({
        "bots_connected": tally.connected,
        "bots_lost": tally.lost.len(),
        "snapshots_received": session.snapshots_received,
        "snapshots_missed": session.snapshots_missed,
        "snapshots_stale": session.snapshots_stale,
        "snapshots_foreign": session.snapshots_foreign,
        "events_received": session.events_received,
        "events_missed": session.events_missed,
        "malformed": session.malformed,
        "inputs_sent": session.inputs_sent,
        "inputs_skipped": tally.inputs_skipped,
        "inputs_in_time": session.inputs_in_time,
        "inputs_late": session.inputs_late,
        "inputs_superseded": session.inputs_superseded,
        "inputs_early": session.inputs_early,
        "inputs_missing": session.inputs_missing,
        "remote_jump_p99_m": quantile_m(&tally.jumps_um, 0.99),
        "remote_jump_max_m": quantile_m(&tally.jumps_um, 1.0),
        "own_correction_p99_m": quantile_m(&session.correction_um, 0.99),
        "jitter_p99_ms": quantile_ms(&session.jitter_us, 0.99),
        "lead_p50_ms": quantile_ms(&session.lead_us, 0.5),
        "distance_min_m": tally.distance_min_m(),
        "distance_mean_m": tally.distance_mean_m(),
        "input_to_effect_p50_ms": quantile_ms(&session.latency_us, 0.5),
        "input_to_effect_p99_ms": quantile_ms(&session.latency_us, 0.99),
        "bots_late_p50_ms": quantile_ms(&tally.lateness_us, 0.5),
        "bots_late_p99_ms": quantile_ms(&tally.lateness_us, 0.99),
        "received_bytes_per_s": per_second(session.received_bytes, elapsed),
        "sent_bytes_per_s": per_second(session.sent_bytes, elapsed),
    })
}

fn per_second(count: u64, elapsed: Duration) -> f64 {
    count as f64 / elapsed.as_secs_f64().max(1e-3)
}

/// `None` where nothing was measured.
fn quantile_ms(durations: &Durations, quantile: f64) -> Option<f64> {
    (!durations.is_empty()).then(|| durations.value_at_quantile(quantile) as f64 / 1e3)
}

/// Of distances in µm; `None` where nothing was measured.
fn quantile_m(distances_um: &Durations, quantile: f64) -> Option<f64> {
    (!distances_um.is_empty()).then(|| distances_um.value_at_quantile(quantile) as f64 / 1e6)
}

fn milliseconds(durations: &Durations, quantile: f64) -> String {
    quantile_ms(durations, quantile).map_or_else(|| "-".to_owned(), |ms| format!("{ms:.1}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bots::ScriptKind;
    use std::time::Instant;

    fn report(distances_m: &[f64], lost: &[SessionEnd], asked: usize, ran: Duration) -> Report {
        let mut tally = FleetTally::new(Instant::now() - ran);
        for &distance in distances_m {
            let bot = BotTally { connected: 1, distances_m: vec![distance], ..BotTally::default() };
            tally.add(ScriptKind::Circle, &bot);
        }
        tally.add(ScriptKind::Chase, &BotTally { lost: lost.to_vec(), ..BotTally::default() });
        Report::new(tally, asked)
    }

    #[test]
    fn a_good_run_has_no_problems() {
        let report = report(&[120.0, 5.1], &[], 2, Duration::from_secs(30));
        assert_eq!(report.problems(), &[] as &[String]);
        assert_eq!(report.json()["ok"], true);
        assert_eq!(report.json()["scripts"]["circle"]["distance_min_m"], 5.1);
        let table = report.table().to_string();
        assert!(["circle", "chase", "all"].iter().all(|row| table.contains(row)), "{table}");
    }

    #[test]
    fn what_went_wrong_is_counted_by_reason() {
        let closed = SessionEnd::Closed { reason: "maintenance".into() };
        let silent = SessionEnd::Lost { silent_for: Duration::from_millis(3040) };
        let lost = [closed.clone(), silent, closed];
        let problems = report(&[120.0, 4.9], &lost, 5, Duration::from_secs(10)).problems;
        let expected = [
            "3 of 5 bots did not join",
            "1 of 2 bots lost: no snapshot for 3.0 s",
            "2 of 2 bots lost: the server closed (maintenance)",
            "1 of 2 cars went nowhere: less than 5.0 m",
        ];
        assert_eq!(problems.len(), expected.len(), "{problems:?}");
        for (problem, expected) in problems.iter().zip(expected) {
            assert!(problem.starts_with(expected), "{problem}");
        }
    }

    #[test]
    fn a_short_run_has_to_get_less_far() {
        assert_eq!(least_m(Duration::from_secs(2)), 1.0);
        assert_eq!(least_m(Duration::from_secs(60)), NOWHERE_M);
    }
}
