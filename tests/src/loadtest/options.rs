//! Command line of `pita-loadtest`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use pita_client::ConditionerSettings;
use pita_client::bots::ScriptKind;
use pita_protocol::build_info::VERSION_AND_COMMIT;
use serde::Serialize;

/// Finds out how many clients one server carries: ramps bots through a list and prints what a tick costs at each count.
#[derive(Parser)]
#[command(name = "pita-loadtest", version = VERSION_AND_COMMIT, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    /// What to measure.
    #[command(flatten)]
    pub options: Options,
    /// The program's other processes.
    #[command(subcommand)]
    pub role: Option<Role>,
}

/// What to measure, and where the results go.
#[derive(Args)]
pub struct Options {
    /// Numbers of clients, in the order in which they are tried, 1 to 1000 each [default: 1,4,8,16,32,64]
    #[arg(long, value_delimiter = ',', value_name = "N,..", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub clients: Vec<u16>,

    /// Cars that the arena drives itself, on a server of their own for each number, instead of more and more clients: the
    /// arena's parameter `drivers`, 1 to 1000 each; with one client, unless --clients says another number
    #[arg(long, value_delimiter = ',', value_name = "N,..", conflicts_with = "connect",
          value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub vehicles: Vec<u16>,

    /// Stop at the first number whose p99 tick passes this, ms; go on beyond the last one until it does; and look between
    /// the two for how far it goes
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    pub until: Option<f64>,

    /// Ticks to measure at each number of clients, 30 to 1000000
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(30..=1_000_000))]
    pub ticks: u64,

    /// What the bots do
    #[arg(long, default_value = "wander")]
    pub script: ScriptKind,

    /// Make the bots' network worse: latency, jitter (ms), loss, duplicate, reorder (per cent), rate (B/s), freeze
    /// (EVERY/FOR, s), seed; before one of them `up.` or `down.` for one direction
    #[arg(long, value_name = "KEY=VALUE,..", value_parser = checked_conditions)]
    pub conditioner: Option<String>,

    /// Measure the server that runs at this endpoint instead of starting one
    #[arg(long, value_name = "ENDPOINT", conflicts_with_all = ["config", "arena", "cores"])]
    pub connect: Option<String>,

    /// Configuration of the server that is started
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,

    /// Arena of the server that is started
    #[arg(long, value_name = "NAME|FILE")]
    pub arena: Option<String>,

    /// Cores that the server is pinned to [default: the first two that there are]
    #[arg(long, value_delimiter = ',', value_name = "CORE,..")]
    pub cores: Vec<usize>,

    /// Folder for the plot, made if missing
    #[arg(long, default_value = "out/loadtest", value_name = "FOLDER")]
    pub out: PathBuf,

    /// Write the figures as JSON to this file, `-` for standard output
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,

    /// Further arguments of the server that is started, such as `-- --threads 2 --set storm=1`
    #[arg(last = true, value_name = "ARGUMENT", conflicts_with = "connect")]
    pub server: Vec<OsString>,
}

/// The most of either that a load test asks for.
pub const COUNT_MAX: u16 = 1000;

/// Clients where nothing else is asked for.
const CLIENTS_DEFAULT: [u16; 6] = [1, 4, 8, 16, 32, 64];

/// What the numbers of a run are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    /// Bots.
    Clients,
    /// Cars of the arena's own, and so many bots with them.
    Vehicles {
        /// Bots.
        clients: u16,
    },
}

impl Counted {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clients => "clients",
            Self::Vehicles { .. } => "vehicles",
        }
    }
}

impl Options {
    /// What is counted, and the numbers to begin with.
    ///
    /// # Errors
    /// Where both are lists.
    pub fn counts(&self) -> Result<(Counted, Vec<u16>), String> {
        match (&self.clients[..], &self.vehicles[..]) {
            ([], []) => Ok((Counted::Clients, CLIENTS_DEFAULT.to_vec())),
            (clients, []) => Ok((Counted::Clients, clients.to_vec())),
            ([], vehicles) => Ok((Counted::Vehicles { clients: 1 }, vehicles.to_vec())),
            (&[clients], vehicles) => Ok((Counted::Vehicles { clients }, vehicles.to_vec())),
            (clients, _) => Err(format!("--clients {clients:?}: with --vehicles, one number")),
        }
    }
}

/// A limit of a tick's time.
fn milliseconds(text: &str) -> Result<f64, String> {
    let limit: f64 = text.parse().map_err(|_| "not a number of milliseconds".to_owned())?;
    if (0.01..=10_000.0).contains(&limit) { Ok(limit) } else { Err("allowed is 0.01 to 10000 ms".to_owned()) }
}

/// Processes that the load test starts of itself, so that the CPU time of server and bots is told apart.
#[derive(Subcommand)]
pub enum Role {
    /// The server, pinned.
    #[command(hide = true)]
    Serve {
        /// Cores to run on.
        #[arg(long, value_delimiter = ',')]
        cores: Vec<usize>,
        /// Command line of `pita-server`.
        #[arg(last = true)]
        arguments: Vec<OsString>,
    },
    /// The bots of one step.
    #[command(hide = true)]
    Bots {
        /// Where the server listens.
        #[arg(long)]
        connect: String,
        /// Number of bots.
        #[arg(long)]
        count: usize,
        /// What they do.
        #[arg(long)]
        script: ScriptKind,
        /// What their messages meet.
        #[arg(long, value_parser = checked_conditions)]
        conditioner: Option<String>,
    },
}

/// The text as it is, for the bots' process, once it is known to be good.
fn checked_conditions(text: &str) -> Result<String, pita_client::ConditionsError> {
    text.parse::<ConditionerSettings>().map(|_| text.to_owned())
}
