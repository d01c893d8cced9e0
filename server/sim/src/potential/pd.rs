//! PD controller (talk, "Code: PD Controller"): F = (Ct − C) Ks + (Vt − V) Kd, with gains such that a player sees the
//! frequency and damping ratio that the author asked for, at this tick rate.

use glam::{DMat3, DVec3};

use super::{Anchor, End, FIXED, FrameIndex, PairBlocks, Term, Wrench, geometric_stiffness};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::Frame;
use crate::dof::articulated::JointDrive;
use crate::error::{SimError, require, require_vector};

slotmap::new_key_type! {
    /// Handle of a PD controller.
    pub struct PdId;
}

/// A PD controller on a point of a body of any kind, to be added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdDesc {
    /// What it moves. Gains are made for the mass of the whole body or part (of an elastic body, for what a force at the
    /// point feels), so away from a centre of mass the point is quicker than asked for.
    pub at: Anchor,
    /// Second order, or first order (talk, "Velocity Potential": F = (Vt − V) Kd), which does not mind the position.
    pub drive: JointDrive,
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
pub struct PdGains {
    /// Ks, 1/s².
    pub stiffness: f64,
    /// Kd, 1/s.
    pub damping: f64,
}

/// Bound of gains, per kg and tick: a faster mode that a tick shrinks by more is gone anyway, and numbers stay far from
/// overflowing.
const STIFFEST: f64 = 1e12;

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
        // A tick divides the two modes by e^a and e^b: dt² Ks = (e^a − 1)(e^b − 1) and dt Kd = e^a + e^b − 2, written
        // such that nothing cancels where both are near 1, or one is huge.
        let (stiffness, damping) = if damping_ratio < 1.0 {
            let growth = damping_ratio * omega * dt;
            let turned = 4.0 * growth.exp() * (beat_angle / 2.0).sin().powi(2);
            (growth.exp_m1().powi(2) + turned, 2.0 * growth.exp_m1() - turned)
        } else {
            let spread = damping_ratio + (damping_ratio * damping_ratio - 1.0).sqrt();
            let [slow, fast] = [omega * dt / spread, omega * dt * spread].map(f64::exp_m1);
            (slow * fast, slow + fast)
        };
        let (stiffness, damping) = (stiffness / (dt * dt), damping / dt);
        let firm = stiffness.max(damping / dt) * dt * dt < STIFFEST;
        require(
            firm,
            "damping_ratio",
            damping_ratio,
            "one that shrinks the faster of both modes by less than 1e12 a tick",
        )?;
        let reachable = "a frequency and damping ratio that this tick rate can show (damp more, or slow down)";
        require(damping >= 0.0, "damping gain", damping, reachable)?;
        require(stiffness >= 0.0, "stiffness gain", stiffness, reachable)?;
        Ok(Self { stiffness, damping })
    }
}

/// A PD controller in an island.
///
/// Both gains act on the velocity with which the point gets to where it is at the end of the tick, so the force is `slope`
/// (v_goal − v): a bowl around the place that would be right, with a constant slope where the force is at its limit.
#[derive(Clone, Debug)]
pub(crate) struct PdTerm {
    end: End,
    /// The point at the start of the tick, m.
    start: DVec3,
    /// Ks dt + Kd, N s/m.
    slope: f64,
    goal: DVec3,
    max_force: f64,
}

impl PdTerm {
    /// `gains` are per kg of `mass`; the point is at `start`.
    pub fn new(end: End, desc: &PdDesc, gains: PdGains, mass: f64, start: DVec3, dt: f64) -> Self {
        let slope = gains.stiffness * dt + gains.damping;
        let PdControl { target, target_velocity } = desc.control;
        let goal = ((target - start) * gains.stiffness + target_velocity * gains.damping) / slope.max(1e-300);
        Self { end, start, slope: slope * mass, goal, max_force: desc.max_force }
    }

    /// Arm of the point, force without the limit, and the factor that the limit leaves of it.
    fn force<S: Scalar>(&self, dt: f64, body: &Frame<S>) -> (Vec3<S>, Vec3<S>, S) {
        let arm = body.arm(self.end.point);
        let velocity = (body.position + arm - Vec3::constant(self.start)) * dt.recip();
        let force = (Vec3::constant(self.goal) - velocity) * self.slope;
        let size = force.length();
        (arm, force, if size.below(self.max_force) { S::ONE } else { S::from(self.max_force) / size })
    }
}

impl Term for PdTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        [self.end.frame, FIXED]
    }

    fn evaluate<S: Scalar>(&self, dt: f64, [body, _]: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (arm, force, left) = self.force(dt, body);
        // Huber's function of the velocity error, over one tick.
        let energy = left * (-left / 2.0 + 1.0) * force.dot(force) * (dt / self.slope.max(1e-300));
        (energy, [Wrench::at(-force.scale(left), arm), Wrench::ZERO])
    }

    fn hessian(&self, dt: f64, [body, _]: [&Frame<f64>; 2]) -> PairBlocks {
        let (arm, force, left) = self.force(dt, body);
        let (arm, force) = (DVec3::from(arm), DVec3::from(force) * left);
        let stiffness = DMat3::from_diagonal(DVec3::splat(self.slope * left / dt));
        let mut blocks = PairBlocks::of_points(stiffness, arm, DVec3::ZERO);
        blocks.add_rotation_a(geometric_stiffness(-force, arm));
        blocks
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
        // Slow, and overdamped: Ks → ω², and the slower of the two modes is the one that the player sees.
        let omega = std::f64::consts::TAU * 1e-6;
        assert!((PdGains::new(1e-6, 0.5, dt).unwrap().stiffness / (omega * omega) - 1.0).abs() < 1e-6);
        let gains = PdGains::new(2.0, 20.0, dt).unwrap();
        let (k, c) = (gains.stiffness * dt * dt, gains.damping * dt);
        // λ is a root of (1 + c + k) λ² − (2 + c) λ + 1; the larger one.
        let root = ((2.0 + c) + (c * c - 4.0 * k).sqrt()) / (2.0 * (1.0 + c + k));
        let slow = std::f64::consts::TAU * 2.0 * (20.0 - 399f64.sqrt()) * dt;
        assert!((root.ln() + slow).abs() < 1e-9, "{} {slow}", root.ln());
        assert!(PdGains::new(2.0, 500.0, dt).unwrap_err().to_string().contains("damping_ratio"));
        assert!(PdGains::new(5.0, 0.3, dt).unwrap_err().to_string().contains("damping gain"));
        assert!(PdGains::new(30.0, 0.5, dt).unwrap_err().to_string().contains("half the tick rate"));
    }
}
