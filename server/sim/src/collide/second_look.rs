//! The second look: contacts are found at Q0, and what the tick itself brings about cannot be seen from there.
//!
//! A box that falls a quarter of a metre and turns hits with corners that were not near anything when the tick began; one
//! that follows another down finds it stopped. So pairs of which one moves far are looked at again where the solver wants
//! to put them. Where they are deeper in one another than their contact points believe, points of that place join those
//! of the first look, and the islands that they are in are solved on. They join, they do not replace: without the old
//! points the next solution pushes the pair back through. It is still one implicit step.

use glam::DVec3;

use super::hull::{Bodies, Hull, Stride};
use super::material::MaterialTable;
use super::narrow_phase::NarrowPhase;
use super::shape::{Collider, Shape};
use super::{ContactPoint, Detector, Partner};
use crate::dof::{Pose, Twist};
use crate::settings::Settings;

/// A pair is looked at again where one side moves by more than this share of its bounding radius.
const MOVED: f64 = 0.05;

/// ... and gets more points where it is so much deeper than its points believe, m.
const DEEPER: f64 = 3e-3;

/// A contact point that was found at the candidate.
#[derive(Clone, Debug)]
pub(crate) struct SecondPoint {
    pub contact: ContactPoint,
    /// From the origins of both sides to the point, at the candidate, m.
    pub arms: [DVec3; 2],
    /// What the gap is at the start of the tick if it is linear about the candidate, m.
    pub start_gap: f64,
    /// How deep the pair was already when the tick began, m.
    pub start_depth: f64,
}

/// Where the solver wants to put the bodies of a tick.
pub(crate) struct Candidates<'a> {
    pub bodies: Bodies<'a>,
    /// By the bodies' indices in the tick; none for figures, whose points move along arcs that a second point does not
    /// know.
    pub motions: &'a [Option<(Pose, Twist)>],
}

/// One of a pair.
#[derive(Clone, Copy)]
struct Side<'a> {
    serial: u32,
    owner: u32,
    collider: &'a Collider,
    pose: Pose,
    twist: Twist,
    /// Centre of mass of its body, m, and how that moves.
    origin: DVec3,
    carrier: Twist,
}

impl<'a> Candidates<'a> {
    fn side(&self, hull: &Hull) -> Option<Side<'a>> {
        let index = self.bodies.bodies.get(hull.placed.body)?.index;
        let (body, carrier) = (*self.motions.get(index as usize)?)?;
        let (pose, twist) = hull.placed.carried(body, carrier);
        let (serial, owner, collider) = (hull.placed.serial, hull.owner, self.bodies.collider(&hull.placed)?);
        Some(Side { serial, owner, collider, pose, twist, origin: body.position, carrier })
    }

    fn stride(&self, hull: &Hull, dt: f64) -> Stride {
        let Some(Side { collider, pose, twist, .. }) = self.side(hull) else { return Stride::default() };
        // A surface of revolution stays where it is however fast it spins about its axis.
        let across = match (collider.shape(), collider.shape().revolution_axis()) {
            (Shape::Ball { .. }, _) => DVec3::ZERO,
            (_, Some(axis)) => twist.angular.reject_from_normalized(pose.rotation * axis),
            _ => twist.angular,
        };
        let radius = collider.bounding_radius();
        let (turn, far) = (dt * across.length() * radius, MOVED * radius);
        Stride { is_far: turn + dt * twist.linear.length() > far, turns_far: turn > far }
    }
}

impl Detector {
    /// Finds out what `candidates` move far. Answers whether there is something to look at again.
    pub fn find_strides(&mut self, candidates: &Candidates, settings: &Settings) -> bool {
        self.trees.set_strides(|hull| candidates.stride(hull, settings.dt))
    }

