//! What `peers` says: a table of runs, a table of bars, and the same for machines. Pure.

use serde_json::{Map, Value, json};

use super::bar::Bar;
use super::{Measured, Outcome};
use crate::bench::Report;
use crate::table::table;
use crate::yardstick::judge::three_digits;
use crate::yardstick::rapier::Setting;
use crate::yardstick::trace::Trouble;

const HEADER: [&str; 8] = ["scene", "engine", "setting", "p50, ms", "p99, ms", "pita / it", "accepted", "quality"];

const BAR_HEADER: [&str; 9] = [
    "scene",
    "cheapest accepted peer",
    "ms",
    "pita / it",
    "bar",
    "p99: pita / rapier",
    "bar",
    "met",
    "rapier now / then",
];

const NOTE: &str = "ms are CPU time of all threads, p50 and p99 over the ticks of a run, the least of all rounds. Rapier \
ran here and now; what other peers cost is the figure of the yardstick's PEERS.md times rapier's now / then on that \
scene. Their p99 at those settings is not published: p99 is held against rapier's, at its accepted setting where it has \
one (the yardstick's compare.py holds it against MuJoCo's). Sheep have to come to rest as well. PEERS.md calls differences under 20 % ties.";

/// The report of all scenes.
pub fn report(scenes: &[Measured]) -> Report {
    let standings: Vec<Standing> = scenes.iter().map(Standing::of).collect();
    let bars = table(&BAR_HEADER, standings.iter().map(Standing::row)).to_string();
    Report {
        header: HEADER.to_vec(),
        rows: scenes.iter().flat_map(rows).collect(),
        notes: vec![bars, NOTE.to_owned()],
        figures: standings
            .iter()
            .map(|standing| (standing.scene.published.scene.to_owned(), standing.json()))
            .collect(),
    }
}

/// A row for each run.
fn rows(scene: &Measured) -> Vec<Vec<String>> {
    let ours = scene.ours.as_ref();
    let name = scene.published.scene;
    let mut rows = vec![match ours {
        Ok(outcome) => row([name, "pita", "k=1"], outcome, String::new()),
        Err(error) => [name, "pita", "k=1", "", "", "", "no", &error.to_string()].map(str::to_owned).to_vec(),
    }];
    rows.extend(scene.rapier.iter().map(|(setting, outcome)| {
        let ratio = ours.map_or(String::new(), |ours| three_digits(ours.p50_ms / outcome.p50_ms));
        row([name, "rapier", &setting.to_string()], outcome, ratio)
    }));
    rows
}

fn row(head: [&str; 3], outcome: &Outcome, ratio: String) -> Vec<String> {
    let Outcome { p50_ms, p99_ms, trouble, verdict } = outcome;
    let accepted = yes_or_no(verdict.accepted);
    let mut quality = verdict.text();
    if let Some(Trouble { unconverged_ticks, quarantined }) = trouble {
        let counts = [(unconverged_ticks, "ticks unconverged"), (quarantined, "bodies quarantined")];
        for (count, what) in counts.into_iter().filter(|(count, _)| **count > 0) {
            quality += &format!(", {count} {what}");
        }
    }
    [&head.map(str::to_owned)[..], &[three_digits(*p50_ms), three_digits(*p99_ms), ratio, accepted, quality]].concat()
}

/// How ours stands against the peers on a scene.
struct Standing<'a> {
    scene: &'a Measured,
    bar: Bar,
    cheapest: Option<Peer>,
    /// Rapier's p50 here over its published one.
    rapier_now_over_then: f64,
    p50_ratio: Option<f64>,
    p99_ratio: Option<f64>,
    is_met: bool,
}

/// A peer at an accepted setting.
struct Peer {
    name: String,
    p50_ms: f64,
    is_scaled: bool,
}

