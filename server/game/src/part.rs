//! What can be seen of an actor: shapes, and how they follow from slices of the global state.
//!
//! Owns the description that the wire sends once; poses of parts are computed from it by whoever shows them.

use glam::{DQuat, DVec3};
use pita_sim::{BodyId, Mount, PartPoint, Shape, World};

/// A shape that follows a slice of the global state.
#[derive(Clone, Debug, PartialEq)]
pub struct PartInfo {
    /// Serial number of the slice, [`World::serial`].
    pub slice: u32,
    /// How its frame follows from the slice.
    pub mount: PartMount,
    /// The shape's axes to the mount's.
    pub rotation: DQuat,
    /// Shape in that frame.
    pub shape: Shape,
    /// Whether the slice is a rigid body that, seen from the actor's first part, turns about its own z and hardly otherwise,
    /// as a wheel does. So it takes less of the wire.
    pub is_hinged: bool,
}

/// How a shape follows a slice.
#[derive(Clone, Debug, PartialEq)]
pub enum PartMount {
    /// It moves as one.
    Rigid(Mount),
    /// Every vertex of the shape, a hull or a mesh, has a place of its own.
    Skin(Vec<Mount>),
    /// The slice is of a game's own kind: whoever shows it has to know what its numbers mean.
    Own,
}

impl PartInfo {
    /// A shape at the origin of a body: of a particle or rigid body, or of the first part of another kind.
    pub fn new(world: &World, body: BodyId, shape: Shape) -> Self {
        Self::at(world, body, PartPoint { part: 0, point: DVec3::ZERO }, shape)
    }

    /// A shape with its origin at a material point of a body of any kind, its axes those of the part there.
    pub fn at(world: &World, body: BodyId, at: PartPoint, shape: Shape) -> Self {
        let mount = world.mount(body, at).map_or(PartMount::Own, PartMount::Rigid);
        Self::mounted(world, body, mount, shape)
    }

    /// A hull or mesh that deforms with a body: a material point for each of its vertices.
    pub fn skin(world: &World, body: BodyId, vertices: &[PartPoint], shape: Shape) -> Self {
        let mounts: Option<Vec<_>> = vertices.iter().map(|&at| world.mount(body, at)).collect();
        Self::mounted(world, body, mounts.map_or(PartMount::Own, PartMount::Skin), shape)
    }

    fn mounted(world: &World, body: BodyId, mount: PartMount, shape: Shape) -> Self {
        let slice = world.serial(body).unwrap_or_default();
        Self { slice, mount, rotation: DQuat::IDENTITY, shape, is_hinged: false }
    }

    /// The same, the shape's axes turned against the part's.
    #[must_use]
    pub fn turned(self, rotation: DQuat) -> Self {
        Self { rotation, ..self }
    }

    /// The same of a body that [turns about its own z](Self::is_hinged).
    #[must_use]
    pub fn hinged(self) -> Self {
        Self { is_hinged: true, ..self }
    }
}
