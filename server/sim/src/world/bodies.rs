//! Bodies and static geometry: added, checked and removed.

use glam::{DQuat, DVec3};

use super::World;
use crate::collide::{Collider, Compound, EmbeddedHull, StaticDesc, StaticId};
use crate::dof::{
    self, ABSENT, Body, BodyId, DofKind, FigureBody, FigureDesc, PartPoint, ParticleDesc, Placed, Pose, RigidBodyDesc,
    Twist, particle, rigid_body,
};
use crate::error::{SimError, require_rotation, require_vector};
use crate::sleep::Rest;

impl World {
    /// Adds a rigid body.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_rigid_body(&mut self, desc: RigidBodyDesc) -> Result<BodyId, SimError> {
        dof::validate_rigid_body(&desc)?;
        let id = self.add_body(DofKind::RigidBody, rigid_body::SIZE, desc.mass, desc.inertia);
        self.place_all(id, desc.collider.map(|collider| (collider, Pose::IDENTITY)));
        let body = &self.bodies[id];
        body.set_pose(Pose { position: desc.position, rotation: desc.rotation.normalize() }, &mut self.state);
        body.set_twist(Twist { linear: desc.velocity, angular: desc.angular_velocity }, &mut self.state);
        Ok(id)
    }

    /// Adds a rigid body of several shapes at rest, its compound's frame at `position` and turned by `rotation`.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_compound(&mut self, compound: &Compound, position: DVec3, rotation: DQuat) -> Result<BodyId, SimError> {
        require_vector(position, "position")?;
        require_rotation(rotation, "rotation")?;
        let id = self.add_rigid_body(compound.desc(position, rotation.normalize()))?;
        self.place_all(id, compound.placed());
        Ok(id)
    }

    /// Adds a particle.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_particle(&mut self, desc: ParticleDesc) -> Result<BodyId, SimError> {
        dof::validate_particle(&desc)?;
        let id = self.add_body(DofKind::Particle, particle::SIZE, desc.mass, DVec3::ZERO);
        self.place_all(id, desc.collider.map(|collider| (collider, Pose::IDENTITY)));
        let body = &self.bodies[id];
        body.set_pose(Pose { position: desc.position, ..Pose::IDENTITY }, &mut self.state);
        body.set_twist(Twist { linear: desc.velocity, ..Twist::REST }, &mut self.state);
        Ok(id)
    }

    /// Adds a body of a general kind.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_figure(&mut self, desc: FigureDesc) -> Result<BodyId, SimError> {
        self.add_figure_with_hulls(desc, Vec::new())
    }

    /// Adds a body of a general kind that also collides with hulls whose vertices are embedded in it.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range, and the hull.
    pub fn add_figure_with_hulls(&mut self, desc: FigureDesc, hulls: Vec<EmbeddedHull>) -> Result<BodyId, SimError> {
        desc.validate(self.settings.dt)?;
        for (index, hull) in hulls.iter().enumerate() {
            hull.validate(desc.dof.parts()).map_err(|reason| reason.of(format!("hull {index}")))?;
        }
        let rates = desc.v.len() as u32;
        let (kind, q, v) = (desc.dof.kind(), desc.q.clone(), desc.v.clone());
        let figure = FigureBody::new(desc, hulls);
        let id = self.add_body(kind, (q.len() as u32, rates), figure.mass, DVec3::ZERO);
        let carried = figure.colliders.iter().map(|part| part.at);
        let embedded = figure.hulls.iter().map(|hull| hull.vertices()[0]);
        for (index, at) in (0..).zip(carried.chain(embedded)) {
            self.place(id, index, at, DQuat::IDENTITY);
        }
        let body = &mut self.bodies[id];
        body.figure = Some(figure);
        self.state.q_mut(body.slice).copy_from_slice(&q);
        self.state.v_mut(body.slice).copy_from_slice(&v);
        Ok(id)
    }

    /// Removes a body with every potential and contact that it has. Answers whether there was one.
    pub fn remove_body(&mut self, id: BodyId) -> bool {
        self.rouse(id);
        let Some(body) = self.bodies.remove(id) else { return false };
        self.state.free(body.slice);
        self.order.retain(|&other| other != id);
        self.awake.retain(|&other| other != id);
        self.potentials.remove_body(id);
        self.detector.forget_exclusions(body.serial);
        let Self { placed, detector, .. } = self;
        placed.iter().filter(|placed| placed.body == id).for_each(|placed| detector.remove(placed));
        placed.retain(|placed| placed.body != id);
        true
    }

    fn add_body(&mut self, kind: DofKind, size: (u32, u32), mass: f64, inertia: DVec3) -> BodyId {
        let (slice, serial) = (self.state.allocate(size.0, size.1), self.serials);
        self.serials += 1;
        let (force, torque, impulse, surge, index) = (DVec3::ZERO, DVec3::ZERO, Twist::REST, DVec3::ZERO, ABSENT);
        let (wheel_axis, wheel_turn, quarantined, touching) = (None, DVec3::ZERO, false, 0);
        let (rest, asleep) = (Rest::new(size.1), None);
        let (colliders, figure) = (Vec::new(), None);
        let id = self.bodies.insert(Body {
            kind,
            slice,
            serial,
            mass,
            inertia,
            colliders,
            figure,
            force,
            torque,
            impulse,
            touching,
            surge,
            index,
            wheel_axis,
            wheel_turn,
            quarantined,
            rest,
            asleep,
        });
        self.order.push(id);
        self.awake.push(id);
        id
    }

    /// Puts colliders at their places on a body that was added last.
    fn place_all(&mut self, id: BodyId, colliders: impl IntoIterator<Item = (Collider, Pose)>) {
        for (collider, Pose { position: point, rotation }) in colliders {
            let colliders = &mut self.bodies[id].colliders;
            let index = colliders.len() as u32;
            colliders.push(collider);
            self.place(id, index, PartPoint { part: 0, point }, rotation);
        }
    }

    /// Puts one of its colliders on a body that was added last. The first is found under the body's own serial, the
    /// others follow.
    fn place(&mut self, body: BodyId, index: u32, at: PartPoint, rotation: DQuat) {
        let owner = self.bodies[body].serial;
        let serial = owner + index;
        self.serials = self.serials.max(serial + 1);
        let placed = Placed { serial, body, at, rotation, index, hull: ABSENT };
        let hull = self.detector.add(placed, owner);
        self.placed.push(Placed { hull, ..placed });
    }

    /// Adds a piece of static geometry.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_static(&mut self, desc: StaticDesc) -> Result<StaticId, SimError> {
        let id = self.detector.add_static(desc)?;
        self.rouse_around(id);
        Ok(id)
    }

    /// Removes a piece of static geometry. Answers whether there was one.
    pub fn remove_static(&mut self, id: StaticId) -> bool {
        self.rouse_around(id);
        self.detector.remove_static(id)
    }

    /// Wakes what is near a piece of static geometry.
    fn rouse_around(&mut self, id: StaticId) {
        let near = match self.detector.sleepers_around(id) {
            Some(near) => near,
            None => self.sleepers.representatives().collect(),
        };
        near.into_iter().for_each(|id| self.rouse(id));
    }
}
