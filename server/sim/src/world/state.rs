//! The state of bodies: read, set, pushed and steered.

use glam::{DQuat, DVec3};

use super::World;
use crate::dof::{BlockSize, BodyId, DofKind, Frame, Mount, PartPoint, Pose, Twist};
use crate::error::{LARGEST, SimError, require, require_rotation, require_vector};

/// A body's share of Q and Q'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceView<'a> {
    /// Names the body for as long as the world lives; never used twice.
    pub serial: u32,
    /// What the numbers mean.
    pub kind: DofKind,
    /// What its numbers are, block by block: a block of (3, 3) is a point, of (4, 3) a unit quaternion, of (7, 6) both,
    /// of (n, n) as many coordinates of joints.
    pub blocks: &'a [BlockSize],
    /// Positions: m, and a unit quaternion x y z w for a rigid body.
    pub q: &'a [f64],
    /// Rates: m/s, and rad/s in world axes for a rigid body.
    pub v: &'a [f64],
}

const PARTICLE_BLOCKS: &[BlockSize] = &[BlockSize { positions: 3, rates: 3 }];
const RIGID_BODY_BLOCKS: &[BlockSize] = &[BlockSize { positions: 7, rates: 6 }];

impl World {
    /// Centre of mass, m.
    pub fn position(&self, id: BodyId) -> Option<DVec3> {
        Some(self.bodies.get(id)?.pose(&self.state).position)
    }

    /// Principal axes to world.
    pub fn rotation(&self, id: BodyId) -> Option<DQuat> {
        Some(self.bodies.get(id)?.pose(&self.state).rotation)
    }

    /// Of the centre of mass, m/s.
    pub fn velocity(&self, id: BodyId) -> Option<DVec3> {
        Some(self.bodies.get(id)?.twist(&self.state).linear)
    }

    /// In world axes, rad/s.
    pub fn angular_velocity(&self, id: BodyId) -> Option<DVec3> {
        Some(self.bodies.get(id)?.twist(&self.state).angular)
    }

    /// kg.
    pub fn mass(&self, id: BodyId) -> Option<f64> {
        Some(self.bodies.get(id)?.mass)
    }

    /// What snapshots call the body; never used twice.
    pub fn serial(&self, id: BodyId) -> Option<u32> {
        Some(self.bodies.get(id)?.serial)
    }

    /// Whether the body's state became non-finite and it was taken out of dynamics and collision.
    pub fn is_quarantined(&self, id: BodyId) -> bool {
        self.bodies.get(id).is_some_and(|body| body.quarantined)
    }

    /// Puts a body somewhere else; its contacts of the last tick are forgotten, and so are a quarantine and the forces and
    /// torques that were asked for until now.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a body that is gone.
    pub fn set_pose(&mut self, id: BodyId, position: DVec3, rotation: DQuat) -> Result<(), SimError> {
        require_vector(position, "position")?;
        require_rotation(rotation, "rotation")?;
        let id = self.simple_body(id)?;
        self.rouse(id);
        let body = &mut self.bodies[id];
        body.set_pose(Pose { position, rotation: rotation.normalize() }, &mut self.state);
        body.forget_forces();
        body.quarantined = false;
        body.impulse = Twist::REST;
        self.forget_contacts(id);
        Ok(())
    }

    /// Forgets the contacts of a body, which is awake.
    fn forget_contacts(&mut self, id: BodyId) {
        let serials: Vec<_> = self.colliders_of(id).iter().map(|placed| placed.serial).collect();
        serials.into_iter().for_each(|serial| self.detector.forget_contacts(serial));
    }

    /// Sets velocity, m/s, and angular velocity, rad/s in world axes.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a body that is gone.
    pub fn set_velocity(&mut self, id: BodyId, linear: DVec3, angular: DVec3) -> Result<(), SimError> {
        require_vector(linear, "velocity")?;
        require_vector(angular, "angular_velocity")?;
        let id = self.simple_body(id)?;
        self.rouse(id);
        let body = &self.bodies[id];
        body.set_twist(Twist { linear, angular }, &mut self.state);
        Ok(())
    }

