//! Potentials of a world: added, checked, steered and removed.

use glam::DVec3;

use super::World;
use crate::dof::DofKind;
use crate::error::{SimError, require, require_vector};
use crate::potential::hold::Held;
use crate::potential::{
    Anchor, AntiRollBarDesc, AntiRollBarId, AxleControl, AxleDesc, AxleId, BallJointDesc, BallJointId, PdControl,
    PdDesc, PdId, RodDesc, RodId, SpringDesc, SpringId,
};

/// Why two axles cannot be coupled.
pub(super) const NO_PAIR: &str = "two axles that are coupled must exist and carry different wheels of one chassis";

impl World {
    /// Adds a spring with a damper.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a body that is gone, or two ends at the same body; parts of one figure may be
    /// its two ends.
    pub fn add_spring(&mut self, desc: SpringDesc) -> Result<SpringId, SimError> {
        desc.validate()?;
        self.check_anchors(desc.a, desc.b)?;
        self.rouse_ends(desc.a, desc.b);
        Ok(self.potentials.springs.insert(desc))
    }

    /// Adds a rod.
    ///
    /// # Errors
    /// As [`World::add_spring`].
    pub fn add_rod(&mut self, desc: RodDesc) -> Result<RodId, SimError> {
        desc.validate()?;
        self.check_anchors(desc.a, desc.b)?;
        self.rouse_ends(desc.a, desc.b);
        Ok(self.potentials.rods.insert(Held::new(desc)))
    }

    /// Adds a ball joint.
    ///
    /// # Errors
    /// As [`World::add_spring`].
    pub fn add_ball_joint(&mut self, desc: BallJointDesc) -> Result<BallJointId, SimError> {
        desc.validate()?;
        self.check_anchors(desc.a, desc.b)?;
        self.exclude(desc.a, desc.b);
        Ok(self.potentials.ball_joints.insert(Held::new(desc)))
    }

    /// Adds an axle between two rigid bodies.
    ///
    /// # Errors
    /// As [`World::add_spring`].
    pub fn add_axle(&mut self, desc: AxleDesc) -> Result<AxleId, SimError> {
        desc.validate()?;
        let bodies = [desc.chassis, desc.wheel].map(|id| self.bodies.get(id));
        let [Some(chassis), Some(wheel)] = bodies else { return Err(SimError::Gone { what: "a body of the axle" }) };
        if chassis.kind != DofKind::RigidBody || wheel.kind != DofKind::RigidBody || desc.chassis == desc.wheel {
            return Err(SimError::Unusable { what: "an axle needs two different rigid bodies" });
        }
        self.detector.exclude(chassis.serial, wheel.serial);
        [desc.chassis, desc.wheel].into_iter().for_each(|id| self.rouse(id));
        Ok(self.potentials.axles.insert(desc))
    }

    /// Adds an anti-roll bar.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or axles that are gone or not of one chassis.
    pub fn add_anti_roll_bar(&mut self, desc: AntiRollBarDesc) -> Result<AntiRollBarId, SimError> {
        desc.validate()?;
        let wheels = self.potentials.wheels_of(desc.axles).ok_or(SimError::Unusable { what: NO_PAIR })?;
        wheels.into_iter().for_each(|id| self.rouse(id));
        Ok(self.potentials.anti_roll_bars.insert(desc))
    }

    /// Adds a PD controller.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, for what this tick rate cannot show, or a body that is gone.
    pub fn add_pd(&mut self, desc: PdDesc) -> Result<PdId, SimError> {
        desc.control.validate()?;
        let positive = desc.max_force > 0.0;
        if !positive {
            return Err(SimError::OutOfRange { what: "max_force", value: desc.max_force, allowed: "above 0 N" });
        }
        require_vector(desc.at.point, "at.point")?;
        let gains = desc.drive.gains(self.settings.dt)?;
        if desc.at.body.is_none() {
            return Err(SimError::Unusable { what: "a controller needs a body to move" });
        }
        self.check_anchors(desc.at, Anchor::world(DVec3::ZERO))?;
        self.rouse_ends(desc.at, desc.at);
        Ok(self.potentials.pds.insert((desc, gains)))
    }

    /// Removes a spring. Answers whether there was one.
    pub fn remove_spring(&mut self, id: SpringId) -> bool {
        let Some(spring) = self.potentials.springs.remove(id) else { return false };
        self.rouse_ends(spring.a, spring.b);
        true
    }

