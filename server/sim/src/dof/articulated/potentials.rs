//! What acts between a figure's parts: limits, springs and motors, each at one joint.

use std::ops::Range;

use glam::DVec3;

use super::Articulated;
use super::inertia::MassMatrix;
use super::joint::{Joint, JointKind};
use super::limit::Start;
use super::motor::Driven;
use super::well::Well;
use crate::dof::{BLOCK_RATES_MAX, LocalState, RateBlock};
use crate::error::SimError;

/// Where the motor of a joint is steered among a figure's controls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotorControls {
    /// Target positions, as the joint has them in Q.
    pub position: Range<usize>,
    /// Target rates, as the joint has them in Q'.
    pub rate: Range<usize>,
    /// The largest torque or force, N m or N; 0 lets the joint go limp.
    pub max_force: usize,
}

impl Articulated {
    /// Where the motor of a part's joint is steered; `None` where there is none.
    pub fn motor(&self, part: u32) -> Option<MotorControls> {
        let joint = self.joints.get(part as usize)?;
        let (_, size) = (joint.motor?, joint.kind.size()?);
        let start = joint.controls.start;
        let (rate, end) = (start + usize::from(size.positions), joint.controls.end - 1);
        Some(MotorControls { position: start..rate, rate: rate..end, max_force: end })
    }

    pub(super) fn first_controls(&self) -> Vec<f64> {
        let mut controls = Vec::new();
        for joint in &self.joints {
            if let Some(motor) = joint.motor {
                motor.controls(joint.kind, &mut controls);
            }
        }
        controls
    }

    pub(super) fn check_motors(&self, controls: &[f64], dt: f64) -> Result<(), SimError> {
        for (joint, part) in self.joints.iter().zip(&self.parts) {
            let Some(motor) = joint.motor else { continue };
            let checked = motor.check_controls(joint.kind, &controls[joint.controls.clone()], dt);
            checked.map_err(|reason| reason.of(format!("motor of the {}", part.name)))?;
        }
        Ok(())
    }

    /// What each rate resists with where all others are held, and the mass matrix in which rates without motors are
    /// loose; nothing where no limit or motor asks.
    pub(super) fn prepare_inertia(&self, q0: &[f64], prepared: &mut Vec<f64>) {
        if self.joints.iter().all(|joint| joint.limits.is_empty() && joint.motor.is_none()) {
            return;
        }
        let n = self.lengths.1;
        prepared.resize(n + n * n, 0.0);
        let (held, entries) = prepared.split_at_mut(n);
        let mut matrix = MassMatrix { n, entries };
        matrix.add(self, q0);
        held.iter_mut().enumerate().for_each(|(i, held)| *held = matrix.held(i));
        for joint in self.joints.iter().filter(|joint| joint.motor.is_none()) {
            joint.rates().for_each(|i| matrix.release(i));
        }
    }

    pub(super) fn potential_energy(&self, at: &LocalState, gradient: &mut [f64]) -> f64 {
        let mut energy = 0.0;
        for joint in self.joints.iter().filter(|joint| joint.acts()) {
            let well = self.well(joint, at);
            energy += well.energy;
            for (g, slope) in gradient[joint.rates()].iter_mut().zip(well.gradient.to_array()) {
                *g += slope;
            }
        }
        energy
    }

    pub(super) fn potential_stiffness(&self, at: &LocalState, add: &mut dyn FnMut(usize, usize, &RateBlock)) {
        for joint in self.joints.iter().filter(|joint| joint.acts()) {
            let (Some(block), rates) = (joint.block, joint.rates().len()) else { continue };
            let hessian = self.well(joint, at).hessian.to_cols_array_2d();
            let mut entries = [[0.0; BLOCK_RATES_MAX]; BLOCK_RATES_MAX];
            for (entries, column) in entries.iter_mut().zip(hessian).take(rates) {
                entries[..rates].copy_from_slice(&column[..rates]);
            }
            add(block, block, &entries);
        }
    }

    /// Energy of the springs, J.
    pub(super) fn spring_energy(&self, q: &[f64]) -> f64 {
        let stored = |joint: &Joint| joint.spring.map_or(0.0, |spring| spring.stored(joint.kind, joint.q(q)));
        self.joints.iter().map(stored).sum()
    }

    /// All that acts at a joint, at the candidate.
    fn well(&self, joint: &Joint, at: &LocalState) -> Well {
        let mut well = Well::FLAT;
        let (q0, q1, v1) = (joint.q(at.q0), joint.q(at.q1), joint.v(at.v1));
        if let Some(spring) = joint.spring {
            spring.add(joint.kind, q0, v1, at.dt, &mut well);
        }
        let (held, loose) = at.prepared.split_at(at.prepared.len().min(self.lengths.1));
        if let Some(motor) = joint.motor {
            let rates = joint.rates();
            let inertia = MassMatrix::block(loose, self.lengths.1, rates.start, rates.len());
            let driven = Driven { dt: at.dt, q0, v1, controls: &at.controls[joint.controls.clone()] };
            motor.add(joint.kind, &driven, inertia, &mut well);
        }
        if !joint.limits.is_empty() {
            let largest = |numbers: &[f64]| numbers.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let (inertia, speed) = (largest(&held[joint.rates()]), largest(&at.v0[joint.rates()]));
            let turn = if joint.kind == JointKind::Ball { DVec3::from_slice(v1) * at.dt } else { DVec3::ZERO };
            let start = Start { dt: at.dt, inertia, speed, turn };
            joint.limits.iter().for_each(|limit| limit.add(&start, q0, q1, &mut well));
        }
        well
    }
}
