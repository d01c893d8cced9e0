//! The command line of `pita-bots`.

use std::{
    process::ExitCode,
    time::{Duration, Instant},
};

use clap::Parser;
use pita_protocol::{DEFAULT_ENDPOINT, build_info::VERSION_AND_COMMIT};
use tokio::{
    signal::unix::{SignalKind, signal},
    sync::watch,
    time::sleep,
};

use super::{BotFleet, FleetSettings, Report, ScriptKind, progress};
use crate::{ClientError, ConditionerSettings};

/// How often a server is looked for that does not answer.
const RETRY_PERIOD: Duration = Duration::from_secs(1);
/// How often the person who waits is told so.
const REMINDER_PERIOD: Duration = Duration::from_secs(5);
/// Bots that join between two steps of the bar.
const JOINING_STEP: usize = 8;
/// Between two looks at the bots while they drive.
const LOOK_PERIOD: Duration = Duration::from_millis(200);

/// Bots that connect to a PITA server and drive.
///
/// Prints what they saw, and fails (exit code 1) when a bot could not join, was lost, or went nowhere.
#[derive(Clone, Debug, Parser)]
#[command(name = "pita-bots", version = VERSION_AND_COMMIT, max_term_width = 100)]
pub struct Args {
    /// How many bots.
    #[arg(long, short = 'n', default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1024))]
    count: u16,
    /// What they do; several scripts are dealt out in turn.
    #[arg(long, value_delimiter = ',', default_value = "wander")]
    script: Vec<ScriptKind>,
    /// How long they drive, s.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// Zenoh endpoint of the server.
    #[arg(long, value_name = "ENDPOINT", default_value = DEFAULT_ENDPOINT)]
    connect: String,
    /// Take snapshots as datagrams from this endpoint of the server.
    #[arg(long, value_name = "udp/HOST:PORT")]
    datagrams: Option<String>,
    /// Arena to join; otherwise the server is asked.
    #[arg(long)]
    arena: Option<String>,
    /// Seed of everything random about the bots.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Make the network worse: latency, jitter (ms), loss, duplicate, reorder (per cent), rate (B/s), freeze (EVERY/FOR,
    /// s), seed; before one of them `up.` or `down.` for one direction.
    #[arg(long, value_name = "KEY=VALUE,..")]
    conditioner: Option<ConditionerSettings>,
    /// Look at the world as a player's screen would show it, and count how smoothly cars move.
    #[arg(long)]
    watch: bool,
    /// How long to wait for a server to answer, s.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(0..=86_400))]
    wait: u32,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

/// Runs `pita-bots` with the arguments of this process.
pub fn main() -> ExitCode {
    let args = Args::parse();
    init_log();
    // Zenoh brings its own threads; this one only runs the scripts and the schedule.
    let runtime = match tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => {
            eprintln!("pita-bots: cannot start threads: {error}");
            return ExitCode::FAILURE;
        }
    };
    match runtime.block_on(run(&args)) {
        Ok(report) if report.problems().is_empty() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("pita-bots: {error}");
            ExitCode::FAILURE
        }
    }
}

fn init_log() {
    // What Zenoh has to say about a server that is not there is said by us, in words.
    let filter = tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn,zenoh=off".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
}

async fn run(args: &Args) -> Result<Report, ClientError> {
    let mut fleet = BotFleet::new(FleetSettings {
        arena: args.arena.clone(),
        datagrams: args.datagrams.clone(),
        scripts: args.script.clone(),
        seed: args.seed,
        conditioner: args.conditioner,
        watch: args.watch,
        ..FleetSettings::new(&args.connect)
    });
    let mut interrupted = watch_signals();
    let joined = tokio::select! {
        joined = join(&mut fleet, args) => joined,
        _ = interrupted.wait_for(|&yes| yes) => Ok(()),
    };
    match joined {
        Err(error) if fleet.is_empty() => return Err(error),
        Err(error) => eprintln!("pita-bots: {error}"),
        Ok(()) => {}
    }
    let began = fleet.tally();
    tokio::select! {
        () = drive(&fleet, Duration::from_secs(args.seconds.into())) => {}
        _ = interrupted.wait_for(|&yes| yes) => eprintln!("interrupted: the bots leave"),
    }
    let report = Report::new(fleet.tally().since(&began), args.count.into());
    fleet.stop().await;
    show(&report, args.json);
    Ok(report)
}

/// Connects all bots; the first one patiently.
async fn join(fleet: &mut BotFleet, args: &Args) -> Result<(), ClientError> {
    join_first(fleet, args).await?;
    let count = usize::from(args.count);
    let bar = progress::counting(count);
    bar.set_message("joining");
    let mut joined = Ok(());
    while fleet.len() < count && joined.is_ok() {
        bar.set_position(fleet.len() as u64);
        joined = fleet.add(JOINING_STEP.min(count - fleet.len())).await;
    }
    bar.finish_and_clear();
    joined
}

/// Connects one bot; while no server answers, says so and tries again.
async fn join_first(fleet: &mut BotFleet, args: &Args) -> Result<(), ClientError> {
    let until = Instant::now() + Duration::from_secs(args.wait.into());
    let mut told: Option<Instant> = None;
    loop {
        let error = match fleet.add(1).await {
            Ok(()) => return Ok(()),
            Err(error) => error,
        };
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() || !error.is_worth_retrying() {
            return Err(error);
        }
        if told.is_none_or(|told| told.elapsed() >= REMINDER_PERIOD) {
            told = Some(Instant::now());
            eprintln!("{error}\nwaiting for it, {} s more", left.as_secs_f64().ceil());
        }
        sleep(RETRY_PERIOD.min(left)).await;
    }
}

/// Waits while the bots drive; no longer than one of them is left.
async fn drive(fleet: &BotFleet, duration: Duration) {
    let bar = progress::timing(duration);
    let began = Instant::now();
    while began.elapsed() < duration {
        let running = fleet.running();
        bar.set_position(u64::try_from(began.elapsed().as_millis()).unwrap_or(u64::MAX));
        bar.set_message(format!("{:.0} of {} s, {running} bots", began.elapsed().as_secs_f64(), duration.as_secs()));
        if running == 0 {
            break;
        }
        sleep(LOOK_PERIOD.min(duration.saturating_sub(began.elapsed()))).await;
    }
    bar.finish_and_clear();
}

fn show(report: &Report, json: bool) {
    if json {
        println!("{:#}", report.json());
    } else {
        println!("{}", report.table());
    }
    report.problems().iter().for_each(|problem| eprintln!("pita-bots: {problem}"));
}

/// Turns true at Ctrl-C or SIGTERM.
fn watch_signals() -> watch::Receiver<bool> {
    let (sender, receiver) = watch::channel(false);
    tokio::spawn(async move {
        match terminated().await {
            Ok(()) => drop(sender.send(true)),
            Err(error) => {
                tracing::warn!("Ctrl-C will not be noticed: {error}");
                std::future::pending().await
            }
        }
    });
    receiver
}

async fn terminated() -> std::io::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        pressed = tokio::signal::ctrl_c() => pressed,
        _ = terminate.recv() => Ok(()),
    }
}
