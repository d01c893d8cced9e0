//! Gathering: the world's bodies and potentials become islands of unknowns and terms.

use glam::DVec3;

use super::attachment::{Follows, trace};
use super::problem::{Rates, Unknown};
use super::step::{Integrator, Scene, Solve};
use super::wheels;
use crate::collide::{ContactPoint, Foot, Partner, SecondPoint, Surface};
use crate::dof::{ABSENT, BLOCK_RATES_MAX, BodyId, FigureBody, Frame, Inertia, Node, PartPoint, Placed, Twist};
use crate::island::Islands;
use crate::potential::ball_joint::BallJointTerm;
use crate::potential::contact::{Approach, ContactTerm};
use crate::potential::hold::{Held, STRONGEST, Scale};
use crate::potential::pd::PdTerm;
use crate::potential::rod::RodTerm;
use crate::potential::rolling::RollingTerm;
use crate::potential::spring::SpringTerm;
use crate::potential::{Anchor, End, FIXED};
use crate::settings::Settings;

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
    pub(super) fn gather_bodies(&mut self, scene: &mut Scene) {
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

    pub(super) fn build_islands(&mut self, scene: &Scene) {
        self.find_islands(scene);
        for (island, solve) in self.solves.iter_mut().take(self.islands.len()).enumerate() {
            solve.clear(scene.settings);
            for &member in self.islands.members(island) {
                let active = &mut self.active[member as usize];
                solve.take_in(active, scene);
            }
        }
    }

    /// Finds out what is coupled.
    pub(super) fn find_islands(&mut self, scene: &Scene) {
        self.islands.begin(self.active.len());
        let figures = (0..).zip(&self.active).filter(|(_, active)| scene.bodies[active.id].figure.is_some());
        figures.for_each(|(index, _)| self.islands.touch(index));
        let contacts = scene.contacts.chunk_by(ContactPoint::same_pair).map(|points| contact_spots(scene, &points[0]));
        let anchors = scene.potentials.pairs().map(|[a, b]| Some([spot(scene, a)?, spot(scene, b)?]));
        let second = scene.second.iter().map(|point| second_spots(scene, point));
        for spots in contacts.chain(second).chain(anchors).flatten() {
            match spots.map(Spot::body) {
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

    /// The island of two spots, and their ends in it; `None` where that has all its potentials already.
    pub(super) fn localise(&mut self, spots: [Spot; 2], follows: Follows) -> Option<(&mut Solve, [End; 2])> {
        let island = |spot: Spot| spot.body().map_or(Islands::FREE, |index| self.islands.island_of(index));
        let solve = self.solves.get_mut(island(spots[0]).min(island(spots[1])) as usize)?;
        if !solve.is_gathering {
            return None;
        }
        let mut end = |spot: Spot| match spot {
            Spot::World => End { frame: FIXED, point: DVec3::ZERO },
            Spot::Body(index, at) => match self.active[index as usize] {
                Active { start, figure: ABSENT, .. } => End { frame: start, point: at.point },
                Active { figure, .. } => {
                    let attachment = solve.problem.figures.attach(figure, at, follows);
                    End { frame: solve.problem.len() as u32 + attachment, point: DVec3::ZERO }
                }
            },
            Spot::Vertices(index, foot) => {
                let attachment = solve.problem.figures.attach_foot(self.active[index as usize].figure, &foot);
                End { frame: solve.problem.len() as u32 + attachment, point: DVec3::ZERO }
            }
        };
        let ends = spots.map(&mut end);
        Some((solve, ends))
    }

    /// As [`Integrator::localise`], for two anchors; [`Follows::Place`] where a potential asks for no axes.
    pub(super) fn localise_anchors(
        &mut self,
        scene: &Scene,
        anchors: [Anchor; 2],
        follows: Follows,
    ) -> Option<(&mut Solve, [End; 2])> {
        let spots = [spot(scene, anchors[0])?, spot(scene, anchors[1])?];
        let (solve, mut ends) = self.localise(spots, follows)?;
        for (end, anchor) in ends.iter_mut().zip(anchors) {
            if end.frame == FIXED {
                end.point = anchor.point;
            }
        }
        Some((solve, ends))
    }

    pub(super) fn gather_potentials(&mut self, scene: &Scene) {
        self.gather_contacts(scene);
        self.gather_second(scene);
        let Settings { dt, solver, .. } = scene.settings;
        for (_, desc) in scene.potentials.springs.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Place) else { continue };
            let points = solve.places(ends);
            solve.problem.terms.springs.push(SpringTerm::new(ends, desc, points[0].distance(points[1])));
        }
        for (id, &Held { desc, memory }) in scene.potentials.rods.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Place) else { continue };
            let scale = solve.scale(ends, solve.places(ends), solver.joint_stiffness);
            solve.problem.terms.rods.push(RodTerm::new(ends, [desc.length; 2], desc.tolerance, scale, memory));
            solve.rods.push(id);
        }
        self.gather_own_rods(scene);
        for (id, &Held { desc, memory }) in scene.potentials.ball_joints.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Place) else { continue };
            let scale = solve.scale(ends, solve.places(ends), solver.joint_stiffness);
            solve.problem.terms.ball_joints.push(BallJointTerm::new(ends, desc.tolerance, scale, memory));
            solve.ball_joints.push(id);
        }
        self.gather_joints(scene);
        self.gather_axles(scene);
        for (_, (desc, gains)) in scene.potentials.pds.awake() {
            let anchors = [desc.at, Anchor::world(DVec3::ZERO)];
            let Some((solve, [end, _])) = self.localise_anchors(scene, anchors, Follows::Place) else { continue };
            let (mass, start) = (solve.mass(end), solve.start(end).place(end.point));
            solve.problem.terms.pds.push(PdTerm::new(end, desc, *gains, mass, start, *dt));
        }
    }

    /// The rods between points of figures: a point's block is its frame.
    fn gather_own_rods(&mut self, scene: &Scene) {
        for (active, index) in self.active.iter().zip(0..) {
            let body = &scene.bodies[active.id];
            let Some(figure) = &body.figure else { continue };
            let solve = &mut self.solves[self.islands.island_of(index) as usize];
            if !solve.is_gathering {
                continue;
            }
            let q = scene.state.q(body.slice);
            let rods = (0u32..).zip(figure.dof.rods()).zip(&figure.rods);
            for ((index, rod), &memory) in rods {
                let frames = rod.points.map(|point| active.start + figure.ranks[point as usize]);
                let ends = frames.map(|frame| End { frame, point: DVec3::ZERO });
                let points = rod.points.map(|point| DVec3::from_slice(&q[3 * point as usize..]));
                let scale = solve.scale(ends, points, scene.settings.solver.joint_stiffness);
                solve.problem.terms.own_rods.push(RodTerm::new(ends, [rod.length; 2], rod.tolerance, scale, memory));
                solve.own_rods.push((active.id, index));
            }
        }
    }

    fn gather_contacts(&mut self, scene: &Scene) {
        let Settings { dt, contact: settings, .. } = scene.settings;
        let mut source = 0;
        // Points of a pair share the frames of its colliders; vertices beneath a point are its own.
        let shares = |a: &ContactPoint, b: &ContactPoint| a.same_pair(b) && !is_embedded(scene, a);
        for points in scene.contacts.chunk_by(shares) {
            let sources = (source..).take(points.len());
            source += points.len() as u32;
            let Some(spots) = contact_spots(scene, &points[0]) else { continue };
            let Some((solve, ends)) = self.localise(spots, Follows::Start) else { continue };
            let (frames, mass) = (ends.map(|end| end.frame), solve.reduced_mass(ends));
            let (origins, turns) = (ends.map(|end| solve.origin(end)), ends.map(|end| solve.turns(end)));
            let (now, free) = (ends.map(|end| solve.start_twist(end)), ends.map(|end| solve.free_twist(end)));
            for (index, contact) in (0..).zip(points) {
                let arm = |i: usize| if turns[i] { contact.position - origins[i] } else { DVec3::ZERO };
                let arms = [arm(0), arm(1)];
                let closing = |of: [Twist; 2]| contact.normal.dot(of[0].at(arms[0]) - of[1].at(arms[1]));
                let bounces = contact.surface.restitution > 0.0;
                let mobility = |i: usize| solve.mobility(ends[i], arms[i], contact.normal);
                let at_point = if bounces { (mobility(0) + mobility(1)).recip() } else { mass };
                let approach = Approach { now: closing(now), free: closing(free), mass: at_point };
                let term = ContactTerm::new(frames, contact, arms, mass, approach, settings, *dt);
                let Surface { rolling_resistance, spinning_resistance, .. } = contact.surface;
                if rolling_resistance.max(spinning_resistance) > 0.0 {
                    let scale = solve.turn_scale(ends, settings.tangent_stiffness);
                    if scale.unit > 0.0 {
                        let rolling = RollingTerm::new(term.clone(), contact, scale.unit * scale.least);
                        solve.problem.terms.rolling.push(rolling);
                        solve.rolling.push(solve.contacts.len() as u32 + index);
                    }
                }
                solve.problem.terms.contacts.push(term);
            }
            solve.contacts.extend(sources);
        }
    }

    /// Points of the second look. They come after all contacts.
    fn gather_second(&mut self, scene: &Scene) {
        for (point, source) in scene.second.iter().zip(0..) {
            let Some(spots) = second_spots(scene, point) else { continue };
            let Some((solve, ends)) = self.localise(spots, Follows::Start) else { continue };
            let (frames, mass) = (ends.map(|end| end.frame), solve.reduced_mass(ends));
            let arm = |i: usize| if solve.turns(ends[i]) { point.arms[i] } else { DVec3::ZERO };
            let Settings { dt, contact: settings, .. } = scene.settings;
            let term = ContactTerm::second(frames, point, [arm(0), arm(1)], mass, settings, *dt);
            solve.problem.terms.contacts.push(term);
            solve.second.push(source);
            solve.problem.looked_again = true;
        }
    }
}

