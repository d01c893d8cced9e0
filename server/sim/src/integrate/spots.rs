//! Where potentials act: on which bodies of the tick, and so in which islands.
//!
//! Owns what is done of gathering before islands are known, on one thread: the bodies that take part, the spots of contacts
//! and potentials, the islands that these couple, and the list of each island. What islands make of their lists is `gather`.

use glam::DVec3;

use super::step::{Integrator, Scene, Solve};
use super::wheels;
use crate::collide::{ContactPoint, Foot, Partner, SecondPoint};
use crate::dof::{ABSENT, BodyId, PartPoint, Placed};
use crate::island::Islands;
use crate::potential::{Anchor, PotentialId};

/// A body that takes part in this tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Active {
    pub id: BodyId,
    /// Its first block in its island; [`ABSENT`] where nothing acts on it.
    pub start: u32,
    /// Its index among the figures of its island; [`ABSENT`] for particles and rigid bodies.
    pub figure: u32,
}

/// Where a potential acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Spot {
    World,
    /// The body with this index among the active ones.
    Body(u32, PartPoint),
    /// Between vertices of a hull that is embedded in the body.
    Vertices(u32, Foot),
}

/// Contact points that share the frames on which they act.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touching {
    /// Index of the first among the world's contacts, and of the one after the last.
    pub points: (u32, u32),
    pub spots: [Spot; 2],
}

/// What acts in a tick, and where.
#[derive(Default)]
pub(super) struct Acting {
    pub touching: Vec<Touching>,
    /// Potentials, with the bodies that they act on.
    potentials: Vec<(PotentialId, [Option<u32>; 2])>,
}

impl Acting {
    /// The bodies that other potentials than contacts act on.
    pub fn driven(&self) -> impl Iterator<Item = u32> {
        self.potentials.iter().flat_map(|(_, bodies)| bodies.iter().flatten().copied())
    }
}

impl Spot {
    /// The body that it is on.
    pub fn body(self) -> Option<u32> {
        match self {
            Self::World => None,
            Self::Body(index, _) | Self::Vertices(index, _) => Some(index),
        }
    }
}

impl Integrator {
    /// Finds out who takes part.
    pub(super) fn find_bodies(&mut self, scene: &mut Scene) {
        self.active.clear();
        wheels::find(scene);
        for &id in scene.order {
            let body = &mut scene.bodies[id];
            body.index = if body.quarantined { ABSENT } else { self.active.len() as u32 };
            if body.quarantined {
                body.forget_forces();
            } else {
                self.active.push(Active { id, start: ABSENT, figure: ABSENT });
            }
        }
    }

    /// Finds out what acts, and where; what acts on no body that takes part is left out.
    pub(super) fn find_acting(&mut self, scene: &Scene) {
        let Acting { touching, potentials } = &mut self.acting;
        touching.clear();
        let mut end = 0;
        for points in scene.contacts.chunk_by(ContactPoint::same_pair) {
            let (start, spots) = (end, contact_spots(scene, &points[0]));
            end += points.len() as u32;
            // Points of a pair share the frames of its colliders; vertices beneath a point are its own.
            match spots {
                Some(spots) if spots.iter().any(|spot| matches!(spot, Spot::Vertices(..))) => {
                    let spots = points.iter().map(|point| contact_spots(scene, point));
                    let of_point = |(i, spots)| Some(Touching { points: (i, i + 1), spots: spots? });
                    touching.extend((start..).zip(spots).filter_map(of_point));
                }
                spots => touching.extend(spots.map(|spots| Touching { points: (start, end), spots })),
            }
        }
        potentials.clear();
        potentials.extend(scene.potentials.awake().filter_map(|(id, [a, b])| {
            let bodies = [spot(scene, a)?.body(), spot(scene, b)?.body()];
            bodies.iter().any(Option::is_some).then_some((id, bodies))
        }));
    }

    /// Finds out what is coupled.
    pub(super) fn find_islands(&mut self, scene: &Scene) {
        self.islands.begin(self.active.len());
        let figures = (0..).zip(&self.active).filter(|(_, active)| scene.bodies[active.id].figure.is_some());
        figures.for_each(|(index, _)| self.islands.touch(index));
        let contacts = self.acting.touching.iter().map(|touching| touching.spots.map(Spot::body));
        let second = scene.second.iter().filter_map(|point| Some(second_spots(scene, point)?.map(Spot::body)));
        let potentials = self.acting.potentials.iter().map(|&(_, bodies)| bodies);
        for bodies in contacts.chain(second).chain(potentials) {
            match bodies {
                // A loop within a figure couples what is coupled anyway.
                [Some(a), Some(b)] if a == b => self.islands.touch(a),
                [Some(a), Some(b)] => self.islands.couple(a, b),
                [Some(a), None] | [None, Some(a)] => self.islands.touch(a),
                [None, None] => {}
            }
        }
        self.islands.finish();
        self.solves.resize_with(self.islands.len().max(self.solves.len()), Solve::default);
    }

