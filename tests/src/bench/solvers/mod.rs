//! `solvers`: "Which method is best?" (talk). Every method, and conjugate gradients under every preconditioner, on the
//! same ticks.
//!
//! Each subject runs with the daemon's solver. Every [`EVERY`] ticks all contenders rehearse the tick from the state that
//! it has reached, so that they solve the same systems, and what a bad one does to the world is not the others' trouble.

mod contenders;
mod document;
mod plot;
mod report;
mod subjects;

use indicatif::{ProgressBar, ProgressStyle};
use pita_server::trace::time;

use self::contenders::{Contender, contenders};
use self::subjects::{SUBJECTS, Subject};
use super::{EntryError, Options, Report};

/// Ticks of a run that are rehearsed: one in so many.
const EVERY: u32 = 10;

/// Ticks of a run, 10 s, where the options do not say.
const TICKS: u32 = 300;

/// What a contender took on a subject, summed over the rehearsed ticks.
#[derive(Clone, Debug, Default)]
struct Tally {
    ticks: u32,
    work: u64,
    cpu_ms: f64,
    iterations: usize,
    linear_iterations: usize,
    evaluations: usize,
    islands: usize,
    unsolved: usize,
}

/// A subject with a tally for each contender.
struct Measured {
    subject: &'static Subject,
    tallies: Vec<Tally>,
}

/// Measures; draws and writes where `options.plot` and `options.document` say so.
pub fn run(options: &Options) -> Result<Report, EntryError> {
    let (contenders, ticks) = (contenders(), options.ticks.unwrap_or(TICKS));
    let progress = progress_bar(u64::from(ticks) * SUBJECTS.len() as u64);
    let measured: Result<Vec<_>, _> =
        SUBJECTS.iter().map(|subject| measure(subject, &contenders, ticks, &progress)).collect();
    progress.finish_and_clear();
    let measured = measured?;
    if let Some(path) = &options.plot {
        plot::draw(&contenders, &measured, path).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    if let Some(path) = &options.document {
        document::write(&contenders, &measured, ticks, path).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(report::report(&contenders, &measured))
}

fn measure(
    subject: &'static Subject,
    contenders: &[Contender],
    ticks: u32,
    progress: &ProgressBar,
) -> Result<Measured, EntryError> {
    let mut world = (subject.world)()?;
    let mut tallies = vec![Tally::default(); contenders.len()];
    for tick in 0..ticks {
        world.detect_collisions();
        if tick % EVERY == 0 {
            for (contender, tally) in contenders.iter().zip(&mut tallies) {
                progress.set_message(format!("{}: {}", subject.name, contender.name));
                let mut report = None;
                let took = time(|| report = Some(world.rehearse(&contender.solver)));
                if let Some(report) = report {
                    tally.add(&report?, took.cpu_ms);
                }
            }
        }
        world.integrate();
        progress.inc(1);
    }
    Ok(Measured { subject, tallies })
}

impl Tally {
    fn add(&mut self, report: &pita_sim::StepReport, cpu_ms: f64) {
        self.ticks += 1;
        self.work += report.work;
        self.cpu_ms += cpu_ms;
        self.iterations += report.iterations;
        self.linear_iterations += report.linear_iterations;
        self.evaluations += report.evaluations;
        self.islands += report.islands;
        self.unsolved += report.unconverged_islands;
    }

    /// Block operations a tick.
    fn work_per_tick(&self) -> f64 {
        self.work as f64 / f64::from(self.ticks.max(1))
    }

    fn ms_per_tick(&self) -> f64 {
        self.cpu_ms / f64::from(self.ticks.max(1))
    }

    /// Share of the islands that did not come to the tolerance.
    fn unsolved_share(&self) -> f64 {
        self.unsolved as f64 / self.islands.max(1) as f64
    }
}

fn progress_bar(length: u64) -> ProgressBar {
    // The template is a constant; should indicatif refuse it, its own default serves.
    let style = ProgressStyle::with_template("{bar:32} {pos}/{len} ticks, {elapsed}, {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