impl Solve {
    /// Takes a body into the island, with its share of all `unknowns`.
    pub(super) fn take_in(&mut self, active: &mut Active, scene: &Scene) {
        let (dt, gravity) = (scene.settings.dt, scene.settings.field());
        let body = &scene.bodies[active.id];
        let start = self.problem.unknowns.len();
        active.start = start as u32;
        self.mass += body.mass;
        let unknowns = &mut self.problem.unknowns;
        let Some(figure) = &body.figure else {
            return unknowns.push(Unknown::Body(body.node(scene.state, dt, gravity)));
        };
        let state = [scene.state.q(body.slice), scene.state.v(body.slice)];
        unknowns.resize(start + figure.ranks.len(), Unknown::Rates(Rates::default()));
        for (&rank, rates) in figure.ranks.iter().zip(rates(figure, state[1], gravity.fall(dt))) {
            unknowns[start + rank as usize] = Unknown::Rates(rates);
        }
        let blocks = figure.ranks.iter().map(|rank| active.start + rank);
        active.figure = self.problem.figures.add(figure, blocks, state, dt);
        self.problem.figures.attach_parts(active.figure, dt, gravity);
    }

    /// The particle or rigid body of a frame.
    pub(super) fn node(&self, frame: u32) -> Option<&Node> {
        match self.problem.unknowns.get(frame as usize) {
            Some(Unknown::Body(node)) => Some(node),
            _ => None,
        }
    }

