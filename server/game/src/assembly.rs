//! Rigid bodies that make up one actor.
//!
//! Owns which bodies they are and where each belongs, so that an actor is placed anew in one call. What holds them
//! together, joints and springs, is the actor's own.

use pita_sim::{BodyId, Collider, DQuat, DVec3, Material, RigidBodyDesc, Shape, SimError, World};

use crate::Pose;
use crate::part::PartInfo;

/// One rigid body of an assembly, in the assembly's frame.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Shape and surface.
    pub collider: Collider,
    /// Kg; its moments of inertia are those of the homogeneous shape.
    pub mass: f64,
    /// Its centre, m.
    pub position: DVec3,
    /// Its own frame to the assembly's.
    pub rotation: DQuat,
}

impl Piece {
    /// A piece that is not turned.
    pub fn new(shape: Shape, mass: f64, material: impl Into<Material>, position: DVec3) -> Self {
        Self { collider: Collider::new(shape, material), mass, position, rotation: DQuat::IDENTITY }
    }
}

/// Rigid bodies and where they belong.
#[derive(Clone, Debug)]
pub struct Assembly {
    pose: Pose,
    bodies: Vec<BodyId>,
    parts: Vec<PartInfo>,
    /// Position, m, and rotation of each body in the assembly's frame.
    rest: Vec<(DVec3, DQuat)>,
}

impl Assembly {
    /// An assembly without bodies at `pose`.
    pub fn at(pose: Pose) -> Self {
        Self { pose, bodies: Vec::new(), parts: Vec::new(), rest: Vec::new() }
    }

    /// Adds a piece to the world and to the assembly.
    ///
    /// # Errors
    /// What the engine says where it refuses the body.
    pub fn add(&mut self, world: &mut World, piece: Piece) -> Result<BodyId, SimError> {
        let Piece { collider, mass, position, rotation } = piece;
        let (turn, shape) = (self.pose.rotation(), collider.shape().clone());
        let body = world.add_rigid_body(RigidBodyDesc {
            rotation: turn * rotation,
            collider: Some(collider),
            ..RigidBodyDesc::new(self.pose.position + turn * position, mass, shape.inertia(mass))
        })?;
        self.bodies.push(body);
        self.parts.push(PartInfo::new(world, body, shape));
        self.rest.push((position, rotation));
        Ok(body)
    }

    /// Where the assembly was put last.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Its bodies, in the order in which they were added.
    pub fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// What the wire says of them.
    pub fn parts(&self) -> Vec<PartInfo> {
        self.parts.clone()
    }

    /// A point of the assembly's frame in the world as it was put last, m.
    pub fn point(&self, at: DVec3) -> DVec3 {
        self.pose.position + self.pose.rotation() * at
    }

    /// Puts every body where it belongs about `pose`, at rest.
    ///
    /// # Errors
    /// What the engine says where it refuses a pose.
    pub fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.pose = pose;
        for (&body, &(position, rotation)) in self.bodies.iter().zip(&self.rest) {
            world.set_pose(body, self.pose.position + pose.rotation() * position, pose.rotation() * rotation)?;
            world.set_velocity(body, DVec3::ZERO, DVec3::ZERO)?;
        }
        Ok(())
    }
}
