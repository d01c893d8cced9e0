//! The ramp: steps through the numbers of clients and measures each.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use pita_protocol::message::{Status, TickRecord};

use super::bots::Bots;
use super::course::Course;
use super::figures::TickFigures;
use super::options::{Counted, Options};
use super::report::{Report, Step};
use super::server;
use super::{STARVED_LATENESS_TICKS, this_program};
use crate::observer::{Observer, ObserverError};
use crate::process::ProcessError;
use crate::server_process::ServerProcess;

/// Ticks between the last join and the first measured one: cars have come to rest on the ground and drive.
const SETTLE_TICKS: u64 = 60;

/// How often the server is asked for the records of its ticks. It keeps over two minutes of them.
const POLL: Duration = Duration::from_millis(500);

/// How long a server may take for its next tick, for the bots to join, or for their sessions to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum LoadTestError {
    /// Server or bots did not run.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// The server does not answer.
    #[error(transparent)]
    Observer(#[from] ObserverError),
    /// The options do not say what to do.
    #[error("{0}")]
    Unclear(String),
    /// The server does not get on.
    #[error("{0}")]
    Stuck(String),
}

/// Runs the whole ramp: starts a server unless told of one, measures each number, ends the server in order. Where vehicles
/// are counted, each number has a server of its own.
///
/// # Errors
/// [`LoadTestError`] before the first step: what did not run, with what it printed. A step that fails ends the ramp, and
/// clients may be lost: the report has both.
pub async fn run(options: &Options) -> Result<Report, LoadTestError> {
    let (counted, counts) = options.counts().map_err(LoadTestError::Unclear)?;
    let mut course = Course::new(counts, options.until);
    let cores = server::cores(options);
    if let Counted::Vehicles { clients } = counted {
        return with_servers_of_their_own(options, &cores, clients, &mut course).await;
    }
    if let Some(endpoint) = &options.connect {
        return ramp(endpoint, options, None, &mut course).await;
    }
    let server = ServerProcess::start(&mut server::command(options, &cores, None))?;
    let mut report = ramp(&server.endpoint, options, Some(cores), &mut course).await?;
    if let Err(error) = server.stop() {
        report.fail(error.to_string());
    }
    Ok(report)
}

async fn ramp(
    endpoint: &str,
    options: &Options,
    server_cores: Option<Vec<usize>>,
    course: &mut Course,
) -> Result<Report, LoadTestError> {
    let observer = Observer::connect(endpoint).await?;
    let mut report = Report::new(&observer.status().await?, Counted::Clients, server_cores, options.until);
    while let Some(clients) = course.advance() {
        match measure(&observer, endpoint, options, (Counted::Clients, clients)).await {
            Ok(step) => {
                course.saw(step.ticks.tick.p99_ms);
                eprintln!("{}", step.line(Counted::Clients));
                report.push(step);
            }
            Err(error) => {
                report.fail(format!("{clients} clients: {error}"));
                break;
            }
        }
    }
    Ok(report)
}

/// The ramp where vehicles are counted.
async fn with_servers_of_their_own(
    options: &Options,
    cores: &[usize],
    clients: u16,
    course: &mut Course,
) -> Result<Report, LoadTestError> {
    let counted = Counted::Vehicles { clients };
    let mut report: Option<Report> = None;
    while let Some(vehicles) = course.advance() {
        let step = async {
            let server = ServerProcess::start(&mut server::command(options, cores, Some(vehicles)))?;
            let observer = Observer::connect(&server.endpoint).await?;
            let status = observer.status().await?;
            let step = measure(&observer, &server.endpoint, options, (counted, vehicles)).await?;
            server.stop()?;
            Ok::<_, LoadTestError>((status, step))
        };
        match (step.await, &mut report) {
            (Ok((status, step)), report) => {
                course.saw(step.ticks.tick.p99_ms);
                eprintln!("{}", step.line(counted));
                let fresh = || Report::new(&status, counted, Some(cores.to_vec()), options.until);
                report.get_or_insert_with(fresh).push(step);
            }
            (Err(error), Some(report)) => {
                report.fail(format!("{vehicles} vehicles: {error}"));
                break;
            }
            (Err(error), None) => return Err(error),
        }
    }
    report.ok_or_else(|| LoadTestError::Unclear("no number of vehicles was given".to_owned()))
}

