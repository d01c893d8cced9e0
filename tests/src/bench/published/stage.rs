//! A world with a stopwatch, and bodies for it.

use std::time::{Duration, Instant};

use pita_sim::{BodyId, Collider, DQuat, DVec3, Material, RigidBodyDesc, Settings, Shape, SimError, StaticDesc, World};

/// Standard gravity of the published scenes, m/s².
pub(super) const G: f64 = 9.81;

/// Density where the authors give none, kg/m³.
pub(super) const DENSITY: f64 = 1000.0;

/// A world that is stepped and watched.
pub(super) struct Stage {
    pub world: World,
    /// Length of a step, s.
    pub dt: f64,
    /// Deepest overlap at the start of any step, m.
    pub deepest: f64,
    steps: u32,
    took: Duration,
}

impl Stage {
    /// An empty world with gravity downwards.
    pub fn new(dt: f64) -> Result<Self, SimError> {
        Self::under(dt, DVec3::NEG_Y * G)
    }

    /// An empty world with this gravity, m/s².
    pub fn under(dt: f64, gravity: DVec3) -> Result<Self, SimError> {
        let world = World::new(Settings { gravity, sleep: None, ..Settings::at(dt) })?;
        Ok(Self { world, dt, deepest: 0.0, steps: 0, took: Duration::ZERO })
    }

    /// Steps in `seconds`.
    pub fn steps_in(&self, seconds: f64) -> u32 {
        (seconds / self.dt).round() as u32
    }

    /// One step.
    pub fn step(&mut self) {
        let start = Instant::now();
        self.world.step();
        self.took += start.elapsed();
        self.steps += 1;
        self.deepest = self.world.contacts().map(|contact| -contact.gap).fold(self.deepest, f64::max);
    }

    /// Steps for so long, s.
    pub fn run(&mut self, seconds: f64) {
        (0..self.steps_in(seconds)).for_each(|_| self.step());
    }

    /// Mean time of a step, ms.
    pub fn step_ms(&self) -> f64 {
        1e3 * self.took.as_secs_f64() / f64::from(self.steps.max(1))
    }

    /// Ground at height 0.
    pub fn ground(&mut self, material: impl Into<Material>) -> Result<(), SimError> {
        self.fix(Shape::HalfSpace { normal: DVec3::Y }, material, DVec3::ZERO)
    }

    /// Static geometry.
    pub fn fix(&mut self, shape: Shape, material: impl Into<Material>, position: DVec3) -> Result<(), SimError> {
        self.world.add_static(StaticDesc { position, ..StaticDesc::new(Collider::new(shape, material)) })?;
        Ok(())
    }

    /// A body of `mass` kg at rest whose shape's axes are principal.
    pub fn put(
        &mut self,
        shape: Shape,
        mass: f64,
        material: impl Into<Material>,
        (position, rotation): (DVec3, DQuat),
    ) -> Result<BodyId, SimError> {
        let desc = RigidBodyDesc::new(position, mass, shape.inertia(mass));
        let collider = Some(Collider::new(shape, material));
        self.world.add_rigid_body(RigidBodyDesc { rotation, collider, ..desc })
    }

    /// A convex solid of [`DENSITY`] with corners at these places, at rest.
    pub fn put_solid(&mut self, corners: &[DVec3], material: impl Into<Material>) -> Result<BodyId, SimError> {
        let solid = Shape::Hull { points: corners.to_vec(), radius: 0.0 };
        let mass = solid.mass_properties(pita_sim::mass::Density::constant(DENSITY))?;
        let (inertia, rotation) = mass.principal();
        let points = corners.iter().map(|&corner| rotation.inverse() * (corner - mass.centre)).collect();
        let collider = Some(Collider::new(Shape::Hull { points, radius: 0.0 }, material));
        let desc = RigidBodyDesc::new(mass.centre, mass.mass, inertia);
        self.world.add_rigid_body(RigidBodyDesc { rotation, collider, ..desc })
    }

    /// Where a body is; the origin where it is gone.
    pub fn position(&self, id: BodyId) -> DVec3 {
        self.world.position(id).unwrap_or_default()
    }

    /// How fast a body is.
    pub fn velocity(&self, id: BodyId) -> DVec3 {
        self.world.velocity(id).unwrap_or_default()
    }
}
