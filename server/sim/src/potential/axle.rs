//! Axle: carries a wheel on a chassis. The wheel slides along the chassis' y axis against a spring and damper, steers
//! about it, spins about its own z axis, and is driven and braked.
//!
//! Suspension is the author's stiffness; what keeps the hub on its line and the wheel in its plane is penalty whose
//! stiffness the engine chooses.

use glam::{DMat3, DVec3};

use super::{FrameIndex, PairBlocks, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::dof::{BodyId, Frame, Node};
use crate::error::{SimError, require, require_vector};

slotmap::new_key_type! {
    /// Handle of an axle.
    pub struct AxleId;
}

/// An axle to be added. Chassis and wheel do not collide with each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleDesc {
    /// The body that is carried.
    pub chassis: BodyId,
    /// The body that rolls.
    pub wheel: BodyId,
    /// Where the wheel's centre is without load, in the chassis' frame, m.
    pub hub: DVec3,
    /// Suspension, N/m.
    pub stiffness: f64,
    /// Suspension, N s/m.
    pub damping: f64,
    /// Steering, drive and brake at the start.
    pub control: AxleControl,
}

/// What a driver does to a wheel; may be changed at any tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxleControl {
    /// About the chassis' y axis, rad; positive turns left.
    pub steer: f64,
    /// Drive.
    pub drive: Motor,
    /// Largest torque against any spin, N m.
    pub brake: f64,
}

/// A motor: torque clamp(gain (target − spin), ±max_torque) about the wheel's z axis, or a hinge's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motor {
    /// Spin against the chassis (a hinge's first end), rad/s; a wheel that drives towards +x spins negatively.
    pub target_speed: f64,
    /// N m s/rad.
    pub gain: f64,
    /// N m.
    pub max_torque: f64,
}

/// Gain of a brake, in wheel inertias per tick: stiff enough that a parked car does not creep.
const BRAKE_GAIN: f64 = 1e4;

impl AxleControl {
    /// The wheel's axis as it is steered, in the chassis' frame.
    pub(crate) fn axis(&self) -> DVec3 {
        let (sine, cosine) = self.steer.sin_cos();
        DVec3::new(sine, 0.0, cosine)
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require(self.steer.abs() < std::f64::consts::FRAC_PI_2, "steer", self.steer, "-90 to 90 degrees")?;
        self.drive.validate().map_err(|reason| reason.of("drive"))?;
        require((0.0..1e9).contains(&self.brake), "brake", self.brake, "0 to below 1e9 N m")
    }
}

impl AxleDesc {
    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.hub, "hub")?;
        require((0.0..1e15).contains(&self.stiffness), "stiffness", self.stiffness, "0 to below 1e15 N/m")?;
        require((0.0..1e15).contains(&self.damping), "damping", self.damping, "0 to below 1e15 N s/m")?;
        self.control.validate()
    }
}

/// An axle in an island.
#[derive(Clone, Debug)]
pub(crate) struct AxleTerm {
    /// Chassis, wheel.
    frames: [FrameIndex; 2],
    desc: AxleDesc,
    /// Of the two directions in which the hub may not move, N/m.
    hub_stiffness: f64,
    /// Of the two turns that the wheel may not make, N m/rad.
    plane_stiffness: f64,
    /// Wheel's axis in the chassis' frame.
    axis: DVec3,
    /// Wheel's axis as it is headed in the tick, about which spins and torques are measured.
    spin_axis: DVec3,
    /// Hub along the chassis' y axis at the start of the tick, m.
    start_travel: f64,
    brake_gain: f64,
}

impl AxleTerm {
    /// `joint_stiffness` in reduced masses per dt².
    pub fn new(frames: [FrameIndex; 2], desc: &AxleDesc, nodes: [&Node; 2], joint_stiffness: f64, dt: f64) -> Self {
        let [chassis, wheel] = nodes;
        let spin_axis = wheel.free_rotation * DVec3::Z;
        let across = spin_axis.any_orthonormal_vector();
        let inertia = |node: &Node| across.dot(node.inertia * across);
        let reduced = |a: f64, b: f64| (a.recip() + b.recip()).recip();
        let start = chassis.start.rotation.inverse() * (wheel.start.position - chassis.start.position);
        Self {
            frames,
            desc: *desc,
            hub_stiffness: joint_stiffness * reduced(chassis.mass, wheel.mass) / (dt * dt),
            plane_stiffness: joint_stiffness * reduced(inertia(chassis), inertia(wheel)) / (dt * dt),
            axis: desc.control.axis(),
            spin_axis,
            start_travel: start.y,
            brake_gain: BRAKE_GAIN * spin_axis.dot(wheel.inertia * spin_axis) / dt,
        }
    }

