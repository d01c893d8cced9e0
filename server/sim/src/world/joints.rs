//! Joints that hold turns, and what limits and drives them: added, checked, steered and removed.

use glam::DVec3;

use super::World;
use super::potentials::NO_PAIR;
use crate::dof::{DofKind, Frame, PartPoint};
use crate::error::{SimError, require};
use crate::potential::alignment::Captured;
use crate::potential::hold::Held;
use crate::potential::limit::hinge_angle;
use crate::potential::{
    Anchor, AngleLimitDesc, AngleLimitId, DistanceLimitDesc, DistanceLimitId, Driven, FixedJointDesc, FixedJointId,
    HingeDesc, HingeId, Motor, MotorDesc, MotorId, SliderDesc, SliderId, UniversalJointDesc, UniversalJointId,
};

/// Sine of the angle below which the axes of a universal joint are taken for parallel.
const PARALLEL: f64 = 0.01;

impl World {
    /// Adds a hinge.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a body that is gone, two ends at the same body, or an end that cannot turn.
    pub fn add_hinge(&mut self, desc: HingeDesc) -> Result<HingeId, SimError> {
        desc.validate()?;
        self.check_turning(desc.a, desc.b)?;
        let axes = [desc.axis_a.normalize(), desc.axis_b.normalize()];
        let [a, b] = [self.frame_at(desc.a), self.frame_at(desc.b)];
        // Across both axes, so that it is across both when the hinge has closed.
        let [x, y] = [DVec3::from(a.arm(axes[0])), DVec3::from(b.arm(axes[1]))];
        let zero = x.cross(y).try_normalize().filter(|_| x.cross(y).length() > 1e-6);
        let zero = zero.unwrap_or_else(|| x.any_orthonormal_vector());
        let zeros = [local(&a, zero), local(&b, zero)];
        self.exclude(desc.a, desc.b);
        Ok(self.potentials.hinges.insert(Held::new(Captured { desc, axes: [axes, zeros] })))
    }

    /// Adds a universal joint.
    ///
    /// # Errors
    /// As [`World::add_hinge`]; and where the axes are parallel as the bodies stand: nothing says which way to turn them.
    pub fn add_universal_joint(&mut self, desc: UniversalJointDesc) -> Result<UniversalJointId, SimError> {
        desc.validate()?;
        self.check_turning(desc.a, desc.b)?;
        let [a, b] = [self.frame_at(desc.a).arm(desc.axis_a), self.frame_at(desc.b).arm(desc.axis_b)];
        let [a, b] = [a, b].map(|axis| DVec3::from(axis).normalize_or_zero());
        require(
            a.cross(b).length() > PARALLEL,
            "sine of the angle between the axes",
            a.cross(b).length(),
            "above 0.01",
        )?;
        self.exclude(desc.a, desc.b);
        Ok(self.potentials.universal_joints.insert(Held::new(desc)))
    }

    /// Adds a fixed joint.
    ///
    /// # Errors
    /// As [`World::add_hinge`].
    pub fn add_fixed_joint(&mut self, desc: FixedJointDesc) -> Result<FixedJointId, SimError> {
        desc.validate()?;
        self.check_turning(desc.a, desc.b)?;
        let axes = self.capture(desc.a, desc.b, DVec3::AXES);
        self.exclude(desc.a, desc.b);
        Ok(self.potentials.fixed_joints.insert(Held::new(Captured { desc, axes })))
    }

    /// Adds a slider.
    ///
    /// # Errors
    /// As [`World::add_hinge`].
    pub fn add_slider(&mut self, desc: SliderDesc) -> Result<SliderId, SimError> {
        desc.validate()?;
        self.check_turning(desc.a, desc.b)?;
        let axis = desc.axis_a.normalize();
        let (x, y) = axis.any_orthonormal_pair();
        let axes = self.capture(desc.a, desc.b, [axis, x, y]);
        self.exclude(desc.a, desc.b);
        Ok(self.potentials.sliders.insert(Held::new(Captured { desc, axes })))
    }

    /// Adds a limit of a distance.
    ///
    /// # Errors
    /// As [`World::add_spring`].
    pub fn add_distance_limit(&mut self, desc: DistanceLimitDesc) -> Result<DistanceLimitId, SimError> {
        desc.validate()?;
        self.check_anchors(desc.a, desc.b)?;
        self.rouse_ends(desc.a, desc.b);
        Ok(self.potentials.distance_limits.insert(Held::new(desc)))
    }

    /// Adds a limit of a hinge's angle.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a hinge that is gone.
    pub fn add_angle_limit(&mut self, desc: AngleLimitDesc) -> Result<AngleLimitId, SimError> {
        desc.validate()?;
        let Some([a, b]) = self.potentials.ends_of(Driven::Hinge(desc.hinge)) else {
            return Err(SimError::Gone { what: "the hinge of the limit" });
        };
        self.rouse_ends(a, b);
        Ok(self.potentials.angle_limits.insert(Held::new(desc)))
    }

