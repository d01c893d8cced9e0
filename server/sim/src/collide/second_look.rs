//! The second look: contacts are found at Q0, and what the tick itself brings about cannot be seen from there.
//!
//! A box that falls a quarter of a metre and turns hits with corners that were not near anything when the tick began; one
//! that follows another down finds it stopped. So pairs of which one moves far are looked at again where the solver wants
//! to put them. Where they are deeper in one another than their contact points believe, points of that place join those
//! of the first look, and the islands that they are in are solved on. They join, they do not replace: without the old
//! points the next solution pushes the pair back through. It is still one implicit step.

use glam::DVec3;

use super::fine_phase::FinePhase;
use super::hull::{Bodies, Hull, Stride};
use super::material::MaterialTable;
use super::narrow_phase::{Key, Other};
use super::shape::{Collider, Shape};
use super::{ContactPoint, Detector, EmbeddedHull, Foot, Partner, Static, is_excluded};
use crate::dof::{FigureBody, Pose, Twist};
use crate::settings::Settings;
use crate::threads::Threads;

/// A pair is looked at again where one side moves by more than this share of its bounding radius.
const MOVED: f64 = 0.05;

/// ... and gets more points where it is so much deeper than its points believe, m.
const DEEPER: f64 = 3e-3;

/// A contact point that was found at the candidate.
#[derive(Clone, Debug)]
pub(crate) struct SecondPoint {
    pub contact: ContactPoint,
    /// Between which vertices it is, where they are embedded.
    pub feet: [Option<Foot>; 2],
    /// From the origins of both sides to the point, at the candidate, m.
    pub arms: [DVec3; 2],
    /// What the gap is at the start of the tick if it is linear about the candidate, m.
    pub start_gap: f64,
    /// How deep the pair was already when the tick began, m.
    pub start_depth: f64,
}

/// Where the solver wants to put a body.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Course {
    /// A particle or rigid body.
    Body(Pose, Twist),
    /// A figure: where its positions and rates begin among those of all.
    Figure([usize; 2]),
}

/// Where the solver wants to put the bodies of a tick.
pub(crate) struct Candidates<'a> {
    pub bodies: Bodies<'a>,
    /// By the bodies' indices in the tick.
    pub courses: &'a [Course],
    /// Positions and rates of figures, one after the other.
    pub rates: [&'a [f64]; 2],
}

/// One of a pair.
struct Side<'a> {
    serial: u32,
    collider: &'a Collider,
    pose: Pose,
    carrier: Carrier<'a>,
}

/// What moves the points of a side.
enum Carrier<'a> {
    /// A frame, whose origin the tick brings here, m, and how it moves.
    Frame(DVec3, Twist),
    /// Vertices of a figure: its positions before and after, and its rates.
    Vertices { figure: &'a FigureBody, hull: &'a EmbeddedHull, q: [&'a [f64]; 2], v: &'a [f64] },
}

/// What moves a point.
struct Hold {
    /// Where the tick brings what it is fixed to, m.
    origin: DVec3,
    twist: Twist,
    foot: Option<Foot>,
}

impl<'a> Candidates<'a> {
    /// Positions and rates that the solver wants a figure to have.
    fn of_figure(&self, figure: &FigureBody, [q, v]: [usize; 2]) -> [&'a [f64]; 2] {
        let [positions, rates] = self.rates;
        let sizes = figure.dof.blocks().iter();
        let [many, few] =
            sizes.fold([0, 0], |[p, r], size| [p + usize::from(size.positions), r + usize::from(size.rates)]);
        [&positions[q..q + many], &rates[v..v + few]]
    }