impl<'a> Standing<'a> {
    fn of(scene: &'a Measured) -> Self {
        let Measured { published, content, ours, rapier } = scene;
        let (default, tuned) = (&rapier[0], rapier.get(1));
        let then_ms = published.rapier_accepted.map_or(published.rapier_default_ms, |(_, ms)| ms);
        let reference = &tuned.unwrap_or(default).1;
        let rapier_now_over_then = reference.p50_ms / then_ms;
        let cheapest = cheapest(scene, rapier_now_over_then);

        let bar = Bar::of(content);
        let ours = ours.as_ref().ok();
        let p50_ratio = ours.zip(cheapest.as_ref()).map(|(ours, peer)| ours.p50_ms / peer.p50_ms);
        let p99_ratio = ours.map(|ours| ours.p99_ms / reference.p99_ms);
        let is_met = ours.is_some_and(|ours| bar.is_met(content, &ours.verdict, p50_ratio, p99_ratio));
        Self { scene, bar, cheapest, rapier_now_over_then, p50_ratio, p99_ratio, is_met }
    }

    fn row(&self) -> Vec<String> {
        let Self { bar, cheapest, .. } = self;
        let ratio = |ratio: Option<f64>| ratio.map_or("-".to_owned(), three_digits);
        let peer = cheapest.as_ref().map(|peer| (peer.name.clone(), three_digits(peer.p50_ms)));
        let (name, ms) = peer.unwrap_or(("none".to_owned(), "-".to_owned()));
        vec![
            self.scene.published.scene.to_owned(),
            name,
            ms,
            ratio(self.p50_ratio),
            format!("< {}", bar.p50_ratio),
            ratio(self.p99_ratio),
            format!("<= {}", bar.p99_ratio),
            yes_or_no(self.is_met),
            three_digits(self.rapier_now_over_then),
        ]
    }

    fn json(&self) -> Value {
        let Measured { ours, rapier, .. } = self.scene;
        let rapier: Vec<Value> = rapier.iter().map(|(setting, outcome)| run_json(outcome, Some(setting))).collect();
        let cheapest = self
            .cheapest
            .as_ref()
            .map(|peer| json!({ "peer": peer.name, "p50_ms": peer.p50_ms, "scaled_from_published": peer.is_scaled }));
        json!({
            "pita": ours.as_ref().map_or_else(
                |error| json!({ "accepted": false, "error": error.to_string() }),
                |outcome| run_json(outcome, None),
            ),
            "rapier": rapier,
            "rapier_now_over_then": self.rapier_now_over_then,
            "cheapest_accepted_peer": cheapest,
            "p50_ratio": self.p50_ratio,
            "p50_ratio_bar": self.bar.p50_ratio,
            "p99_ratio_to_rapier": self.p99_ratio,
            "p99_ratio_bar": self.bar.p99_ratio,
            "bar_met": self.is_met,
        })
    }
}

/// The cheapest of rapier's accepted runs and of the other peers' scaled figures.
fn cheapest(scene: &Measured, scale: f64) -> Option<Peer> {
    let measured = scene.rapier.iter().filter(|(_, outcome)| outcome.verdict.accepted);
    let measured = measured.map(|(setting, outcome)| {
        let name = format!("rapier {setting}");
        Peer { name, p50_ms: outcome.p50_ms, is_scaled: false }
    });
    let others = scene.published.others.iter().map(|other| {
        let name = format!("{} {}, scaled", other.peer, other.setting);
        Peer { name, p50_ms: other.ms * scale, is_scaled: true }
    });
    measured.chain(others).min_by(|a, b| a.p50_ms.total_cmp(&b.p50_ms))
}

