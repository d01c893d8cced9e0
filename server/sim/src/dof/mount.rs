//! How a place in a body follows from the body's Q alone: what a receiver of Q has to know to show what hangs there.
//!
//! Owns the description; [`Dof::mount`](super::Dof::mount) of each kind answers it, and whoever shows bodies evaluates
//! it. The engine itself does not: it has [`Dof::frame`](super::Dof::frame).

use glam::{DMat3, DQuat, DVec3};

use super::articulated::JointKind;

/// How position and axes at a material point follow from Q.
#[derive(Clone, Debug, PartialEq)]
pub enum Mount {
    /// Q is a place, perhaps with a rotation: of a particle or rigid body.
    Body {
        /// In the body's frame, m.
        offset: DVec3,
    },
    /// At the end of a chain of joints.
    Chain {
        /// From the world to the part.
        joints: Vec<MountJoint>,
        /// In the part's frame, m.
        offset: DVec3,
    },
    /// Between points: at Σ weight x + `position`, turned by the rotation of Σ x ⊗ gradient + `deformation` (its polar
    /// decomposition).
    Points {
        /// The points and their shares.
        nodes: Vec<MountNode>,
        /// What does not move, m.
        position: DVec3,
        /// Likewise, of the deformation gradient.
        deformation: DMat3,
    },
    /// On the line between two points, turned by the shortest turn from its direction at rest: at x0 + `share` (x1 − x0)
    /// and off it by the turned `offset`.
    Line {
        /// Indices of points.
        points: [u32; 2],
        /// Of the way from the first to the second.
        share: f64,
        /// Unit vector, at rest.
        direction: DVec3,
        /// At right angles to the line, m.
        offset: DVec3,
    },
}

/// A joint on the way to a part. The part is turned by the joint's turn times `rest` against its parent, and the two
/// places meet, but for what the joint shifts them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountJoint {
    /// Its coordinates; axes have length 1.
    pub kind: JointKind,
    /// Where they start in Q.
    pub start: u32,
    /// Its place in the parent's frame, or in the world, m.
    pub in_parent: DVec3,
    /// Its place in the part's frame, m.
    pub in_part: DVec3,
    /// Turns the part's axes into the parent's at rest.
    pub rest: DQuat,
}

/// A point's share of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountNode {
    /// Its numbers are `q[3 point..3 point + 3]`.
    pub point: u32,
    /// Of the position.
    pub weight: f64,
    /// Of the deformation gradient, 1/m.
    pub gradient: DVec3,
}
