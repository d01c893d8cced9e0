//! Springs and motors at joints.

use glam::{DMat3, DQuat, DVec3};

use super::joint::JointKind;
use super::turning::{Turning, differentiate};
use super::well::Well;
use crate::autodiff::{Mat3, Scalar, Vec3};
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

    /// Adds the potential of a joint that was at `q0` and has rates `v1`.
    pub(super) fn add(&self, kind: JointKind, q0: &[f64], v1: &[f64], dt: f64, well: &mut Well) {
        let moved = rates(kind, v1) * dt;
        if kind == JointKind::Ball {
            let (energy, gradient, hessian) = differentiate(moved, |moved| self.evaluate(kind, q0, moved, dt));
            well.add(energy, gradient, positive_part(hessian));
        } else {
            let (energy, gradient) = self.evaluate(kind, q0, Vec3::from(moved), dt);
            let curvature = self.stiffness + self.damping / dt;
            well.add(energy, gradient.value(), DMat3::from_diagonal(DVec3::splat(curvature)));
        }
    }

    /// Energy, J, and its gradient where a tick of `dt` moves the joint by `moved`, from `q0`.
    fn evaluate<S: Scalar>(&self, kind: JointKind, q0: &[f64], moved: Vec3<S>, dt: f64) -> (S, Vec3<S>) {
        let (half_square, stretch) = if kind == JointKind::Ball {
            half_square(&Turning::new(DQuat::from_slice(q0), moved))
        } else {
            let stretch = Vec3::constant(rates(kind, q0)) + moved;
            (stretch.dot(stretch) * 0.5, stretch)
        };
        let damping = self.damping / dt;
        let energy = half_square * self.stiffness + moved.dot(moved) * (0.5 * damping);
        (energy, stretch * self.stiffness + moved * damping)
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

    /// Adds the potential of a joint during a tick; `inertia` is what it feels.
    pub(super) fn add(&self, kind: JointKind, at: &Driven, inertia: DMat3, well: &mut Well) {
        let Some(bowl) = self.bowl(kind, at, inertia) else { return };
        let rates = rates(kind, at.v1);
        let (energy, gradient) = bowl.evaluate(Vec3::from(rates));
        well.add(energy, gradient.value(), bowl.hessian(rates));
    }

    fn bowl(&self, kind: JointKind, at: &Driven, inertia: DMat3) -> Option<Bowl> {
        let PdGains { stiffness, damping } = self.drive.gains(at.dt).ok()?;
        let (&max_force, targets) = at.controls.split_last()?;
        let positions = kind.size().map_or(0, |size| usize::from(size.positions));
        let (target, target_rates) = targets.split_at(positions);
        let error = match kind {
            JointKind::Ball => rotation_vector(DQuat::from_slice(target) * DQuat::from_slice(at.q0).inverse()),
            _ => rates(kind, target) - rates(kind, at.q0),
        };
        let slope = stiffness * at.dt + damping;
        let goal = (error * stiffness + rates(kind, target_rates) * damping) / slope.max(1e-300);
        Some(Bowl { goal, slope: inertia * slope, max_force, dt: at.dt })
    }
}

/// What a motor adds to the energy of a tick: a bowl around the rates that would be right, with a constant slope where the
/// force is at its limit.
struct Bowl {
    /// Rates at its bottom.
    goal: DVec3,
    /// Force over what is missing of them, N s/m or N m s/rad.
    slope: DMat3,
    max_force: f64,
    dt: f64,
}

impl Bowl {
    /// What is missing of the goal, the force that this asks for, and the factor that the limit leaves of it.
    fn force<S: Scalar>(&self, rates: Vec3<S>) -> (Vec3<S>, Vec3<S>, S) {
        let missing = Vec3::constant(self.goal) - rates;
        let force = Mat3::constant(self.slope).multiply(missing);
        let size = force.length();
        let left = if size.value() > self.max_force { S::from(self.max_force) / size } else { S::ONE };
        (missing, force, left)
    }

    /// Energy, J, and its gradient with respect to displacements. Where several rates share a limit that is reached, no
    /// energy has such a force, unless they feel the same inertia, and this one is an estimate.
    fn evaluate<S: Scalar>(&self, rates: Vec3<S>) -> (S, Vec3<S>) {
        let (missing, force, left) = self.force(rates);
        let energy = left * (-left / 2.0 + 1.0) * force.dot(missing) * self.dt;
        (energy, -force.scale(left))
    }

    /// Positive semidefinite.
    fn hessian(&self, rates: DVec3) -> DMat3 {
        let (_, _, left) = self.force(Vec3::from(rates));
        self.slope * (left / self.dt)
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

    const DT: f64 = 1.0 / 30.0;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
    }

    fn kind() -> impl Strategy<Value = JointKind> {
        let axis = DVec3::new(0.6, 0.0, 0.8);
        prop_oneof![
            Just(JointKind::Hinge { axis }),
            Just(JointKind::Slider { axis }),
            Just(JointKind::Universal { axes: [axis, DVec3::Y] }),
            Just(JointKind::Ball),
        ]
    }

    fn drive() -> impl Strategy<Value = JointDrive> {
        prop_oneof![
            (0.5..2.0f64, 0.7..2.0f64)
                .prop_map(|(frequency, damping_ratio)| JointDrive::Position { frequency, damping_ratio }),
            (0.02..1.0f64).prop_map(|time_constant| JointDrive::Velocity { time_constant }),
        ]
    }

