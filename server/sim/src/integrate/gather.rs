//! Gathering: an island takes the bodies and potentials of its list in, as unknowns and terms of its problem.
//!
//! Islands share nothing here but what they read, so this runs on all threads; what is in which list is `spots`.

use glam::DVec3;

use super::attachment::{Follows, trace};
use super::problem::{Rates, Unknown};
use super::second_look::Onward;
use super::spots::{Active, Spot, Touching, second_spots, spot};
use super::step::{Scene, Solve};
use crate::collide::{ContactPoint, Surface};
use crate::dof::{ABSENT, BLOCK_RATES_MAX, FigureBody, Frame, Inertia, Node, Twist};
use crate::potential::contact::{Approach, ContactTerm};
use crate::potential::hold::{STRONGEST, Scale};
use crate::potential::rod::RodTerm;
use crate::potential::rolling::RollingTerm;
use crate::potential::{Anchor, End, FIXED};
use crate::settings::Settings;

/// What islands are gathered from; all threads share it.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a, 'world> {
    pub scene: &'a Scene<'world>,
    pub active: &'a [Active],
    pub touching: &'a [Touching],
    /// Where those go on from that the second look added points to.
    pub onward: Option<&'a Onward>,
}

impl Solve {
    /// Takes in `members`, bodies by their index in the tick, and everything on the island's list.
    pub(super) fn gather(&mut self, members: &[u32], sources: Sources) {
        let Settings { dt, .. } = *sources.scene.settings;
        self.problem.clear(dt, sources.scene.settings.field());
        self.mass = 0.0;
        for &member in members {
            let known = self.problem.len();
            self.take_in(&sources.active[member as usize], sources.scene);
            if let Some(onward) = sources.onward {
                self.problem.start_from(known, onward.solution_of(member));
            }
        }
        self.gather_contacts(sources);
        self.gather_second(sources);
        self.gather_own_rods(members, sources);
        self.gather_potentials(sources);
    }

    /// The ends of two spots.
    fn ends(&mut self, spots: [Spot; 2], follows: Follows, active: &[Active]) -> [End; 2] {
        let blocks = self.problem.len() as u32;
        let figures = &mut self.problem.figures;
        spots.map(|spot| match spot {
            Spot::World => End { frame: FIXED, point: DVec3::ZERO },
            Spot::Body(index, at) => match active[index as usize] {
                Active { start, figure: ABSENT, .. } => End { frame: start, point: at.point },
                Active { figure, .. } => {
                    End { frame: blocks + figures.attach(figure, at, follows), point: DVec3::ZERO }
                }
            },
            Spot::Vertices(index, foot) => {
                let attachment = figures.attach_foot(active[index as usize].figure, &foot);
                End { frame: blocks + attachment, point: DVec3::ZERO }
            }
        })
    }

    /// The ends of two anchors; [`Follows::Place`] where a potential asks for no axes.
    pub(super) fn anchored(&mut self, anchors: [Anchor; 2], follows: Follows, sources: Sources) -> Option<[End; 2]> {
        let spots = [spot(sources.scene, anchors[0])?, spot(sources.scene, anchors[1])?];
        let mut ends = self.ends(spots, follows, sources.active);
        for (end, anchor) in ends.iter_mut().zip(anchors) {
            if end.frame == FIXED {
                end.point = anchor.point;
            }
        }
        Some(ends)
    }

    /// The rods between points of figures: a point's block is its frame.
    fn gather_own_rods(&mut self, members: &[u32], sources: Sources) {
        let Sources { scene, active, .. } = sources;
        for active in members.iter().map(|&member| &active[member as usize]) {
            let body = &scene.bodies[active.id];
            let Some(figure) = &body.figure else { continue };
            let q = scene.state.q(body.slice);
            let rods = (0u32..).zip(figure.dof.rods()).zip(&figure.rods);
            for ((index, rod), &memory) in rods {
                let frames = rod.points.map(|point| active.start + figure.ranks[point as usize]);
                let ends = frames.map(|frame| End { frame, point: DVec3::ZERO });
                let points = rod.points.map(|point| DVec3::from_slice(&q[3 * point as usize..]));
                let scale = self.scale(ends, points, scene.settings.solver.joint_stiffness);
                self.problem.terms.own_rods.push(RodTerm::new(ends, [rod.length; 2], rod.tolerance, scale, memory));
                self.own_rods.push((active.id, index));
            }
        }
    }