    /// Hub in the chassis' frame, from where it would be without load, m.
    fn travel<S: Scalar>(&self, [chassis, wheel]: [&Frame<S>; 2]) -> Vec3<S> {
        chassis.rotation.transposed_multiply(wheel.position - chassis.position) - Vec3::constant(self.desc.hub)
    }

    /// Distance of the hub from its line, m.
    pub fn gap(&self, at: [&Frame<f64>; 2]) -> f64 {
        let travel = self.travel(at);
        travel.x.hypot(travel.z)
    }

    /// Work of spring, drive and brake in the tick, J. The hub and the wheel's plane are held, not pushed, and the damper
    /// only takes.
    pub fn work(&self, dt: f64, at: [&Frame<f64>; 2]) -> f64 {
        let (before, now) = (self.start_travel - self.desc.hub.y, self.travel(at).y);
        let spring = 0.5 * self.desc.stiffness * (before * before - now * now);
        let turn = self.spin(at) * dt;
        let motors = self.motors().map(|(gain, target, limit)| -clamped(gain, self.spin(at) - target, limit).1 * turn);
        spring + motors.iter().sum::<f64>()
    }

    fn spin<S: Scalar>(&self, [chassis, wheel]: [&Frame<S>; 2]) -> S {
        (wheel.angular - chassis.angular).along(self.spin_axis)
    }

    /// The two clamped torques on a wheel: (gain, target spin, limit).
    fn motors(&self) -> [(f64, f64, f64); 2] {
        let AxleControl { drive, brake, .. } = self.desc.control;
        [(drive.gain, drive.target_speed, drive.max_torque), (self.brake_gain, 0.0, brake)]
    }
}

impl Term for AxleTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        self.frames
    }

    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let [chassis, wheel] = at;
        let travel = self.travel(at);
        let motion = travel.y + (self.desc.hub.y - self.start_travel);
        let (spring, damper) = (self.desc.stiffness, self.desc.damping / dt);
        let local = Vec3 {
            x: travel.x * self.hub_stiffness,
            y: travel.y * spring + motion * damper,
            z: travel.z * self.hub_stiffness,
        };
        let off = travel.x * travel.x + travel.z * travel.z;
        let mut energy =
            off * (0.5 * self.hub_stiffness) + travel.y * travel.y * (0.5 * spring) + motion * motion * (0.5 * damper);
        let force = chassis.rotation.multiply(local);
        let arm = wheel.position - chassis.position;
        let (wanted, actual) = (chassis.arm(self.axis), wheel.arm(DVec3::Z));
        let tilt = wanted - actual;
        energy += tilt.dot(tilt) * (0.5 * self.plane_stiffness);
        // Derivative of ½|z − z'|² with respect to a turn of the wheel, whose z is the second.
        // The axis is a function of the turn across the spin axis alone (see `Node`), so there is no torque about that:
        // the part about it that an unconverged plane's would have makes wheels spin away.
        let plane = wanted.cross(actual);
        let about = Vec3::constant(self.spin_axis);
        let mut torque = (plane - about.scale(plane.along(self.spin_axis))) * self.plane_stiffness;
        for (gain, target, limit) in self.motors() {
            let (value, slope) = clamped(gain, self.spin(at) - target, limit);
            energy += value * dt;
            torque += about.scale(slope);
        }
        let on_chassis = Wrench { force: -force, torque: -arm.cross(force) - torque };
        (energy, [on_chassis, Wrench { force, torque }])
    }

    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let [chassis, wheel] = at;
        let r = chassis.rotation.value();
        let along = self.desc.stiffness + self.desc.damping / dt;
        let local = DMat3::from_diagonal(DVec3::new(self.hub_stiffness, along, self.hub_stiffness));
        let arm = DVec3::from(wheel.position - chassis.position);
        let mut blocks = PairBlocks::of_points(r * local * r.transpose(), arm, DVec3::ZERO);
        let spin = self.spin(at);
        let motors: f64 = self
            .motors()
            .into_iter()
            .filter(|&(gain, target, limit)| gain * (spin - target).abs() < limit)
            .map(|(gain, ..)| gain / dt)
            .sum();
        // About the axis as it is headed: that is what a wheel spins about without leaving its plane.
        let about = outer(self.spin_axis, self.spin_axis);
        let plane = (DMat3::IDENTITY - about) * self.plane_stiffness;
        blocks.add_rotation(plane + about * motors);
        blocks
    }
}

