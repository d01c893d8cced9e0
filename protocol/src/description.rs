//! The world in words: actors, their parts, what the parts look like and how they follow from the numbers of snapshots.
//!
//! Owns [`Description`] and its checks. A part is drawn by its [`Shape`] where its [`Mount`] says; the arithmetic is in
//! `protocol/PROTOCOL.md`, section 7, and in the client's library.

use serde::{Deserialize, Serialize};

use crate::codec::{Message, WireError, require};
use crate::dof::Precision;
use crate::message::TEXT_MAX;

/// Most points of a convex hull.
const HULL_POINTS_MAX: usize = 256;
/// Most corners, and most triangles, of a mesh.
const MESH_MAX: usize = 65_536;
/// Most joints from the world to a part.
const CHAIN_MAX: usize = 64;
/// Most points that a place lies between.
const NODES_MAX: usize = 64;

/// What the numbers of the snapshots belong to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Name of the arena, as in the key expressions.
    pub arena: String,
    /// What a person calls it.
    pub title: String,
    /// Tick at which this was true.
    pub tick: u64,
    /// Number of the last event that is contained in it.
    pub event_sequence: u32,
    /// Acceleration, m/s².
    pub gravity: [f32; 3],
    /// How fine the numbers of snapshots are.
    pub precision: Precision,
    /// Points of this round, of actors that have any, in order of id.
    pub scores: Vec<(u32, u32)>,
    /// Geometry that never moves.
    pub statics: Vec<StaticDescription>,
    /// Everything that has game logic, in order of id.
    pub actors: Vec<ActorDescription>,
}

/// A piece of static geometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaticDescription {
    /// Its shape.
    pub shape: Shape,
    /// Where it stands, m.
    pub position: [f32; 3],
    /// Unit quaternion x y z w, shape to world.
    pub rotation: [f32; 4],
}

/// An actor and the slices that it consists of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActorDescription {
    /// Identifies the actor for as long as it lives; never used twice in a run.
    pub id: u32,
    /// `vehicle`, `crate`, ...
    pub kind: String,
    /// What a person calls it; the player's name for a player's vehicle.
    pub name: String,
    /// Slot of the session that drives it.
    pub slot: Option<u16>,
    /// Its parts; the first is the one that says where the actor is.
    pub parts: Vec<PartDescription>,
}

/// A shape that follows a slice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartDescription {
    /// [`Slice::id`](crate::dof::Slice::id) in the snapshots.
    pub slice: u32,
    /// How its frame follows from the slice's Q.
    pub mount: Mount,
    /// Unit quaternion x y z w, the shape's axes to the mount's.
    pub rotation: [f32; 4],
    /// Shape in that frame.
    pub shape: Shape,
}

/// How a frame follows from the Q of a slice. Points are numbered: point i is `q[3 i..3 i + 3]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Mount {
    /// A point, or a point and a rotation.
    Body {
        /// In the body's frame, m.
        offset: [f32; 3],
    },
    /// At the end of a chain of joints.
    Chain {
        /// From the world to the part, 1 to 64.
        joints: Vec<ChainJoint>,
        /// In the part's frame, m.
        offset: [f32; 3],
    },
    /// At Σ weight x + `position`, turned by the rotation nearest to Σ x ⊗ gradient + `deformation`.
    Points {
        /// The points, 1 to 64.
        nodes: Vec<MountNode>,
        /// m.
        position: [f32; 3],
        /// By columns.
        deformation: [[f32; 3]; 3],
    },
    /// On the line between two points, turned by the shortest turn from `direction` to the line's: at
    /// x0 + `share` (x1 − x0) + the turned `offset`.
    Line {
        /// The two.
        points: [u16; 2],
        /// Of the way.
        share: f32,
        /// Unit vector, the line's at rest.
        direction: [f32; 3],
        /// m.
        offset: [f32; 3],
    },
    /// Every vertex of the shape, which is a hull or a mesh, has a place of its own.
    Skin {
        /// In the order of the shape's points.
        vertices: Vec<Vertex>,
    },
    /// The slice is of a game's own kind: the game knows.
    Own,
}

