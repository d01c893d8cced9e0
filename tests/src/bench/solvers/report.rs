//! What `solvers` says: a table, how `auto` did, and the same for machines. Pure.

use serde_json::{Map, Value, json};

use super::contenders::Contender;
use super::{Measured, Tally};
use crate::bench::Report;
use crate::table::table;
use crate::yardstick::judge::three_digits;

/// A contender counts as one that solves a subject where it leaves no larger share of islands unsolved than `auto`,
/// give or take this.
const AS_GOOD: f64 = 0.01;

const NOTE: &str = "Work is in thousands of block operations a tick (a 3x3 block times a vector is one), ms are CPU time \
of a tick's integration; in brackets the share of islands that did not come to the tolerance. All contenders solve the \
same ticks. Preconditioners of truncated_newton are those of its conjugate gradients.";

/// The report of all subjects.
pub fn report(contenders: &[Contender], measured: &[Measured]) -> Report {
    let mut header = vec![""];
    for subject in measured {
        header.extend([subject.subject.name, "ms"]);
    }
    let rows = contenders.iter().enumerate().map(|(i, contender)| {
        let cells = measured.iter().flat_map(|subject| cells(&subject.tallies[i]));
        [contender.name.clone()].into_iter().chain(cells).collect()
    });
    let bests: Vec<_> = measured.iter().map(|subject| Best::of(contenders, subject)).collect();
    let autos = table(&["", "best fixed choice", "auto / it"], measured.iter().zip(&bests).map(auto_row));
    let what = measured.iter().map(|m| format!("{}: {}", m.subject.name, m.subject.what));
    Report {
        header,
        rows: rows.collect(),
        notes: vec![autos.to_string(), NOTE.to_owned(), what.collect::<Vec<_>>().join("; ") + "."],
        figures: measured
            .iter()
            .zip(&bests)
            .map(|(subject, best)| (subject.subject.name.to_owned(), json(contenders, subject, best)))
            .collect(),
    }
}

/// Work and time.
fn cells(tally: &Tally) -> [String; 2] {
    [work(tally), three_digits(tally.ms_per_tick())]
}

/// Thousands of block operations a tick, and the share of islands that were not solved.
pub(super) fn work(tally: &Tally) -> String {
    let unsolved = tally.unsolved_share();
    let note = if unsolved > 0.0 { format!(" ({:.0} %)", (100.0 * unsolved).ceil()) } else { String::new() };
    three_digits(tally.work_per_tick() * 1e-3) + &note
}

/// The fixed choice with the least work among those that solve a subject.
pub(super) struct Best<'a> {
    pub name: &'a str,
    /// Work of `auto` over its.
    pub auto_over_it: f64,
}

impl<'a> Best<'a> {
    /// `auto` is the first contender; where nobody else solves the subject it is held against itself.
    pub fn of(contenders: &'a [Contender], measured: &Measured) -> Self {
        let (auto, fixed) = (&measured.tallies[0], &measured.tallies[1..]);
        let solves = |tally: &Tally| tally.unsolved_share() <= auto.unsolved_share() + AS_GOOD;
        let best = contenders[1..].iter().zip(fixed).filter(|(_, tally)| solves(tally)).min_by_key(|(_, t)| t.work);
        let (name, work) = best.map_or(("none", auto.work), |(contender, tally)| (&contender.name, tally.work));
        Self { name, auto_over_it: auto.work as f64 / work.max(1) as f64 }
    }
}

fn auto_row((measured, best): (&Measured, &Best)) -> Vec<String> {
    vec![measured.subject.name.to_owned(), best.name.to_owned(), three_digits(best.auto_over_it)]
}

fn json(contenders: &[Contender], measured: &Measured, best: &Best) -> Value {
    let per_tick = |sum: usize, tally: &Tally| sum as f64 / f64::from(tally.ticks.max(1));
    let mut figures: Map<String, Value> = contenders
        .iter()
        .zip(&measured.tallies)
        .map(|(contender, tally)| {
            let figures = json!({
                "work_per_tick_block_operations": tally.work_per_tick(),
                "cpu_per_tick_ms": tally.ms_per_tick(),
                "iterations_per_tick": per_tick(tally.iterations, tally),
                "linear_iterations_per_tick": per_tick(tally.linear_iterations, tally),
                "evaluations_per_tick": per_tick(tally.evaluations, tally),
                "unsolved_islands_share": tally.unsolved_share(),
            });
            (contender.name.clone(), figures)
        })
        .collect();
    figures.insert("best_fixed_choice".to_owned(), json!(best.name));
    figures.insert("auto_work_over_best".to_owned(), json!(best.auto_over_it));
    Value::Object(figures)
}

#[cfg(test)]
mod tests {
    use super::super::contenders::contenders;
    use super::super::subjects::SUBJECTS;
    use super::*;

    fn tally(work: u64, unsolved: usize) -> Tally {
        Tally { ticks: 10, work, islands: 100, unsolved, ..Tally::default() }
    }

    #[test]
    fn auto_is_held_against_the_least_work_of_those_that_solve() {
        let contenders = contenders();
        let mut tallies = vec![tally(9_000_000, 50); contenders.len()];
        (tallies[0], tallies[3], tallies[5]) = (tally(1_200_000, 2), tally(1_000_000, 3), tally(500, 40));
        let measured = [Measured { subject: &SUBJECTS[0], tallies }];
        let report = report(&contenders, &measured);
        let figures = &report.figures[SUBJECTS[0].name];
        assert_eq!(figures["best_fixed_choice"], json!(contenders[3].name));
        assert_eq!(figures["auto_work_over_best"], json!(1.2));
        assert_eq!(report.rows[0][1], "120 (2 %)");
        assert_eq!(report.rows.len(), contenders.len());
    }
}
