//! `pita-bench [NAME..] [--json]`: measurements by name; see [`pita_tests::bench`].

use std::alloc::System;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use pita_protocol::build_info::VERSION_AND_COMMIT;
use pita_tests::bench::{ENTRIES, Options, select};
use pita_tests::table::table;
use serde_json::{Map, Value, json};
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

/// Counts allocations for the measurements that ask.
#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Measures PITA. Without names it measures everything; `pita-bench list` names what there is.
#[derive(Parser)]
#[command(name = "pita-bench", version = VERSION_AND_COMMIT)]
struct Arguments {
    /// What to measure, or `list`
    #[arg(value_name = "NAME")]
    names: Vec<String>,

    /// Print one JSON object on standard output, with units in the key names
    #[arg(long)]
    json: bool,

    /// Ticks to measure [default: each measurement's own]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    ticks: Option<u32>,

    /// Threads of the engine, 1 to 64 [default: each measurement's own]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=64))]
    threads: Option<u16>,

    /// Scenes that `peers` runs, or families of scenes that `published` does, with commas between them [default: all]
    #[arg(long, value_name = "SCENE", value_delimiter = ',')]
    scenes: Vec<String>,

    /// Times that `peers` runs everything in turn; the least time counts [default: 3]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: Option<u32>,

    /// SVG that `solvers` draws
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// Markdown document in which `solvers` replaces what stands between its two comment lines
    #[arg(long, value_name = "FILE")]
    document: Option<PathBuf>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.names == ["list"] {
        let rows = ENTRIES.iter().map(|entry| vec![entry.name.to_owned(), entry.measures.to_owned()]);
        println!("{}", table(&["name", "measures"], rows));
        return ExitCode::SUCCESS;
    }
    let options = Options {
        ticks: arguments.ticks,
        threads: arguments.threads.map(usize::from),
        scenes: arguments.scenes,
        rounds: arguments.rounds,
        plot: arguments.plot,
        document: arguments.document,
    };
    match run(&arguments.names, &options, arguments.json) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("pita-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Measures and prints; tables go to standard error where standard output is for JSON.
fn run(names: &[String], options: &Options, json: bool) -> Result<(), String> {
    let mut figures = Map::new();
    for entry in select(ENTRIES, names)? {
        eprintln!("{}: {}", entry.name, entry.measures);
        let report = (entry.run)(options).map_err(|error| format!("{}: {error}", entry.name))?;
        if json {
            eprintln!("{}\n", report.text());
        } else {
            println!("{}\n", report.text());
        }
        figures.insert(entry.name.to_owned(), Value::Object(report.figures));
    }
    if json {
        println!("{}", json!({ "version": VERSION_AND_COMMIT, "figures": figures }));
    }
    Ok(())
}