    /// What a spring or a motor is expected to add to the velocity of a particle or rigid body within a tick, m/s, until it is
    /// set anew. Contacts are found along the motion that bodies have when a tick begins; what is driven hard from rest would
    /// be through a thin wall before any is found. Detection looks ahead as if the body had this velocity besides, and tells
    /// of its collisions so; the motion itself does not depend on it.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a body that is gone or of another kind.
    pub fn set_surge(&mut self, id: BodyId, surge: DVec3) -> Result<(), SimError> {
        require_vector(surge, "surge")?;
        let id = self.simple_body(id)?;
        self.bodies[id].surge = surge;
        Ok(())
    }

    /// Pushes a particle or rigid body during the coming tick with `force`, N, at the world point `at`, m. Bodies of other
    /// kinds are pushed at a point of a part: [`World::apply_force_at`].
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a body of another kind, or one that is gone.
    pub fn apply_force(&mut self, id: BodyId, force: DVec3, at: DVec3) -> Result<(), SimError> {
        require_vector(force, "force")?;
        require_vector(at, "at")?;
        let id = self.simple_body(id)?;
        if force != DVec3::ZERO {
            self.rouse(id);
        }
        let body = &mut self.bodies[id];
        let arm = at - body.pose(&self.state).position;
        body.force += force;
        body.torque += arm.cross(force);
        Ok(())
    }

    /// Turns a rigid body during the coming tick with `torque`, N m in world axes.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a body of another kind, or one that is gone.
    pub fn apply_torque(&mut self, id: BodyId, torque: DVec3) -> Result<(), SimError> {
        require_vector(torque, "torque")?;
        let id = self.simple_body(id)?;
        if self.bodies[id].kind == DofKind::Particle {
            return Err(SimError::Unusable { what: "a particle does not turn" });
        }
        if torque != DVec3::ZERO {
            self.rouse(id);
        }
        self.bodies[id].torque += torque;
        Ok(())
    }

    /// Pushes a body of any kind during the coming tick with `force`, N, at a material point; a particle has but one.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a part that there is not, or a body that is gone.
    pub fn apply_force_at(&mut self, id: BodyId, at: PartPoint, force: DVec3) -> Result<(), SimError> {
        require_vector(force, "force")?;
        require_vector(at.point, "at.point")?;
        let body = self.bodies.get(id).ok_or(SimError::Gone { what: "the body" })?;
        let parts = body.figure.as_ref().map_or(1, |figure| figure.dof.parts());
        require(at.part < parts, "at.part", f64::from(at.part), "the index of one of the body's parts")?;
        if force != DVec3::ZERO {
            self.rouse(id);
        }
        let body = &mut self.bodies[id];
        match &mut body.figure {
            Some(figure) => figure.pull(at, force, self.state.q(body.slice)),
            None => {
                body.force += force;
                body.torque += (body.pose(&self.state).rotation * at.point).cross(force);
            }
        }
        Ok(())
    }

    /// A particle or rigid body.
    fn simple_body(&self, id: BodyId) -> Result<BodyId, SimError> {
        let body = self.bodies.get(id).ok_or(SimError::Gone { what: "the body" })?;
        match body.figure {
            None => Ok(id),
            Some(_) => Err(SimError::Unusable { what: "this is for particles and rigid bodies alone" }),
        }
    }

    /// The frame at a material point: where it is and how it moves. `None` where there is no such body or part.
    pub fn frame(&self, id: BodyId, at: PartPoint) -> Option<Frame<f64>> {
        let body = self.bodies.get(id)?;
        let parts = body.figure.as_ref().map_or(1, |figure| figure.dof.parts());
        (at.part < parts).then(|| body.frame(at, &self.state))
    }

