//! `pita-server simulate`: runs a scene or an arena headless, as fast as it goes, without network.

use std::path::PathBuf;
use std::process::ExitCode;

use comfy_table::{Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use pita_game::scene::{Scene, SceneError};
use pita_game::{Arena, ArenaSettings, Command, LogicReport, Ports, Stage, pipeline};
use pita_sim::{Energy, Momentum, Settings, StepReport, World};
use serde_json::json;

use crate::arena_source::{ArenaText, SourceError};
use crate::cli::SimulateArgs;
use crate::files;
use crate::report;
use crate::trace::{self, Trace, TraceError};

/// Longest scene file, bytes: as many lines as a scene may have, of a body each.
const SCENE_BYTES_MAX: usize = 64 << 20;

/// Why a run cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// No such arena, or it is not valid.
    #[error(transparent)]
    Arena(#[from] SourceError),
    /// The scene file cannot be read.
    #[error("{file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        reason: std::io::Error,
    },
    /// The scene file is no scene.
    #[error("{file}, {reason}")]
    Scene {
        /// The file.
        file: String,
        /// Line and reason.
        reason: SceneError,
    },
    /// The trace cannot be made.
    #[error(transparent)]
    Trace(#[from] TraceError),
}

/// What is run.
enum Subject {
    Scene(Box<Scene>),
    Arena(Box<Arena>),
}

/// An arena without an outside.
struct Alone;

impl Ports for Alone {
    fn begin(&mut self, _: Stage) {}
    fn collect(&mut self, _: u64, _: &mut Vec<Command>) {}
    fn output(&mut self, _: &Arena) {}
    fn end(&mut self) {}
}

impl Subject {
    /// A `.scene` file, else what [`arena_source`] finds under this name.
    fn load(args: &SimulateArgs) -> Result<Self, SimulateError> {
        let tick_hz = args.tick_hz.hz();
        if args.scene.extension().is_none_or(|extension| extension != "scene") {
            let settings = ArenaSettings { tick_hz, threads: usize::from(args.threads) };
            let given = args.parameters.iter().cloned().collect();
            let text = ArenaText::find(&args.scene.to_string_lossy(), &given)?;
            let mut arena = Box::new(text.build(&settings)?);
            arena.audit_energy();
            return Ok(Self::Arena(arena));
        }
        let file = args.scene.display().to_string();
        let text = files::read_text(&args.scene, SCENE_BYTES_MAX)
            .map_err(|reason| SimulateError::Unreadable { file: file.clone(), reason })?;
        let (threads, dt) = (usize::from(args.threads), 1.0 / f64::from(tick_hz));
        let settings = Settings { threads, audit_energy: true, ..Settings::at(dt) };
        match Scene::parse(&text, &settings) {
            Ok(scene) => Ok(Self::Scene(Box::new(scene))),
            Err(reason) => Err(SimulateError::Scene { file, reason }),
        }
    }

    fn world(&self) -> &World {
        match self {
            Self::Scene(scene) => &scene.world,
            Self::Arena(arena) => arena.world(),
        }
    }

    /// What logic did; nothing in a scene.
    fn logic(&self) -> LogicReport {
        match self {
            Self::Scene(_) => LogicReport::default(),
            Self::Arena(arena) => *arena.logic(),
        }
    }

    fn tick(&mut self) {
        match self {
            Self::Scene(scene) => {
                scene.world.step();
            }
            Self::Arena(arena) => pipeline::tick(arena, &mut Alone),
        }
    }

    /// Ticks to run where the caller does not say: the scene's own number, a minute of an arena.
    fn usual_ticks(&self, tick_hz: u16) -> usize {
        match self {
            Self::Scene(scene) => scene.ticks,
            Self::Arena(_) => 60 * usize::from(tick_hz),
        }
    }
}

/// Runs what `args` say and prints a summary.
pub fn run(args: &SimulateArgs) -> ExitCode {
    match simulate(args) {
        Ok(summary) => {
            report::print(&if args.json { summary.json() } else { summary.table() });
            ExitCode::SUCCESS
        }
        Err(error) => report::failure(&error.to_string()),
    }
}

fn simulate(args: &SimulateArgs) -> Result<Summary, SimulateError> {
    let mut subject = Subject::load(args)?;
    let ticks = args.ticks.map_or_else(|| subject.usual_ticks(args.tick_hz.hz()), |ticks| ticks as usize);
    let mut summary = Summary::new(args, subject.world());
    let mut trace = args.out.as_deref().map(Trace::create).transpose()?;
    if let Some(trace) = &mut trace {
        trace.record(subject.world())?;
    }
    let progress = progress_bar(ticks);
    for _ in 0..ticks {
        let took = trace::time(|| subject.tick());
        summary.add(took.wall_ms, subject.world().report());
        summary.watch(&subject);
        if let Some(trace) = &mut trace {
            trace.record_time(took)?;
            trace.record(subject.world())?;
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    summary.finish(subject.world());
    trace.map_or(Ok(()), Trace::finish)?;
    Ok(summary)
}

/// On a terminal only.
fn progress_bar(ticks: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{wide_bar} tick {pos}/{len}, {eta} left");
    ProgressBar::new(ticks as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// What a run did.
struct Summary {
    scene: PathBuf,
    tick_hz: u16,
    wall_ms: Vec<f64>,
    energy: [Energy; 2],
    momentum: [Momentum; 2],
    /// Sums of the counts and maxima of the sizes over all ticks.
    total: StepReport,
    bodies: usize,
    dof: usize,
    /// Speed of the fastest body at the end of any tick, m/s.
    fastest: f64,
    /// Most kinetic energy at the end of any tick, J.
    liveliest: f64,
    /// Ticks in which energy came from nowhere, and the most that came in one, J.
    bursts: usize,
    worst_gain: f64,
    /// Sporadic jobs of all ticks.
    sporadic: usize,
    /// Actors that were put back, or taken away, because they left the bounds or were quarantined.
    lost: usize,
    expired: usize,
    state_hash: u64,
}

impl Summary {
    fn new(args: &SimulateArgs, world: &World) -> Self {
        Self {
            scene: args.scene.clone(),
            tick_hz: args.tick_hz.hz(),
            wall_ms: Vec::new(),
            energy: [world.energy(); 2],
            momentum: [world.momentum(); 2],
            total: StepReport::default(),
            bodies: 0,
            dof: 0,
            fastest: 0.0,
            liveliest: 0.0,
            bursts: 0,
            worst_gain: 0.0,
            sporadic: 0,
            lost: 0,
            expired: 0,
            state_hash: 0,
        }
    }

    fn add(&mut self, wall_ms: f64, tick: &StepReport) {
        self.wall_ms.push(wall_ms);
        self.total.contacts += tick.contacts;
        self.total.islands += tick.islands;
        self.total.iterations += tick.iterations;
        self.total.linear_iterations += tick.linear_iterations;
        self.total.unconverged_islands += tick.unconverged_islands;
        self.total.quarantined += tick.quarantined;
        self.total.worst_penetration = self.total.worst_penetration.max(tick.worst_penetration);
        self.total.worst_joint_gap = self.total.worst_joint_gap.max(tick.worst_joint_gap);
        self.total.residual = self.total.residual.max(tick.residual);
        self.dof = self.dof.max(tick.dof);
        self.liveliest = self.liveliest.max(tick.kinetic_energy);
        self.bursts += usize::from(tick.is_energy_burst());
        self.worst_gain = self.worst_gain.max(tick.energy_gain);
    }

    fn watch(&mut self, subject: &Subject) {
        let (world, logic) = (subject.world(), subject.logic());
        let speeds = world.bodies().iter().filter_map(|&id| world.velocity(id)).map(|velocity| velocity.length());
        self.fastest = speeds.fold(self.fastest, f64::max);
        self.sporadic += logic.sporadic;
        self.lost += logic.lost;
        self.expired += logic.expired;
    }

    fn finish(&mut self, world: &World) {
        self.energy[1] = world.energy();
        self.momentum[1] = world.momentum();
        self.bodies = world.body_count();
        self.state_hash = world.state_hash();
        self.wall_ms.sort_unstable_by(f64::total_cmp);
    }

    fn quantile_ms(&self, q: f64) -> f64 {
        let last = self.wall_ms.len().saturating_sub(1);
        self.wall_ms.get((q * last as f64).round() as usize).copied().unwrap_or(0.0)
    }

    fn mean(&self, sum: usize) -> f64 {
        sum as f64 / self.wall_ms.len().max(1) as f64
    }

    fn json(&self) -> String {
        let momentum = |m: &Momentum| json!({ "linear_kg_m_per_s": m.linear.to_array(), "angular_kg_m2_per_s": m.angular.to_array() });
        let energy = |e: &Energy| json!({ "kinetic_J": e.kinetic, "gravitational_J": e.gravitational, "elastic_J": e.elastic, "total_J": e.total() });
        let value = json!({
            "scene": self.scene.display().to_string(),
            "ticks": self.wall_ms.len(),
            "tick_hz": self.tick_hz,
            "bodies": self.bodies,
            "dof": self.dof,
            "tick_p50_ms": self.quantile_ms(0.5),
            "tick_p99_ms": self.quantile_ms(0.99),
            "tick_max_ms": self.quantile_ms(1.0),
            "energy_start": energy(&self.energy[0]),
            "energy_end": energy(&self.energy[1]),
            "momentum_start": momentum(&self.momentum[0]),
            "momentum_end": momentum(&self.momentum[1]),
            "worst_penetration_m": self.total.worst_penetration,
            "worst_joint_gap_m": self.total.worst_joint_gap,
            "worst_residual_m_per_s": self.total.residual,
            "contacts_per_tick": self.mean(self.total.contacts),
            "islands_per_tick": self.mean(self.total.islands),
            "newton_iterations_per_tick": self.mean(self.total.iterations),
            "linear_iterations_per_tick": self.mean(self.total.linear_iterations),
            "unconverged_islands": self.total.unconverged_islands,
            "quarantined": self.total.quarantined,
            "fastest_m_per_s": self.fastest,
            "kinetic_energy_max_J": self.liveliest,
            "energy_bursts": self.bursts,
            "worst_energy_gain_J": self.worst_gain,
            "lost_actors": self.lost,
            "expired_actors": self.expired,
            "sporadic_jobs_per_tick": self.mean(self.sporadic),
            // A 64-bit hash does not survive readers that know numbers only as f64.
            "state_hash": format!("{:016x}", self.state_hash),
        });
        format!("{value:#}")
    }

    fn table(&self) -> String {
        let mut table = Table::new();
        table.load_style(presets::UTF8_BORDERS_ONLY);
        let ticks = self.wall_ms.len();
        let seconds = ticks as f64 / f64::from(self.tick_hz);
        let [before, after] = &self.energy;
        let [p, q] = &self.momentum;
        let rows = [
            ("scene", self.scene.display().to_string()),
            ("ran", format!("{ticks} ticks, {seconds:.1} s at {} Hz", self.tick_hz)),
            ("bodies, DOF", format!("{}, {}", self.bodies, self.dof)),
            (
                "tick p50 / p99 / max",
                format!(
                    "{:.3} / {:.3} / {:.3} ms",
                    self.quantile_ms(0.5),
                    self.quantile_ms(0.99),
                    self.quantile_ms(1.0)
                ),
            ),
            ("energy", format!("{:.6e} J -> {:.6e} J", before.total(), after.total())),
            ("  of motion", format!("{:.6e} J -> {:.6e} J", before.kinetic, after.kinetic)),
            ("momentum", format!("{:.4e} kg m/s -> {:.4e} kg m/s", p.linear.length(), q.linear.length())),
            ("  about the origin", format!("{:.4e} kg m²/s -> {:.4e} kg m²/s", p.angular.length(), q.angular.length())),
            ("worst penetration", format!("{:.3} mm", 1e3 * self.total.worst_penetration)),
            ("worst joint gap", format!("{:.4} mm", 1e3 * self.total.worst_joint_gap)),
            ("contacts a tick", format!("{:.1}", self.mean(self.total.contacts))),
            ("islands a tick", format!("{:.1}", self.mean(self.total.islands))),
            ("Newton iterations a tick", format!("{:.2}", self.mean(self.total.iterations))),
            ("linear iterations a tick", format!("{:.2}", self.mean(self.total.linear_iterations))),
            ("unconverged islands", self.total.unconverged_islands.to_string()),
            ("quarantined bodies", self.total.quarantined.to_string()),
            ("fastest body, most energy of motion", format!("{:.1} m/s, {:.3e} J", self.fastest, self.liveliest)),
            ("energy bursts, most gained in a tick", format!("{}, {:.3e} J", self.bursts, self.worst_gain)),
            ("actors lost, expired at the bounds", format!("{}, {}", self.lost, self.expired)),
            ("sporadic jobs a tick", format!("{:.2}", self.mean(self.sporadic))),
            ("state hash", format!("{:016x}", self.state_hash)),
        ];
        for (name, value) in rows {
            table.add_row([name.to_owned(), value]);
        }
        table.to_string()
    }
}