    /// The frame of an end at the start of the tick.
    pub(super) fn start(&self, end: End) -> Frame<f64> {
        if let Some(node) = self.node(end.frame) {
            return node.start_frame();
        }
        let attachment = (end.frame as usize).checked_sub(self.problem.len());
        let attachment = attachment.and_then(|k| self.problem.figures.attachments.get(k));
        attachment.map_or(Frame::WORLD, |attachment| attachment.start)
    }

    /// The twist of an end at the start of the tick.
    fn start_twist(&self, end: End) -> Twist {
        self.node(end.frame).map_or_else(|| self.start(end).twist(), |node| node.before)
    }

    /// The twist of an end at the end of the tick if nothing acts on its body but gravity.
    fn free_twist(&self, end: End) -> Twist {
        self.node(end.frame).map_or_else(|| self.start(end).twist(), |node| node.target)
    }

    /// What resists a force at an end, kg; infinite for the world.
    fn mass(&self, end: End) -> f64 {
        match self.problem.unknowns.get(end.frame as usize) {
            Some(Unknown::Body(node)) => node.mass,
            // The frame is a point.
            Some(Unknown::Rates(rates)) => rates.masses[0],
            None => {
                let attachment = (end.frame as usize).checked_sub(self.problem.len());
                let attachment = attachment.and_then(|k| self.problem.figures.attachments.get(k));
                attachment.map_or(f64::INFINITY, |attachment| attachment.mass)
            }
        }
    }

    /// Reduced mass of two ends, kg; of the one that moves where the other is the world.
    pub(super) fn reduced_mass(&self, [a, b]: [End; 2]) -> f64 {
        (self.mass(a).recip() + self.mass(b).recip()).recip()
    }

    /// What the stiffness of a joint between two ends is measured with; its points are at `places`.
    pub(super) fn scale(&self, ends: [End; 2], places: [DVec3; 2], least: f64) -> Scale {
        let dt = self.problem.dt;
        let reach = places[0].abs().max(places[1].abs()).max_element();
        let (unit, strongest) = (self.reduced_mass(ends) / (dt * dt), self.mass * STRONGEST / (dt * dt));
        Scale { unit, least, reach, strongest }
    }