/// One step: bots join, settle, are measured and leave.
async fn measure(
    observer: &Observer,
    endpoint: &str,
    options: &Options,
    (counted, count): (Counted, u16),
) -> Result<Step, LoadTestError> {
    let clients = usize::from(if let Counted::Vehicles { clients } = counted { clients } else { count });
    let progress = progress_bar(&format!("{count} {}", counted.name()), options.ticks);
    let others = observer.status().await?.clients;
    let mut bots = Bots::start(&this_program(), endpoint, clients, options.script, options.conditioner.as_deref())?;
    progress.set_message("joining");
    bots.wait_until_joined(PATIENCE)?;
    progress.set_message("settling");
    let joined = observer.status().await?.tick;
    await_status(observer, "the next tick", |status| status.tick >= joined + SETTLE_TICKS).await?;

    progress.set_message("measuring");
    bots.mark()?;
    let before = observer.status().await?;
    let records = collect(observer, before.tick + 1, options.ticks, &progress).await?;
    let after = observer.status().await?;
    let bot_figures = bots.figures()?;
    progress.set_message("leaving");
    bots.stop()?;
    await_status(observer, "all bots to be gone", |status| status.clients <= others).await?;
    progress.finish_and_clear();

    let tick_ms = 1000.0 / f64::from(after.tick_hz.max(1));
    Ok(Step {
        count: usize::from(count),
        clients,
        ticks: TickFigures::of(&records, after.tick_hz),
        server_cpu_cores: (after.cpu_s - before.cpu_s) / (after.uptime_s - before.uptime_s).max(f64::MIN_POSITIVE),
        server_memory_bytes: after.memory_bytes,
        bots: bot_figures,
        bots_starved: bot_figures.late_p99_ms.is_some_and(|late_ms| late_ms > STARVED_LATENESS_TICKS * tick_ms),
    })
}

/// The records of `ticks` ticks from `since` on.
async fn collect(
    observer: &Observer,
    since: u64,
    ticks: u64,
    progress: &ProgressBar,
) -> Result<Vec<TickRecord>, LoadTestError> {
    let wanted = usize::try_from(ticks).unwrap_or(usize::MAX);
    let mut records: Vec<TickRecord> = Vec::new();
    let mut last_news = Instant::now();
    while records.len() < wanted {
        let next = records.last().map_or(since, |record| record.tick + 1);
        let new = observer.ticks(next).await?.records;
        if !new.is_empty() {
            last_news = Instant::now();
        } else if last_news.elapsed() > PATIENCE {
            return Err(LoadTestError::Stuck(format!("the server made no tick for {PATIENCE:?} after tick {next}")));
        }
        records.extend(new.into_iter().filter(|record| record.tick >= next));
        progress.set_position(records.len() as u64);
        tokio::time::sleep(POLL).await;
    }
    records.truncate(wanted);
    Ok(records)
}

async fn await_status(
    observer: &Observer,
    what: &str,
    done: impl Fn(&Status) -> bool,
) -> Result<Status, LoadTestError> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let status = observer.status().await?;
        if done(&status) {
            return Ok(status);
        }
        if Instant::now() > deadline {
            let clients = status.clients;
            let text = format!("waited {PATIENCE:?} for {what}; tick {}, {clients} clients", status.tick);
            return Err(LoadTestError::Stuck(text));
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

fn progress_bar(prefix: &str, ticks: u64) -> ProgressBar {
    // The template is a constant; should indicatif refuse it, its own default serves.
    let style = ProgressStyle::with_template("{prefix:>12} {bar:32} {pos}/{len} ticks, {msg}, {elapsed} (left {eta})")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(ticks).with_style(style).with_prefix(prefix.to_owned())
}
