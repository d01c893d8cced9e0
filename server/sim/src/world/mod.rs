//! The world: bodies, potentials and static geometry under generational handles, and the two stages of the pipeline that
//! are the engine's.

mod joints;
mod potentials;

use glam::{DQuat, DVec3};
use slotmap::SlotMap;

use crate::collide::{Collider, ContactView, Detector, Moving, Partner, StaticDesc, StaticId};
use crate::dof::{
    self, ABSENT, Body, BodyId, DofKind, FigureBody, FigureDesc, Frame, PartPoint, ParticleDesc, Placed, Pose,
    RigidBodyDesc, Twist, particle, rigid_body,
};
use crate::error::{SimError, require, require_rotation, require_vector};
use crate::integrate::{Integrator, Scene, StepReport};
use crate::potential::{Anchor, Potentials};
use crate::settings::{Settings, SolverSettings};
use crate::state::State;

/// A running world.
pub struct World {
    settings: Settings,
    state: State,
    bodies: SlotMap<BodyId, Body>,
    /// All bodies, in order of serial.
    order: Vec<BodyId>,
    /// All colliders of bodies, in order of serial.
    placed: Vec<Placed>,
    serials: u32,
    potentials: Potentials,
    detector: Detector,
    integrator: Integrator,
    report: StepReport,
}

/// A body's share of Q and Q'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceView<'a> {
    /// Names the body for as long as the world lives; never used twice.
    pub serial: u32,
    /// What the numbers mean.
    pub kind: DofKind,
    /// Positions: m, and a unit quaternion x y z w for a rigid body.
    pub q: &'a [f64],
    /// Rates: m/s, and rad/s in world axes for a rigid body.
    pub v: &'a [f64],
}

/// Energy of the world, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of motion and spin.
    pub kinetic: f64,
    /// Against gravity, from the origin's height.
    pub gravitational: f64,
    /// In springs.
    pub elastic: f64,
}

impl Energy {
    /// Sum of all.
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravitational + self.elastic
    }
}

/// Momentum of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Momentum {
    /// kg m/s.
    pub linear: DVec3,
    /// About the origin, kg m²/s.
    pub angular: DVec3,
}

impl World {
    /// An empty world.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] for a bad setting, [`SimError::Unusable`] where threads cannot be had.
    pub fn new(settings: Settings) -> Result<Self, SimError> {
        settings.validate()?;
        let integrator = Integrator::new(settings.threads)
            .map_err(|_| SimError::Unusable { what: "threads cannot be started: use fewer" })?;
        Ok(Self {
            settings,
            state: State::default(),
            bodies: SlotMap::with_key(),
            order: Vec::new(),
            placed: Vec::new(),
            serials: 0,
            potentials: Potentials::default(),
            detector: Detector::default(),
            integrator,
            report: StepReport::default(),
        })
    }

    /// The settings that it was made with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    // --- bodies ----------------------------------------------------------------------------------------------------