fn run_json(outcome: &Outcome, setting: Option<&Setting>) -> Value {
    let Outcome { p50_ms, p99_ms, trouble, verdict } = outcome;
    let mut figures: Map<String, Value> =
        verdict.figures.iter().map(|figure| (figure.key.to_owned(), json!(figure.value))).collect();
    figures.insert("p50_ms".to_owned(), json!(p50_ms));
    figures.insert("p99_ms".to_owned(), json!(p99_ms));
    figures.insert("accepted".to_owned(), json!(verdict.accepted));
    if let Some(trouble) = trouble {
        figures.insert("unconverged_ticks".to_owned(), json!(trouble.unconverged_ticks));
        figures.insert("quarantined_bodies".to_owned(), json!(trouble.quarantined));
    }
    if let Some(failure) = verdict.failure {
        figures.insert("failure".to_owned(), json!(failure));
    }
    figures.insert("steps_per_tick".to_owned(), json!(setting.map_or(1, |setting| setting.steps)));
    if let Some(iterations) = setting.and_then(|setting| setting.iterations) {
        figures.insert("solver_iterations_per_step".to_owned(), json!(iterations));
    }
    Value::Object(figures)
}

fn yes_or_no(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_owned()
}

#[cfg(test)]
mod tests {
    use pita_game::scene::SceneError;

    use super::*;
    use crate::bench::peers::published::PUBLISHED;
    use crate::yardstick::catalogue;
    use crate::yardstick::judge::Verdict;
    use crate::yardstick::ours::OursError;

    fn outcome(p50_ms: f64, accepted: bool) -> Outcome {
        let verdict = Verdict { accepted, ..Verdict::default() };
        Outcome { p50_ms, p99_ms: 2.0 * p50_ms, trouble: None, verdict }
    }

    /// The chain, with rapier twice as slow as published.
    fn chain(ours: Result<Outcome, OursError>, rapier_is_accepted: bool) -> Measured {
        let published = PUBLISHED.iter().find(|entry| entry.scene == "chain").unwrap();
        let (setting, then_ms) = published.rapier_accepted.unwrap();
        let tuned = outcome(2.0 * then_ms, rapier_is_accepted);
        let rapier = vec![(Setting::DEFAULT, outcome(0.01, false)), (setting, tuned)];
        Measured { published, content: catalogue::content("chain").unwrap(), ours, rapier }
    }

    #[test]
    fn other_peers_are_scaled_by_rapier_then_and_now() {
        let scene = chain(Ok(outcome(0.1, true)), true);
        let standing = Standing::of(&scene);
        let cheapest = standing.cheapest.as_ref().unwrap();
        assert_eq!((cheapest.name.as_str(), cheapest.is_scaled), ("MuJoCo k=32, scaled", true));
        assert!((cheapest.p50_ms - 2.0 * 0.741).abs() < 1e-12);
        assert!((standing.p50_ratio.unwrap() - 0.1 / 1.482).abs() < 1e-12);
        assert!((standing.p99_ratio.unwrap() - 0.1 / 2.72).abs() < 1e-12);
        assert!(standing.is_met);
    }

    #[test]
    fn only_accepted_peers_count() {
        let mut scene = chain(Ok(outcome(0.1, true)), true);
        scene.rapier[0].1.verdict.accepted = true;
        let cheapest = Standing::of(&scene).cheapest.unwrap();
        assert_eq!((cheapest.name.as_str(), cheapest.p50_ms, cheapest.is_scaled), ("rapier k=1", 0.01, false));
    }

    #[test]
    fn what_does_not_run_has_no_ratio_and_meets_no_bar() {
        let refusal = SceneError { line: 3, what: "no such shape".to_owned() };
        let scene = chain(Err(refusal.into()), true);
        let report = report(&[scene]);
        let figures = &report.figures["chain"];
        assert_eq!(figures["p50_ratio"], Value::Null);
        assert_eq!(figures["bar_met"], false);
        assert_eq!(figures["pita"]["error"], "line 3: no such shape");
        assert_eq!(figures["rapier"][1]["solver_iterations_per_step"], 256);
        assert_eq!(report.rows.len(), 3);
        assert!(report.rows.iter().all(|row| row.len() == HEADER.len()), "{:?}", report.rows);
    }
}