    /// Removes a rod. Answers whether there was one.
    pub fn remove_rod(&mut self, id: RodId) -> bool {
        let Some(rod) = self.potentials.rods.remove(id) else { return false };
        self.rouse_ends(rod.desc.a, rod.desc.b);
        true
    }

    /// Removes a ball joint. Answers whether there was one.
    pub fn remove_ball_joint(&mut self, id: BallJointId) -> bool {
        let Some(joint) = self.potentials.ball_joints.remove(id) else { return false };
        self.include(joint.desc.a, joint.desc.b);
        true
    }

    /// Removes an anti-roll bar. Answers whether there was one.
    pub fn remove_anti_roll_bar(&mut self, id: AntiRollBarId) -> bool {
        let Some(bar) = self.potentials.anti_roll_bars.remove(id) else { return false };
        let wheels = self.potentials.wheels_of(bar.axles);
        wheels.into_iter().flatten().for_each(|id| self.rouse(id));
        true
    }

    /// Removes a controller. Answers whether there was one.
    pub fn remove_pd(&mut self, id: PdId) -> bool {
        let Some((pd, _)) = self.potentials.pds.remove(id) else { return false };
        self.rouse_ends(pd.at, pd.at);
        true
    }

    /// What a driver does to a wheel now.
    pub fn axle(&self, id: AxleId) -> Option<&AxleControl> {
        self.potentials.axles.get(id).map(|axle| &axle.control)
    }

    /// Steers, drives and brakes a wheel from the coming tick on.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or an axle that is gone.
    pub fn set_axle(&mut self, id: AxleId, control: AxleControl) -> Result<(), SimError> {
        control.validate()?;
        let axle = self.potentials.axles.get_mut(id).ok_or(SimError::Gone { what: "the axle" })?;
        if std::mem::replace(&mut axle.control, control) != control {
            let wheel = axle.wheel;
            self.rouse(wheel);
        }
        Ok(())
    }

    /// Moves a controller's target.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a controller that is gone.
    pub fn set_pd(&mut self, id: PdId, control: PdControl) -> Result<(), SimError> {
        control.validate()?;
        let (pd, _) = self.potentials.pds.get_mut(id).ok_or(SimError::Gone { what: "the controller" })?;
        if std::mem::replace(&mut pd.control, control) != control {
            let at = pd.at;
            self.rouse_ends(at, at);
        }
        Ok(())
    }

    /// From now on the bodies of a joint do not collide with each other. They wake.
    pub(super) fn exclude(&mut self, a: Anchor, b: Anchor) {
        self.rouse_ends(a, b);
        if let (Some(a), Some(b)) = (a.body, b.body) {
            self.detector.exclude(self.bodies[a].serial, self.bodies[b].serial);
        }
    }

    /// Takes one [`World::exclude`] back. The bodies wake.
    pub(super) fn include(&mut self, a: Anchor, b: Anchor) {
        self.rouse_ends(a, b);
        if let (Some(a), Some(b)) = (a.body, b.body) {
            self.detector.include(self.bodies[a].serial, self.bodies[b].serial);
        }
    }

    pub(super) fn check_anchors(&self, a: Anchor, b: Anchor) -> Result<(), SimError> {
        for anchor in [a, b] {
            let Some(id) = anchor.body else { continue };
            let body = self.bodies.get(id).ok_or(SimError::Gone { what: "a body of the potential" })?;
            if body.kind == DofKind::Particle && anchor.point != DVec3::ZERO {
                return Err(SimError::Unusable { what: "a particle has no point but its own: use 0, 0, 0" });
            }
            let parts = body.figure.as_ref().map_or(1, |figure| figure.dof.parts());
            require(
                anchor.part < parts,
                "part of an anchor",
                f64::from(anchor.part),
                "the index of one of the body's parts",
            )?;
        }
        if a.body == b.body { self.check_loop(a, b) } else { Ok(()) }
    }

    /// What closes a loop within a figure, or spans what deforms, has its ends at two points that can come closer.
    fn check_loop(&self, a: Anchor, b: Anchor) -> Result<(), SimError> {
        let body = a.body.map(|id| &self.bodies[id]).filter(|body| body.figure.is_some());
        let Some(body) = body else {
            return Err(SimError::Unusable { what: "both ends are at the same body" });
        };
        let deforms = matches!(body.kind, DofKind::FiniteElements | DofKind::Lattice);
        if a == b || a.part == b.part && !deforms {
            return Err(SimError::Unusable { what: "both ends are at the same part of a figure" });
        }
        Ok(())
    }
}
