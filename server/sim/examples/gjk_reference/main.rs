//! Checks the fine phase against a slow reference, and measures what an extrusion radius does for GJK.
//!
//! `cargo run -p pita-sim --release --example gjk_reference -- --pairs 1000000`

mod convergence;
mod pairs;
mod reference;
mod tally;

use clap::Parser;
use comfy_table::Table;
use convergence::Convergence;
use indicatif::{ProgressBar, ProgressStyle};
use pairs::{Kind, Pairs};
use serde::Serialize;
use tally::Tally;

/// Checks the fine phase against a slow reference, and measures what an extrusion radius does for GJK.
#[derive(Parser)]
struct Arguments {
    /// Pairs to check, all kinds together.
    #[arg(long, default_value_t = 1_000_000)]
    pairs: u64,
    /// Seed of the pairs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Shows this many pairs that fail.
    #[arg(long, default_value_t = 0)]
    show: usize,
    /// Prints JSON instead of tables.
    #[arg(long)]
    json: bool,
}

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    let bar = ProgressBar::new(arguments.pairs);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {human_pos}/{human_len} pairs, {eta} left") {
        bar.set_style(style);
    }
    let tallies = tallies(&arguments, &bar);
    bar.set_message("convergence");
    let convergence = convergence::measure(arguments.pairs.min(2000) as u32, arguments.seed);
    bar.finish_and_clear();
    let failures: u64 = tallies.iter().map(Tally::failures).sum();
    let report = Report { tallies, convergence };
    match (arguments.json, serde_json::to_string_pretty(&report)) {
        (true, Ok(json)) => println!("{json}"),
        _ => println!("{}\n{}", tally_table(&report.tallies), convergence_table(&report.convergence)),
    }
    if failures == 0 { std::process::ExitCode::SUCCESS } else { std::process::ExitCode::FAILURE }
}

#[derive(Serialize)]
struct Report {
    tallies: Vec<Tally>,
    convergence: Vec<Convergence>,
}

fn tallies(arguments: &Arguments, bar: &ProgressBar) -> Vec<Tally> {
    let mut shown = 0;
    Kind::ALL
        .into_iter()
        .zip(0..)
        .map(|(kind, index)| {
            let mut pairs = Pairs::new(arguments.seed + index);
            let mut tally = Tally::of(kind);
            for done in 1..=arguments.pairs / Kind::ALL.len() as u64 {
                let pair = pairs.pair(kind);
                if !tally.check(&pair) && shown < arguments.show {
                    shown += 1;
                    bar.suspend(|| eprintln!("{}: {pair:?}", kind.name()));
                }
                if done % 1000 == 0 {
                    bar.inc(1000);
                }
            }
            tally
        })
        .collect()
}

fn tally_table(tallies: &[Tally]) -> Table {
    let mut table = Table::new();
    table.set_header([
        "kind",
        "pairs",
        "overlap",
        "missed",
        "not finite",
        "distance",
        "depth",
        "normal",
        "unsure",
        "worst distance, m",
        "worst depth, m",
    ]);
    for t in tallies {
        let counts = [
            t.pairs,
            t.overlapping,
            t.missed,
            t.not_finite,
            t.wrong_distances,
            t.wrong_depths,
            t.wrong_normals,
            t.unsure,
        ];
        let worst = [t.worst_distance, t.worst_depth].map(|error| format!("{error:.1e}"));
        let row = std::iter::once(t.kind.to_owned()).chain(counts.map(|n| n.to_string())).chain(worst);
        table.add_row(row);
    }
    table
}

fn convergence_table(measured: &[Convergence]) -> Table {
    let mut table = Table::new();
    table.set_header(["gap, m", "radius, m", "GJK support points", "most", "with EPA", "EPA support points"]);
    for c in measured {
        table.add_row([
            format!("{:.0e}", c.gap),
            format!("{}", c.radius),
            format!("{:.1}", c.mean),
            c.most.to_string(),
            format!("{:.0} %", 100.0 * c.epa_share),
            format!("{:.1}", c.epa_mean),
        ]);
    }
    table
}