    /// `None` for what takes no part, and where the solver lost its way.
    fn side(&'a self, hull: &'a Hull, dt: f64) -> Option<Side<'a>> {
        let placed = &hull.placed;
        let body = self.bodies.bodies.get(placed.body)?;
        let serial = placed.serial;
        let collider = self.bodies.collider(placed)?;
        let (collider, pose, carrier) = match (*self.courses.get(body.index as usize)?, &body.figure) {
            (Course::Body(pose, twist), _) => {
                (collider, placed.carried(pose, twist).0, Carrier::Frame(pose.position, twist))
            }
            (Course::Figure(start), Some(figure)) => {
                let ([q, v], before) = (self.of_figure(figure, start), self.bodies.state.q(body.slice));
                if let Some(hull_of_figure) = figure.hull(placed.index) {
                    let (collider, pose) = hull.ahead()?;
                    (collider, pose, Carrier::Vertices { figure, hull: hull_of_figure, q: [before, q], v })
                } else {
                    // Contacts keep the derivatives of the start.
                    let start = figure.dof.frame(placed.at, before, v);
                    let (origin, twist) = (DVec3::from(start.position), start.twist());
                    let pose = figure.dof.frame(placed.at, q, v).pose();
                    (collider, pose, Carrier::Frame(origin + dt * twist.linear, twist))
                }
            }
            (Course::Figure(_), None) => return None,
        };
        let is_sane = pose.position.is_finite() && pose.rotation.is_finite();
        is_sane.then_some(Side { serial, collider, pose, carrier })
    }

    /// How the tick moves a hull.
    fn stride(&self, hull: &mut Hull, dt: f64) -> Stride {
        self.strides(hull, dt).unwrap_or_default()
    }

    fn strides(&self, hull: &mut Hull, dt: f64) -> Option<Stride> {
        let placed = hull.placed;
        let body = self.bodies.bodies.get(placed.body)?;
        let collider = self.bodies.collider(&placed)?;
        let mut radius = collider.bounding_radius();
        let (rotation, twist, spread) = match (*self.courses.get(body.index as usize)?, &body.figure) {
            (Course::Figure(start), Some(figure)) => {
                let state = self.of_figure(figure, start);
                if let Some((twist, spread)) = hull.deform_ahead(figure, state) {
                    radius = hull.ahead()?.0.bounding_radius();
                    (None, twist, spread)
                } else {
                    let frame = figure.dof.frame(placed.at, state[0], state[1]);
                    (Some(frame.pose().rotation), frame.twist(), 0.0)
                }
            }
            (Course::Body(pose, twist), None) => {
                let (pose, twist) = placed.carried(pose, twist);
                (Some(pose.rotation), twist, 0.0)
            }
            _ => return None,
        };
        // A surface of revolution stays where it is however fast it spins about its axis.
        let across = match (collider.shape(), rotation.zip(collider.shape().revolution_axis())) {
            (Shape::Ball { .. }, _) => DVec3::ZERO,
            (_, Some((rotation, axis))) => twist.angular.reject_from_normalized(rotation * axis),
            _ => twist.angular,
        };
        let (turn, far) = (dt * across.length() * radius, MOVED * radius);
        let is_far = turn + dt * (twist.linear.length() + spread) > far;
        Some(Stride { is_far, turns_far: turn + dt * spread > far, velocity: twist.linear })
    }
}

impl Side<'_> {
    /// What moves a point of the surface at `position`, on the side towards `outward`, where the gap is so wide.
    fn hold(&self, position: DVec3, outward: DVec3, gap: f64, dt: f64) -> Hold {
        let (figure, hull, [before, after], v) = match self.carrier {
            Carrier::Frame(origin, twist) => return Hold { origin, twist, foot: None },
            Carrier::Vertices { figure, hull, q, v } => (figure, hull, q, v),
        };
        let core = position - outward * (gap / 2.0 + hull.radius());
        let foot = hull.foot(core, outward, |at| figure.dof.point(at, after, v)[0]);
        let (mut origin, mut twist) = (DVec3::ZERO, Twist::REST);
        for &(at, weight) in foot.iter().filter(|(_, weight)| *weight > 0.0) {
            // Contacts keep the derivatives of the start.
            let frame = figure.dof.frame(at, before, v);
            let moves = frame.twist();
            origin += weight * (DVec3::from(frame.position) + dt * moves.linear);
            twist =
                Twist { linear: twist.linear + weight * moves.linear, angular: twist.angular + weight * moves.angular };
        }
        Hold { origin, twist, foot: Some(foot) }
    }
}

