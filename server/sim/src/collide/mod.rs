//! Collision detection: which DOF are incompatible, and where.
//!
//! Once a tick, at Q0, with margins that cover the tick's motion: `broad_phase` prunes, `narrow_phase` finds the
//! points. What comes out are contact points; [`potential::contact`](crate::potential) makes potentials of them.

mod broad_phase;
mod collision;
mod groups;
mod half_space;
pub mod kdop;
pub mod kdop_tree;
mod manifold;
mod material;
mod narrow_phase;
mod shape;

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

pub use collision::{Collision, CollisionId, CollisionObject, CollisionSide, Phase};
pub use groups::Groups;
pub use material::{Material, MaterialId, Surface};
pub use shape::{Collider, HULL_POINTS_MAX, Shape};

use crate::dof::{BodyId, Placed, Pose, Twist};
use crate::error::{SimError, require_rotation, require_vector};
use crate::settings::Settings;
use broad_phase::{Bounds, BroadPhase};
use collision::{Closest, Touch};
use material::MaterialTable;
use narrow_phase::NarrowPhase;

slotmap::new_key_type! {
    /// Handle of a piece of static geometry.
    pub struct StaticId;
}

/// A piece of static geometry to be added.
#[derive(Clone, Debug)]
pub struct StaticDesc {
    /// What it collides with.
    pub collider: Collider,
    /// Where it stands, m.
    pub position: DVec3,
    /// Shape to world.
    pub rotation: DQuat,
}

impl StaticDesc {
    /// A piece that stands at the origin, not turned.
    pub fn new(collider: Collider) -> Self {
        Self { collider, position: DVec3::ZERO, rotation: DQuat::IDENTITY }
    }
}

/// A contact point of the last tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactView {
    /// First body.
    pub a: BodyId,
    /// Second body; `None` for static geometry.
    pub b: Option<BodyId>,
    /// Half way between the surfaces, m.
    pub point: DVec3,
    /// Unit vector from `a` to `b`.
    pub normal: DVec3,
    /// Distance of the surfaces when it was found, m; negative where they overlap.
    pub gap: f64,
    /// At the end of the tick, N.
    pub normal_force: f64,
}

/// What detection sees of a body.
#[derive(Clone, Copy)]
pub(crate) struct Moving<'a> {
    /// Of the collider.
    pub serial: u32,
    /// Serial of the body that it is on.
    pub owner: u32,
    pub collider: &'a Collider,
    pub pose: Pose,
    pub twist: Twist,
}

/// The second half of a pair: another body or a piece of static geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Partner {
    Body(u32),
    Static(u32),
}

/// A contact point as it was found at Q0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactPoint {
    /// Serial of the first body.
    pub a: u32,
    pub b: Partner,
    /// Half way between the surfaces, m.
    pub position: DVec3,
    /// From `a` to `b`.
    pub normal: DVec3,
    pub gap: f64,
    /// What the contact is like.
    pub surface: Surface,
    /// Tangential slip of `b` against `a` that the friction spring remembers, m.
    pub anchor: DVec3,
    /// At the end of the last tick that had this point, N.
    pub normal_force: f64,
    /// Logic lets the pair pass in this tick.
    pub is_cancelled: bool,
    feature: u32,
}

impl ContactPoint {
    /// Whether two points are of the same pair.
    pub fn same_pair(&self, other: &Self) -> bool {
        self.a == other.a && self.b == other.b
    }

    /// A new point without a history between bodies that do not matter.
    #[cfg(test)]
    pub fn at(position: DVec3, normal: DVec3, gap: f64, friction: f64) -> Self {
        let (a, b, feature, is_cancelled) = (0, Partner::Static(0), 0, false);
        let surface = Material::from(friction).surface;
        let (anchor, normal_force) = (DVec3::ZERO, 0.0);
        Self { a, b, position, normal, gap, surface, anchor, normal_force, is_cancelled, feature }
    }
}

struct Static {
    serial: u32,
    collider: Collider,
    pose: Pose,
    bounds: Bounds,
}