    /// Adds a motor to a hinge, a slider or a pair of wheels.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a joint that is gone, or wheels that are not of one chassis.
    pub fn add_motor(&mut self, desc: MotorDesc) -> Result<MotorId, SimError> {
        desc.motor.validate()?;
        let Some([a, b]) = self.potentials.ends_of(desc.joint) else {
            return Err(match desc.joint {
                Driven::Wheels(_) => SimError::Unusable { what: NO_PAIR },
                _ => SimError::Gone { what: "the joint of the motor" },
            });
        };
        self.rouse_ends(a, b);
        Ok(self.potentials.motors.insert(desc))
    }

    /// What a motor does now.
    pub fn motor(&self, id: MotorId) -> Option<&Motor> {
        self.potentials.motors.get(id).map(|desc| &desc.motor)
    }

    /// Sets what a motor does from the coming tick on.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a motor that is gone.
    pub fn set_motor(&mut self, id: MotorId, motor: Motor) -> Result<(), SimError> {
        motor.validate()?;
        let desc = self.potentials.motors.get_mut(id).ok_or(SimError::Gone { what: "the motor" })?;
        let (joint, changes) = (desc.joint, std::mem::replace(&mut desc.motor, motor) != motor);
        if let Some([a, b]) = self.potentials.ends_of(joint).filter(|_| changes) {
            self.rouse_ends(a, b);
        }
        Ok(())
    }

    /// Angle of a hinge since it was added, −π to π rad.
    pub fn hinge_angle(&self, id: HingeId) -> Option<f64> {
        let Captured { desc, axes } = &self.potentials.hinges.get(id)?.desc;
        Some(hinge_angle(*axes, [&self.frame_at(desc.a), &self.frame_at(desc.b)]))
    }

    /// Removes a hinge with its limits and motors. Answers whether there was one.
    pub fn remove_hinge(&mut self, id: HingeId) -> bool {
        let Some(hinge) = self.potentials.hinges.remove(id) else { return false };
        self.potentials.remove_orphans();
        self.include(hinge.desc.desc.a, hinge.desc.desc.b);
        true
    }

    /// Removes a universal joint. Answers whether there was one.
    pub fn remove_universal_joint(&mut self, id: UniversalJointId) -> bool {
        let Some(joint) = self.potentials.universal_joints.remove(id) else { return false };
        self.include(joint.desc.a, joint.desc.b);
        true
    }

    /// Removes a fixed joint. Answers whether there was one.
    pub fn remove_fixed_joint(&mut self, id: FixedJointId) -> bool {
        let Some(joint) = self.potentials.fixed_joints.remove(id) else { return false };
        self.include(joint.desc.desc.a, joint.desc.desc.b);
        true
    }

    /// Removes a slider with its motors. Answers whether there was one.
    pub fn remove_slider(&mut self, id: SliderId) -> bool {
        let Some(slider) = self.potentials.sliders.remove(id) else { return false };
        self.potentials.remove_orphans();
        self.include(slider.desc.desc.a, slider.desc.desc.b);
        true
    }

    /// Removes a limit of a distance. Answers whether there was one.
    pub fn remove_distance_limit(&mut self, id: DistanceLimitId) -> bool {
        let Some(limit) = self.potentials.distance_limits.remove(id) else { return false };
        self.rouse_ends(limit.desc.a, limit.desc.b);
        true
    }

    /// Removes a limit of an angle. Answers whether there was one.
    pub fn remove_angle_limit(&mut self, id: AngleLimitId) -> bool {
        let Some(limit) = self.potentials.angle_limits.remove(id) else { return false };
        if let Some([a, b]) = self.potentials.ends_of(Driven::Hinge(limit.desc.hinge)) {
            self.rouse_ends(a, b);
        }
        true
    }

    /// Removes a motor. Answers whether there was one.
    pub fn remove_motor(&mut self, id: MotorId) -> bool {
        let Some(motor) = self.potentials.motors.remove(id) else { return false };
        if let Some([a, b]) = self.potentials.ends_of(motor.joint) {
            self.rouse_ends(a, b);
        }
        true
    }

    /// What the frames of two anchors have in common now, given as directions in the first.
    fn capture(&self, a: Anchor, b: Anchor, axes: [DVec3; 3]) -> [[DVec3; 2]; 3] {
        let [a, b] = [self.frame_at(a), self.frame_at(b)];
        axes.map(|axis| [axis, local(&b, a.arm(axis).into())])
    }

    /// As [`World::check_anchors`], for joints that hold turns.
    fn check_turning(&self, a: Anchor, b: Anchor) -> Result<(), SimError> {
        self.check_anchors(a, b)?;
        let is_particle = |id| self.bodies[id].kind == DofKind::Particle;
        if [a.body, b.body].into_iter().flatten().any(is_particle) {
            return Err(SimError::Unusable { what: "a particle does not turn: hold it by a ball joint or a rod" });
        }
        Ok(())
    }

    fn frame_at(&self, anchor: Anchor) -> Frame<f64> {
        let body = anchor.body.and_then(|id| self.bodies.get(id));
        let at = PartPoint { part: anchor.part, point: anchor.point };
        body.map_or(Frame::WORLD, |body| body.frame(at, &self.state))
    }
}

/// A world direction in a frame's axes.
fn local(frame: &Frame<f64>, direction: DVec3) -> DVec3 {
    frame.rotation.transposed_multiply(direction.into()).into()
}