impl Detector {
    /// Finds the pairs of the tick of which `candidates` move one far. Answers whether there is one to look at again.
    pub fn pick_pairs(&mut self, candidates: &Candidates, settings: &Settings) -> bool {
        self.glances.clear();
        if self.trees.set_strides(|hull| candidates.stride(hull, settings.dt)) {
            self.pick_bodies();
            self.pick_statics(settings);
        }
        self.glances.len() > 0
    }

    /// Looks again at the pairs that [`Detector::pick_pairs`] found, where `candidates` has them. Answers whether points
    /// were added to [`Detector::second`], where those of earlier looks stay.
    pub fn look_again(&mut self, candidates: &Candidates, settings: &Settings, threads: &Threads) -> bool {
        let Self { trees, materials, statics, contacts, second, narrow_phase, beliefs, glances, .. } = self;
        beliefs.clear();
        beliefs.extend(second.iter().map(|SecondPoint { contact, .. }| ((contact.a, contact.b), contact.believed_gap)));
        beliefs.sort_unstable_by_key(|&(key, _)| key);
        let look = Look { contacts, beliefs, materials, settings };
        let is_worth_it = glances.len() >= PARALLEL_GLANCES_MIN;
        threads.each(glances.used_mut(), narrow_phase.workspaces(), is_worth_it, |_, glance, fine_phase| {
            let Some(a) = candidates.side(trees.hull(glance.hull), settings.dt) else { return };
            match glance.other {
                Other::Hull(hull, _) => {
                    let Some(b) = candidates.side(trees.hull(hull), settings.dt) else { return };
                    let partner = Partner::Body(b.serial);
                    look.at_pair([a, b], partner, fine_phase, &mut glance.found);
                }
                Other::Piece(id) => {
                    let Static { serial, ref collider, pose, .. } = statics[id];
                    let carrier = Carrier::Frame(pose.position, Twist::REST);
                    let b = Side { serial, collider, pose, carrier };
                    look.at_pair([a, b], Partner::Static(serial), fine_phase, &mut glance.found);
                }
            }
        });
        let known = second.len();
        glances.used_mut().iter_mut().for_each(|glance| second.append(&mut glance.found));
        second.len() > known
    }

    /// Picks the pairs of bodies of which one moves far.
    fn pick_bodies(&mut self) {
        let Self { trees, excluded, glances, .. } = self;
        for pair in trees.pairs_awake() {
            let [a, b] = pair.map(|key| trees.hull(key));
            if (a.stride.is_far || b.stride.is_far) && !is_excluded(excluded, a.owner, b.owner) {
                glances.take(pair[0], Other::Hull(pair[1], None));
            }
        }
    }

    /// Picks the bodies that move far past static geometry.
    fn pick_statics(&mut self, settings: &Settings) {
        let Self { trees, statics, unbounded, glances, .. } = self;
        for (hull, id) in trees.pairs_awake_with_fixed() {
            if trees.hull(hull).stride.is_far {
                glances.take(hull, Other::Piece(id));
            }
        }
        for key in trees.awake() {
            let hull = trees.hull(key);
            for &id in unbounded.iter().filter(|_| hull.stride.is_far) {
                let Static { collider, pose, .. } = &statics[id];
                let Shape::HalfSpace { normal } = collider.shape() else { continue };
                // Gaps to a half-space are linear in all motion but turns; those that were wide are not known.
                if hull.stride.turns_far || hull.dips(pose.rotation * *normal, settings) {
                    glances.take(key, Other::Piece(id));
                }
            }
        }
    }
}

