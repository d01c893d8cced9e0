//! Short-lived particles: a pool of bodies with 3 linear and 0 angular DOF that are used again and again.
//!
//! Owns the bodies and a velocity potential on each (talk, "Code: Velocity Potential"). Nothing is added to the world
//! after the pool: what is not in use sleeps where it is parked and costs a tick nothing. Particles touch nothing.

use glam::DVec3;
use pita_sim::{Anchor, BodyId, DQuat, JointDrive, ParticleDesc, PdControl, PdDesc, PdId, SimError, World};

/// What weighs nothing to speak of, kg: nothing feels it, its motion is its velocity potential's.
const MASS: f64 = 0.01;

/// A bounded number of particles.
pub struct Particles {
    pool: Vec<Particle>,
    /// Where they are while they are not in use, m.
    parked: DVec3,
    /// Who was used first.
    oldest: usize,
}

struct Particle {
    body: BodyId,
    flow: PdId,
    /// For how long it still lives, s; 0 while it is parked.
    left: f64,
}

impl Particles {
    /// Adds `count` particles to the world, parked at `parked`; each approaches the velocity that it is told to within
    /// `time_constant`, s.
    ///
    /// # Errors
    /// What the engine says.
    pub fn add(world: &mut World, count: usize, time_constant: f64, parked: DVec3) -> Result<Self, SimError> {
        let mut pool = Vec::with_capacity(count);
        for _ in 0..count {
            let desc = ParticleDesc { position: parked, velocity: DVec3::ZERO, mass: MASS, collider: None };
            let body = world.add_particle(desc)?;
            let flow = world.add_pd(PdDesc {
                at: Anchor::body(body, DVec3::ZERO),
                drive: JointDrive::Velocity { time_constant },
                max_force: f64::INFINITY,
                control: PdControl { target: DVec3::ZERO, target_velocity: DVec3::ZERO },
            })?;
            world.sleep(body)?;
            pool.push(Particle { body, flow, left: 0.0 });
        }
        Ok(Self { pool, parked, oldest: 0 })
    }

    /// Their bodies, those that are parked included.
    pub fn bodies(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.pool.iter().map(|particle| particle.body)
    }

    /// A particle at `position`, m, with `velocity`, m/s, for `life` s: one that is parked, or the one that was used first.
    ///
    /// # Errors
    /// What the engine says.
    pub fn spawn(&mut self, world: &mut World, position: DVec3, velocity: DVec3, life: f64) -> Result<(), SimError> {
        let count = self.pool.len();
        let Some(particle) = self.pool.get_mut(self.oldest) else { return Ok(()) };
        self.oldest = (self.oldest + 1) % count;
        particle.left = life;
        world.set_pose(particle.body, position, DQuat::IDENTITY)?;
        world.set_velocity(particle.body, velocity, DVec3::ZERO)
    }

    /// After `passed` s since the last time: parks what has lived for long enough, and tells the others the velocity that
    /// `flow` has where they are.
    ///
    /// # Errors
    /// What the engine says.
    pub fn steer(&mut self, world: &mut World, passed: f64, flow: impl Fn(DVec3) -> DVec3) -> Result<(), SimError> {
        for particle in self.pool.iter_mut().filter(|particle| particle.left > 0.0) {
            particle.left = (particle.left - passed).max(0.0);
            let at = world.position(particle.body).ok_or(SimError::Gone { what: "a particle" })?;
            if particle.left > 0.0 {
                world.set_pd(particle.flow, PdControl { target: at, target_velocity: flow(at) })?;
            } else {
                park(world, particle.body, self.parked)?;
            }
        }
        Ok(())
    }

    /// Parks all of them.
    ///
    /// # Errors
    /// What the engine says.
    pub fn park(&mut self, world: &mut World) -> Result<(), SimError> {
        for particle in &mut self.pool {
            particle.left = 0.0;
            park(world, particle.body, self.parked)?;
        }
        Ok(())
    }
}

fn park(world: &mut World, body: BodyId, at: DVec3) -> Result<(), SimError> {
    world.set_pose(body, at, DQuat::IDENTITY)?;
    world.set_velocity(body, DVec3::ZERO, DVec3::ZERO)?;
    world.sleep(body)
}