    /// Coordinates, or rates, of a joint from three numbers.
    fn coordinates(kind: JointKind, numbers: DVec3) -> Vec<f64> {
        numbers.to_array()[..kind.size().map_or(0, |size| usize::from(size.rates))].to_vec()
    }

    /// The gradient of a potential over displacements, as written, is that of its energy, by automatic differentiation
    /// and by differences, where it `has_energy`; and so is its derivative, which is answered.
    fn check(
        at: DVec3,
        has_energy: bool,
        potential: impl Fn(Vec3<Dual<3>>) -> (Dual<3>, Vec3<Dual<3>>),
    ) -> Result<DMat3, TestCaseError> {
        let dual = |at: DVec3| {
            let [x, y, z] = [0, 1, 2].map(|i| Dual::variable(at[i], i));
            potential(Vec3 { x, y, z })
        };
        let (energy, _) = dual(at);
        let (_, written, rows) = differentiate(at, &potential);
        let stiff = rows.to_cols_array().into_iter().fold(1.0, |most: f64, k| most.max(k.abs()));
        let automatic = DVec3::from_array(energy.tangent);
        let near = |a: DVec3, b: DVec3, accuracy: f64| (a - b).length() < accuracy * (stiff + written.length());
        prop_assert!(!has_energy || near(automatic, written, 1e-12), "{automatic} {written}");
        for (i, axis) in DVec3::AXES.into_iter().enumerate() {
            let h = 1e-6;
            let (above, below) = (dual(at + axis * h), dual(at - axis * h));
            let slope = (above.0.value - below.0.value) / (2.0 * h);
            prop_assert!((slope - automatic[i]).abs() < 1e-7 * (stiff + automatic.length()), "{slope} {automatic}");
            let column = (above.1.value() - below.1.value()) / (2.0 * h);
            prop_assert!(near(column, rows.row(i), 1e-6), "{i}: {column} {rows}");
        }
        Ok(rows)
    }

    proptest! {
        #[test]
        fn springs_derive(kind in kind(), start in vector(), turn in vector(), damping in 0.0..2.0f64) {
            let spring = JointSpring { stiffness: 30.0, damping };
            let v1 = coordinates(kind, turn / DT);
            let moved = rates(kind, &v1) * DT;
            let q0 = match kind {
                JointKind::Ball => DQuat::from_scaled_axis(start * 1.5).to_array().to_vec(),
                _ => coordinates(kind, start),
            };
            // Off half a turn, where the shorter way round changes.
            let turned = || rotation_vector(DQuat::from_scaled_axis(moved) * DQuat::from_slice(&q0)).length();
            prop_assume!(kind != JointKind::Ball || turned() < 3.0);
            let automatic = check(moved, true, |moved| spring.evaluate(kind, &q0, moved, DT))?;
            let mut well = Well::FLAT;
            spring.add(kind, &q0, &v1, DT, &mut well);
            // Of what bends, the positive part.
            let exact = positive_part(automatic);
            prop_assert!(well.hessian.abs_diff_eq(exact, 1e-9 * (30.0 + damping / DT)), "{} {exact}", well.hessian);
        }

        #[test]
        fn motors_derive(
            kind in kind(), drive in drive(), start in vector(), rate in vector(), targets in (vector(), vector()),
            inertia in vector(), max_force in prop_oneof![Just(f64::INFINITY), 0.01..1.0f64],
        ) {
            let count = coordinates(kind, DVec3::ONE).len();
            let inertia = DVec3::from_array(std::array::from_fn(|i| if i < count { inertia[i] } else { 0.0 }));
            let own = DVec3::from_array(std::array::from_fn(|i| if i < count { 1.0 + i as f64 } else { 0.0 }));
            let inertia = DMat3::from_diagonal(own) + crate::potential::outer(inertia, inertia);
            let place = |at: DVec3| match kind {
                JointKind::Ball => DQuat::from_scaled_axis(at).to_array().to_vec(),
                _ => coordinates(kind, at),
            };
            let (q0, v1) = (place(start), coordinates(kind, rate));
            let controls = [place(targets.0), coordinates(kind, targets.1), vec![max_force]].concat();
            let motor = JointMotor { drive, max_force };
            let bowl = motor.bowl(kind, &Driven { dt: DT, q0: &q0, v1: &v1, controls: &controls }, inertia).unwrap();
            let (missing, force, left) = bowl.force(Vec3::from(rates(kind, &v1)));
            // Off the kink where the limit begins.
            prop_assume!((DVec3::from(force).length() / max_force - 1.0).abs() > 1e-3);
            // Of several rates at their limit there is an estimate of the energy alone.
            let has_energy = left == 1.0 || count == 1;
            let moved = rates(kind, &v1) * DT;
            let automatic = check(moved, has_energy, |moved| bowl.evaluate(moved * DT.recip()))?;
            let written = bowl.hessian(rates(kind, &v1));
            if left == 1.0 {
                prop_assert!(written.abs_diff_eq(automatic, 1e-9 * written.col(0).length()), "{written} {automatic}");
            }
            let mut well = Well::FLAT;
            motor.add(kind, &Driven { dt: DT, q0: &q0, v1: &v1, controls: &controls }, inertia, &mut well);
            prop_assert!(well.gradient.dot(missing.into()) <= 0.0 && well.gradient.length() <= max_force * 1.000_001);
        }
    }
}