/// Fewer pairs than this are looked at by the calling thread: waking another one costs more.
const PARALLEL_GLANCES_MIN: usize = 32;

/// A pair that is looked at again.
struct Glance {
    /// Hull of the first body.
    hull: u32,
    other: Other,
    found: Vec<SecondPoint>,
}

/// The pairs of a look.
#[derive(Default)]
pub(super) struct Glances {
    list: Vec<Glance>,
    /// Those of this look; those after them keep their memory for later.
    used: usize,
}

impl Glances {
    fn clear(&mut self) {
        self.used = 0;
    }

    fn len(&self) -> usize {
        self.used
    }

    fn used_mut(&mut self) -> &mut [Glance] {
        &mut self.list[..self.used]
    }

    fn take(&mut self, hull: u32, other: Other) {
        match self.list.get_mut(self.used) {
            Some(glance) => (glance.hull, glance.other) = (hull, other),
            None => self.list.push(Glance { hull, other, found: Vec::new() }),
        }
        self.used += 1;
    }
}

/// What a look reads.
struct Look<'a> {
    contacts: &'a [ContactPoint],
    /// How wide the points of earlier looks believe to be, m, in order of pair.
    beliefs: &'a [(Key, f64)],
    materials: &'a MaterialTable,
    settings: &'a Settings,
}

impl Look<'_> {
    /// Adds the points of a pair, if it is deeper than its points believe.
    fn at_pair(
        &self,
        [a, b]: [Side; 2],
        partner: Partner,
        fine_phase: &mut FinePhase,
        points_found: &mut Vec<SecondPoint>,
    ) {
        let pushes = a.collider.meets(b.collider) && !a.collider.is_sensor() && !b.collider.is_sensor();
        let key = (a.serial, partner);
        let start = self.contacts.partition_point(|contact| (contact.a, contact.b) < key);
        let points = || self.contacts[start..].iter().take_while(|contact| (contact.a, contact.b) == key);
        if !pushes || points().any(|contact| contact.is_cancelled) {
            return;
        }
        let added = &self.beliefs[self.beliefs.partition_point(|&(other, _)| other < key)..];
        let added = added.iter().take_while(|(other, _)| *other == key).map(|&(_, gap)| gap);
        let believed = points().map(|contact| contact.believed_gap).chain(added).fold(0.0, f64::min);
        let found = fine_phase.overlap((a.collider, a.pose), (b.collider, b.pose), self.settings.contact.margin);
        if found.iter().all(|(_, point)| point.gap >= believed - DEEPER) {
            return;
        }
        let dt = self.settings.dt;
        let start_depth = -points().map(|contact| contact.gap).fold(0.0, f64::min);
        let surface = self.materials.contact(a.collider.material(), b.collider.material());
        let partner_moves = matches!(partner, Partner::Body(_));
        for (normal, point) in found {
            let hold = |side: &Side, outward: DVec3| side.hold(point.position, outward, point.gap, dt);
            let [of_a, of_b] = [hold(&a, *normal), hold(&b, -normal)];
            // Momentum turns about where the bodies were at the start of the tick: a force on both at one point conserves
            // it only if the arms differ as they did then. What they have moved since is shared.
            let moved = dt * (of_b.twist.linear - of_a.twist.linear);
            let moved = if partner_moves { moved } else { DVec3::ZERO };
            let arms = [of_a.origin + moved / 2.0, of_b.origin - moved / 2.0].map(|origin| point.position - origin);
            let moved = dt * (of_b.twist.at(arms[1]) - of_a.twist.at(arms[0]));
            let (contact, start_gap) =
                (ContactPoint::fresh(key, *normal, point, surface), point.gap - moved.dot(*normal));
            points_found.push(SecondPoint { contact, feet: [of_a.foot, of_b.foot], arms, start_gap, start_depth });
        }
    }
}
