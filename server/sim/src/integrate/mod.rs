//! Implicit Euler: from Q0, Q0' and the potentials to Q1, Q1' (the talk's "BOOM!").
//!
//! `problem` is an island with its potentials as one residual; a `solver` makes the residual zero, with the
//! `line_search`, the sparse `matrix`, its `factorization` and the preconditioned `conjugate_gradient` under it.
//! Islands share nothing while they are solved, so that threads cannot change the result.

mod attachment;
mod audit;
pub(crate) mod block;
mod conjugate_gradient;
mod energy_bound;
mod factorization;
pub(crate) mod figure;
mod figures;
mod friction_tangent;
mod gather;
mod gather_joints;
mod gmres;
mod line_search;
mod matrix;
mod preconditioner;
pub(crate) mod problem;
mod pull_back;
mod recovery;
mod rest;
mod second_look;
mod solver;
mod spots;
mod step;
mod vector;
mod wheels;

pub use solver::StoppedBecause;
pub use solver::method::{Method, Preconditioner};
pub(crate) use step::{Integrator, Scene};

/// What the last integration did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Bodies that took part.
    pub bodies: usize,
    /// Islands of more than one body, or with potentials.
    pub islands: usize,
    /// Unknowns.
    pub dof: usize,
    /// Contact points.
    pub contacts: usize,
    /// Iterations of the solver, summed over islands.
    pub iterations: usize,
    /// Iterations of the linear solver, summed over islands.
    pub linear_iterations: usize,
    /// Evaluations of the residual, summed over islands.
    pub evaluations: usize,
    /// Block operations, summed over islands: a 3×3 block times a vector, or as much of something else. Counted, so the
    /// same on every machine.
    pub work: u64,
    /// Islands that stopped above the tolerance.
    pub unconverged_islands: usize,
    /// Islands that stopped because their share of the budget was used up.
    pub out_of_budget_islands: usize,
    /// Largest residual of any body at the end, as the speed that it misses, m/s.
    pub residual: f64,
    /// Deepest contact at the end of the tick, m.
    pub worst_penetration: f64,
    /// Widest gap of any joint at the end of the tick, m.
    pub worst_joint_gap: f64,
    /// Widest turn that any joint or angle limit should not leave, at the end of the tick, rad.
    pub worst_joint_tilt: f64,
    /// Joints, rods and limits whose gap or tilt is above their tolerance at the end of the tick: overloaded beyond what stiffness can
    /// hold, torn by an impact, or lengths that cannot agree.
    pub open_joints: usize,
    /// Pairs that the fine phase of collision detection looked at.
    pub pairs: usize,
    /// Bodies that sleep after the tick.
    pub asleep: usize,
    /// Bodies that were quarantined in this tick because their state became non-finite.
    pub quarantined: usize,
    /// Work that forces, axles, motors and controllers did on bodies in this tick, and recovery, which moves what overlaps
    /// apart, and what restitution gave back, J; 0 unless [audited](crate::Settings::audit_energy).
    pub work_put_in: f64,
    /// By how much more than that the energy of the world rose in the integration, J; below 0 where it was dissipated. 0
    /// unless audited.
    pub energy_gain: f64,
    /// Energy of motion at the end of the tick, J; 0 unless audited.
    pub kinetic_energy: f64,
}

/// Energy that a tick may gain without being a burst: a share of the energy of motion, and so much in any case, J. A tick
/// that is not solved has to pay for its motion (`energy_bound`). An explosion of the numbers is many times more.
const BURST: (f64, f64) = (1e-2, 100.0);

impl StepReport {
    /// Whether energy came from nowhere, beyond what the scheme may bring about; never unless
    /// [audited](crate::Settings::audit_energy).
    pub fn is_energy_burst(&self) -> bool {
        let (share, least) = BURST;
        self.energy_gain > share * self.kinetic_energy + least
    }
}
