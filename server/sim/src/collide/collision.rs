//! Collisions: which pairs touch, since when, and which of them logic lets pass.
//!
//! Owns the phases of pairs and what is told of them. Points are the narrow phase's, forces the integrator's.

use glam::DVec3;

use super::narrow_phase::Key;
use super::{ContactPoint, MaterialId, Moving, StaticId, Surface};
use crate::dof::BodyId;
use crate::settings::Settings;

/// A pair that touched goes on touching while it is closer than this, m: what rests must not begin and end.
const PARTING_GAP: f64 = 1e-3;

/// Where a collision stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The two overlap, or will meet in this tick if nothing but gravity turns them aside, and did not in the last tick.
    Begin,
    /// They did so in the last tick, too.
    Stay,
    /// They did so in the last tick and do not any more; once for every [`Phase::Begin`], unless a body is removed or put
    /// elsewhere before.
    End,
}

/// Names a collision until the next detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CollisionId {
    /// Counts detections.
    pub(super) detection: u64,
    pub(super) index: u32,
}

/// One half of a colliding pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollisionSide {
    /// What collides.
    pub object: CollisionObject,
    /// Of its collider.
    pub material: MaterialId,
    /// Whether its collider is a sensor: it sees and does not push.
    pub is_sensor: bool,
}

/// What collides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CollisionObject {
    /// A body.
    Body(BodyId),
    /// A piece of static geometry.
    Static(StaticId),
}

/// A collision as stage 2 found it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// For [`World::cancel_collision`](crate::World::cancel_collision).
    pub id: CollisionId,
    /// Where it stands.
    pub phase: Phase,
    /// The two colliders; the first is a body's.
    pub sides: [CollisionSide; 2],
    /// Where they are closest at the end of the tick, as far as that is known, m; at [`Phase::End`], where they were.
    pub point: DVec3,
    /// Unit vector from the first to the second.
    pub normal: DVec3,
    /// Distance of the surfaces at the start of the tick, m; negative where they overlap.
    pub gap: f64,
    /// How fast they come closer there at the start of the tick, m/s; negative where they part.
    pub approach_speed: f64,
    /// That they gave each other along the normal in the last tick, N s.
    pub impulse: f64,
    /// Whether logic lets the pair pass in this tick.
    pub is_cancelled: bool,
}

/// What is kept of a collision from detection on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub key: Key,
    pub phase: Phase,
    pub closest: Closest,
    /// N s.
    pub impulse: f64,
    pub is_cancelled: bool,
}

/// The point of a pair that is closest at the end of the tick, as far as that is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    pub position: DVec3,
    pub normal: DVec3,
    pub gap: f64,
    pub approach_speed: f64,
}

/// Two colliders at the start of a tick.
pub(super) struct Meeting<'a> {
    pub a: &'a Moving<'a>,
    /// `None` for static geometry.
    pub b: Option<&'a Moving<'a>>,
    pub surface: Surface,
}

impl Meeting<'_> {
    /// How fast a point at `position` of `a` closes in on `b` along `normal`, m/s.
    fn closing_speed(&self, position: DVec3, normal: DVec3) -> f64 {
        let velocity = |body: &Moving| body.twist.at(position - body.pose.position);
        normal.dot(velocity(self.a) - self.b.map_or(DVec3::ZERO, velocity))
    }

    /// By how much the gap at `position` along `normal` closes in the tick if nothing but gravity acts, m.
    pub fn closes(&self, position: DVec3, normal: DVec3, settings: &Settings) -> f64 {
        let fall = if self.b.is_none() { settings.gravity * settings.dt } else { DVec3::ZERO };
        settings.dt * (self.closing_speed(position, normal) + normal.dot(fall))
    }

    /// The closest of `points` where they touch; `touched` says that they did in the last tick.
    pub fn closest(&self, points: &[ContactPoint], touched: bool, settings: &Settings) -> Option<Closest> {
        let fall = if self.b.is_none() { settings.gravity * settings.dt } else { DVec3::ZERO };
        let mut least = if touched { PARTING_GAP } else { 0.0 };
        let mut closest = None;
        for &ContactPoint { position, normal, gap, .. } in points {
            let approach_speed = self.closing_speed(position, normal);
            let end_gap = gap - settings.dt * (approach_speed + normal.dot(fall)).max(0.0);
            if end_gap <= least {
                least = end_gap;
                closest = Some(Closest { position, normal, gap, approach_speed });
            }
        }
        closest
    }
}
