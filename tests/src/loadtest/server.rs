//! The server under test: a process of this very program, pinned to cores of its own.

use std::ffi::OsString;
use std::process::{Command, ExitCode};

use rustix::process::{Signal, set_parent_process_death_signal};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use super::options::Options;
use super::this_program;

/// Cores that a server is pinned to unless told otherwise: one for the ticks, one for the network.
const CORES_DEFAULT: usize = 2;

/// Cores to pin the server to.
pub fn cores(options: &Options) -> Vec<usize> {
    if options.cores.is_empty() { first_cores() } else { options.cores.clone() }
}

/// Command line that makes this program the server of `options`, pinned to `cores`; `vehicles` is how many cars it drives
/// itself, unless its arena says.
pub fn command(options: &Options, cores: &[usize], vehicles: Option<u16>) -> Command {
    let cores: Vec<String> = cores.iter().map(usize::to_string).collect();
    let mut command = Command::new(this_program());
    command.args(["serve", "--cores", &cores.join(","), "--", "run"]);
    if let Some(config) = &options.config {
        command.arg("--config").arg(config);
    }
    if let Some(arena) = &options.arena {
        command.args(["--arena", arena]);
    }
    if let Some(vehicles) = vehicles {
        command.args(["--set", &format!("drivers={vehicles}")]);
    }
    command.args(&options.server);
    command
}

/// Runs the server in this process: pinned to `cores`, and not longer than the load test lives.
pub fn serve(cores: &[usize], arguments: Vec<OsString>) -> ExitCode {
    if let Err(error) = end_with_the_parent().and_then(|()| pin(cores)) {
        eprintln!("pita-loadtest: {error}");
        return ExitCode::FAILURE;
    }
    pita_server::run_from_args(std::iter::once("pita-server".into()).chain(arguments))
}

fn end_with_the_parent() -> Result<(), String> {
    set_parent_process_death_signal(Some(Signal::TERM))
        .map_err(|error| format!("cannot be tied to its parent: {error}"))
}

/// Pins this thread, and with it all that it will start, to `cores`.
fn pin(cores: &[usize]) -> Result<(), String> {
    let mut set = CpuSet::new();
    for &core in cores {
        if core >= CpuSet::MAX_CPU {
            return Err(format!("--cores {core}: allowed is 0 to {}", CpuSet::MAX_CPU - 1));
        }
        set.set(core);
    }
    sched_setaffinity(None, &set).map_err(|error| format!("--cores {cores:?} cannot be used here: {error}"))
}

fn first_cores() -> Vec<usize> {
    let allowed = sched_getaffinity(None).unwrap_or_else(|_| CpuSet::new());
    (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core)).take(CORES_DEFAULT).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_core_to_pin_to_and_none_beyond_the_last() {
        assert!((1..=CORES_DEFAULT).contains(&first_cores().len()));
        assert!(pin(&[CpuSet::MAX_CPU]).unwrap_err().contains("allowed is 0 to"));
        assert!(pin(&[]).unwrap_err().contains("cannot be used here"));
    }
}