/// Huber's function of `error`: its value and its derivative clamp(gain error, ±limit).
pub(super) fn clamped<S: Scalar>(gain: f64, error: S, limit: f64) -> (S, S) {
    let slope = error * gain;
    if slope.value().abs() <= limit {
        (slope * error * 0.5, slope)
    } else {
        ((error.abs() - 0.5 * limit / gain) * limit, S::from(limit * error.value().signum()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RigidBodyDesc, Settings, Shape, World};

    /// A car in free flight that turns with `turn` while its wheels spin at 20 m/s.
    fn flying_car(turn: DVec3, brake: f64) -> (World, BodyId) {
        let mut world = World::new(Settings { gravity: DVec3::ZERO, ..Settings::at(1.0 / 30.0) }).unwrap();
        let inertia = Shape::Box { half: DVec3::new(1.9, 0.3, 0.85) }.inertia(1100.0);
        let body = RigidBodyDesc { angular_velocity: turn, ..RigidBodyDesc::new(DVec3::ZERO, 1100.0, inertia) };
        let chassis = world.add_rigid_body(body).unwrap();
        let inertia = Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 }.inertia(25.0);
        for hub in [(1.3, -0.8), (1.3, 0.8), (-1.3, -0.8), (-1.3, 0.8)].map(|(x, z)| DVec3::new(x, -0.25, z)) {
            let wheel = RigidBodyDesc {
                velocity: turn.cross(hub),
                angular_velocity: turn - DVec3::Z * 57.0,
                ..RigidBodyDesc::new(hub, 25.0, inertia)
            };
            let wheel = world.add_rigid_body(wheel).unwrap();
            let control = AxleControl { brake, ..AxleControl::default() };
            world.add_axle(AxleDesc { chassis, wheel, hub, stiffness: 4e4, damping: 4e3, control }).unwrap();
        }
        (world, chassis)
    }

    /// Predicting the wheels' free nutation made the roll grow and Newton diverge within a second.
    #[test]
    fn spinning_wheels_follow_a_turning_chassis() {
        let (mut world, chassis) = flying_car(DVec3::new(0.0, 0.5, 0.0), 0.0);
        let before = world.momentum().angular;
        for tick in 0..30 {
            let report = world.step();
            assert!(report.residual < 1e-3 && report.iterations <= 5, "tick {tick}: {report:?}");
        }
        let change = (world.momentum().angular - before).length() / before.length();
        assert!(change < 3e-3, "angular momentum changed by {change}");
        // What the wheels' momentum resists in yaw turns up as roll: L_wheels ω / I_roll a second at most.
        let turn = world.angular_velocity(chassis).unwrap();
        assert!((0.2..0.5).contains(&turn.x) && (turn.y - 0.5).abs() < 0.05, "{turn}");
    }

    /// The torque of an unconverged plane had a part about the wheel's axis, which spun wheels up to 1e5 rad/s.
    #[test]
    fn a_tumbling_car_keeps_its_wheels_while_they_lock() {
        for turn in [DVec3::new(6.0, 0.0, 0.0), DVec3::new(0.0, 6.0, 0.0), DVec3::new(4.0, -3.0, 5.0)] {
            let (mut world, chassis) = flying_car(turn, 2_500.0);
            let energy = world.energy().kinetic;
            for tick in 0..60 {
                let report = world.step();
                assert!(report.worst_joint_gap < 1e-3 && report.residual < 1.0, "{turn}, tick {tick}: {report:?}");
            }
            assert!(world.energy().kinetic < energy);
            assert!(world.angular_velocity(chassis).unwrap().length() < 10.0);
        }
    }
}