/// A joint on the way to a part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChainJoint {
    /// Its coordinates.
    pub motion: JointMotion,
    /// Where they start in Q.
    pub start: u16,
    /// Its place in the parent's frame, or in the world, m.
    pub in_parent: [f32; 3],
    /// Its place in the part's frame, m.
    pub in_part: [f32; 3],
    /// Unit quaternion x y z w, the part's axes to the parent's at rest.
    pub rest: [f32; 4],
}

/// How a part moves against its parent, in the parent's axes at rest. Axes have length 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum JointMotion {
    /// Not at all.
    Fixed,
    /// One angle, rad.
    Hinge {
        /// Axis.
        axis: [f32; 3],
    },
    /// Two angles, rad: the turn about the second, then that about the first.
    Universal {
        /// Axes.
        axes: [[f32; 3]; 2],
    },
    /// A unit quaternion x y z w.
    Ball,
    /// One distance, m.
    Slider {
        /// Axis.
        axis: [f32; 3],
    },
    /// Position, m, and unit quaternion.
    Free,
}

/// A point's share of a place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MountNode {
    /// Its number.
    pub point: u16,
    /// Of the position.
    pub weight: f32,
    /// Of the deformation, 1/m.
    pub gradient: [f32; 3],
}

/// A vertex of a skin: at Σ weight x + `position`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Vertex {
    /// Numbers of points and weights, at most 64.
    pub nodes: Vec<(u16, f32)>,
    /// m.
    pub position: [f32; 3],
}

/// Shapes, metres, in their own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// Everything below the plane through the origin.
    HalfSpace {
        /// Unit normal, points out of the ground.
        normal: [f32; 3],
    },
    /// Ball around the origin.
    Ball {
        /// Radius.
        radius: f32,
    },
    /// Box around the origin.
    Box {
        /// Half extents.
        half: [f32; 3],
    },
    /// Segment along x, spherically extruded.
    Capsule {
        /// Half length of the segment.
        half_length: f32,
        /// Radius.
        radius: f32,
    },
    /// Cylinder along z, its edges rounded.
    Cylinder {
        /// Half length along z.
        half_length: f32,
        /// Radius.
        radius: f32,
        /// Radius of the rounded edge, contained in the other two.
        rounding: f32,
    },
    /// Convex hull, spherically extruded.
    Hull {
        /// Its vertices.
        points: Vec<[f32; 3]>,
        /// Extrusion radius.
        radius: f32,
    },
    /// Triangles.
    Mesh {
        /// Corners.
        points: Vec<[f32; 3]>,
        /// Three indices of corners each, anticlockwise seen from outside.
        triangles: Vec<[u16; 3]>,
    },
}

impl Message for Description {
    const KIND: u8 = 3;
    const MAX_BYTES: usize = 2 << 20;
    fn validate(&self) -> Result<(), WireError> {
        let poses = self.statics.iter().all(|s| all_finite(&s.position) && all_finite(&s.rotation));
        require(poses && all_finite(&self.gravity), "description numbers", "finite")?;
        self.precision.check()?;
        self.statics.iter().try_for_each(|piece| piece.shape.validate())?;
        self.actors.iter().try_for_each(ActorDescription::validate)?;
        let is_short = self.arena.len() <= TEXT_MAX && self.title.len() <= TEXT_MAX;
        require(is_short, "text", "at most 256 bytes")
    }
}

impl PartDescription {
    /// A shape in the frame of a particle or rigid body.
    pub fn of_body(slice: u32, shape: Shape) -> Self {
        Self { slice, mount: Mount::Body { offset: [0.0; 3] }, rotation: [0.0, 0.0, 0.0, 1.0], shape }
    }
}