    /// Looks again at the pairs of the tick that move far, where `candidates` has them. Answers whether points were added
    /// to [`Detector::second`], where those of earlier looks stay.
    pub fn look_again(&mut self, candidates: &Candidates, settings: &Settings) -> bool {
        let Self { trees, excluded, materials, statics, unbounded, contacts, second, narrow_phase, .. } = self;
        let known = second.len();
        let mut look = Look { contacts, second, narrow_phase, dt: settings.dt };
        let excludes = |a: u32, b: u32| excluded.binary_search(&(a.min(b), a.max(b))).is_ok();
        for pair in trees.pairs_awake().filter(|pair| pair.iter().any(|hull| hull.stride.is_far)) {
            let [Some(a), Some(b)] = pair.map(|hull| candidates.side(hull)) else { continue };
            if !excludes(a.owner, b.owner) {
                look.at_pair(a, b, Partner::Body(b.serial), materials);
            }
        }
        let unbounded = trees.awake().flat_map(|hull| unbounded.iter().map(move |&id| (hull, id)));
        for (hull, id) in trees.pairs_awake_with_fixed().chain(unbounded) {
            let piece = &statics[id];
            // Gaps to a half-space are linear in all motion but turns.
            let is_flat = matches!(piece.collider.shape(), Shape::HalfSpace { .. });
            if !(if is_flat { hull.stride.turns_far } else { hull.stride.is_far }) {
                continue;
            }
            let Some(a) = candidates.side(hull) else { continue };
            let (serial, collider, pose) = (piece.serial, &piece.collider, piece.pose);
            let (origin, twist) = (pose.position, Twist::REST);
            let b = Side { serial, owner: serial, collider, pose, twist, origin, carrier: twist };
            look.at_pair(a, b, Partner::Static(serial), materials);
        }
        second.len() > known
    }
}

/// What a look reads and writes.
struct Look<'a> {
    contacts: &'a [ContactPoint],
    second: &'a mut Vec<SecondPoint>,
    narrow_phase: &'a mut NarrowPhase,
    dt: f64,
}

impl Look<'_> {
    /// Adds the points of a pair, if it is deeper than its points believe.
    fn at_pair(&mut self, a: Side, b: Side, partner: Partner, materials: &MaterialTable) {
        let pushes = a.collider.meets(b.collider) && !a.collider.is_sensor() && !b.collider.is_sensor();
        let key = (a.serial, partner);
        let start = self.contacts.partition_point(|contact| (contact.a, contact.b) < key);
        let points = || self.contacts[start..].iter().take_while(|contact| (contact.a, contact.b) == key);
        if !pushes || points().any(|contact| contact.is_cancelled) {
            return;
        }
        let added = self.second.iter().map(|point| &point.contact).filter(|contact| (contact.a, contact.b) == key);
        let believed = points().chain(added).map(|contact| contact.believed_gap).fold(0.0, f64::min);
        let (normal, found) = self.narrow_phase.look((a.collider, a.pose), (b.collider, b.pose), 0.0);
        if found.iter().all(|point| point.gap >= believed - DEEPER) {
            return;
        }
        let start_depth = -points().map(|contact| contact.gap).fold(0.0, f64::min);
        let surface = materials.contact(a.collider.material(), b.collider.material());
        let partner_moves = matches!(partner, Partner::Body(_));
        for point in found {
            // Momentum turns about where the bodies were at the start of the tick: a force on both at one point conserves
            // it only if the arms differ as they did then. What they have moved since is shared.
            let moved = if partner_moves { self.dt * (b.carrier.linear - a.carrier.linear) } else { DVec3::ZERO };
            let arms = [a.origin + moved / 2.0, b.origin - moved / 2.0];
            let arms = arms.map(|origin| point.position - origin);
            let moved = self.dt * (b.carrier.at(arms[1]) - a.carrier.at(arms[0]));
            let contact = ContactPoint::fresh(key, normal, point, surface);
            self.second.push(SecondPoint { contact, arms, start_gap: point.gap - moved.dot(normal), start_depth });
        }
    }
}
