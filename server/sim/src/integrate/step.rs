//! One integration of the whole world: bodies and potentials are sorted into islands, islands are solved, the answers
//! are written to Q and Q'.

use glam::DVec3;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};
use slotmap::SlotMap;

use super::StepReport;
use super::newton::{Newton, NewtonInfo};
use super::problem::Problem;
use crate::collide::{ContactPoint, Partner};
use crate::dof::{ABSENT, Body, BodyId, Node, Twist};
use crate::island::{Islands, Place};
use crate::potential::axle::AxleTerm;
use crate::potential::ball_joint::BallJointTerm;
use crate::potential::contact::ContactTerm;
use crate::potential::pd::PdTerm;
use crate::potential::spring::SpringTerm;
use crate::potential::{Anchor, FIXED, NodeIndex, Potentials, reduced_mass};
use crate::settings::Settings;
use crate::state::State;

/// Islands of fewer bodies than this in all are solved on the calling thread: waking another one costs more.
const PARALLEL_BODIES_MIN: usize = 40;

/// Everything that an integration reads and writes.
pub(crate) struct Scene<'a> {
    pub settings: &'a Settings,
    pub state: &'a mut State,
    pub bodies: &'a mut SlotMap<BodyId, Body>,
    /// All bodies, in order of serial.
    pub order: &'a [BodyId],
    pub potentials: &'a mut Potentials,
    pub contacts: &'a mut [ContactPoint],
}

/// An island's problem with its solver and the way back to what it was made of.
#[derive(Default)]
struct Solve {
    problem: Problem,
    rigid: Newton<6>,
    particles: Newton<3>,
    info: NewtonInfo,
    /// Index of each contact term among the world's contacts.
    contacts: Vec<u32>,
    ball_joints: Vec<crate::potential::BallJointId>,
}

/// The integrator with its memory.
#[derive(Default)]
pub(crate) struct Integrator {
    islands: Islands,
    nodes: Vec<Node>,
    /// Bodies that take part, in order of serial.
    active: Vec<BodyId>,
    /// Indices of each contact's bodies.
    contact_ends: Vec<Option<[u32; 2]>>,
    solves: Vec<Solve>,
    pool: Option<rayon::ThreadPool>,
}