impl ActorDescription {
    /// # Errors
    /// [`WireError::Content`] for what no actor is.
    pub(crate) fn validate(&self) -> Result<(), WireError> {
        require(self.kind.len() <= TEXT_MAX && self.name.len() <= TEXT_MAX, "text", "at most 256 bytes")?;
        self.parts.iter().try_for_each(|part| {
            require(all_finite(&part.rotation), "rotation of a part", "finite")?;
            part.shape.validate()?;
            part.mount.validate(&part.shape)
        })
    }
}

impl Mount {
    fn validate(&self, shape: &Shape) -> Result<(), WireError> {
        let finite = match self {
            Self::Own => true,
            Self::Body { offset } => all_finite(offset),
            Self::Chain { joints, offset } => {
                require((1..=CHAIN_MAX).contains(&joints.len()), "joints of a part", "1 to 64")?;
                all_finite(offset) && joints.iter().all(ChainJoint::is_finite)
            }
            Self::Points { nodes, position, deformation } => {
                require((1..=NODES_MAX).contains(&nodes.len()), "points of a part", "1 to 64")?;
                let shares = nodes.iter().all(|node| node.weight.is_finite() && all_finite(&node.gradient));
                shares && all_finite(position) && all_finite(deformation.as_flattened())
            }
            Self::Line { share, direction, offset, .. } => {
                share.is_finite() && all_finite(direction) && all_finite(offset)
            }
            Self::Skin { vertices } => {
                let points = match shape {
                    Shape::Hull { points, .. } | Shape::Mesh { points, .. } => points.len(),
                    _ => 0,
                };
                require(vertices.len() == points && points > 0, "vertices of a skin", "as many as the shape's points")?;
                let few = vertices.iter().all(|vertex| vertex.nodes.len() <= NODES_MAX);
                require(few, "points of a vertex", "at most 64")?;
                let weights = |vertex: &Vertex| vertex.nodes.iter().all(|(_, weight)| weight.is_finite());
                vertices.iter().all(|vertex| all_finite(&vertex.position) && weights(vertex))
            }
        };
        require(finite, "mount", "finite numbers")
    }
}

impl ChainJoint {
    fn is_finite(&self) -> bool {
        let axes = match &self.motion {
            JointMotion::Hinge { axis } | JointMotion::Slider { axis } => all_finite(axis),
            JointMotion::Universal { axes } => all_finite(axes.as_flattened()),
            JointMotion::Fixed | JointMotion::Ball | JointMotion::Free => true,
        };
        axes && all_finite(&self.in_parent) && all_finite(&self.in_part) && all_finite(&self.rest)
    }
}

impl Shape {
    fn validate(&self) -> Result<(), WireError> {
        let size = |x: f32| x.is_finite() && x >= 0.0;
        let is_sane = match self {
            Self::HalfSpace { normal } => all_finite(normal),
            Self::Ball { radius } => size(*radius),
            Self::Box { half } => half.iter().all(|&x| size(x)),
            Self::Capsule { half_length, radius } => size(*half_length) && size(*radius),
            Self::Cylinder { half_length, radius, rounding } => size(*half_length) && size(*radius) && size(*rounding),
            Self::Hull { points, radius } => {
                require(points.len() <= HULL_POINTS_MAX, "points of a hull", "at most 256")?;
                all_finite(points.as_flattened()) && size(*radius)
            }
            Self::Mesh { points, triangles } => {
                require(
                    points.len().max(triangles.len()) <= MESH_MAX,
                    "corners and triangles of a mesh",
                    "at most 65536",
                )?;
                let known = triangles.as_flattened().iter().all(|&corner| usize::from(corner) < points.len());
                require(known, "corner of a triangle", "one that the mesh has")?;
                all_finite(points.as_flattened())
            }
        };
        require(is_sane, "shape", "finite, no negative size")
    }
}

fn all_finite(numbers: &[f32]) -> bool {
    numbers.iter().all(|x| x.is_finite())
}