    /// Gives the bodies of an island that starts anew their places in it.
    pub(super) fn seat(&mut self, island: usize, scene: &Scene) {
        let (mut start, mut figures) = (0, 0);
        for &member in self.islands.members(island) {
            let active = &mut self.active[member as usize];
            (active.start, active.figure) = (start, ABSENT);
            match &scene.bodies[active.id].figure {
                Some(figure) => {
                    active.figure = figures;
                    (start, figures) = (start + figure.ranks.len() as u32, figures + 1);
                }
                None => start += 1,
            }
        }
        self.solves[island].clear(start as usize);
    }

    /// Gives every island that starts anew the list of what acts in it.
    pub(super) fn hand_out(&mut self, scene: &Scene) {
        let Self { acting, islands, solves, .. } = self;
        let island_of = |bodies: [Option<u32>; 2]| {
            let [a, b] = bodies.map(|body| body.map_or(Islands::FREE, |index| islands.island_of(index)));
            a.min(b) as usize
        };
        let anew = |solve: &&mut Solve| solve.is_pending;
        for (index, touching) in (0..).zip(&acting.touching) {
            if let Some(solve) = solves.get_mut(island_of(touching.spots.map(Spot::body))).filter(anew) {
                solve.touching.push(index);
                solve.contacts.extend(touching.points.0..touching.points.1);
            }
        }
        for (index, point) in (0..).zip(scene.second.iter()) {
            let Some(spots) = second_spots(scene, point) else { continue };
            if let Some(solve) = solves.get_mut(island_of(spots.map(Spot::body))).filter(anew) {
                solve.second.push(index);
            }
        }
        for &(id, bodies) in &acting.potentials {
            if let Some(solve) = solves.get_mut(island_of(bodies)).filter(anew) {
                solve.potentials.push(id);
            }
        }
    }
}

/// Where an anchor acts; `None` where its body takes no part.
pub(super) fn spot(scene: &Scene, anchor: Anchor) -> Option<Spot> {
    let Some(id) = anchor.body else { return Some(Spot::World) };
    let body = scene.bodies.get(id).filter(|body| body.index != ABSENT)?;
    Some(Spot::Body(body.index, PartPoint { part: anchor.part, point: anchor.point }))
}

/// Where a contact acts: at the frames of the two colliders, or between the vertices of one that is embedded; nowhere if
/// logic lets the pair pass.
fn contact_spots(scene: &Scene, contact: &ContactPoint) -> Option<[Spot; 2]> {
    spots(scene, contact, [None; 2])
}

/// The same for a point of the second look, which knows its vertices.
pub(super) fn second_spots(scene: &Scene, point: &SecondPoint) -> Option<[Spot; 2]> {
    spots(scene, &point.contact, point.feet)
}

fn spots(scene: &Scene, contact: &ContactPoint, feet: [Option<Foot>; 2]) -> Option<[Spot; 2]> {
    if contact.is_cancelled {
        return None;
    }
    let spot = |serial: u32, outward: DVec3, foot: Option<Foot>| {
        let &Placed { body, at, index, .. } = placed(scene, serial)?;
        let body = &scene.bodies[body];
        let hull = body.figure.as_ref().and_then(|figure| Some((figure, figure.hull(index)?)));
        let spot = match hull {
            None => Spot::Body(body.index, at),
            Some((figure, hull)) => {
                let (q, v) = (scene.state.q(body.slice), scene.state.v(body.slice));
                let core = contact.position - outward * (contact.gap / 2.0 + hull.radius());
                let find = || hull.foot(core, outward, |at| figure.dof.point(at, q, v)[0]);
                Spot::Vertices(body.index, foot.unwrap_or_else(find))
            }
        };
        (body.index != ABSENT).then_some(spot)
    };
    let b = match contact.b {
        Partner::Body(serial) => spot(serial, -contact.normal, feet[1])?,
        Partner::Static(_) => Spot::World,
    };
    Some([spot(contact.a, contact.normal, feet[0])?, b])
}

/// A collider by its serial.
fn placed<'a>(scene: &'a Scene, serial: u32) -> Option<&'a Placed> {
    let place = scene.placed.binary_search_by_key(&serial, |placed| placed.serial).ok()?;
    Some(&scene.placed[place])
}
