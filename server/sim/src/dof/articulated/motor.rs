//! Springs and motors at joints.

use glam::{DMat3, DQuat, DVec3};

use super::joint::JointKind;
use super::turning::{Turning, differentiate};
use super::well::Well;
use crate::autodiff::{Scalar, Vec3};
use crate::eigen::positive_part;
use crate::error::{LARGEST, SimError, require, require_rotation};
use crate::potential::PdGains;

/// A spring with a damper that pulls a joint to rest, as strong as its author says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSpring {
    /// N m/rad, N/m for a slider.
    pub stiffness: f64,
    /// N m s/rad, N s/m for a slider.
    pub damping: f64,
}

/// A motor at a joint. Its targets and its strength may be changed at any tick: [`super::MotorControls`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotor {
    /// How it follows its targets.
    pub drive: JointDrive,
    /// Largest torque, N m; force of a slider, N; infinite for none.
    pub max_force: f64,
}

/// How a motor or a PD controller follows its targets, as a player sees it: the engine finds the gains for its tick and
/// for the inertia that it feels; at a joint, the others with motors being held and those without being loose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointDrive {
    /// Swings to the target like a damped spring.
    Position {
        /// Hz.
        frequency: f64,
        /// 1 is critical.
        damping_ratio: f64,
    },
    /// Approaches the target rate and does not mind the position.
    Velocity {
        /// After this time 1/e of the difference is left, s.
        time_constant: f64,
    },
}

impl JointSpring {
    pub(super) fn validate(&self) -> Result<(), SimError> {
        let Self { stiffness, damping } = *self;
        require((0.0..1e12).contains(&stiffness), "stiffness of the spring", stiffness, "0 to below 1e12 N m/rad")?;
        require((0.0..1e12).contains(&damping), "damping of the spring", damping, "0 to below 1e12 N m s/rad")
    }

    /// Adds the potential of a joint that was at `q0`, is at `q1` and has rates `v1`.
    pub(super) fn add(&self, kind: JointKind, [q0, q1, v1]: [&[f64]; 3], dt: f64, well: &mut Well) {
        let stretching = rates(kind, v1);
        well.energy += self.stored(kind, q1) + 0.5 * self.damping * dt * stretching.length_squared();
        well.gradient += stretching * self.damping;
        well.hessian += DMat3::IDENTITY * (self.damping / dt);
        if kind == JointKind::Ball {
            let start = DQuat::from_slice(q0);
            let (_, gradient, hessian) = differentiate(stretching * dt, |turn| half_square(&Turning::new(start, turn)));
            well.gradient += gradient * self.stiffness;
            well.hessian += positive_part(hessian) * self.stiffness;
        } else {
            well.gradient += stretch(kind, q1) * self.stiffness;
            well.hessian += DMat3::IDENTITY * self.stiffness;
        }
    }

    /// Energy of a joint at `q`, J.
    pub(super) fn stored(&self, kind: JointKind, q: &[f64]) -> f64 {
        0.5 * self.stiffness * stretch(kind, q).length_squared()
    }
}

/// Half of the squared angle of a rotation, and the derivative with respect to the turn.
fn half_square<S: Scalar>(rotation: &Turning<S>) -> (S, Vec3<S>) {
    let sign = if rotation.w.below(0.0) { -1.0 } else { 1.0 };
    let (v, w) = (rotation.v * sign, rotation.w * sign);
    let sine = v.length();
    let vector = if sine.below(1e-9) { v * 2.0 } else { v.scale(sine.atan2(w) * 2.0 / sine) };
    // A small turn changes half the square by what it has along the rotation's axis.
    (vector.dot(vector) * 0.5, rotation.pull_back(vector))
}

/// A joint's coordinates as numbers that its rates change; of a ball joint, the vector of its rotation.
fn stretch(kind: JointKind, q: &[f64]) -> DVec3 {
    match kind {
        JointKind::Ball => rotation_vector(DQuat::from_slice(q)),
        _ => rates(kind, q),
    }
}

/// One to three numbers; those that a joint does not have are zero.
fn rates(kind: JointKind, v: &[f64]) -> DVec3 {
    match kind {
        JointKind::Fixed | JointKind::Free => DVec3::ZERO,
        JointKind::Hinge { .. } | JointKind::Slider { .. } => DVec3::new(v[0], 0.0, 0.0),
        JointKind::Universal { .. } => DVec3::new(v[0], v[1], 0.0),
        JointKind::Ball => DVec3::from_slice(v),
    }
}

/// The shorter way round.
fn rotation_vector(q: DQuat) -> DVec3 {
    if q.w < 0.0 { (-q).to_scaled_axis() } else { q.to_scaled_axis() }
}

