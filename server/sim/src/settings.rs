//! The engine's parameters. Every one says its unit, why it has its value, and what breaks if it changes.

use glam::DVec3;

use crate::error::{SimError, require, require_vector};
use crate::integrate::{Method, Preconditioner};
use crate::potential::gravity::Gravity;

/// Parameters of a [`World`](crate::World).
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Length of a tick, s, 1e-6 to 1.
    pub dt: f64,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Threads that solve islands. The result does not depend on it.
    pub threads: usize,
    /// The integrator's parameters.
    pub solver: SolverSettings,
    /// The contact model's parameters.
    pub contact: ContactSettings,
    /// When islands fall asleep; `None` keeps everything awake.
    pub sleep: Option<SleepSettings>,
    /// Whether each tick says how much energy came from nowhere, [`StepReport::energy_gain`](crate::StepReport::energy_gain):
    /// for shows and tests; it changes nothing of the motion.
    pub audit_energy: bool,
}

/// When an island falls asleep: no part of it was faster than this for a while, nor became faster or slower. What sleeps
/// has no speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SleepSettings {
    /// m/s. What rests trembles by up to 3 mm/s; what is slower than this on purpose stops.
    pub linear_speed: f64,
    /// rad/s.
    pub angular_speed: f64,
    /// For how long, s. Anything that passes its highest point is slow for a moment.
    pub time: f64,
}

/// Parameters of the integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverSettings {
    /// How residuals are made zero.
    pub method: Method,
    /// Of conjugate gradients, in [`Method::TruncatedNewton`] and [`Method::NonlinearConjugateGradient`].
    pub preconditioner: Preconditioner,
    /// A solver stops when no body's acceleration is wrong by more, m/s². Ten times the default is invisible in piles, but
    /// sticks what should slide.
    pub tolerance: f64,
    /// Most iterations an island gets; `None` is the method's own limit, [`Method::iterations`].
    pub iterations: Option<usize>,
    /// Block operations (see [`StepReport::work`](crate::StepReport::work)) that a tick may take; `None` is any number.
    /// Islands share them by size, and each ends at the best state that it has seen; the start and the last iteration of
    /// each may exceed its share.
    pub budget: Option<u64>,
    /// The linear solver stops when its residual has shrunk to this fraction: the truncation of truncated Newton.
    pub forcing: f64,
    /// ω of [`Method::Sor`] and [`Preconditioner::Ssor`], above 0 and below 2.
    pub relaxation: f64,
    /// Sweeps of an iteration of [`Method::GaussSeidel`] and [`Method::Sor`].
    pub sweeps: usize,
    /// Stiffness that joints start a tick with, in reduced masses per dt²; they stiffen from there until they hold. 100 sheep
    /// take 164, 185 and 209 Newton iterations a tick at 3e3, 1e4 and 3e4; at 3e3 a landing foot gets 25 mm deep.
    pub joint_stiffness: f64,
}

/// Parameters of the contact model.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSettings {
    /// Normal stiffness of a contact point, in reduced masses per dt².
    pub normal_stiffness: f64,
    /// Stiffness of the friction anchor, in reduced masses per dt². 27 or more keep a cube on a slope within 0.05 mm.
    pub tangent_stiffness: f64,
    /// Depth over which the normal force's cubic grows into a line, m.
    pub transition: f64,
    /// Fastest recovery of what is too deep, m/s. It moves positions and leaves no speed behind; 0 leaves depths as they are.
    /// Islands in which something recovers are solved a second time, within as much of the budget again.
    pub recovery_speed: f64,
    /// Depth that a steady load may bring about, whatever the masses, m: contacts stiffen with their load until it holds.
    pub gap_tolerance: f64,
    /// What closes faster is a collision and bounces by its restitution; what is slower rests, m/s. Below what gravity adds
    /// in a tick, 0.33 m/s at 30 Hz, what rests would go on bouncing.
    pub collision_speed: f64,
    /// Contacts are made where the gap is below this plus what the tick's motion may close, m.
    pub margin: f64,
}

