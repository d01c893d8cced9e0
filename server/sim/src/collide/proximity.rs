//! What the fine phase finds between two colliders, asked for by itself.

use glam::{DQuat, DVec3};

use super::fine_phase::FinePhase;
use super::shape::Collider;
use crate::dof::Pose;

/// The nearest points of two colliders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proximity {
    /// Distance of the surfaces along the normal, m; negative where they overlap.
    pub gap: f64,
    /// Unit vector from the first collider to the second.
    pub normal: DVec3,
    /// Half way between the surfaces, m.
    pub point: DVec3,
}

/// A collider at a place.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// What is there.
    pub collider: &'a Collider,
    /// m.
    pub position: DVec3,
    /// Shape to world, of length 1.
    pub rotation: DQuat,
}

/// The nearest points of two convex colliders, or the deepest where they overlap: what contacts are made of.
/// `None` where they are farther apart than `within`, m.
pub fn proximity(a: At, b: At, within: f64) -> Option<Proximity> {
    FinePhase::default().proximity(
        (a.collider, Pose { position: a.position, rotation: a.rotation }),
        (b.collider, Pose { position: b.position, rotation: b.rotation }),
        within,
    )
}