/// The collision stage.
#[derive(Default)]
pub(crate) struct Detector {
    statics: slotmap::SlotMap<StaticId, Static>,
    static_serials: u32,
    /// Handle of each piece of static geometry by its serial.
    static_ids: BTreeMap<u32, StaticId>,
    materials: MaterialTable,
    /// Pairs of bodies that never collide, by serial, smaller first; sorted, and once for every reason.
    excluded: Vec<(u32, u32)>,
    broad_phase: BroadPhase,
    narrow_phase: NarrowPhase,
    bounds: Vec<Bounds>,
    pairs: Vec<(u32, u32)>,
    /// Contacts of this tick, in order of pair.
    pub contacts: Vec<ContactPoint>,
    /// What there is to tell of pairs in this tick, in order of pair.
    touches: Vec<Touch>,
    /// Counts detections.
    detections: u64,
}

impl Detector {
    pub fn add_static(&mut self, desc: StaticDesc) -> Result<StaticId, SimError> {
        require_vector(desc.position, "position")?;
        require_rotation(desc.rotation, "rotation")?;
        let collider = desc.collider;
        collider.validate()?;
        let pose = Pose { position: desc.position, rotation: desc.rotation.normalize() };
        let half = collider.shape().half_extents(pose.rotation);
        let bounds = Bounds { min: pose.position - half, max: pose.position + half };
        let serial = self.static_serials;
        self.static_serials += 1;
        let id = self.statics.insert(Static { serial, collider, pose, bounds });
        self.static_ids.insert(serial, id);
        Ok(id)
    }

    /// Removes a piece, and with it its contacts and collisions of this tick. Answers whether there was one.
    pub fn remove_static(&mut self, id: StaticId) -> bool {
        let Some(piece) = self.statics.remove(id) else { return false };
        self.static_ids.remove(&piece.serial);
        let partner = Partner::Static(piece.serial);
        self.contacts.retain(|contact| contact.b != partner);
        self.narrow_phase.forget(|(_, b)| b == partner);
        true
    }

    /// From now on contacts of two materials are like `surface`.
    pub fn set_material_pair(&mut self, a: MaterialId, b: MaterialId, surface: Surface) {
        self.materials.insert(a, b, surface);
    }

    /// Lets a pair pass in this tick. Answers whether the collision is of this tick.
    pub fn cancel(&mut self, id: CollisionId) -> bool {
        let touch = self.touches.get_mut(id.index as usize).filter(|_| id.detection == self.detections);
        let Some(touch) = touch else { return false };
        touch.is_cancelled = true;
        let of_pair = |contact: &ContactPoint| (contact.a, contact.b);
        let start = self.contacts.partition_point(|contact| of_pair(contact) < touch.key);
        for contact in self.contacts[start..].iter_mut().take_while(|contact| of_pair(contact) == touch.key) {
            (contact.is_cancelled, contact.anchor, contact.normal_force) = (true, DVec3::ZERO, 0.0);
        }
        true
    }