    /// How the frame at a material point follows from the body's Q. `None` where there is no such body or part, or its
    /// kind does not say.
    pub fn mount(&self, id: BodyId, at: PartPoint) -> Option<Mount> {
        let body = self.bodies.get(id)?;
        match &body.figure {
            Some(figure) if at.part < figure.dof.parts() => figure.dof.mount(at),
            Some(_) => None,
            None => (at.part == 0).then_some(Mount::Body { offset: at.point }),
        }
    }

    /// A body's positions and rates.
    pub fn slice(&self, id: BodyId) -> Option<SliceView<'_>> {
        let body = self.bodies.get(id)?;
        let (q, v) = (self.state.q(body.slice), self.state.v(body.slice));
        let blocks = match (&body.figure, body.kind) {
            (Some(figure), _) => figure.dof.blocks(),
            (None, DofKind::Particle) => PARTICLE_BLOCKS,
            (None, _) => RIGID_BODY_BLOCKS,
        };
        Some(SliceView { serial: body.serial, kind: body.kind, blocks, q, v })
    }

    /// Sets positions and rates of a body of a general kind; its contacts of the last tick are forgotten, and so are a
    /// quarantine and the forces that were asked for until now.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, numbers that are too many or too few, or a body that is gone.
    pub fn set_slice(&mut self, id: BodyId, q: &[f64], v: &[f64]) -> Result<(), SimError> {
        let body = self.bodies.get_mut(id).ok_or(SimError::Gone { what: "the body" })?;
        let Some(figure) = &mut body.figure else {
            return Err(SimError::Unusable { what: "particles and rigid bodies have set_pose and set_velocity" });
        };
        let lengths = (self.state.q(body.slice).len(), self.state.v(body.slice).len());
        if (q.len(), v.len()) != lengths {
            return Err(SimError::Unusable { what: "q and v must be as long as the body's" });
        }
        for (numbers, what) in [(q, "q"), (v, "v")] {
            numbers.iter().try_for_each(|&x| require(x.abs() < LARGEST, what, x, "finite and below 1e9"))?;
        }
        figure.dof.check(q, v)?;
        figure.change.fill(0.0);
        figure.force.fill(0.0);
        body.quarantined = false;
        self.state.q_mut(body.slice).copy_from_slice(q);
        self.state.v_mut(body.slice).copy_from_slice(v);
        self.rouse(id);
        self.forget_contacts(id);
        Ok(())
    }

    /// What steers a body of a general kind, as its kind orders it; none for other bodies.
    pub fn controls(&self, id: BodyId) -> Option<&[f64]> {
        Some(self.bodies.get(id)?.figure.as_ref().map_or(&[], |figure| &figure.controls))
    }

    /// Steers a body of a general kind from the coming tick on.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, numbers that are too many or too few, or a body that is gone.
    pub fn set_controls(&mut self, id: BodyId, controls: &[f64]) -> Result<(), SimError> {
        let body = self.bodies.get_mut(id).ok_or(SimError::Gone { what: "the body" })?;
        let Some(figure) = body.figure.as_mut().filter(|figure| figure.controls.len() == controls.len()) else {
            return Err(SimError::Unusable { what: "controls must be as many as the body has" });
        };
        if controls.iter().any(|x| x.is_nan()) {
            return Err(SimError::Unusable { what: "a control is NaN" });
        }
        figure.dof.check_controls(controls, self.settings.dt)?;
        if figure.controls != controls {
            figure.controls.copy_from_slice(controls);
            self.rouse(id);
        }
        Ok(())
    }

    /// Number of bodies.
    pub fn body_count(&self) -> usize {
        self.order.len()
    }

    /// All bodies, in order of serial.
    pub fn bodies(&self) -> &[BodyId] {
        &self.order
    }

    /// All slices of Q and Q', in order of serial.
    pub fn slices(&self) -> impl Iterator<Item = SliceView<'_>> {
        self.order.iter().filter_map(|&id| self.slice(id))
    }

    /// Hash over every bit of Q and Q'.
    pub fn state_hash(&self) -> u64 {
        self.state.hash()
    }
}
