//! `pita-loadtest`: how many clients, or cars of its own, one server carries; see [`pita_tests::loadtest`].

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use pita_tests::loadtest::options::{Arguments, Options, Role};
use pita_tests::loadtest::report::Report;
use pita_tests::loadtest::{bots, plot, ramp, server};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match arguments.role {
        Some(Role::Serve { cores, arguments }) => server::serve(&cores, arguments),
        Some(Role::Bots { connect, count, script, conditioner }) => {
            bots::run(&connect, count, script, conditioner.as_deref())
        }
        None => measure(&arguments.options),
    }
}

fn measure(options: &Options) -> ExitCode {
    let outcome = tokio::runtime::Runtime::new()
        .map_err(|error| format!("no runtime: {error}"))
        .and_then(|runtime| runtime.block_on(ramp::run(options)).map_err(|error| error.to_string()))
        .and_then(|report| show(&report, options).map(|()| report));
    match outcome {
        Ok(report) if report.is_good() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("pita-loadtest: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Prints the report; on standard error where standard output is for JSON.
fn show(report: &Report, options: &Options) -> Result<(), String> {
    let plot = plot_file(report, &options.out)?;
    let text = format!("{}Plot: {}", report.text(), plot.display());
    let json = serde_json::to_string_pretty(report).map_err(|error| format!("JSON: {error}"))?;
    match &options.json {
        Some(file) if file.as_os_str() == "-" => {
            eprintln!("{text}");
            println!("{json}");
        }
        Some(file) => {
            println!("{text}\nFigures: {}", file.display());
            std::fs::write(file, json).map_err(|error| format!("{}: {error}", file.display()))?;
        }
        None => println!("{text}"),
    }
    Ok(())
}

fn plot_file(report: &Report, folder: &Path) -> Result<PathBuf, String> {
    let file = folder.join("tick-time.svg");
    let title = format!("Tick time against {}, {} at {} Hz", report.counted.name(), report.arena, report.tick_hz);
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    plot::draw(&report.steps, report.counted, &title, &file).map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(file)
}
