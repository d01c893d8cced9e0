//! `published`: scenes for which others have published figures, ours beside theirs, at their time step and at ours.
//!
//! SimBenchmark (ETH Zürich): Rolling and 666. The fixtures of Rigid-IPC: slope, card house, arch, mass ratio, and
//! Erleben's degenerate pairs. Parameters are as their authors give them; where they give none, the scene's file says what
//! was taken. Every scene is a function on a [`Stage`], one file a family, and answers a [`Finding`]. The engine has the
//! daemon's settings without sleep: nothing stands because it was put to rest.

mod arch;
mod balls;
mod card_house;
mod degenerate;
mod heavy;
mod rolling;
mod slope;
mod stage;

use pita_sim::SimError;
use serde_json::{Map, Value, json};

use super::{EntryError, Options, Report};
use stage::Stage;

/// The talk's tick, s.
const OURS: f64 = 1.0 / 30.0;

/// What was found of a scene at a time step.
struct Finding {
    /// Name of the scene, with its case.
    scene: String,
    /// What came out, in the words of the table.
    ours: String,
    /// What it has to be.
    wanted: &'static str,
    /// What others published.
    theirs: &'static str,
    /// Whether it is as wanted.
    holds: bool,
    /// The same for machines, with units in the keys.
    figures: Vec<(&'static str, f64)>,
    /// Where it ran.
    stage: Stage,
}

/// A scene at a time step, s.
type Scene = fn(f64) -> Result<Vec<Finding>, SimError>;

/// A family of scenes.
struct Family {
    name: &'static str,
    /// The authors' time steps, s.
    theirs: &'static [f64],
    run: Scene,
}

const FAMILIES: &[Family] = &[
    Family { name: "rolling", theirs: &[1e-3], run: rolling::run },
    Family { name: "666", theirs: &[0.01, 0.04], run: balls::run },
    Family { name: "slope", theirs: &[0.025], run: slope::run },
    Family { name: "card_house", theirs: &[0.01], run: card_house::run },
    Family { name: "arch", theirs: &[0.01], run: arch::run },
    Family { name: "heavy", theirs: &[0.01], run: heavy::run },
    Family { name: "degenerate", theirs: &[0.01], run: degenerate::run },
];

/// Runs every scene, or those whose families `options.scenes` names.
pub fn run(options: &Options) -> Result<Report, EntryError> {
    let names: Vec<_> = FAMILIES.iter().map(|family| family.name).collect();
    if let Some(unknown) = options.scenes.iter().find(|scene| !names.contains(&scene.as_str())) {
        return Err(format!("no published scene is called '{unknown}'; there are: {}", names.join(", ")).into());
    }
    let mut report = Report {
        header: vec!["scene", "step, ms", "ours", "wanted", "theirs", "ms a step", "deepest, mm", "holds"],
        ..Report::default()
    };
    let (mut scenes, mut held) = (Map::new(), 0);
    let chosen = |family: &&Family| options.scenes.is_empty() || options.scenes.iter().any(|s| s == family.name);
    for family in FAMILIES.iter().filter(chosen) {
        for &dt in family.theirs.iter().chain([&OURS]) {
            eprintln!("  {} at {:.1} ms", family.name, 1e3 * dt);
            for finding in (family.run)(dt)? {
                held += usize::from(finding.holds);
                report.rows.push(finding.row());
                let of_scene = scenes.entry(finding.scene.clone()).or_insert_with(|| Value::Array(Vec::new()));
                if let Value::Array(list) = of_scene {
                    list.push(finding.figures());
                }
            }
        }
    }
    report.notes.push(format!("{held} of {} hold.", report.rows.len()));
    report.figures = scenes;
    Ok(report)
}

impl Finding {
    fn row(&self) -> Vec<String> {
        let Stage { dt, .. } = self.stage;
        vec![
            self.scene.clone(),
            format!("{:.1}", 1e3 * dt),
            self.ours.clone(),
            self.wanted.to_owned(),
            self.theirs.to_owned(),
            format!("{:.4}", self.stage.step_ms()),
            format!("{:.2}", 1e3 * self.stage.deepest),
            if self.holds { "yes" } else { "NO" }.to_owned(),
        ]
    }

    fn figures(&self) -> Value {
        let mut figures = Map::new();
        for &(key, value) in &self.figures {
            figures.insert(key.to_owned(), json!(value));
        }
        figures.insert("time_step_s".into(), json!(self.stage.dt));
        figures.insert("step_mean_ms".into(), json!(self.stage.step_ms()));
        figures.insert("deepest_m".into(), json!(self.stage.deepest));
        figures.insert("holds".into(), json!(self.holds));
        Value::Object(figures)
    }
}
