//! Collision detection: which DOF are incompatible, and where.
//!
//! Once a tick, at Q0, with margins that cover the tick's motion, and again (`second_look`) where the solver puts what
//! moves far: three `trees` of k-DOPs prune, `narrow_phase` keeps the pairs, `fine_phase` finds their
//! points. What comes out are contact points; [`potential::contact`](crate::potential) makes potentials of them.

mod boxes;
mod cloud;
mod collision;
mod compound;
mod convex;
mod core;
mod embedded_hull;
mod fine_phase;
mod gjk;
mod groups;
mod half_space;
mod hull;
pub mod kdop;
pub mod kdop_tree;
mod manifold;
mod material;
mod narrow_phase;
mod passing;
mod patches;
mod proximity;
mod query;
mod second_look;
mod shape;
mod still;
mod trees;
mod triangle_mesh;

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

pub use collision::{Collision, CollisionId, CollisionObject, CollisionSide, Phase};
pub use compound::{Compound, PIECES_MAX, Piece};
pub use embedded_hull::EmbeddedHull;
pub(crate) use embedded_hull::Foot;
pub use groups::Groups;
pub use material::{Material, MaterialId, Surface};
pub use proximity::{At, Proximity, proximity};
pub use query::{Nearest, QueryFilter, RayHit};
pub use shape::{Collider, HULL_POINTS_MAX, Shape};
pub use triangle_mesh::{Repairs, TRIANGLES_MAX, TriangleMesh};

use crate::dof::{BodyId, Placed, Pose, Twist};
use crate::error::{SimError, require_rotation, require_vector};
use crate::potential::restitution::Blow;
use crate::settings::Settings;
use crate::threads::Threads;
use collision::{Closest, Touch};
use fine_phase::may_reach;
pub(crate) use hull::Bodies;
use kdop::Kdop;
use manifold::ManifoldPoint;
use material::MaterialTable;
use narrow_phase::{Key, NarrowPhase, Other};
use second_look::Glances;
pub(crate) use second_look::{Candidates, Course, SecondPoint};
use trees::Trees;

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
    pub collider: &'a Collider,
    pub pose: Pose,
    pub twist: Twist,
    /// How much faster than its twist says its surface may be where it deforms, m/s.
    pub spread: f64,
    /// Whether it goes on as its twist says, but for `bend`, as long as nothing touches it.
    pub flies: bool,
    /// From its origin to what it goes round: its body's centre of mass, m.
    pub pivot: DVec3,
    /// How much faster than its twist says the end of the tick may find its surface, m/s: joints and muscles bend its way.
    pub bend: f64,
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
    /// What it bears, N: the least normal force of the last two ticks that were solved. A blow is no load, nor is the force
    /// of a depth that the solver left.
    pub load: f64,
    /// How much stiffer than the settings' the last tick found that it must be for its load; 0 where nothing is known.
    pub stiffening: f64,
    /// Turn of `b` against `a` that rolling and spinning resistance remember, rad.
    pub turn: DVec3,
    /// That the two gave each other in the last tick.
    pub blow: Blow,
    /// Where the solver put its bodies, as its linear model has it, m.
    pub believed_gap: f64,
    /// Logic lets the pair pass in this tick.
    pub is_cancelled: bool,
    /// The last tick left it as it was, and its bodies, too.
    pub is_settled: bool,
    feature: u32,
}

impl ContactPoint {
    /// Whether two points are of the same pair.
    pub fn same_pair(&self, other: &Self) -> bool {
        self.a == other.a && self.b == other.b
    }

    /// A point of a pair that has no history.
    fn fresh((a, b): Key, normal: DVec3, point: &ManifoldPoint, surface: Surface) -> Self {
        let ManifoldPoint { position, gap, feature } = *point;
        let (anchor, turn, blow, believed_gap) = (DVec3::ZERO, DVec3::ZERO, Blow::default(), gap);
        let (normal_force, load, stiffening, is_cancelled, is_settled) = (0.0, 0.0, 0.0, false, false);
        Self {
            a,
            b,
            position,
            normal,
            gap,
            surface,
            anchor,
            normal_force,
            load,
            stiffening,
            turn,
            blow,
            believed_gap,
            is_cancelled,
            is_settled,
            feature,
        }
    }

    /// What the integrator makes it remember, but for turns, and for the stiffening, which is the pair's.
    pub fn memory(&self) -> (DVec3, f64, f64, Blow) {
        (self.anchor, self.normal_force, self.load, self.blow)
    }

    /// Takes over what `old`, the same point in the last tick, remembers; stiffening is the pair's.
    fn inherit(&mut self, old: &Self) {
        self.anchor = old.anchor - self.normal * self.normal.dot(old.anchor);
        (self.normal_force, self.load, self.turn, self.blow) = (old.normal_force, old.load, old.turn, old.blow);
    }

