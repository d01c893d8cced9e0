//! The bots of one step, in a process of their own: this program in another role, told what to do over its standard
//! input.
//!
//! It prints `joined` once all bots drive. Told `mark`, it begins to count and prints `marked`; told `figures`, it
//! prints what it counted since. At the end of its input the bots leave.

use std::io::BufRead;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use pita_client::bots::{BotFleet, FleetSettings, FleetTally, ScriptKind};
use pita_client::{ClientError, ConditionerSettings, Durations};
use rustix::time::{ClockId, clock_gettime};
use tokio::sync::mpsc;

use super::report::BotFigures;
use crate::process::{Process, ProcessError};

/// How long the bots' process may take to answer, and to leave.
const PATIENCE: Duration = Duration::from_secs(20);

/// How long a bot may take for each step of connecting: many connect at once.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// Seed of the bots' choices: every run drives alike, as far as the network lets it.
const SEED: u64 = 2002;

const JOINED: &str = "joined";
const MARK: &str = "mark";
const MARKED: &str = "marked";
const FIGURES: &str = "figures";

/// A running process of bots.
pub struct Bots {
    /// The process.
    pub process: Process,
}

impl Bots {
    /// Starts `count` bots that do `script` as a process of `program`, which is `pita-loadtest`; what their messages meet
    /// is text of [`ConditionerSettings`].
    ///
    /// # Errors
    /// [`ProcessError::Start`].
    pub fn start(
        program: &Path,
        endpoint: &str,
        count: usize,
        script: ScriptKind,
        conditioner: Option<&str>,
    ) -> Result<Self, ProcessError> {
        let mut command = Command::new(program);
        command.args(["bots", "--connect", endpoint, "--count", &count.to_string(), "--script", script.name()]);
        conditioner.map(|conditions| command.args(["--conditioner", conditions]));
        Ok(Self { process: Process::start("the bots", &mut command)? })
    }

    /// Waits until all of them drive.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where one cannot join, or `within` passes.
    pub fn wait_until_joined(&mut self, within: Duration) -> Result<(), ProcessError> {
        self.process.line_with(JOINED, within).map(drop)
    }

    /// Begins to count.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where the process does not answer.
    pub fn mark(&mut self) -> Result<(), ProcessError> {
        self.process.tell(MARK)?;
        self.process.line_with(MARKED, PATIENCE).map(drop)
    }

    /// What was counted since the mark; to be asked once.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where the process does not answer.
    pub fn figures(&mut self) -> Result<BotFigures, ProcessError> {
        self.process.tell(FIGURES)?;
        let line = self.process.line_with(FIGURES, PATIENCE)?;
        let json = line.trim_start_matches(FIGURES);
        serde_json::from_str(json)
            .map_err(|error| self.process.failed(format!("printed figures that are none: {error}")))
    }

    /// Lets them leave.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where they do not, in time.
    pub fn stop(mut self) -> Result<(), ProcessError> {
        self.process.end_input();
        self.process.wait_for_success(PATIENCE)
    }
}

/// Runs the bots in this process, until its standard input ends.
pub fn run(endpoint: &str, count: usize, script: ScriptKind, conditioner: Option<&str>) -> ExitCode {
    // Text that was no conditions did not get past the command line.
    let conditioner: Option<ConditionerSettings> = conditioner.and_then(|text| text.parse().ok());
    let settings = FleetSettings {
        scripts: vec![script],
        seed: SEED,
        conditioner,
        connect_timeout: CONNECT_TIMEOUT,
        ..FleetSettings::new(endpoint)
    };
    let outcome = tokio::runtime::Runtime::new()
        .map_err(|error| format!("no runtime: {error}"))
        .and_then(|runtime| runtime.block_on(obey(settings, count)).map_err(|error| error.to_string()));
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("pita-loadtest: {error}");
            ExitCode::FAILURE
        }
    }
}

async fn obey(settings: FleetSettings, count: usize) -> Result<(), ClientError> {
    let mut fleet = BotFleet::new(settings);
    fleet.add(count).await?;
    println!("{JOINED}");
    let mut told = standard_input();
    let mut mark = Mark::now(&fleet);
    while let Some(line) = told.recv().await {
        match line.as_str() {
            MARK => {
                mark = Mark::now(&fleet);
                println!("{MARKED}");
            }
            // Numbers and a struct of numbers always have a JSON form.
            FIGURES => println!("{FIGURES} {}", serde_json::to_string(&mark.figures(&fleet)).unwrap_or_default()),
            other => eprintln!("told \"{other}\", which is nothing"),
        }
    }
    fleet.stop().await;
    Ok(())
}

/// State of all counts at the beginning of a measurement.
struct Mark {
    tally: FleetTally,
    cpu: Duration,
    at: Instant,
}

impl Mark {
    fn now(fleet: &BotFleet) -> Self {
        Self { tally: fleet.tally(), cpu: process_cpu_time(), at: Instant::now() }
    }

    fn figures(&self, fleet: &BotFleet) -> BotFigures {
        let counted = fleet.tally().since(&self.tally).total();
        let ms = |durations: &Durations, quantile| {
            (!durations.is_empty()).then(|| durations.value_at_quantile(quantile) as f64 / 1000.0)
        };
        let elapsed_s = self.at.elapsed().as_secs_f64();
        let rate = |bytes: u64| bytes as f64 / elapsed_s / fleet.len().max(1) as f64;
        BotFigures {
            cpu_cores: (process_cpu_time() - self.cpu).as_secs_f64() / elapsed_s,
            late_p99_ms: ms(&counted.lateness_us, 0.99),
            effect_p50_ms: ms(&counted.session.latency_us, 0.50),
            effect_p99_ms: ms(&counted.session.latency_us, 0.99),
            distance_min_m: counted.distance_min_m(),
            received_bytes_per_s_per_client: rate(counted.session.received_bytes),
            sent_bytes_per_s_per_client: rate(counted.session.sent_bytes),
            snapshots: counted.session.snapshots_received,
            missed_snapshots: counted.session.snapshots_missed,
            lost: counted.lost.len(),
        }
    }
}

/// CPU time of all threads of this process.
fn process_cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    // The clock starts at zero with the process.
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap_or(0))
}

/// Lines of the standard input, which blocks and so has a thread of its own.
fn standard_input() -> mpsc::Receiver<String> {
    let (sender, receiver) = mpsc::channel(4);
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.blocking_send(line).is_err() {
                return;
            }
        }
    });
    receiver
}