    /// The collisions of this tick, in order of pair. `side` answers what the collider with a serial is on, and itself.
    pub fn collisions<'a>(
        &'a self,
        side: impl Fn(u32) -> Option<(BodyId, &'a Collider)> + 'a,
    ) -> impl Iterator<Item = Collision> + 'a {
        let tell = |object, collider: &Collider| CollisionSide {
            object,
            material: collider.material().id,
            is_sensor: collider.is_sensor(),
        };
        (0..).zip(&self.touches).filter_map(move |(index, touch)| {
            let Touch { key: (a, b), phase, closest, impulse, is_cancelled } = *touch;
            let body = |serial| side(serial).map(|(body, collider)| tell(CollisionObject::Body(body), collider));
            let b = match b {
                Partner::Body(serial) => body(serial)?,
                Partner::Static(serial) => {
                    let id = *self.static_ids.get(&serial)?;
                    tell(CollisionObject::Static(id), &self.statics[id].collider)
                }
            };
            let Closest { position, normal, gap, approach_speed } = closest;
            let id = CollisionId { detection: self.detections, index };
            let sides = [body(a)?, b];
            Some(Collision { id, phase, sides, point: position, normal, gap, approach_speed, impulse, is_cancelled })
        })
    }

    /// The two bodies do not collide with each other, for one reason more.
    pub fn exclude(&mut self, a: u32, b: u32) {
        let pair = (a.min(b), a.max(b));
        let place = self.excluded.partition_point(|other| other < &pair);
        self.excluded.insert(place, pair);
    }

    /// Takes one [`Detector::exclude`] back.
    pub fn include(&mut self, a: u32, b: u32) {
        if let Ok(place) = self.excluded.binary_search(&(a.min(b), a.max(b))) {
            self.excluded.remove(place);
        }
    }

    fn excludes(&self, a: u32, b: u32) -> bool {
        self.excluded.binary_search(&(a.min(b), a.max(b))).is_ok()
    }

    /// Forgets a body: its contacts and exclusions.
    pub fn forget(&mut self, serial: u32) {
        self.excluded.retain(|&(a, b)| a != serial && b != serial);
        self.forget_contacts(serial);
    }

    /// Forgets a body's contacts.
    pub fn forget_contacts(&mut self, serial: u32) {
        self.contacts.retain(|c| c.a != serial && c.b != Partner::Body(serial));
        self.narrow_phase.forget(|(a, b)| a == serial || b == Partner::Body(serial));
    }

    /// Finds all contact points of the colliders `bodies`, which are in order of serial. `look` answers `None` for what does not
    /// collide.
    pub fn detect<'a>(&mut self, bodies: &[Placed], settings: &Settings, look: impl Fn(&Placed) -> Option<Moving<'a>>) {
        self.bounds.clear();
        let bounds = |placed: &Placed| look(placed).map_or(Bounds::EMPTY, |body| swept_bounds(&body, settings));
        self.bounds.extend(bodies.iter().map(bounds));
        self.broad_phase.pairs(&self.bounds, &mut self.pairs);
        self.narrow_phase.begin();
        let mut pairs = self.pairs.iter().peekable();
        for (i, placed) in (0..).zip(bodies) {
            while pairs.next_if(|&&(a, _)| a < i).is_some() {}
            let Some(body) = &look(placed) else { continue };
            while let Some(&(_, j)) = pairs.next_if(|&&(a, _)| a == i) {
                let Some(other) = &look(&bodies[j as usize]) else { continue };
                let meet = body.owner != other.owner && body.collider.meets(other.collider);
                if meet && !self.excludes(body.owner, other.owner) {
                    let surface = self.materials.contact(body.collider.material(), other.collider.material());
                    self.narrow_phase.bodies(body, other, surface, settings);
                }
            }
            for piece in self.statics.values() {
                if piece.bounds.overlaps(&self.bounds[i as usize]) && body.collider.meets(&piece.collider) {
                    let surface = self.materials.contact(body.collider.material(), piece.collider.material());
                    let at = (piece.serial, &piece.collider, piece.pose);
                    self.narrow_phase.with_static(body, at, surface, settings);
                }
            }
        }
        self.contacts.clear();
        self.touches.clear();
        self.detections += 1;
        self.narrow_phase.finish(&mut self.contacts, &mut self.touches, settings);
    }

    /// Remembers what the friction springs and normal forces of `contacts` became.
    pub fn remember(&mut self) {
        self.narrow_phase.remember(&self.contacts);
    }
}

/// Bounds of a body and of all that a tick may do to it.
fn swept_bounds(body: &Moving, settings: &Settings) -> Bounds {
    let half = body.collider.shape().half_extents(body.pose.rotation);
    let sweep = settings.dt * body.twist.linear;
    let slack = settings.contact.margin + settings.dt * settings.dt * settings.gravity.length();
    // Turning moves no point of the body farther than its bounding ball reaches beyond its present box.
    let turn = settings.dt * body.twist.angular.length() * body.collider.bounding_radius();
    let turn = DVec3::splat(turn).min(DVec3::splat(body.collider.bounding_radius()) - half).max(DVec3::ZERO);
    let reach = half + turn + slack;
    let ends = [body.pose.position, body.pose.position + sweep];
    Bounds { min: ends[0].min(ends[1]) - reach, max: ends[0].max(ends[1]) + reach }
}
