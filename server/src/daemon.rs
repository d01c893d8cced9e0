//! `pita-server run`: puts the parts together, watches over them, and ends them in order.

mod reload;
mod serve;

use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use pita_game::Arena;
use pita_protocol::Keys;
use pita_protocol::message::ArenaSource;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot;

use crate::admin::{Doorkeeper, SecretError};
use crate::arena_source::{ArenaText, SourceError};
use crate::cli::RunArgs;
use crate::config::{BUILT_IN, ConfigError, ServerConfig};
use crate::network::{self, NetworkError};
use crate::output::Output;
use crate::report::Troubles;
use crate::sessions::{Limits, Sessions};
use crate::shared::{Phase, Shared, Start};
use crate::stopwatch::Clock;
use crate::{admin, description, frame, metrics, report};
use serve::{Happening, Serving};

/// Threads of the runtime: signals, status lines and Zenoh's set-up; its traffic has threads of its own.
const RUNTIME_THREADS: usize = 2;
/// How long the end waits for clients to leave after they were told, ms.
const FAREWELL_MS: u64 = 500;
/// How often it looks whether they have left.
const FAREWELL_STEP: Duration = Duration::from_millis(10);
/// Most inputs that may wait for a tick, whatever the limits of sessions multiply to.
const INPUTS_MAX: usize = 65_536;

