//! The body of a tornado (talk, "Code: Optimizations": "spheres instead of hulls; DOFs: 3 lin, 0 ang"): three particles, one
//! above the other, each with a sphere that sees and does not push.

use glam::{DQuat, DVec3};
use pita_sim::{Anchor, BodyId, Collider, JointDrive, ParticleDesc, PdControl, PdDesc, PdId, Shape, SimError, World};

use super::TornadoParameters;
use super::path::Path;

/// kg: nothing feels it, and controllers do not mind it.
const MASS: f64 = 1.0;

/// Foot, waist and top. The foot follows the path; the others follow what is below them and stay behind, which bends the
/// tornado.
pub struct Column {
    bodies: [BodyId; Self::SPHERES],
    shapes: [Shape; Self::SPHERES],
    /// Of all but the foot, from each to the one below it.
    followers: [PdId; Self::SPHERES - 1],
    /// m.
    spacing: f64,
}

impl Column {
    /// Foot, waist and top.
    pub const SPHERES: usize = 3;

    /// Adds the spheres, at rest, with the foot at `foot`, m.
    ///
    /// # Errors
    /// What the engine says.
    pub fn add(world: &mut World, p: &TornadoParameters, foot: DVec3) -> Result<Self, SimError> {
        let spacing = p.height / (Self::SPHERES - 1) as f64;
        let shapes: [Shape; Self::SPHERES] = std::array::from_fn(|i| {
            let share = i as f64 / (Self::SPHERES - 1) as f64;
            let orbit = p.foot_radius + (p.top_radius - p.foot_radius) * share;
            Shape::Ball { radius: if i == 0 { p.reach } else { orbit } }
        });
        let mut add_sphere = |i: usize| {
            let collider = Some(Collider::new(shapes[i].clone(), 0.0).into_sensor());
            let position = foot + DVec3::Y * spacing * i as f64;
            world.add_particle(ParticleDesc { position, velocity: DVec3::ZERO, mass: MASS, collider })
        };
        let bodies = [add_sphere(0)?, add_sphere(1)?, add_sphere(2)?];
        let mut add_follower = |i: usize| {
            let target = foot + DVec3::Y * spacing * i as f64;
            world.add_pd(PdDesc {
                at: Anchor::body(bodies[i], DVec3::ZERO),
                drive: JointDrive::Position { frequency: p.sway_frequency, damping_ratio: p.sway_damping },
                max_force: f64::INFINITY,
                control: PdControl { target, target_velocity: DVec3::ZERO },
            })
        };
        let followers = [add_follower(1)?, add_follower(2)?];
        Ok(Self { bodies, shapes, followers, spacing })
    }

    /// Foot first.
    pub fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// Foot first.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// What touches the ground.
    pub fn foot(&self) -> BodyId {
        self.bodies[0]
    }

    /// Places, m, and velocities, m/s, foot first.
    ///
    /// # Errors
    /// Where a sphere is gone.
    pub fn spheres(&self, world: &World) -> Result<[(DVec3, DVec3); Self::SPHERES], SimError> {
        let mut spheres = [(DVec3::ZERO, DVec3::ZERO); Self::SPHERES];
        for (sphere, &body) in spheres.iter_mut().zip(&self.bodies) {
            let motion = world.position(body).zip(world.velocity(body));
            *sphere = motion.ok_or(SimError::Gone { what: "a sphere of the tornado" })?;
        }
        Ok(spheres)
    }

    /// Bears the spheres' weight, moves the foot's controller along the path, and lets each of the others follow the one
    /// below it.
    ///
    /// # Errors
    /// What the engine says.
    pub fn push(&self, world: &mut World, path: &mut Path, dt: f64) -> Result<(), SimError> {
        let weight = -MASS * world.settings().gravity;
        let spheres = self.spheres(world)?;
        for (&body, (at, _)) in self.bodies.iter().zip(spheres) {
            world.apply_force(body, weight, at)?;
        }
        path.follow(world, self.foot(), dt)?;
        for (&follower, (below, velocity)) in self.followers.iter().zip(spheres) {
            let target = below + velocity * dt + DVec3::Y * self.spacing;
            world.set_pd(follower, PdControl { target, target_velocity: velocity })?;
        }
        Ok(())
    }

    /// Puts it with the foot at `foot`, m, upright and at rest.
    ///
    /// # Errors
    /// What the engine says.
    pub fn place(&self, world: &mut World, foot: DVec3) -> Result<(), SimError> {
        for (i, &body) in self.bodies.iter().enumerate() {
            world.set_pose(body, foot + DVec3::Y * self.spacing * i as f64, DQuat::IDENTITY)?;
            world.set_velocity(body, DVec3::ZERO, DVec3::ZERO)?;
        }
        Ok(())
    }
}
