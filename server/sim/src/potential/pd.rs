//! PD controller (talk, "Code: PD Controller"): F = (Ct − C) Ks + (Vt − V) Kd, with gains such that a player sees the
//! frequency and damping ratio that the author asked for, at this tick rate.

use glam::{DMat3, DVec3};

use super::{FIXED, FrameIndex, PairBlocks, Term, Wrench};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::{BodyId, Frame};
use crate::error::{SimError, require, require_vector};

slotmap::new_key_type! {
    /// Handle of a PD controller.
    pub struct PdId;
}

/// A PD controller on a body's centre of mass, to be added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdDesc {
    /// What it moves.
    pub body: BodyId,
    /// Hz, as seen by a player.
    pub frequency: f64,
    /// 1 is critical, as seen by a player.
    pub damping_ratio: f64,
    /// Largest force, N; infinite for none.
    pub max_force: f64,
    /// Where to; may be changed at any tick.
    pub control: PdControl,
}

/// What a PD controller follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdControl {
    /// Position at the end of the coming tick, m.
    pub target: DVec3,
    /// Velocity at the end of the coming tick, m/s.
    pub target_velocity: DVec3,
}

impl PdControl {
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.target, "target")?;
        require_vector(self.target_velocity, "target_velocity")
    }
}

/// Gains per kg: Ks in 1/s², Kd in 1/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PdGains {
    pub stiffness: f64,
    pub damping: f64,
}

impl PdGains {
    /// Gains for which implicit Euler with ticks of `dt` samples the oscillator asked for (DESIGN, section 3).
    ///
    /// # Errors
    /// Where the tick cannot show it: stiffness or damping would have to be negative.
    pub fn new(frequency: f64, damping_ratio: f64, dt: f64) -> Result<Self, SimError> {
        require(frequency > 0.0 && frequency < 1e3, "frequency", frequency, "above 0, below 1000 Hz")?;
        require((0.0..1e3).contains(&damping_ratio), "damping_ratio", damping_ratio, "0 to below 1000")?;
        let omega = std::f64::consts::TAU * frequency;
        let beat_angle = omega * (1.0 - damping_ratio * damping_ratio).max(0.0).sqrt() * dt;
        let slow_enough = beat_angle < std::f64::consts::PI;
        require(slow_enough, "frequency", frequency, "less than half the tick rate, as damped")?;
        let grown = (damping_ratio * omega * dt).exp();
        let beat = if damping_ratio < 1.0 {
            beat_angle.cos()
        } else {
            (omega * (damping_ratio * damping_ratio - 1.0).sqrt() * dt).cosh()
        };
        let damping = (2.0 * grown * beat - 2.0) / dt;
        let stiffness = (grown * grown - 1.0 - dt * damping) / (dt * dt);
        let reachable = "a frequency and damping ratio that this tick rate can show (damp more, or slow down)";
        require(damping >= 0.0, "damping gain", damping, reachable)?;
        require(stiffness >= 0.0, "stiffness gain", stiffness, reachable)?;
        Ok(Self { stiffness, damping })
    }
}

/// A PD controller in an island.
///
/// Both gains act on the velocity at the end of the tick, so the force is `slope` (v_goal − v): a bowl around the
/// velocity that would be right, with a constant slope where the force is at its limit.
#[derive(Clone, Debug)]
pub(crate) struct PdTerm {
    frame: FrameIndex,
    /// Ks dt + Kd, N s/m.
    slope: f64,
    goal: DVec3,
    max_force: f64,
}

impl PdTerm {
    pub fn new(frame: FrameIndex, desc: &PdDesc, gains: PdGains, mass: f64, position: DVec3, dt: f64) -> Self {
        let slope = gains.stiffness * dt + gains.damping;
        let PdControl { target, target_velocity } = desc.control;
        let goal = ((target - position) * gains.stiffness + target_velocity * gains.damping) / slope.max(1e-300);
        Self { frame, slope: slope * mass, goal, max_force: desc.max_force }
    }

    /// Force without the limit, and the factor that the limit leaves of it.
    fn force<S: Scalar>(&self, body: &Frame<S>) -> (Vec3<S>, S) {
        let force = (Vec3::constant(self.goal) - body.linear) * self.slope;
        let size = force.length();
        (force, if size.below(self.max_force) { S::ONE } else { S::from(self.max_force) / size })
    }
}

impl Term for PdTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        [self.frame, FIXED]
    }

    fn evaluate<S: Scalar>(&self, dt: f64, [body, _]: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (force, left) = self.force(body);
        // Huber's function of the velocity error, over one tick.
        let energy = left * (-left / 2.0 + 1.0) * force.dot(force) * (dt / self.slope.max(1e-300));
        (energy, [Wrench::at_fixed(-force.scale(left), DVec3::ZERO), Wrench::ZERO])
    }

    fn hessian(&self, dt: f64, [body, _]: [&Frame<f64>; 2]) -> PairBlocks {
        let (_, left) = self.force(body);
        PairBlocks::of_points(DMat3::from_diagonal(DVec3::splat(self.slope * left / dt)), DVec3::ZERO, DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The talk's two examples, and one that 30 Hz cannot show.
    #[test]
    fn gains_sample_the_oscillator_that_was_asked_for() {
        let dt = 1.0 / 30.0;
        for (frequency, ratio, time, expected) in [(2.0, 1.0, 0.5, 0.0136), (0.2, 0.5, 2.887, -0.163)] {
            let gains = PdGains::new(frequency, ratio, dt).unwrap();
            let (mut x, mut v) = (1.0, 0.0);
            let mut extreme = f64::MAX;
            for _ in 0..(time / dt + 0.5) as usize {
                v = (v - dt * gains.stiffness * x) / (1.0 + dt * gains.damping + dt * dt * gains.stiffness);
                x += dt * v;
                extreme = extreme.min(x);
            }
            assert!((extreme - expected).abs() < 0.003, "{frequency} Hz: {extreme}");
        }
        assert!(PdGains::new(5.0, 0.3, dt).unwrap_err().to_string().contains("damping gain"));
        assert!(PdGains::new(30.0, 0.5, dt).unwrap_err().to_string().contains("half the tick rate"));
    }
}