impl JointDrive {
    /// Gains per unit of inertia in a world of ticks of `dt`: what a potential of a game's own needs to move as asked for.
    ///
    /// # Errors
    /// What this tick cannot show.
    pub fn gains(self, dt: f64) -> Result<PdGains, SimError> {
        match self {
            Self::Position { frequency, damping_ratio } => PdGains::new(frequency, damping_ratio, dt),
            Self::Velocity { time_constant } => {
                require((1e-3..1e6).contains(&time_constant), "time_constant", time_constant, "1e-3 to below 1e6 s")?;
                // (1 + dt Kd) is what a tick shrinks the difference by: after 20 time constants 2e-9 are left.
                Ok(PdGains { stiffness: 0.0, damping: (dt / time_constant).min(20.0).exp_m1() / dt })
            }
        }
    }
}

impl JointMotor {
    pub(super) fn validate(&self) -> Result<(), SimError> {
        let strong = self.max_force >= 0.0;
        if strong { Ok(()) } else { Err(out_of_range(self.max_force)) }
    }

    /// What it is steered by at first: a joint at rest that shall stay there.
    pub(super) fn controls(&self, kind: JointKind, controls: &mut Vec<f64>) {
        let Some(size) = kind.size() else { return };
        let start = controls.len();
        controls.resize(start + usize::from(size.positions), 0.0);
        kind.rest(&mut controls[start..]);
        controls.resize(controls.len() + usize::from(size.rates), 0.0);
        controls.push(self.max_force);
    }

    pub(super) fn check_controls(&self, kind: JointKind, controls: &[f64], dt: f64) -> Result<(), SimError> {
        self.drive.gains(dt)?;
        let Some((&strength, targets)) = controls.split_last() else { return Ok(()) };
        targets.iter().try_for_each(|&x| require(x.abs() < LARGEST, "target of the motor", x, "finite, below 1e9"))?;
        if kind == JointKind::Ball {
            require_rotation(DQuat::from_slice(targets), "target of the motor")?;
        }
        Self { max_force: strength, ..*self }.validate()
    }

    /// Adds the potential of a joint that was at `q0` and has rates `v1`: a bowl around the rates that would be right,
    /// with a constant slope where the force is at its limit. `inertia` is what the joint feels.
    pub(super) fn add(&self, kind: JointKind, at: &Driven, inertia: DMat3, well: &mut Well) {
        let Ok(PdGains { stiffness, damping }) = self.drive.gains(at.dt) else { return };
        let Some((&max_force, targets)) = at.controls.split_last() else { return };
        let positions = kind.size().map_or(0, |size| usize::from(size.positions));
        let (target, target_rates) = targets.split_at(positions);
        let error = match kind {
            JointKind::Ball => rotation_vector(DQuat::from_slice(target) * DQuat::from_slice(at.q0).inverse()),
            _ => rates(kind, target) - rates(kind, at.q0),
        };
        let slope = stiffness * at.dt + damping;
        let goal = (error * stiffness + rates(kind, target_rates) * damping) / slope.max(1e-300);
        let missing = goal - rates(kind, at.v1);
        let force = inertia * missing * slope;
        let left = if force.length() > max_force { max_force / force.length() } else { 1.0 };
        well.energy += left * (1.0 - left / 2.0) * force.dot(missing) * at.dt;
        well.gradient -= force * left;
        well.hessian += inertia * (slope * left / at.dt);
    }
}

/// A joint with a motor during a tick.
pub(super) struct Driven<'a> {
    pub dt: f64,
    pub q0: &'a [f64],
    pub v1: &'a [f64],
    /// Target positions, target rates, largest force.
    pub controls: &'a [f64],
}

fn out_of_range(max_force: f64) -> SimError {
    SimError::OutOfRange { what: "max_force of the motor", value: max_force, allowed: "0 or more" }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::autodiff::Dual;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
    }

    proptest! {
        /// The derivatives of a ball joint's spring, as written, are those by automatic differentiation of its energy and
        /// by differences; and so are its second derivatives.
        #[test]
        fn springs_of_ball_joints_derive(start in vector(), turn in vector()) {
            let start = DQuat::from_scaled_axis(start * 1.5);
            let at = |turn: DVec3| {
                let [x, y, z] = [0, 1, 2].map(|i| Dual::<3>::variable(turn[i], i));
                half_square(&Turning::new(start, Vec3 { x, y, z }))
            };
            let (value, gradient) = at(turn);
            // Off half a turn, where the shorter way round changes.
            prop_assume!(value.value < 4.0);
            let automatic = DVec3::from_array(value.tangent);
            prop_assert!((automatic - gradient.value()).length() < 1e-9, "{automatic} {}", gradient.value());
            let (_, _, hessian) = differentiate(turn, |turn| half_square(&Turning::new(start, turn)));
            for (i, axis) in DVec3::AXES.into_iter().enumerate() {
                let h = 1e-6;
                let (above, below) = (at(turn + axis * h), at(turn - axis * h));
                prop_assert!(((above.0.value - below.0.value) / (2.0 * h) - automatic[i]).abs() < 1e-7);
                let column = (above.1.value() - below.1.value()) / (2.0 * h);
                prop_assert!((column - hessian.col(i)).length() < 1e-6, "{column} {}", hessian.col(i));
            }
        }
    }
}