    fn gather_contacts(&mut self, sources: Sources) {
        for index in 0..self.touching.len() {
            let Touching { points: (start, end), spots } = sources.touching[self.touching[index] as usize];
            let ends = self.ends(spots, Follows::Start, sources.active);
            self.touch(ends, &sources.scene.contacts[start as usize..end as usize], sources.scene.settings);
        }
    }

    /// Contact points that act on the same two ends.
    fn touch(&mut self, ends: [End; 2], points: &[ContactPoint], settings: &Settings) {
        let Settings { dt, contact: settings, .. } = settings;
        let (frames, mass) = (ends.map(|end| end.frame), self.reduced_mass(ends));
        let (origins, turns) = (ends.map(|end| self.origin(end)), ends.map(|end| self.turns(end)));
        let (now, free) = (ends.map(|end| self.start_twist(end)), ends.map(|end| self.free_twist(end)));
        for contact in points {
            let arm = |i: usize| if turns[i] { contact.position - origins[i] } else { DVec3::ZERO };
            let arms = [arm(0), arm(1)];
            let closing = |of: [Twist; 2]| contact.normal.dot(of[0].at(arms[0]) - of[1].at(arms[1]));
            let bounces = contact.surface.restitution > 0.0;
            let mobility = |i: usize| self.mobility(ends[i], arms[i], contact.normal);
            let at_point = if bounces { (mobility(0) + mobility(1)).recip() } else { mass };
            let approach = Approach { now: closing(now), free: closing(free), mass: at_point };
            let term = ContactTerm::new(frames, contact, arms, mass, approach, settings, *dt);
            let Surface { rolling_resistance, spinning_resistance, .. } = contact.surface;
            if rolling_resistance.max(spinning_resistance) > 0.0 {
                let scale = self.turn_scale(ends, settings.tangent_stiffness);
                if scale.unit > 0.0 {
                    let rolling = RollingTerm::new(term.clone(), contact, scale.unit * scale.least);
                    self.rolling.push(self.problem.terms.contacts.len() as u32);
                    self.problem.terms.rolling.push(rolling);
                }
            }
            self.problem.terms.contacts.push(term);
        }
    }

    /// Points of the second look. They come after all contacts.
    fn gather_second(&mut self, sources: Sources) {
        let Settings { dt, contact: settings, .. } = sources.scene.settings;
        for index in 0..self.second.len() {
            let point = &sources.scene.second[self.second[index] as usize];
            let Some(spots) = second_spots(sources.scene, point) else { continue };
            let ends = self.ends(spots, Follows::Start, sources.active);
            let (frames, mass) = (ends.map(|end| end.frame), self.reduced_mass(ends));
            let arm = |i: usize| if self.turns(ends[i]) { point.arms[i] } else { DVec3::ZERO };
            let term = ContactTerm::second(frames, point, [arm(0), arm(1)], mass, settings, *dt);
            self.problem.terms.contacts.push(term);
            self.problem.looked_again = true;
        }
    }

    /// Takes a body into the island, with its share of all `unknowns`.
    fn take_in(&mut self, active: &Active, scene: &Scene) {
        let (dt, gravity) = (scene.settings.dt, scene.settings.field());
        let body = &scene.bodies[active.id];
        let start = active.start as usize;
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
        let index = self.problem.figures.add(figure, blocks, state, dt);
        self.problem.figures.attach_parts(index, dt, gravity);
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
    pub(super) fn mass(&self, end: End) -> f64 {
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
