//! The command line.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use pita_protocol::DEFAULT_ENDPOINT;
use pita_protocol::build_info::VERSION_AND_COMMIT;

use crate::config::{TickRate, Within};
use crate::{check, daemon, reload_command, simulate, status};

/// Headless physics game server.
#[derive(Debug, Parser)]
#[command(name = "pita-server", version = VERSION_AND_COMMIT, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: RunArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the server (also without a subcommand)
    Run(RunArgs),
    /// Check configuration and arena files
    Check(CheckArgs),
    /// Run a scene or an arena headless, as fast as it goes, without network
    Simulate(SimulateArgs),
    /// Ask a running server how it does
    Status(StatusArgs),
    /// Ask a running server to read its arena's file again, as SIGHUP does
    Reload(ReloadArgs),
}

/// Arguments of `run`. What is given here comes before the configuration.
#[derive(Debug, Default, Args)]
pub struct RunArgs {
    /// Configuration file; keys that it lacks have their defaults
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Endpoint to listen on; port 0 takes a free one
    #[arg(long, value_name = "tcp/ADDRESS:PORT")]
    pub listen: Option<String>,
    /// Endpoint for snapshots as datagrams besides; port 0 takes a free one
    #[arg(long, value_name = "udp/ADDRESS:PORT")]
    pub datagrams: Option<String>,
    /// Name of a built-in arena, or path of an arena file
    #[arg(long, value_name = "NAME|FILE")]
    pub arena: Option<String>,
    /// A parameter of the arena; may be given several times
    #[arg(long = "set", value_name = "NAME=NUMBER", value_parser = parameter)]
    pub parameters: Vec<(String, i64)>,
    /// Ticks a second
    #[arg(long, value_name = "30|25")]
    pub tick_hz: Option<TickRate>,
    /// Threads that integrate, 1 to 64
    #[arg(long, value_name = "N")]
    pub threads: Option<Within<1, 64>>,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Files, or folders of them; without any: what is built in, and configs/ where there is one
    pub paths: Vec<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// A .scene file, an arena file, or the name of a built-in arena
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// A parameter of the arena; may be given several times
    #[arg(long = "set", value_name = "NAME=NUMBER", value_parser = parameter)]
    pub parameters: Vec<(String, i64)>,
    /// Ticks to run; the scene's own number, or a minute of an arena, where it is not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub ticks: Option<u32>,
    /// Write PREFIX.tr (states) and PREFIX.ms (times) for the yardstick's judge
    #[arg(long, value_name = "PREFIX")]
    pub out: Option<PathBuf>,
    /// Ticks a second
    #[arg(long, value_name = "30|25", default_value = "30")]
    pub tick_hz: TickRate,
    /// Threads that solve islands; the result does not depend on it
    #[arg(long, value_name = "1..64", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub threads: u16,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// Endpoint of the server
    #[arg(long, value_name = "ENDPOINT", default_value = DEFAULT_ENDPOINT)]
    pub connect: String,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `reload`.
#[derive(Debug, Args)]
pub struct ReloadArgs {
    /// Endpoint of the server
    #[arg(long, value_name = "ENDPOINT", default_value = DEFAULT_ENDPOINT)]
    pub connect: String,
    /// The file that the server's admin.secret_file names, or a copy of it
    #[arg(long, value_name = "FILE")]
    pub secret_file: PathBuf,
    /// Print JSON instead of lines
    #[arg(long)]
    pub json: bool,
}

/// `size=20`.
fn parameter(text: &str) -> Result<(String, i64), String> {
    let parts = text.split_once('=').and_then(|(name, number)| Some((name.to_owned(), number.parse().ok()?)));
    parts.ok_or_else(|| "expected a name, =, and a whole number: size=20".to_owned())
}

impl Cli {
    /// Does what was asked for.
    pub fn execute(self) -> ExitCode {
        match self.command.unwrap_or(Command::Run(self.run)) {
            Command::Run(args) => daemon::run(&args),
            Command::Check(args) => check::run(&args),
            Command::Simulate(args) => simulate::run(&args),
            Command::Status(args) => status::run(&args),
            Command::Reload(args) => reload_command::run(&args),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent_and_runs_by_default() {
        Cli::command().debug_assert();
        let cli = Cli::try_parse_from(["pita-server", "--tick-hz", "25", "--listen", "tcp/127.0.0.1:0"]).unwrap();
        assert!(cli.command.is_none());
        assert_eq!(cli.run.tick_hz.map(TickRate::hz), Some(25));
        let refused = Cli::try_parse_from(["pita-server", "run", "--tick-hz", "60"]).unwrap_err().to_string();
        assert!(refused.contains("--tick-hz") && refused.contains("60") && refused.contains("30 or 25"), "{refused}");
    }
}
