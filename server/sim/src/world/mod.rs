//! The world: bodies, potentials and static geometry under generational handles, and the two stages of the pipeline that
//! are the engine's.

mod bodies;
mod collisions;
mod conserved;
mod joint_loads;
mod joints;
mod potentials;
mod queries;
mod sleep;
mod state;

use slotmap::SlotMap;

use crate::collide::{Bodies, Detector};
use crate::dof::{Body, BodyId, Placed};
use crate::error::SimError;
use crate::integrate::{Integrator, Scene, StepReport};
use crate::potential::Potentials;
use crate::settings::{Settings, SolverSettings};
use crate::sleep::Sleepers;
use crate::state::State;
use crate::threads::Threads;

pub use conserved::{Energy, Momentum};
pub use joint_loads::JointId;
pub use state::SliceView;

/// Most times that a tick looks again for contacts where the solver put the bodies.
const SECOND_LOOKS: usize = 3;

/// A running world.
pub struct World {
    settings: Settings,
    state: State,
    bodies: SlotMap<BodyId, Body>,
    /// All bodies, in order of serial.
    order: Vec<BodyId>,
    /// Those that do not sleep, in order of serial.
    awake: Vec<BodyId>,
    /// All colliders of bodies, in order of serial.
    placed: Vec<Placed>,
    serials: u32,
    potentials: Potentials,
    /// Whether they know who is awake.
    potentials_are_sorted: bool,
    sleepers: Sleepers,
    /// For how long each island has been still, s; kept for its memory.
    stillness: Vec<f64>,
    detector: Detector,
    integrator: Integrator,
    threads: Threads,
    report: StepReport,
}

impl World {
    /// An empty world.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] for a bad setting, [`SimError::Unusable`] where threads cannot be had.
    pub fn new(settings: Settings) -> Result<Self, SimError> {
        settings.validate()?;
        let threads = Threads::new(settings.threads)
            .map_err(|_| SimError::Unusable { what: "threads cannot be started: use fewer" })?;
        Ok(Self {
            settings,
            state: State::default(),
            bodies: SlotMap::with_key(),
            order: Vec::new(),
            awake: Vec::new(),
            placed: Vec::new(),
            serials: 0,
            potentials: Potentials::default(),
            potentials_are_sorted: true,
            sleepers: Sleepers::default(),
            stillness: Vec::new(),
            detector: Detector::default(),
            integrator: Integrator::default(),
            threads,
            report: StepReport::default(),
        })
    }

    /// The settings that it was made with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Stage 2: finds contacts at Q0.
    pub fn detect_collisions(&mut self) {
        self.detector.begin();
        while {
            let bodies = Bodies { bodies: &self.bodies, state: &self.state };
            self.detector.meet(bodies, &self.settings, &self.threads)
        } {
            // What was touched in its sleep meets others in turn.
            let mut touched = std::mem::take(&mut self.detector.touched);
            touched.drain(..).for_each(|id| self.rouse(id));
            self.detector.touched = touched;
        }
        self.detector.finish(&self.settings);
    }

    /// Stage 4: integrates all DOF over one tick.
    pub fn integrate(&mut self) -> &StepReport {
        let before = self.settings.audit_energy.then(|| self.energy().total());
        self.detector.second.clear();
        let (integrator, mut scene) = self.scene();
        integrator.begin(&mut scene);
        for _ in 0..SECOND_LOOKS {
            let first = self.detector.second.len();
            let (integrator, scene) = self.scene();
            integrator.find_candidates(&scene);
            let bodies = Bodies { bodies: &self.bodies, state: &self.state };
            let candidates = self.integrator.candidates(bodies);
            if !self.detector.pick_pairs(&candidates, &self.settings) {
                break;
            }
            self.integrator.tell_beliefs(&mut self.detector);
            if !self.detector.look_again(&candidates, &self.settings, &self.threads) {
                break;
            }
            let (integrator, scene) = self.scene();
            integrator.solve_on(&scene, first);
        }
        let (integrator, mut scene) = self.scene();
        let mut report = integrator.scatter(&mut scene);
        integrator.forget_recovery(&mut scene, &mut report);
        self.report = report;
        self.detector.remember();
        self.report.pairs = self.detector.pairs();
        self.settle();
        self.report.asleep = self.sleepers.count;
        if let Some(before) = before {
            let after = self.energy();
            self.report.kinetic_energy = after.kinetic;
            self.report.energy_gain = after.total() - before - self.report.work_put_in;
        }
        &self.report
    }

    /// What stage 4 would take with another solver, from the same state; nothing moves. It is for comparing solvers:
    /// the report has what the solver did, and nothing of what became of contacts and joints.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] for a bad setting.
    pub fn rehearse(&mut self, solver: &SolverSettings) -> Result<StepReport, SimError> {
        let settings = Settings { solver: solver.clone(), ..self.settings.clone() };
        settings.validate()?;
        self.detector.second.clear();
        let (integrator, scene) = self.scene();
        Ok(integrator.rehearse(&mut Scene { settings: &settings, ..scene }))
    }

    fn scene(&mut self) -> (&mut Integrator, Scene<'_>) {
        self.sort_potentials();
        let scene = Scene {
            settings: &self.settings,
            threads: &self.threads,
            state: &mut self.state,
            bodies: &mut self.bodies,
            order: &self.awake,
            placed: &self.placed,
            potentials: &mut self.potentials,
            contacts: &mut self.detector.contacts,
            second: &mut self.detector.second,
        };
        (&mut self.integrator, scene)
    }

    /// Stages 2 and 4, for worlds without game logic.
    pub fn step(&mut self) -> &StepReport {
        self.detect_collisions();
        self.integrate()
    }

    /// What the last integration did.
    pub fn report(&self) -> &StepReport {
        &self.report
    }
}
