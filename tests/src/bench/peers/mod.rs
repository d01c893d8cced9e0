//! `peers`: ours and rapier on every scene of the yardstick, in turn and in one process.
//!
//! Ours runs at one step a tick with the daemon's settings; rapier at its defaults and at its cheapest setting that the
//! judge accepts. A round is one run of each, so that a slow spell of the machine hits all of them; of several rounds
//! the least p50 and the least p99 count. Times are CPU times of the whole process around the steps alone, so that all
//! threads of an engine count.

mod bar;
mod published;
mod report;

use indicatif::{ProgressBar, ProgressStyle};
use pita_sim::Settings;

use super::{EntryError, Options, Report};
use crate::yardstick::judge::{Verdict, judge};
use crate::yardstick::ours::{Ours, OursError};
use crate::yardstick::rapier::{Rapier, Setting};
use crate::yardstick::scene::Content;
use crate::yardstick::trace::{self, Engine, Trouble, quantile};
use crate::yardstick::{TICK_HZ, catalogue};
use published::{PUBLISHED, Published};

const ROUNDS: u32 = 3;

/// What came out on a scene.
struct Measured {
    published: &'static Published,
    content: Content,
    ours: Result<Outcome, OursError>,
    /// At its defaults first; then at its accepted setting, where that is known and another.
    rapier: Vec<(Setting, Outcome)>,
}

/// Times and quality of an engine on a scene.
#[derive(Clone, Debug)]
struct Outcome {
    p50_ms: f64,
    p99_ms: f64,
    trouble: Option<Trouble>,
    verdict: Verdict,
}

/// Measures `options.scenes` in `options.rounds` rounds, 3 by default.
pub fn run(options: &Options) -> Result<Report, EntryError> {
    let published = selected(&options.scenes)?;
    let (rounds, threads) = (options.rounds.unwrap_or(ROUNDS).max(1), options.threads.unwrap_or(1));
    let settings = Settings { threads, ..Settings::at(TICK_HZ.recip()) };
    let progress = progress_bar();
    let scenes: Result<Vec<_>, _> =
        published.into_iter().map(|published| measure(published, rounds, &settings, &progress)).collect();
    progress.finish_and_clear();
    Ok(report::report(&scenes?))
}

/// The scenes of those names, all of them for no names.
fn selected(names: &[String]) -> Result<Vec<&'static Published>, EntryError> {
    match names.iter().find(|name| PUBLISHED.iter().all(|entry| entry.scene != **name)) {
        Some(name) => {
            let known: Vec<_> = catalogue::names().collect();
            Err(format!("the yardstick has no scene '{name}'; there are: {}", known.join(", ")).into())
        }
        None => Ok(PUBLISHED.iter().filter(|e| names.is_empty() || names.iter().any(|name| name == e.scene)).collect()),
    }
}

fn measure(
    published: &'static Published,
    rounds: u32,
    settings: &Settings,
    progress: &ProgressBar,
) -> Result<Measured, EntryError> {
    let content = catalogue::content(published.scene).ok_or_else(|| format!("no scene '{}'", published.scene))?;
    let tuned = published.rapier_accepted.map(|(setting, _)| setting).filter(|&setting| setting != Setting::DEFAULT);
    let peers: Vec<Setting> = [Setting::DEFAULT].into_iter().chain(tuned).collect();
    progress.set_prefix(published.scene);
    progress.set_position(0);
    progress.set_length(u64::from(rounds) * content.ticks() as u64 * (1 + peers.len() as u64));

    let mut ours = Vec::new();
    let mut rapier = vec![Vec::new(); peers.len()];
    for _ in 0..rounds {
        progress.set_message("pita");
        ours.push(Ours::new(&content, settings).map(|engine| Outcome::of(engine, &content, progress)));
        for (&setting, outcomes) in peers.iter().zip(&mut rapier) {
            progress.set_message(format!("rapier {setting}"));
            outcomes.push(Outcome::of(Rapier::new(&content, setting), &content, progress));
        }
    }
    let rapier = peers.into_iter().zip(rapier.into_iter().map(Outcome::best)).collect();
    let ours = ours.into_iter().collect::<Result<Vec<_>, _>>().map(Outcome::best);
    Ok(Measured { published, content, ours, rapier })
}

impl Outcome {
    /// Runs and judges.
    fn of(mut engine: impl Engine, content: &Content, progress: &ProgressBar) -> Self {
        let run = trace::run(&mut engine, content.ticks(), || progress.inc(1));
        let mut cpu_ms: Vec<f64> = run.times.iter().map(|time| time.cpu_ms).collect();
        let [p50_ms, p99_ms] = [0.5, 0.99].map(|q| quantile(&mut cpu_ms, q));
        let mut verdict = judge(content, &run.trace);
        // What the engine has taken out stands still, and the judge may like that.
        verdict.accepted &= run.trouble.is_none_or(|trouble| trouble.quarantined == 0);
        Self { p50_ms, p99_ms, trouble: run.trouble, verdict }
    }

    /// The least of the times, with the first run's quality: engines repeat themselves. Where one does not, a refused run
    /// counts.
    fn best(outcomes: Vec<Self>) -> Self {
        let least = |ms: fn(&Self) -> f64| outcomes.iter().map(ms).fold(f64::INFINITY, f64::min);
        let (p50_ms, p99_ms) = (least(|outcome| outcome.p50_ms), least(|outcome| outcome.p99_ms));
        let worst = outcomes.into_iter().min_by_key(|outcome| outcome.verdict.accepted);
        // There is at least one round.
        let Self { trouble, verdict, .. } = worst.expect("a run");
        Self { p50_ms, p99_ms, trouble, verdict }
    }
}

fn progress_bar() -> ProgressBar {
    // The template is a constant; should indicatif refuse it, its own default serves.
    let style = ProgressStyle::with_template("{prefix:>13} {bar:32} {pos}/{len} ticks, {msg}, {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(0).with_style(style)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(selected: Result<Vec<&'static Published>, EntryError>) -> Vec<&'static str> {
        selected.unwrap().iter().map(|entry| entry.scene).collect()
    }

    #[test]
    fn scenes_are_selected_and_a_wrong_name_is_answered_with_the_right_ones() {
        assert_eq!(names(selected(&["spin".to_owned(), "chain".to_owned()])), ["chain", "spin"]);
        assert_eq!(names(selected(&[])).len(), catalogue::names().count());
        let error = selected(&["chian".to_owned()]).err().unwrap().to_string();
        assert!(error.starts_with("the yardstick has no scene 'chian'; there are: pile100, pile500"), "{error}");
    }

    #[test]
    fn the_least_time_and_the_worst_verdict_count() {
        let outcome = |p50_ms, p99_ms, accepted| {
            let verdict = Verdict { accepted, ..Verdict::default() };
            Outcome { p50_ms, p99_ms, trouble: None, verdict }
        };
        let best = Outcome::best(vec![outcome(2.0, 3.0, true), outcome(1.0, 9.0, false), outcome(4.0, 5.0, true)]);
        assert_eq!((best.p50_ms, best.p99_ms, best.verdict.accepted), (1.0, 3.0, false));
    }
}
