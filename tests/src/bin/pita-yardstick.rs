//! `pita-yardstick SCENE_FILE K VARIANT OUT_PREFIX`: runs a `.scene` with K steps a tick and writes what the yardstick's
//! judge reads, `OUT_PREFIX.tr` and `OUT_PREFIX.ms` (see [`pita_server::trace`]).

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use clap::Parser;
use pita_game::scene::Scene;
use pita_server::trace::{self, Trace};
use pita_sim::{Settings, SimError, World};
use pita_tests::yardstick::catalogue;
use pita_tests::yardstick::ours::world_of_beam;
use pita_tests::yardstick::scene::Content;

#[derive(Parser)]
#[command(name = "pita-yardstick", version = pita_protocol::build_info::VERSION_AND_COMMIT, about = "Runs a yardstick scene and writes its trace and times")]
struct Arguments {
    /// Scene file to run, or `soft`: the elastic beam, which has no file.
    scene: PathBuf,
    /// Engine steps per tick of 1/30 s, 1 to 1024.
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1024))]
    steps: u32,
    /// Comma list of solver options: default, method=NAME, preconditioner=NAME, iterations=N, tol=M/S², budget=N,
    /// forcing=X, kn=X, kt=X, kj=X, threads=N.
    variant: String,
    /// Path prefix of the two files that are written.
    out: PathBuf,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("pita-yardstick: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let (mut world, ticks) = subject(&arguments.scene, &settings(arguments)?)?;
    let mut trace = Trace::create(&arguments.out).map_err(|error| error.to_string())?;
    trace.record(&world).map_err(|error| error.to_string())?;
    for _ in 0..ticks {
        let took = trace::time(|| {
            for _ in 0..arguments.steps {
                world.step();
            }
        });
        trace.record_time(took).and_then(|()| trace.record(&world)).map_err(|error| error.to_string())?;
    }
    trace.finish().map_err(|error| error.to_string())
}

/// The world to run, and its ticks.
fn subject(path: &Path, settings: &Settings) -> Result<(World, usize), String> {
    let name = path.display();
    if let Some(Content::Beam(beam)) = path.to_str().and_then(catalogue::content) {
        let world = world_of_beam(&beam, settings).map_err(|error| format!("{name}: {error}"))?;
        return Ok((world, beam.ticks));
    }
    let text = std::fs::read_to_string(path).map_err(|error| format!("{name}: {error}"))?;
    let scene = Scene::parse(&text, settings).map_err(|error| format!("{name}, {error}"))?;
    Ok((scene.world, scene.ticks))
}

/// Settings of the daemon with the variant's options on top.
fn settings(arguments: &Arguments) -> Result<Settings, String> {
    let mut settings = Settings::at(1.0 / (30.0 * f64::from(arguments.steps)));
    for option in arguments.variant.split(',').filter(|&option| option != "default") {
        let unknown = || {
            format!(
                "variant option {option:?}: expected default, method=, preconditioner=, iterations=, tol=, budget=, \
                 forcing=, kn=, kt=, kj= or threads="
            )
        };
        let (key, value) = option.split_once('=').ok_or_else(unknown)?;
        match key {
            "method" => settings.solver.method = named(option, value)?,
            "preconditioner" => settings.solver.preconditioner = named(option, value)?,
            "iterations" => settings.solver.iterations = Some(parsed(option, value, "a whole number")?),
            "budget" => settings.solver.budget = Some(parsed(option, value, "a whole number")?),
            "tol" => settings.solver.tolerance = parsed(option, value, "a number")?,
            "forcing" => settings.solver.forcing = parsed(option, value, "a number")?,
            "kj" => settings.solver.joint_stiffness = parsed(option, value, "a number")?,
            "kn" => settings.contact.normal_stiffness = parsed(option, value, "a number")?,
            "kt" => settings.contact.tangent_stiffness = parsed(option, value, "a number")?,
            "threads" => settings.threads = parsed(option, value, "a whole number")?,
            _ => return Err(unknown()),
        }
    }
    settings.validate().map_err(|error| format!("variant {:?}: {error}", arguments.variant))?;
    Ok(settings)
}

/// The engine's value of a name.
fn named<T: FromStr<Err = SimError>>(option: &str, value: &str) -> Result<T, String> {
    value.parse().map_err(|error| format!("variant option {option:?}: {error}"))
}

/// The value of an option.
fn parsed<T: FromStr>(option: &str, value: &str, kind: &str) -> Result<T, String> {
    value.parse().map_err(|_| format!("variant option {option:?}: {value:?} is not {kind}"))
}