impl Integrator {
    /// An integrator that solves islands on `threads` threads.
    pub fn new(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("island-{i}"));
        let pool = if threads > 1 { Some(pool.build()?) } else { None };
        Ok(Self { pool, ..Self::default() })
    }

    /// Integrates one tick.
    pub fn step(&mut self, scene: &mut Scene) -> StepReport {
        self.gather_bodies(scene);
        self.build_islands(scene);
        self.gather_potentials(scene);
        self.solve(scene.settings);
        self.scatter(scene)
    }

    fn gather_bodies(&mut self, scene: &mut Scene) {
        let Settings { dt, gravity, .. } = *scene.settings;
        self.nodes.clear();
        self.active.clear();
        for body in scene.bodies.values_mut() {
            body.is_wheel = false;
        }
        for axle in scene.potentials.axles.values() {
            let carried = scene.bodies.get(axle.chassis).is_some_and(|chassis| !chassis.quarantined);
            scene.bodies[axle.wheel].is_wheel = carried;
        }
        for &id in scene.order {
            let body = &mut scene.bodies[id];
            body.index = if body.quarantined { ABSENT } else { self.active.len() as u32 };
            if !body.quarantined {
                self.active.push(id);
                self.nodes.push(body.node(scene.state, dt, gravity));
            }
            // Forces are for one tick, whether the body takes part in it or not.
            (body.force, body.torque) = Default::default();
        }
    }

    fn build_islands(&mut self, scene: &Scene) {
        self.islands.begin(self.nodes.len());
        self.contact_ends.clear();
        let contacts = scene.contacts.iter().map(|c| contact_ends(scene, &self.active, c));
        self.contact_ends.extend(contacts);
        let potentials = scene.potentials.pairs().filter_map(|[a, b]| ends(scene, a, b));
        for [a, b] in self.contact_ends.iter().copied().flatten().chain(potentials) {
            match (a, b) {
                (FIXED, FIXED) => {}
                (FIXED, x) | (x, FIXED) => self.islands.touch(x),
                _ => self.islands.couple(a, b),
            }
        }
        self.islands.finish();
        self.solves.resize_with(self.islands.len().max(self.solves.len()), Solve::default);
        for (i, solve) in self.solves.iter_mut().take(self.islands.len()).enumerate() {
            solve.problem.dt = scene.settings.dt;
            solve.problem.nodes.clear();
            solve.problem.nodes.extend(self.islands.members(i).iter().map(|&m| self.nodes[m as usize]));
            solve.problem.terms.clear();
            solve.contacts.clear();
            solve.ball_joints.clear();
        }
    }

    /// Moves bodies' indices from the world to their island.
    fn localise(&mut self, ends: [u32; 2]) -> Option<(&mut Solve, [NodeIndex; 2])> {
        let place = |end: u32| if end == FIXED { Place::FREE } else { self.islands.place(end) };
        let [a, b] = ends.map(place);
        let island = a.island.min(b.island);
        Some((self.solves.get_mut(island as usize)?, [a.index, b.index]))
    }

    fn gather_potentials(&mut self, scene: &Scene) {
        let Settings { dt, solver, contact: contact_settings, .. } = scene.settings;
        for (source, contact) in (0u32..).zip(scene.contacts.iter()) {
            let Some(ends) = self.contact_ends[source as usize] else { continue };
            let Some((solve, nodes)) = self.localise(ends) else { continue };
            let all = &solve.problem.nodes;
            let arms = nodes.map(|i| arm(all, i, contact.position));
            let mass = reduced_mass(all, nodes);
            let speeds = [0, 1].map(|i| before(all, nodes[i]).at(arms[i]));
            let closing = contact.normal.dot(speeds[0] - speeds[1]);
            let term = ContactTerm::new(nodes, contact, arms, mass, closing, contact_settings, *dt);
            solve.problem.terms.contacts.push(term);
            solve.contacts.push(source);
        }
        for desc in scene.potentials.springs.values() {
            let Some(ends) = ends(scene, desc.a.body, desc.b.body) else { continue };
            let Some((solve, nodes)) = self.localise(ends) else { continue };
            let start = nodes.map(|i| pose(&solve.problem.nodes, i));
            solve.problem.terms.springs.push(SpringTerm::new(nodes, *desc, start));
        }
        for (id, joint) in &scene.potentials.ball_joints {
            let Some(ends) = ends(scene, joint.desc.a.body, joint.desc.b.body) else { continue };
            let Some((solve, nodes)) = self.localise(ends) else { continue };
            let stiffness = solver.joint_stiffness * reduced_mass(&solve.problem.nodes, nodes) / (dt * dt);
            let points = [joint.desc.a, joint.desc.b].map(|anchor: Anchor| anchor.point);
            solve.problem.terms.ball_joints.push(BallJointTerm::new(nodes, points, stiffness, joint.force));
            solve.ball_joints.push(id);
        }
        for desc in scene.potentials.axles.values() {
            let Some(ends) = ends(scene, Some(desc.chassis), Some(desc.wheel)) else { continue };
            let Some((solve, nodes)) = self.localise(ends) else { continue };
            let term = AxleTerm::new(nodes, desc, &solve.problem.nodes, solver.joint_stiffness, *dt);
            let wheel = nodes[1] as usize;
            solve.problem.nodes[wheel].guessed_spin = Some(term.guess_spin(&solve.problem.nodes, *dt));
            solve.problem.terms.axles.push(term);
        }
        for (desc, gains) in scene.potentials.pds.values() {
            let Some(ends) = ends(scene, Some(desc.body), None) else { continue };
            let Some((solve, [node, _])) = self.localise(ends) else { continue };
            let body = &solve.problem.nodes[node as usize];
            let term = PdTerm::new(node, desc, *gains, body.mass, body.start.position, *dt);
            solve.problem.terms.pds.push(term);
        }
    }

    fn solve(&mut self, settings: &Settings) {
        let solves = &mut self.solves[..self.islands.len()];
        let solver = &settings.solver;
        let run = |solve: &mut Solve| {
            solve.info = if solve.problem.nodes.iter().any(|node| node.rotates) {
                solve.rigid.solve(&mut solve.problem, solver)
            } else {
                solve.particles.solve(&mut solve.problem, solver)
            };
        };
        match &self.pool {
            Some(pool) if solves.len() > 1 && self.nodes.len() >= PARALLEL_BODIES_MIN => {
                pool.install(|| solves.par_iter_mut().with_min_len(4).for_each(run));
            }
            _ => solves.iter_mut().for_each(run),
        }
    }

    fn scatter(&mut self, scene: &mut Scene) -> StepReport {
        let mut report = StepReport { islands: self.islands.len(), ..StepReport::default() };
        for (index, &id) in (0..).zip(&self.active) {
            let place = self.islands.place(index);
            let node = &self.nodes[index as usize];
            let twist = match self.solves.get(place.island as usize) {
                Some(solve) => solve.problem.trial[place.index as usize].twist,
                None => node.target,
            };
            let body = &mut scene.bodies[id];
            let before = body.pose(scene.state);
            body.advance(node, twist, scene.settings.dt, scene.state);
            body.impulse =
                Twist { linear: twist.linear - node.target.linear, angular: twist.angular - node.target.angular };
            if !body.is_sane(scene.state) {
                body.quarantined = true;
                body.set_pose(before, scene.state);
                body.set_twist(Twist::REST, scene.state);
                body.impulse = Twist::REST;
                report.quarantined += 1;
            }
            report.bodies += 1;
            report.dof += if node.rotates { 6 } else { 3 };
        }
        for solve in &self.solves[..self.islands.len()] {
            solve.write_back(scene, &mut report);
        }
        report
    }
}

