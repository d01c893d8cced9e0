//! Loose things to knock over: one body, no logic.

use pita_sim::{BodyId, Collider, Material, RigidBodyDesc, Shape, SimError, World};

use crate::actor::{Actor, ActorInfo, PartInfo};
use crate::spawn::Pose;
use glam::DVec3;

/// What a prop is made of.
#[derive(Clone, Debug)]
pub struct PropDesc {
    /// `crate`, `ball`, ...
    pub name: String,
    /// Its shape, m.
    pub shape: Shape,
    /// Mass, kg.
    pub mass: f64,
    /// What it is made of.
    pub material: Material,
    /// Where its centre is, m, and its heading.
    pub home: Pose,
}

/// A loose thing.
pub struct Prop {
    info: ActorInfo,
    bodies: [BodyId; 1],
    home: Pose,
}

impl Prop {
    /// Adds the prop to `world`.
    ///
    /// # Errors
    /// What the engine says where it refuses the body.
    pub fn add(world: &mut World, id: u32, desc: PropDesc) -> Result<Self, SimError> {
        let inertia = desc.shape.inertia(desc.mass);
        let body = world.add_rigid_body(RigidBodyDesc {
            rotation: desc.home.rotation(),
            collider: Some(Collider::new(desc.shape.clone(), desc.material)),
            ..RigidBodyDesc::new(desc.home.position, desc.mass, inertia)
        })?;
        let parts = vec![PartInfo { slice: world.serial(body).unwrap_or_default(), shape: desc.shape }];
        let info = ActorInfo { id, kind: "prop", name: desc.name, slot: None, parts };
        Ok(Self { info, bodies: [body], home: desc.home })
    }
}

impl Actor for Prop {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    fn home(&self) -> Option<Pose> {
        Some(self.home)
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        world.set_pose(self.bodies[0], pose.position, pose.rotation())?;
        world.set_velocity(self.bodies[0], DVec3::ZERO, DVec3::ZERO)
    }
}
