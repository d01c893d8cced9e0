//! `pita-yardstick SCENE_FILE K VARIANT OUT_PREFIX`: runs a `.scene` with K steps a tick and writes what the yardstick's
//! judge reads.
//!
//! `OUT_PREFIX.tr`: little-endian f64 `[ticks + 1][bodies][13]` = centre of mass (3), quaternion w x y z, velocity (3),
//! angular velocity in world axes (3); the first record is the start. `OUT_PREFIX.ms`: `[ticks][2]` = wall ms and CPU ms
//! of all threads, of the step calls alone.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use pita_game::scene::Scene;
use pita_sim::{Settings, World};
use rustix::time::{ClockId, clock_gettime};

#[derive(Parser)]
#[command(version = pita_protocol::build_info::VERSION_AND_COMMIT, about = "Runs a yardstick scene and writes its trace and times")]
struct Arguments {
    /// Scene to run.
    scene: PathBuf,
    /// Engine steps per tick of 1/30 s, 1 to 1024.
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1024))]
    steps: u32,
    /// Comma list of solver options: default, newton=N, tol=M/S, forcing=X, kn=X, kt=X, kj=X, threads=N.
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
    let settings = settings(arguments)?;
    let name = arguments.scene.display();
    let text = std::fs::read_to_string(&arguments.scene).map_err(|error| format!("{name}: {error}"))?;
    let mut scene = Scene::parse(&text, &settings).map_err(|error| format!("{name}: {error}"))?;
    let (mut trace, mut times) = (Vec::new(), Vec::new());
    record(&scene, &mut trace);
    for _ in 0..scene.ticks {
        times.extend(timed_tick(&mut scene.world, arguments.steps));
        record(&scene, &mut trace);
    }
    write(&arguments.out, "tr", &trace)?;
    write(&arguments.out, "ms", &times)
}

/// Settings of the daemon with the variant's options on top.
fn settings(arguments: &Arguments) -> Result<Settings, String> {
    let mut settings = Settings::at(1.0 / (30.0 * f64::from(arguments.steps)));
    for option in arguments.variant.split(',').filter(|&option| option != "default") {
        let unknown = || {
            format!("variant option {option:?}: expected default, newton=N, tol=, forcing=, kn=, kt=, kj= or threads=N")
        };
        let (key, value) = option.split_once('=').ok_or_else(unknown)?;
        let number: f64 = value.parse().map_err(|_| format!("variant option {option:?}: {value:?} is not a number"))?;
        match key {
            "newton" => settings.solver.newton_iterations = number as usize,
            "tol" => settings.solver.tolerance = number,
            "forcing" => settings.solver.forcing = number,
            "kj" => settings.solver.joint_stiffness = number,
            "kn" => settings.contact.normal_stiffness = number,
            "kt" => settings.contact.tangent_stiffness = number,
            "threads" => settings.threads = number as usize,
            _ => return Err(unknown()),
        }
    }
    settings.validate().map_err(|error| format!("variant {:?}: {error}", arguments.variant))?;
    Ok(settings)
}

/// Wall and CPU milliseconds of one tick.
fn timed_tick(world: &mut World, steps: u32) -> [f64; 2] {
    let (wall, cpu) = (Instant::now(), cpu_ms());
    for _ in 0..steps {
        world.step();
    }
    [wall.elapsed().as_secs_f64() * 1e3, cpu_ms() - cpu]
}

/// CPU time of all threads, ms.
fn cpu_ms() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

fn record(scene: &Scene, trace: &mut Vec<f64>) {
    for slice in scene.world.slices() {
        let (q, v) = (slice.q, slice.v);
        trace.extend_from_slice(&q[..3]);
        trace.extend_from_slice(&[q[6], q[3], q[4], q[5]]);
        trace.extend_from_slice(v);
    }
}

fn write(prefix: &Path, extension: &str, numbers: &[f64]) -> Result<(), String> {
    let mut path = prefix.as_os_str().to_owned();
    path.push(format!(".{extension}"));
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(&path, bytes).map_err(|error| format!("{}: {error}", Path::new(&path).display()))
}