impl Solve {
    /// Hands back what potentials remember, and sums up.
    fn write_back(&self, scene: &mut Scene, report: &mut StepReport) {
        let candidate = self.problem.candidate();
        for (term, &source) in self.problem.terms.contacts.iter().zip(&self.contacts) {
            let contact = &mut scene.contacts[source as usize];
            contact.anchor = finite_or_zero(term.final_anchor(&candidate));
            contact.normal_force = finite_or_zero(DVec3::X * term.normal_force(&candidate)).x;
            report.worst_penetration = report.worst_penetration.max(term.final_depth(&candidate));
        }
        for (term, &id) in self.problem.terms.ball_joints.iter().zip(&self.ball_joints) {
            scene.potentials.ball_joints[id].force = finite_or_zero(term.force);
            report.worst_joint_gap = report.worst_joint_gap.max(term.gap(&candidate));
        }
        for term in &self.problem.terms.axles {
            report.worst_joint_gap = report.worst_joint_gap.max(term.gap(&candidate));
        }
        report.contacts += self.contacts.len();
        report.newton_iterations += self.info.newton_iterations;
        report.linear_iterations += self.info.linear_iterations;
        report.evaluations += self.info.evaluations;
        report.unconverged_islands += usize::from(!self.info.converged);
        report.residual = report.residual.max(self.info.residual);
    }
}

/// What a potential remembers must not carry a non-finite number into the next tick.
fn finite_or_zero(v: DVec3) -> DVec3 {
    if v.is_finite() { v } else { DVec3::ZERO }
}

/// Indices of a contact's bodies among the active ones, `None` where one of them is absent.
fn contact_ends(scene: &Scene, active: &[BodyId], contact: &ContactPoint) -> Option<[u32; 2]> {
    let index = |serial: u32| {
        let place = active.binary_search_by_key(&serial, |&id| scene.bodies[id].serial);
        place.ok().map(|i| i as u32)
    };
    let b = match contact.b {
        Partner::Body(serial) => index(serial)?,
        Partner::Static(_) => FIXED,
    };
    Some([index(contact.a)?, b])
}

/// Indices of the bodies at both ends of a potential; `None` where one is absent or both are the world.
fn ends(scene: &Scene, a: Option<BodyId>, b: Option<BodyId>) -> Option<[u32; 2]> {
    let index = |end: Option<BodyId>| match end {
        None => Some(FIXED),
        Some(id) => scene.bodies.get(id).map(|body| body.index).filter(|&index| index != ABSENT),
    };
    let ends = [index(a)?, index(b)?];
    (ends != [FIXED, FIXED]).then_some(ends)
}

fn pose(nodes: &[Node], node: NodeIndex) -> crate::dof::Pose {
    if node == FIXED { crate::dof::Pose::IDENTITY } else { nodes[node as usize].start }
}

fn before(nodes: &[Node], node: NodeIndex) -> Twist {
    nodes.get(node as usize).map_or(Twist::REST, |node| node.before)
}

/// From a body's centre of mass to a contact point; none for what does not turn.
fn arm(nodes: &[Node], node: NodeIndex, point: DVec3) -> DVec3 {
    match nodes.get(node as usize) {
        Some(body) if body.rotates => point - body.start.position,
        _ => DVec3::ZERO,
    }
}