/// Why the daemon does not run, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum DaemonError {
    /// Bad configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Bad arena.
    #[error(transparent)]
    Arena(#[from] SourceError),
    /// The arena's name is no part of a key expression.
    #[error("arena {name:?}: {reason}")]
    ArenaName {
        /// The name.
        name: String,
        /// What is allowed.
        reason: pita_protocol::WireError,
    },
    /// Bad secret.
    #[error(transparent)]
    Secret(#[from] SecretError),
    /// It cannot listen.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Zenoh refuses a declaration.
    #[error("Zenoh: {0}")]
    Zenoh(String),
    /// The operating system gives no thread or no signals.
    #[error("cannot start: {0}")]
    System(#[from] std::io::Error),
    /// Clients could not be told what there is.
    #[error("{0}")]
    Undescribable(String),
    /// A thread ended that should not have.
    #[error("the {0} thread ended unexpectedly; what it said is above")]
    ThreadEnded(&'static str),
}

impl From<zenoh::Error> for DaemonError {
    fn from(error: zenoh::Error) -> Self {
        Self::Zenoh(error.to_string())
    }
}

/// Runs the daemon until a signal ends it; exit code 0 then.
pub fn run(args: &RunArgs) -> ExitCode {
    let clock = Clock::start();
    match start(args, clock) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => report::failure(&error.to_string()),
    }
}

fn start(args: &RunArgs, clock: Clock) -> Result<(), DaemonError> {
    let (out, log) = (Output::to(std::io::stdout())?, Output::to(std::io::stderr())?);
    init_logging(log.clone());
    let ended = configure(args).and_then(|configured| run_arena(configured, clock, &out));
    out.flush();
    log.flush();
    ended
}

/// Reads configuration and arena; arguments come before the file.
fn configure(args: &RunArgs) -> Result<Configured, DaemonError> {
    let mut config = match &args.config {
        Some(file) => ServerConfig::from_file(file)?,
        None => ServerConfig::built_in(),
    };
    if let Some(listen) = &args.listen {
        config.network.listen.clone_from(listen);
    }
    if let Some(datagrams) = &args.datagrams {
        config.network.datagrams.clone_from(datagrams);
    }
    if let Some(arena) = &args.arena {
        config.arena.source.clone_from(arena);
    }
    config.arena.parameters.extend(args.parameters.iter().cloned());
    if let Some(threads) = args.threads {
        config.arena.threads = threads;
    }
    if let Some(rate) = args.tick_hz {
        config.tick.tick_hz = rate;
    }
    let settings = reload::settings(&config);
    let text = ArenaText::find(&config.arena.source, &config.arena.parameters)?;
    let arena = text.build(&settings)?;
    let file = args.config.as_ref().map_or(BUILT_IN.to_owned(), |file| file.display().to_string());
    // The arena's own steps were checked with its file.
    if arena.precision().steps_per_m.is_none() {
        config.precision.check_reach(arena.reach_m(), &file)?;
    }
    let secret_file = Some(&config.admin.secret_file).filter(|file| !file.as_os_str().is_empty());
    let secret = secret_file.map(|file| admin::read_secret(file)).transpose()?;
    let doorkeeper = Doorkeeper::new(secret, admin::new_tag_key()?);
    Ok(Configured { config, arena, source: text.source(), doorkeeper })
}

/// What is to run.
struct Configured {
    config: ServerConfig,
    arena: Arena,
    /// Text of the arena, and its meshes.
    source: ArenaSource,
    doorkeeper: Doorkeeper,
}

fn run_arena(configured: Configured, clock: Clock, out: &Output) -> Result<(), DaemonError> {
    let Configured { config, arena, source, doorkeeper } = configured;
    let config = &config;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(RUNTIME_THREADS).enable_all().build()?;
    runtime.block_on(async {
        // Before anything that has to be ended in order.
        let ending = watch_signals(Signals::new()?);
        let shared = Arc::new(share(config, &arena, source, clock)?);
        let slots = shared.sessions().slots();
        let (session, endpoints) = network::open(&config.network, &shared.keys, slots).await?;
        let mut serving = Serving::start(config, arena, doorkeeper, &shared, session)?;
        out.print(&report::welcome(&endpoints, &metrics::status(&shared)));
        let ended = watch(config, &shared, &mut serving, ending, out).await;
        say_farewell(&shared).await;
        serving.stop(&shared).await;
        ended
    })
}

fn share(config: &ServerConfig, arena: &Arena, source: ArenaSource, clock: Clock) -> Result<Shared, DaemonError> {
    let name_error = |reason| DaemonError::ArenaName { name: arena.name().to_owned(), reason };
    let limits = config.sessions;
    let description = description::describe(arena, config.precision.of_arena(arena.precision()));
    description::check(&description).map_err(DaemonError::Undescribable)?;
    frame::check(arena.world()).map_err(DaemonError::Undescribable)?;
    // Ranges of the configuration are within u16.
    let players = arena.max_players().min(limits.players_max.get() as u16);
    let inputs = limits.inputs_per_tick_max.get();
    Ok(Shared::new(Start {
        keys: Keys::new(arena.name()).map_err(name_error)?,
        clock,
        tick_hz: config.tick.tick_hz.hz(),
        input_timeout_ms: limits.input_timeout_ms.get(),
        inputs_max: (usize::from(players) * inputs as usize).clamp(1, INPUTS_MAX),
        sessions: Sessions::new(
            Limits {
                players,
                spectators: limits.spectators_max.get() as u16,
                input_timeout_ms: limits.input_timeout_ms.get().into(),
                resume_grace_ms: limits.resume_grace_ms.get().into(),
                inputs_per_tick: inputs,
                bytes_per_s: config.network.client_bytes_per_s.get(),
            },
            &config.bans.names,
        ),
        description,
        source,
    }))
}

/// Prints a status line every few seconds, and reads the arena again on SIGHUP or for who may ask, until a signal comes or a thread ends.
async fn watch(
    config: &ServerConfig,
    shared: &Shared,
    serving: &mut Serving,
    mut ending: oneshot::Receiver<()>,
    out: &Output,
) -> Result<(), DaemonError> {
    let period = Duration::from_secs(config.report.status_line_s.get().into());
    let mut lines = tokio::time::interval_at(tokio::time::Instant::now() + period, period);
    lines.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut hangup = signal(SignalKind::hangup())?;
    let mut told = Troubles::default();
    loop {
        tokio::select! {
            _ = lines.tick() => {
                out.print(&report::status_line(&metrics::status(shared)));
                let now = Troubles::of(shared);
                report::trouble(&told, &now, config.tick.when_behind).iter().for_each(|line| out.print(line));
                told = now;
            }
            _ = hangup.recv() => {
                let (_, said) = tokio::task::block_in_place(|| reload::reload(config, shared));
                said.iter().for_each(|line| out.print(line));
            }
            happening = serving.next() => match happening {
                Happening::ThreadEnded(name) => return Err(DaemonError::ThreadEnded(name)),
                Happening::Ordered(order) => {
                    let said = tokio::task::block_in_place(|| reload::obey(&order, config, shared));
                    said.iter().for_each(|line| out.print(line));
                }
            },
            // An error would be the end of the task that watches, which ends with the process only.
            _ = &mut ending => break,
        }
    }
    out.print("Ending: clients are told. Another Ctrl-C ends at once.");
    Ok(())
}

/// Tells of the first signal; the second one ends the process, whatever the rest of it is at.
fn watch_signals(mut signals: Signals) -> oneshot::Receiver<()> {
    let (first, ending) = oneshot::channel();
    tokio::spawn(async move {
        signals.next().await;
        // Where nobody waits for it, the daemon ends already.
        let _ = first.send(());
        signals.next().await;
        std::process::exit(130);
    });
    ending
}

/// Tells clients that the server ends, and gives them a moment to leave.
async fn say_farewell(shared: &Shared) {
    shared.sessions().close();
    shared.set_phase(Phase::Closing);
    let until_ms = shared.clock.ms() + FAREWELL_MS;
    // One step at least, in which the event goes out.
    loop {
        tokio::time::sleep(FAREWELL_STEP).await;
        if shared.sessions().count() == 0 || shared.clock.ms() >= until_ms {
            break;
        }
    }
}

/// The signals that end the daemon in order.
struct Signals {
    interrupt: Signal,
    terminate: Signal,
}

impl Signals {
    fn new() -> std::io::Result<Self> {
        Ok(Self { interrupt: signal(SignalKind::interrupt())?, terminate: signal(SignalKind::terminate())? })
    }

    async fn next(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }
}

/// Logs go to stderr; `RUST_LOG` chooses which.
fn init_logging(log: Output) {
    use tracing_subscriber::EnvFilter;
    let filter =
        EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,zenoh=error,pita_server=info"));
    // Fails only where the process logs already, which is as good.
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(move || log.clone());
    let _ = log.with_ansi(std::io::stderr().is_terminal()).try_init();
}