    /// What turns at an end under a torque, mean over axes, 1/(kg m²); 0 for what does not turn.
    fn inverse_inertia(&self, end: End) -> f64 {
        match self.problem.unknowns.get(end.frame as usize) {
            Some(Unknown::Body(node)) if node.rotates => trace(node.inverse_inertia) / 3.0,
            Some(_) => 0.0,
            None => {
                let attachment = (end.frame as usize).checked_sub(self.problem.len());
                let attachment = attachment.and_then(|k| self.problem.figures.attachments.get(k));
                attachment.map_or(0.0, |attachment| attachment.inverse_inertia)
            }
        }
    }

    /// How a point at `arm` from an end's frame gives way to a force along `direction`, 1/kg; 0 for the world.
    fn mobility(&self, end: End, arm: DVec3, direction: DVec3) -> f64 {
        let lever = arm.cross(direction);
        let turning = match self.node(end.frame) {
            Some(node) if node.rotates => lever.dot(node.inverse_inertia * lever),
            _ => self.inverse_inertia(end) * lever.length_squared(),
        };
        self.mass(end).recip() + turning
    }

    /// What the stiffness of a joint against turns of two ends is measured with.
    pub(super) fn turn_scale(&self, ends: [End; 2], least: f64) -> Scale {
        let dt = self.problem.dt;
        let inverse: f64 = ends.iter().map(|&end| self.inverse_inertia(end)).sum();
        let unit = if inverse > 0.0 { (inverse * dt * dt).recip() } else { 0.0 };
        // Forces that the island can bring to bear act at levers of a metre, or of the ends' own arms.
        let lever = ends.iter().map(|end| end.point.length()).fold(1.0, f64::max);
        Scale { unit, least, reach: 0.0, strongest: self.mass * STRONGEST / (dt * dt) * lever }
    }

    /// World positions of two ends at the start of the tick, m.
    pub(super) fn places(&self, ends: [End; 2]) -> [DVec3; 2] {
        ends.map(|end| self.start(end).place(end.point))
    }

    /// Where an end's frame is at the start of the tick, m.
    fn origin(&self, end: End) -> DVec3 {
        self.node(end.frame).map_or_else(|| self.start(end).position.into(), |node| node.start.position)
    }

    /// Whether an end's frame can turn: a force at an arm of one that cannot has no torque.
    fn turns(&self, end: End) -> bool {
        end.frame != FIXED && self.node(end.frame).is_none_or(|node| node.rotates)
    }
}

/// A figure's rates, block by block.
fn rates<'a>(figure: &'a FigureBody, v: &'a [f64], fall: DVec3) -> impl Iterator<Item = Rates> + 'a {
    let points = matches!(figure.dof.inertia(), Inertia::Points(_));
    let mut offset = 0;
    figure.dof.blocks().iter().map(move |size| {
        let range = offset..offset + usize::from(size.rates);
        offset = range.end;
        let padded = |numbers: &[f64]| {
            let mut block = [0.0; BLOCK_RATES_MAX];
            block[..numbers.len()].copy_from_slice(numbers);
            block
        };
        let before = padded(&v[range.clone()]);
        let change = padded(&figure.change[range.clone()]);
        let mut target = before;
        if points {
            (0..3).for_each(|i| target[i] += fall[i]);
        }
        Rates {
            size: size.rates,
            before,
            target,
            repeated: std::array::from_fn(|i| before[i] + change[i]),
            masses: padded(&figure.masses[range]),
            body_mass: figure.mass,
        }
    })
}

/// Where an anchor acts; `None` where its body takes no part.
fn spot(scene: &Scene, anchor: Anchor) -> Option<Spot> {
    let Some(id) = anchor.body else { return Some(Spot::World) };
    let body = scene.bodies.get(id).filter(|body| body.index != ABSENT)?;
    Some(Spot::Body(body.index, PartPoint { part: anchor.part, point: anchor.point }))
}

/// Where a contact acts: at the frames of the two colliders, or between the vertices of one that is embedded; nowhere if
/// logic lets the pair pass.
pub(super) fn contact_spots(scene: &Scene, contact: &ContactPoint) -> Option<[Spot; 2]> {
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

/// Whether one side of a contact is a hull that is embedded.
fn is_embedded(scene: &Scene, contact: &ContactPoint) -> bool {
    let embedded = |serial: u32| {
        let placed = placed(scene, serial)?;
        scene.bodies[placed.body].figure.as_ref()?.hull(placed.index)
    };
    let other = match contact.b {
        Partner::Body(serial) => embedded(serial),
        Partner::Static(_) => None,
    };
    other.or_else(|| embedded(contact.a)).is_some()
}
