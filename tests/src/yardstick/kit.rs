//! Holds scenes and judge against the kit's own, where the kit and its Python lie beside the repository.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use pita_sim::Settings;
use serde_json::Value;
use tempfile::TempDir;

use super::judge::judge;
use super::ours::Ours;
use super::rapier::{Rapier, Setting};
use super::scene::Content;
use super::trace::{Run, quantile, run};
use super::{TICK_HZ, catalogue};

/// Scenes that take a moment in a test build as well.
const QUICK: &[&str] = &["pile100", "stack10", "sheep100", "chain", "cars16", "spin", "slope45", "slope55", "soft"];

/// What the kit's judge calls our figures.
const KEYS: &[(&str, &str)] = &[
    ("acceleration_error", "acc_err"),
    ("creep_m", "creep"),
    ("drift_max_m", "drift_max"),
    ("energy_change", "E"),
    ("energy_change_max", "dE"),
    ("energy_rise_max", "Emax"),
    ("gap_max_m", "jmax"),
    ("gap_rest_m", "jrest"),
    ("momentum_change_max", "dL"),
    ("penetration_max_m", "pen_max"),
    ("penetration_rest_m", "pen_rest"),
    ("ride_height_m", "y"),
    ("sag_m", "sag"),
    ("speed_m_per_s", "speed"),
    ("stretch_max", "stretch"),
    ("tip_lowest_m", "tip_min"),
    ("tip_mean_m", "tip_mean"),
    ("turn_radius_m", "radius"),
];

/// Prints figures, times and acceptance of `sys.argv[1]` with the files `sys.argv[2]` as JSON.
const JUDGE: &str = "
import sys, json, metrics, run
scene, out, scenes = sys.argv[1:]
m = metrics.metrics(scene, out, scenes)
m['ok'] = bool(run.ok(scene, m))
print(json.dumps(m, default=float))
";

struct Kit {
    folder: PathBuf,
    scenes: TempDir,
}

impl Kit {
    /// The kit with its scenes written; `None`, said aloud, where there is no kit or no Python with NumPy.
    fn find() -> Option<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/yardstick");
        let kit = Self { folder, scenes: tempfile::tempdir().unwrap() };
        let usable = kit.folder.join("scenes.py").exists()
            && kit.python().args(["-c", "import numpy"]).output().is_ok_and(|output| output.status.success());
        if !usable {
            eprintln!("skipped: there is no {}, or no python3 with NumPy", kit.folder.display());
            return None;
        }
        let written = kit.python().arg(kit.folder.join("scenes.py")).arg(kit.scenes.path()).status().unwrap();
        assert!(written.success());
        Some(kit)
    }

    fn python(&self) -> Command {
        let mut python = Command::new("python3");
        python.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", &self.folder).env_remove("PEN_EVERY");
        python
    }

    /// What the kit's judge says of a run.
    fn judge(&self, scene: &str, run: &Run) -> Value {
        let prefix = self.scenes.path().join("run");
        let times = run.times.iter().flat_map(|time| [time.wall_ms, time.cpu_ms]);
        let states = run.trace.iter().flatten().flat_map(|s| {
            let turn = [s.rotation.w, s.rotation.x, s.rotation.y, s.rotation.z];
            let [position, velocity, spin] = [s.position, s.velocity, s.angular_velocity].map(|v| v.to_array());
            [&position[..], &turn, &velocity, &spin].concat()
        });
        fs::write(prefix.with_extension("ms"), times.flat_map(f64::to_le_bytes).collect::<Vec<_>>()).unwrap();
        fs::write(prefix.with_extension("tr"), states.flat_map(f64::to_le_bytes).collect::<Vec<_>>()).unwrap();
        let output = self.python().args(["-c", JUDGE, scene]).arg(&prefix).arg(self.scenes.path()).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
        // Python writes what JSON has no word for.
        serde_json::from_str(&text.replace("NaN", "null").replace("-Infinity", "null").replace("Infinity", "null"))
            .unwrap()
    }
}

#[test]
fn scenes_are_the_kits_bit_by_bit() {
    let Some(kit) = Kit::find() else { return };
    for name in catalogue::names().filter(|name| *name != "soft") {
        let theirs = fs::read_to_string(kit.scenes.path().join(name).with_extension("scene")).unwrap();
        let Some(Content::Rigid(_, ours)) = catalogue::content(name) else { panic!("{name}") };
        let ours = ours.to_string();
        assert_eq!(ours.lines().count(), theirs.lines().count(), "{name}");
        for (number, (ours, theirs)) in (1..).zip(ours.lines().zip(theirs.lines())) {
            // Exponents are written in two ways, so numbers are compared.
            let words = |line: &str| -> Vec<Result<u64, String>> {
                line.split(' ').map(|w| w.parse().map(f64::to_bits).map_err(|_| w.to_owned())).collect()
            };
            assert_eq!(words(ours), words(theirs), "{name}, line {number}:\n{ours}\n{theirs}");
        }
    }
}

#[test]
fn the_judge_says_what_the_kits_says() {
    let Some(kit) = Kit::find() else { return };
    for name in QUICK {
        let content = catalogue::content(name).unwrap();
        let mut rapier = Rapier::new(&content, Setting::DEFAULT);
        let mut ours = Ours::new(&content, &Settings::at(TICK_HZ.recip())).unwrap();
        let runs = [run(&mut rapier, content.ticks(), || ()), run(&mut ours, content.ticks(), || ())];
        for (engine, run) in ["rapier", "pita"].into_iter().zip(runs) {
            compare(&format!("{name}, {engine}"), &content, &run, &kit.judge(name, &run));
        }
    }
}

#[track_caller]
fn compare(what: &str, content: &Content, run: &Run, theirs: &Value) {
    let verdict = judge(content, &run.trace);
    assert_eq!(Some(verdict.accepted), theirs["ok"].as_bool(), "{what}: {}", verdict.text());
    let mut cpu_ms: Vec<f64> = run.times.iter().map(|time| time.cpu_ms).collect();
    let times = [("cpu", 0.5), ("p99_cpu", 0.99)].map(|(key, q)| (key, quantile(&mut cpu_ms, q)));
    let figures = verdict.figures.iter().map(|figure| {
        let (_, key) = KEYS.iter().find(|(ours, _)| *ours == figure.key).unwrap();
        (*key, figure.value)
    });
    for (key, value) in times.into_iter().chain(figures) {
        let expected = theirs[key].as_f64().unwrap_or_else(|| panic!("{what}: the kit has no {key}"));
        let error = (value - expected).abs();
        assert!(error <= 1e-9 * expected.abs() + 1e-11, "{what}, {key}: {value} is not {expected}");
        println!("{what}, {key}: {value:.6e}, off by {error:.1e}");
    }
}