    /// A new point without a history between bodies that do not matter.
    #[cfg(test)]
    pub fn at(position: DVec3, normal: DVec3, gap: f64, friction: f64) -> Self {
        let point = ManifoldPoint { position, gap, feature: 0 };
        Self::fresh((0, Partner::Static(0)), normal, &point, Material::from(friction).surface)
    }
}

/// Slabs of the engine's k-DOPs: k = 26. What its bounds cost more than those of 14 or 18 they save many times over in
/// pairs that the fine phase need not look at (`pita-bench broadphase`).
const SLABS: usize = 13;

/// What bounds a hull, or a piece of static geometry.
type Bound = Kdop<SLABS>;

struct Static {
    serial: u32,
    collider: Collider,
    pose: Pose,
    /// In the static tree; none for a half-space, which has no bounds.
    piece: Option<u32>,
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
    trees: Trees,
    /// Half-spaces, in order of serial.
    unbounded: Vec<StaticId>,
    narrow_phase: NarrowPhase,
    /// Contacts of this tick, in order of pair.
    pub contacts: Vec<ContactPoint>,
    /// Bodies that something touched in their sleep.
    pub touched: Vec<BodyId>,
    /// Points that the second look of this tick added.
    pub second: Vec<SecondPoint>,
    /// How wide those of earlier looks believe to be, m, in order of pair.
    beliefs: Vec<(Key, f64)>,
    /// Pairs that the second look looks at.
    glances: Glances,
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
        let serial = self.static_serials;
        self.static_serials += 1;
        let bounds = match collider.shape() {
            Shape::HalfSpace { .. } => None,
            shape => Some(hull::bounds(shape, pose)),
        };
        let id = self.statics.insert(Static { serial, collider, pose, piece: None });
        match bounds {
            Some(bounds) => self.statics[id].piece = Some(self.trees.add_fixed(id, serial, bounds)),
            None => self.unbounded.push(id),
        }
        self.static_ids.insert(serial, id);
        Ok(id)
    }

    /// Removes a piece, and with it its contacts and collisions of this tick. Answers whether there was one.
    pub fn remove_static(&mut self, id: StaticId) -> bool {
        let Some(piece) = self.statics.remove(id) else { return false };
        self.static_ids.remove(&piece.serial);
        match piece.piece {
            Some(key) => self.trees.remove_fixed(key),
            None => self.unbounded.retain(|&other| other != id),
        }
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
            let (anchor, normal_force, load, blow) = (DVec3::ZERO, 0.0, 0.0, Blow::default());
            let is_settled = false;
            *contact = ContactPoint {
                is_cancelled: true,
                is_settled,
                anchor,
                normal_force,
                load,
                turn: anchor,
                blow,
                ..*contact
            };
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

    /// Takes a collider of the body with serial `owner` in. Answers what detection calls it.
    pub fn add(&mut self, placed: Placed, owner: u32) -> u32 {
        self.trees.add(placed, owner)
    }

    /// Forgets a collider and its contacts.
    pub fn remove(&mut self, placed: &Placed) {
        self.trees.remove(placed.hull);
        self.forget_contacts(placed.serial);
    }

    /// Forgets a body's exclusions.
    pub fn forget_exclusions(&mut self, serial: u32) {
        self.excluded.retain(|&(a, b)| a != serial && b != serial);
    }

    /// Forgets a body's contacts.
    pub fn forget_contacts(&mut self, serial: u32) {
        self.contacts.retain(|c| c.a != serial && c.b != Partner::Body(serial));
        self.narrow_phase.forget(|(a, b)| a == serial || b == Partner::Body(serial));
    }

    /// Starts a tick.
    pub fn begin(&mut self) {
        self.trees.begin();
        self.narrow_phase.begin();
    }

    /// Finds the contacts of everything that is awake, and when called again, of what woke since. Answers whether anything
    /// sleeping was touched: [`Detector::touched`] has it.
    pub fn meet(&mut self, bodies: Bodies, settings: &Settings, threads: &Threads) -> bool {
        self.trees.update(bodies, settings);
        self.ask_about_bodies(bodies, settings);
        self.ask_about_statics(bodies, settings);
        let Self { trees, statics, materials, narrow_phase, touched, .. } = self;
        touched.extend(narrow_phase.answer(threads, |question, fine_phase| {
            let hull = trees.hull(question.hull);
            let Some(a) = hull.moving(bodies) else { return };
            let surface = |collider: &Collider| materials.contact(a.collider.material(), collider.material());
            match question.other {
                Other::Hull(other, sleeper) => {
                    let other = trees.hull(other);
                    let Some(b) = other.moving(bodies) else { return };
                    let (pair, surface) = (&mut question.pair, surface(b.collider));
                    let keeps_still = hull.keeps_still && other.keeps_still && sleeper.is_none();
                    if !(keeps_still && pair.stays(surface)) {
                        question.wakes = fine_phase.bodies(pair, [&a, &b], surface, settings);
                    }
                }
                Other::Piece(id) => {
                    let Static { serial, ref collider, pose, .. } = statics[id];
                    let (pair, surface) = (&mut question.pair, surface(collider));
                    if !(hull.keeps_still && pair.stays(surface)) {
                        fine_phase.with_static(pair, &a, (serial, collider, pose), surface, settings);
                    }
                }
            }
        }));
        !self.touched.is_empty()
    }

    /// Ends a tick: all contact points, and what there is to tell of pairs.
    pub fn finish(&mut self, settings: &Settings) {
        self.contacts.clear();
        self.touches.clear();
        self.detections += 1;
        self.narrow_phase.finish(&mut self.contacts, &mut self.touches, settings);
    }

    /// Pairs of the tick that the fine phase looked at.
    pub fn pairs(&self) -> usize {
        self.narrow_phase.len()
    }

    /// Colliders of bodies that fall asleep together, in order of serial. What is known of their contacts is kept.
    pub fn sleep(&mut self, colliders: &[Placed], bodies: Bodies, settings: &Settings) {
        colliders.iter().for_each(|placed| self.trees.sleep(placed.hull, bodies, settings));
        self.trees.sort_awake();
        let sleeps = |serial: u32| colliders.binary_search_by_key(&serial, |placed| placed.serial).is_ok();
        self.narrow_phase.sleep(sleeps);
    }

    /// Colliders of bodies that wake.
    pub fn wake(&mut self, colliders: &[Placed]) {
        colliders.iter().for_each(|placed| self.trees.wake(placed.hull));
        self.trees.sort_awake();
        self.narrow_phase.wake(colliders.iter().map(|placed| placed.serial));
    }

    /// Bodies that sleep on, or in, a piece of static geometry; `None` where nobody knows: it has no bounds.
    pub fn sleepers_around(&self, id: StaticId) -> Option<Vec<BodyId>> {
        self.statics.get(id).map_or(Some(Vec::new()), |piece| piece.piece.map(|key| self.trees.sleepers_around(key)))
    }

    /// Takes up all pairs of bodies that may touch.
    fn ask_about_bodies(&mut self, bodies: Bodies, settings: &Settings) {
        let Self { trees, excluded, narrow_phase, .. } = self;
        for (pair, sleeper) in trees.pairs() {
            let [a, b] = pair.map(|key| trees.hull(key));
            let (Some(of_a), Some(of_b)) = (a.collider(bodies), b.collider(bodies)) else { continue };
            if of_a.meets(of_b) && !is_excluded(excluded, a.owner, b.owner) {
                let key = (a.placed.serial, Partner::Body(b.placed.serial));
                let is_sensor = of_a.is_sensor() || of_b.is_sensor();
                narrow_phase.ask(key, (pair[0], Other::Hull(pair[1], sleeper)), is_sensor, settings);
            }
        }
    }

    /// Takes up all bodies with the static geometry that they may touch.
    fn ask_about_statics(&mut self, bodies: Bodies, settings: &Settings) {
        let Self { trees, statics, unbounded, narrow_phase, .. } = self;
        let mut ask = |hull: u32, id: StaticId| {
            let (body, piece) = (trees.hull(hull), &statics[id]);
            if let Some(collider) = body.collider(bodies).filter(|collider| collider.meets(&piece.collider)) {
                let key = (body.placed.serial, Partner::Static(piece.serial));
                let is_sensor = collider.is_sensor() || piece.collider.is_sensor();
                narrow_phase.ask(key, (hull, Other::Piece(id)), is_sensor, settings);
            }
        };
        trees.pairs_with_fixed().for_each(|(hull, id)| ask(hull, id));
        if unbounded.is_empty() {
            return;
        }
        for hull in trees.arrivals() {
            let Some(body) = trees.hull(hull).moving(bodies) else { continue };
            for &id in unbounded.iter() {
                if may_reach(&body, (&statics[id].collider, statics[id].pose), settings) {
                    ask(hull, id);
                }
            }
        }
    }

    /// Remembers what the friction springs and normal forces of `contacts` became.
    pub fn remember(&mut self) {
        self.narrow_phase.remember(&self.contacts);
    }
}

/// Whether two bodies never collide, by serial.
fn is_excluded(excluded: &[(u32, u32)], a: u32, b: u32) -> bool {
    excluded.binary_search(&(a.min(b), a.max(b))).is_ok()
}