    /// Adds a rigid body.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_rigid_body(&mut self, desc: RigidBodyDesc) -> Result<BodyId, SimError> {
        dof::validate_rigid_body(&desc)?;
        let id = self.add_body(DofKind::RigidBody, rigid_body::SIZE, desc.mass, desc.inertia, desc.collider);
        let body = &self.bodies[id];
        body.set_pose(Pose { position: desc.position, rotation: desc.rotation.normalize() }, &mut self.state);
        body.set_twist(Twist { linear: desc.velocity, angular: desc.angular_velocity }, &mut self.state);
        Ok(id)
    }

    /// Adds a particle.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_particle(&mut self, desc: ParticleDesc) -> Result<BodyId, SimError> {
        dof::validate_particle(&desc)?;
        let id = self.add_body(DofKind::Particle, particle::SIZE, desc.mass, DVec3::ZERO, desc.collider);
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
        desc.validate(self.settings.dt)?;
        let rates = desc.v.len() as u32;
        let (kind, q, v) = (desc.dof.kind(), desc.q.clone(), desc.v.clone());
        let figure = FigureBody::new(desc);
        let id = self.add_body(kind, (q.len() as u32, rates), figure.mass, DVec3::ZERO, None);
        for (index, part) in (0..).zip(&figure.colliders) {
            // The first collider is found under the body's own serial.
            let serial = self.serials - u32::from(index == 0);
            self.serials = serial + 1;
            self.placed.push(Placed { serial, body: id, at: part.at, index });
        }
        let body = &mut self.bodies[id];
        body.figure = Some(figure);
        self.state.q_mut(body.slice).copy_from_slice(&q);
        self.state.v_mut(body.slice).copy_from_slice(&v);
        Ok(id)
    }

    /// Removes a body with every potential and contact that it has. Answers whether there was one.
    pub fn remove_body(&mut self, id: BodyId) -> bool {
        let Some(body) = self.bodies.remove(id) else { return false };
        self.state.free(body.slice);
        self.order.retain(|&other| other != id);
        self.potentials.remove_body(id);
        self.detector.forget(body.serial);
        let Self { placed, detector, .. } = self;
        placed.iter().filter(|placed| placed.body == id).for_each(|placed| detector.forget_contacts(placed.serial));
        placed.retain(|placed| placed.body != id);
        true
    }

    fn add_body(
        &mut self,
        kind: DofKind,
        size: (u32, u32),
        mass: f64,
        inertia: DVec3,
        collider: Option<Collider>,
    ) -> BodyId {
        let (slice, serial) = (self.state.allocate(size.0, size.1), self.serials);
        self.serials += 1;
        let (force, torque, impulse, index) = (DVec3::ZERO, DVec3::ZERO, Twist::REST, ABSENT);
        let (is_wheel, quarantined) = (false, false);
        let (has_collider, figure) = (collider.is_some(), None);
        let id = self.bodies.insert(Body {
            kind,
            slice,
            serial,
            mass,
            inertia,
            collider,
            figure,
            force,
            torque,
            impulse,
            index,
            is_wheel,
            quarantined,
        });
        self.order.push(id);
        if has_collider {
            let at = PartPoint { part: 0, point: DVec3::ZERO };
            self.placed.push(Placed { serial, body: id, at, index: 0 });
        }
        id
    }

    // --- static geometry -------------------------------------------------------------------------------------------

    /// Adds a piece of static geometry.
    ///
    /// # Errors
    /// [`SimError`] naming the value that is out of range.
    pub fn add_static(&mut self, desc: StaticDesc) -> Result<StaticId, SimError> {
        self.detector.add_static(desc)
    }

    /// Removes a piece of static geometry. Answers whether there was one.
    pub fn remove_static(&mut self, id: StaticId) -> bool {
        self.detector.remove_static(id)
    }

    // --- state -----------------------------------------------------------------------------------------------------

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

    /// Puts a body somewhere else; its contacts of the last tick are forgotten, and so is a quarantine.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a body that is gone.
    pub fn set_pose(&mut self, id: BodyId, position: DVec3, rotation: DQuat) -> Result<(), SimError> {
        require_vector(position, "position")?;
        require_rotation(rotation, "rotation")?;
        let body = self.simple_body(id)?;
        let body = &mut self.bodies[body];
        body.set_pose(Pose { position, rotation: rotation.normalize() }, &mut self.state);
        body.quarantined = false;
        body.impulse = Twist::REST;
        let serial = body.serial;
        self.detector.forget_contacts(serial);
        Ok(())
    }

    /// Sets velocity, m/s, and angular velocity, rad/s in world axes.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a body that is gone.
    pub fn set_velocity(&mut self, id: BodyId, linear: DVec3, angular: DVec3) -> Result<(), SimError> {
        require_vector(linear, "velocity")?;
        require_vector(angular, "angular_velocity")?;
        let body = &self.bodies[self.simple_body(id)?];
        body.set_twist(Twist { linear, angular }, &mut self.state);
        Ok(())
    }

    /// Pushes a body during the coming tick with `force`, N, at the world point `at`, m.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a body that is gone.
    pub fn apply_force(&mut self, id: BodyId, force: DVec3, at: DVec3) -> Result<(), SimError> {
        require_vector(force, "force")?;
        require_vector(at, "at")?;
        let id = self.simple_body(id)?;
        let body = &mut self.bodies[id];
        let arm = at - body.pose(&self.state).position;
        body.force += force;
        body.torque += arm.cross(force);
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

    /// A body's positions and rates.
    pub fn slice(&self, id: BodyId) -> Option<SliceView<'_>> {
        let body = self.bodies.get(id)?;
        let (q, v) = (self.state.q(body.slice), self.state.v(body.slice));
        Some(SliceView { serial: body.serial, kind: body.kind, q, v })
    }

    /// Sets positions and rates of a body of a general kind; its contacts of the last tick are forgotten, and so is a
    /// quarantine.
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
            numbers.iter().try_for_each(|&x| require(x.abs() < 1e9, what, x, "finite and below 1e9"))?;
        }
        figure.dof.check(q, v)?;
        figure.change.fill(0.0);
        body.quarantined = false;
        self.state.q_mut(body.slice).copy_from_slice(q);
        self.state.v_mut(body.slice).copy_from_slice(v);
        for placed in self.placed.iter().filter(|placed| placed.body == id) {
            self.detector.forget_contacts(placed.serial);
        }
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
        figure.controls.copy_from_slice(controls);
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

    /// Energy now.
    pub fn energy(&self) -> Energy {
        let mut energy = Energy::default();
        for body in self.bodies.values() {
            let motion = body.motion(&self.state);
            energy.kinetic += motion.energy;
            energy.gravitational += self.settings.field().energy(motion.moment);
            if let Some(figure) = &body.figure {
                let (q, v) = (self.state.q(body.slice), self.state.v(body.slice));
                energy.elastic += figure.stored_energy(q, v, self.settings.dt);
            }
        }
        for spring in self.potentials.springs.values() {
            let stretch = (self.point(spring.b) - self.point(spring.a)).length() - spring.rest_length;
            energy.elastic += 0.5 * spring.stiffness * stretch * stretch;
        }
        energy
    }

    /// Momentum now.
    pub fn momentum(&self) -> Momentum {
        let mut momentum = Momentum::default();
        for body in self.bodies.values() {
            let motion = body.motion(&self.state);
            momentum.linear += motion.momentum;
            momentum.angular += motion.angular_momentum;
        }
        momentum
    }

    fn point(&self, anchor: Anchor) -> DVec3 {
        let body = anchor.body.and_then(|id| self.bodies.get(id));
        let at = PartPoint { part: anchor.part, point: anchor.point };
        body.map_or(anchor.point, |body| body.frame(at, &self.state).position.into())
    }

    // --- stages ----------------------------------------------------------------------------------------------------

    /// Stage 2: finds contacts at Q0.
    pub fn detect_collisions(&mut self) {
        let Self { bodies, state, placed, detector, settings, .. } = self;
        detector.detect(placed, settings, |&Placed { serial, body, at, index }| {
            let body = &bodies[body];
            if body.quarantined {
                return None;
            }
            let owner = body.serial;
            if let Some(figure) = &body.figure {
                let (q, v) = (state.q(body.slice), state.v(body.slice));
                let (pose, twist) = (figure.pose(at, q, v), figure.dof.frame(at, q, v).twist());
                return Some(Moving {
                    serial,
                    owner,
                    collider: &figure.colliders[index as usize].collider,
                    pose,
                    twist,
                });
            }
            let collider = body.collider.as_ref()?;
            Some(Moving { serial, owner, collider, pose: body.pose(state), twist: body.twist(state) })
        });
    }

    /// Stage 4: integrates all DOF over one tick.
    pub fn integrate(&mut self) -> &StepReport {
        let (integrator, mut scene) = self.scene();
        let report = integrator.step(&mut scene);
        self.report = report;
        self.detector.remember();
        &self.report
    }

    /// What stage 4 would take with another solver, from the same state; nothing moves. It is for comparing solvers:
    /// the report has what the solver did, and nothing of what became of contacts and joints.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] for a bad setting.
    pub fn rehearse(&mut self, solver: &SolverSettings) -> Result<StepReport, SimError> {
        let settings = Settings { solver: solver.clone(), ..self.settings.clone() };
        settings.validate()?;
        let (integrator, scene) = self.scene();
        Ok(integrator.rehearse(&mut Scene { settings: &settings, ..scene }))
    }

    fn scene(&mut self) -> (&mut Integrator, Scene<'_>) {
        let scene = Scene {
            settings: &self.settings,
            state: &mut self.state,
            bodies: &mut self.bodies,
            order: &self.order,
            placed: &self.placed,
            potentials: &mut self.potentials,
            contacts: &mut self.detector.contacts,
        };
        (&mut self.integrator, scene)
    }

    /// Stages 2 and 4, for worlds without game logic.
    pub fn step(&mut self) -> &StepReport {
        self.detect_collisions();
        self.integrate()
    }

    /// What the last integration did.
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// Contact points of the last tick, in a stable order.
    pub fn contacts(&self) -> impl Iterator<Item = ContactView> + '_ {
        self.detector.contacts.iter().filter_map(|c| {
            let b = match c.b {
                Partner::Body(serial) => Some(self.body_of(serial)?),
                Partner::Static(_) => None,
            };
            let (point, normal, gap, normal_force) = (c.position, c.normal, c.gap, c.normal_force);
            Some(ContactView { a: self.body_of(c.a)?, b, point, normal, gap, normal_force })
        })
    }

    /// The body that a collider belongs to.
    fn body_of(&self, serial: u32) -> Option<BodyId> {
        let place = self.placed.binary_search_by_key(&serial, |placed| placed.serial).ok()?;
        Some(self.placed[place].body)
    }
}