impl Settings {
    /// The daemon's settings for ticks of `dt` seconds.
    pub fn at(dt: f64) -> Self {
        Self {
            dt,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            threads: 1,
            solver: SolverSettings::default(),
            contact: ContactSettings::default(),
            sleep: Some(SleepSettings::default()),
            audit_energy: false,
        }
    }

    /// Gravity as a potential.
    pub(crate) fn field(&self) -> Gravity {
        Gravity { acceleration: self.gravity }
    }

    /// # Errors
    /// [`SimError::OutOfRange`] for the first setting that is.
    pub fn validate(&self) -> Result<(), SimError> {
        let (solver, contact) = (&self.solver, &self.contact);
        require((1e-6..=1.0).contains(&self.dt), "dt", self.dt, "1e-6 to 1 s")?;
        require_vector(self.gravity, "gravity")?;
        require((1..=64).contains(&self.threads), "threads", self.threads as f64, "1 to 64")?;
        require((1e-15..=1e3).contains(&solver.tolerance), "solver.tolerance", solver.tolerance, "1e-15 to 1000 m/s²")?;
        let iterations = solver.iterations();
        require((1..=100_000).contains(&iterations), "solver.iterations", iterations as f64, "1 to 100000")?;
        require((1e-12..1.0).contains(&solver.forcing), "solver.forcing", solver.forcing, "1e-12 to below 1")?;
        let relaxes = solver.relaxation > 0.0 && solver.relaxation < 2.0;
        require(relaxes, "solver.relaxation", solver.relaxation, "above 0, below 2")?;
        require((1..=1000).contains(&solver.sweeps), "solver.sweeps", solver.sweeps as f64, "1 to 1000")?;
        let stiff = |value: f64, what| require((1e-3..=1e9).contains(&value), what, value, "0.001 to 1e9");
        stiff(solver.joint_stiffness, "solver.joint_stiffness")?;
        stiff(contact.normal_stiffness, "contact.normal_stiffness")?;
        stiff(contact.tangent_stiffness, "contact.tangent_stiffness")?;
        let ContactSettings { transition, recovery_speed, gap_tolerance, collision_speed, margin, .. } = *contact;
        require((1e-9..=1.0).contains(&transition), "contact.transition", transition, "1e-9 to 1 m")?;
        require((0.0..=1e3).contains(&recovery_speed), "contact.recovery_speed", recovery_speed, "0 to 1000 m/s")?;
        require((1e-6..=1.0).contains(&gap_tolerance), "contact.gap_tolerance", gap_tolerance, "1e-6 to 1 m")?;
        require((0.0..=1e3).contains(&collision_speed), "contact.collision_speed", collision_speed, "0 to 1000 m/s")?;
        require((0.0..=10.0).contains(&margin), "contact.margin", margin, "0 to 10 m")?;
        let Some(SleepSettings { linear_speed, angular_speed, time }) = self.sleep else { return Ok(()) };
        require((0.0..=1.0).contains(&linear_speed), "sleep.linear_speed", linear_speed, "0 to 1 m/s")?;
        require((0.0..=10.0).contains(&angular_speed), "sleep.angular_speed", angular_speed, "0 to 10 rad/s")?;
        require((0.0..=3600.0).contains(&time), "sleep.time", time, "0 to 3600 s")
    }
}

impl SolverSettings {
    /// Most iterations an island gets.
    pub fn iterations(&self) -> usize {
        self.iterations.unwrap_or(self.method.iterations())
    }
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            preconditioner: Preconditioner::default(),
            tolerance: 0.03,
            iterations: None,
            budget: None,
            forcing: 0.1,
            relaxation: 1.3,
            sweeps: 4,
            joint_stiffness: 1e4,
        }
    }
}

impl Default for SleepSettings {
    fn default() -> Self {
        Self { linear_speed: 1e-2, angular_speed: 2e-2, time: 0.5 }
    }
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            normal_stiffness: 300.0,
            tangent_stiffness: 100.0,
            transition: 1e-3,
            recovery_speed: 3.0,
            gap_tolerance: 1e-3,
            collision_speed: 0.5,
            margin: 0.01,
        }
    }
}
