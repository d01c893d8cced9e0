//! One integration of the whole world: bodies and potentials are sorted into islands, islands are solved, the answers
//! are written to Q and Q'.

use glam::DVec3;
use slotmap::SlotMap;

use super::StepReport;
use super::gather::Sources;
use super::problem::{Problem, Unknown};
use super::rest::{Rest, RestSearch};
use super::second_look::Onward;
use super::solver::{SolveReport, Solvers, StoppedBecause};
use super::spots::{Acting, Active};
use crate::collide::{ContactPoint, SecondPoint};
use crate::dof::{Body, BodyId, Placed};
use crate::island::Islands;
use crate::potential::contact::Outcome;
use crate::potential::hold::{Joint, Memory};
use crate::potential::{PotentialId, Potentials};
use crate::settings::{Settings, SolverSettings};
use crate::state::State;
use crate::threads::{Threads, Workspaces};

/// Islands of fewer bodies than this in all are worked on by the calling thread: waking another one costs more.
const PARALLEL_BODIES_MIN: usize = 40;

/// Everything that an integration reads and writes.
pub(crate) struct Scene<'a> {
    pub settings: &'a Settings,
    pub threads: &'a Threads,
    pub state: &'a mut State,
    pub bodies: &'a mut SlotMap<BodyId, Body>,
    /// All bodies that are awake, in order of serial.
    pub order: &'a [BodyId],
    /// All colliders of bodies, in order of serial.
    pub placed: &'a [Placed],
    pub potentials: &'a mut Potentials,
    pub contacts: &'a mut [ContactPoint],
    /// Points of the second look.
    pub second: &'a mut [SecondPoint],
}

/// The solvers' memory. Nothing in it lasts longer than a solve, so islands share it: it stays in the cache.
#[derive(Default)]
pub(super) struct Workspace {
    rigid: Solvers<6>,
    particles: Solvers<3>,
}

/// An island's problem and the way back to what it was made of.
#[derive(Default)]
pub(super) struct Solve {
    pub problem: Problem,
    /// Share of the tick's budget, block operations.
    budget: Option<u64>,
    pub report: SolveReport,
    /// Whether it is to be gathered or solved.
    pub is_pending: bool,
    /// Blocks of unknowns that its bodies have.
    pub blocks: usize,
    /// Of the island, kg.
    pub mass: f64,
    /// What acts in it: indices of [`Touching`](super::spots::Touching) and potentials.
    pub touching: Vec<u32>,
    pub potentials: Vec<PotentialId>,
    /// Index of each contact term among the world's contacts.
    pub contacts: Vec<u32>,
    /// Index of each contact term after those among the points of the second look.
    pub second: Vec<u32>,
    /// Index of the contact term of each rolling resistance.
    pub rolling: Vec<u32>,
    /// Body and index of each rod of a figure.
    pub own_rods: Vec<(BodyId, u32)>,
    /// It rests: it is neither gathered nor solved.
    pub rest: Option<Rest>,
    /// Energy of motion of the first solution where recovery has it solved a second time, J.
    pub first_energy: Option<f64>,
}

/// The integrator with its memory.
#[derive(Default)]
pub(crate) struct Integrator {
    pub(super) islands: Islands,
    /// Bodies that take part, in order of serial.
    pub(super) active: Vec<Active>,
    pub(super) acting: Acting,
    pub(super) solves: Vec<Solve>,
    pub(super) onward: Onward,
    pub(super) rest_search: RestSearch,
    workspaces: Workspaces<Workspace>,
}

impl Integrator {
    /// Gathers and solves a tick. What comes of it is written by [`Integrator::scatter`].
    pub fn begin(&mut self, scene: &mut Scene) {
        self.onward.spent = SolveReport::default();
        self.find_bodies(scene);
        self.find_acting(scene);
        self.find_islands(scene);
        (0..self.islands.len()).for_each(|island| self.seat(island, scene));
        self.find_rest(scene);
        self.solve(scene, None);
    }

    /// Solves one tick, and leaves everything as it was. Answers what the solver did.
    pub fn rehearse(&mut self, scene: &mut Scene) -> StepReport {
        self.begin(scene);
        let mut report = StepReport { bodies: self.active.len(), ..StepReport::default() };
        self.sum_up(&mut report);
        report
    }

    /// Number of islands of the last tick.
    pub fn islands(&self) -> usize {
        self.islands.len()
    }

    /// Island of the body that had this index in the last tick; [`Islands::FREE`] where nothing acted on it.
    pub fn island_of(&self, index: u32) -> u32 {
        self.islands.island_of(index)
    }

    /// Bodies of an island of the last tick; none for [`Islands::FREE`].
    pub fn members(&self, island: u32) -> impl Iterator<Item = BodyId> {
        let members = if island == Islands::FREE { &[] } else { self.islands.members(island as usize) };
        members.iter().map(|&member| self.active[member as usize].id)
    }

    fn sum_up(&self, report: &mut StepReport) {
        report.islands = self.islands.len();
        self.onward.spent.add_to(report);
        for solve in &self.solves[..self.islands.len()] {
            solve.sum_up(report);
        }
    }

    /// Gathers and solves every island that starts anew; `onward` has where those go on from that did before.
    pub(super) fn solve(&mut self, scene: &Scene, onward: Option<&Onward>) {
        self.hand_out(scene);
        share_budget(&mut self.solves[..self.islands.len()], scene.settings.solver.budget);
        let Self { islands, active, acting, solves, workspaces, .. } = self;
        let sources = Sources { scene, active, touching: &acting.touching, onward };
        each_pending(&mut solves[..islands.len()], scene.threads, workspaces, |island, solve, workspace| {
            solve.gather(islands.members(island), sources);
            workspace.solve(solve, &scene.settings.solver);
        });
    }

    /// Solves every island that is pending again.
    pub(super) fn solve_again(&mut self, scene: &Scene) {
        let Self { islands, solves, workspaces, .. } = self;
        each_pending(&mut solves[..islands.len()], scene.threads, workspaces, |_, solve, workspace| {
            workspace.solve(solve, &scene.settings.solver);
        });
    }

    /// Writes what the solver came to.
    pub fn scatter(&mut self, scene: &mut Scene) -> StepReport {
        let mut report = StepReport::default();
        self.sum_up(&mut report);
        for &id in scene.order {
            let body = &mut scene.bodies[id];
            if let Some(active) = self.active.get(body.index as usize) {
                body.touching = self.rest_search.touching[body.index as usize];
                let solve = self.solves.get(self.islands.island_of(body.index) as usize);
                land(body, active, solve, (scene.settings, scene.state), &mut report);
            }
            body.forget_forces();
        }
        for solve in &self.solves[..self.islands.len()] {
            solve.write_back(scene, &mut report);
            if scene.settings.audit_energy {
                report.work_put_in += solve.problem.work_put_in() + solve.problem.rebound_work();
            }
        }
        report
    }
}

/// Has `job` done to every island that is pending.
fn each_pending(
    solves: &mut [Solve],
    threads: &Threads,
    workspaces: &mut Workspaces<Workspace>,
    job: impl Fn(usize, &mut Solve, &mut Workspace) + Sync,
) {
    let pending = || solves.iter().filter(|solve| solve.is_pending);
    let bodies: usize = pending().map(|solve| solve.blocks).sum();
    let is_worth_it = bodies >= PARALLEL_BODIES_MIN && pending().nth(1).is_some();
    threads.each(solves, workspaces, is_worth_it, |island, solve, workspace| {
        if solve.is_pending {
            job(island, solve, workspace);
        }
    });
}

/// Writes the state of a body at the end of the tick; `solve` is its island, where something acts on it.
fn land(
    body: &mut Body,
    active: &Active,
    solve: Option<&Solve>,
    (settings, state): (&Settings, &mut State),
    report: &mut StepReport,
) {
    report.bodies += 1;
    match (&body.figure, solve) {
        (None, Some(Solve { rest: Some(_), .. })) => report.dof += state.v(body.slice).len(),
        (None, solve) => {
            let start = active.start as usize;
            let end = |problem: &Problem| (problem.frames[start].twist(), problem.poses[start]);
            let solved = solve.and_then(|solve| Some((solve.node(active.start)?, end(&solve.problem))));
            let free;
            let (node, (twist, pose)) = match solved {
                Some(solved) => solved,
                None => {
                    free = body.node(state, settings.dt, settings.field());
                    (&free, (free.target, free.pose(free.target, settings.dt)))
                }
            };
            if settings.audit_energy {
                report.work_put_in += settings.dt * (body.force.dot(twist.linear) + body.torque.dot(twist.angular));
            }
            body.advance(node, twist, pose, state);
            body.remember_impulse(node, twist);
            report.dof += if node.rotates { 6 } else { 3 };
            if !body.is_sane(state) {
                body.quarantine(state, |q| node.start.write(q));
                report.quarantined += 1;
            }
        }
        (Some(own), Some(solve)) => {
            let figure = &solve.problem.figures.list()[active.figure as usize];
            if settings.audit_energy {
                let power: f64 = own.force.iter().zip(&figure.v1).map(|(force, rate)| force * rate).sum();
                report.work_put_in += settings.dt * power;
            }
            body.advance_figure(&figure.q1, &figure.v1, state);
            report.dof += figure.v1.len();
            if !body.is_sane(state) {
                body.quarantine(state, |q| q.copy_from_slice(&figure.q0));
                report.quarantined += 1;
            }
        }
        // A figure is always in an island.
        (Some(_), None) => {}
    }
}

impl Workspace {
    pub fn solve(&mut self, solve: &mut Solve, settings: &SolverSettings) {
        let Solve { problem, budget, report, is_pending, .. } = solve;
        *is_pending = false;
        *report = if problem.unknowns.iter().any(Unknown::is_wide) {
            self.rigid.solve(problem, settings, *budget)
        } else {
            self.particles.solve(problem, settings, *budget)
        };
    }
}

impl Solve {
    /// Starts an island anew, with bodies of so many blocks and nothing that acts on them.
    pub fn clear(&mut self, blocks: usize) {
        (self.is_pending, self.blocks, self.rest, self.first_energy) = (true, blocks, None, None);
        self.report = SolveReport::default();
        self.touching.clear();
        self.potentials.clear();
        self.contacts.clear();
        self.second.clear();
        self.rolling.clear();
        self.own_rods.clear();
    }

    /// Hands back what potentials remember, and looks how well they hold.
    fn write_back(&self, scene: &mut Scene, report: &mut StepReport) {
        let (problem, dt) = (&self.problem, self.problem.dt);
        self.write_back_contacts(scene.contacts, report);
        for (term, &contact) in problem.terms.rolling.iter().zip(&self.rolling) {
            let contact = &mut scene.contacts[self.contacts[contact as usize] as usize];
            let turn = finite_or_zero(term.final_anchor(dt, problem.pair(term)));
            let before = std::mem::replace(&mut contact.turn, turn);
            contact.is_settled &= turn == before;
        }
        self.write_back_joints(scene.potentials, report);
        for (term, &(body, rod)) in problem.terms.own_rods.iter().zip(&self.own_rods) {
            let figure = scene.bodies[body].figure.as_mut();
            if let Some(memory) = figure.and_then(|figure| figure.rods.get_mut(rod as usize)) {
                *memory = account(problem, term, report);
            }
        }
        for term in &problem.terms.axles {
            report.worst_joint_gap = report.worst_joint_gap.max(term.gap(problem.pair(term)));
        }
    }

    /// What contacts remember. Points of a pair share the stiffest: each by itself would stiffen for the load that its
    /// stiffness draws to it.
    fn write_back_contacts(&self, contacts: &mut [ContactPoint], report: &mut StepReport) {
        let (problem, dt) = (&self.problem, self.problem.dt);
        let is_solved = self.report.stopped_because == StoppedBecause::Tolerance;
        let mut outcomes = problem.terms.contacts.iter().map(|term| term.outcome(dt, problem.pair(term)));
        let mut sources = &self.contacts[..];
        while let [first, ..] = *sources {
            let count =
                sources.iter().take_while(|&&s| contacts[s as usize].same_pair(&contacts[first as usize])).count();
            let (pair, others) = sources.split_at(count);
            sources = others;
            let mut stiffest = 0.0_f64;
            for (&source, outcome) in pair.iter().zip(&mut outcomes) {
                let Outcome { normal_force, depth, is_still, anchor, stiffening, blow } = outcome;
                let contact = &mut contacts[source as usize];
                let anchor = finite_or_zero(anchor);
                let normal_force = if normal_force.is_finite() { normal_force } else { 0.0 };
                let load = normal_force.min(if is_solved { contact.normal_force } else { contact.load });
                contact.is_settled = is_still && contact.memory() == (anchor, normal_force, load, blow);
                (contact.anchor, contact.normal_force, contact.load, contact.blow) = (anchor, normal_force, load, blow);
                stiffest = if stiffening.is_finite() { stiffest.max(stiffening) } else { stiffest };
                report.worst_penetration = report.worst_penetration.max(depth);
            }
            for &source in pair {
                let contact = &mut contacts[source as usize];
                contact.is_settled &= contact.stiffening == stiffest;
                contact.stiffening = stiffest;
            }
        }
        // Points of the second look live for one tick.
        report.worst_penetration = outcomes.map(|outcome| outcome.depth).fold(report.worst_penetration, f64::max);
    }

    /// What joints remember: there is a term for each on the list, in its order.
    fn write_back_joints(&self, potentials: &mut Potentials, report: &mut StepReport) {
        let (problem, terms) = (&self.problem, &self.problem.terms);
        let (mut rods, mut ball_joints, mut hinges) =
            (terms.rods.iter(), terms.ball_joints.iter(), terms.hinges.iter());
        let (mut universal, mut fixed) = (terms.universal_joints.iter(), terms.fixed_joints.iter());
        let (mut sliders, mut distances) = (terms.sliders.iter(), terms.distance_limits.iter());
        let mut angles = terms.angle_limits.iter();
        for &what in &self.potentials {
            let (memory, new) = match what {
                PotentialId::Rod(id) => (&mut potentials.rods[id].memory, next(problem, &mut rods, report)),
                PotentialId::BallJoint(id) => {
                    (&mut potentials.ball_joints[id].memory, next(problem, &mut ball_joints, report))
                }
                PotentialId::Hinge(id) => (&mut potentials.hinges[id].memory, next(problem, &mut hinges, report)),
                PotentialId::UniversalJoint(id) => {
                    (&mut potentials.universal_joints[id].memory, next(problem, &mut universal, report))
                }
                PotentialId::FixedJoint(id) => {
                    (&mut potentials.fixed_joints[id].memory, next(problem, &mut fixed, report))
                }
                PotentialId::Slider(id) => (&mut potentials.sliders[id].memory, next(problem, &mut sliders, report)),
                PotentialId::DistanceLimit(id) => {
                    (&mut potentials.distance_limits[id].memory, next(problem, &mut distances, report))
                }
                PotentialId::AngleLimit(id) => {
                    (&mut potentials.angle_limits[id].memory, next(problem, &mut angles, report))
                }
                _ => continue,
            };
            *memory = new.unwrap_or(*memory);
        }
    }

    fn sum_up(&self, report: &mut StepReport) {
        let rest = self.rest.unwrap_or_default();
        report.contacts += self.problem.terms.contacts.len() + rest.contacts;
        report.worst_penetration = report.worst_penetration.max(rest.depth);
        self.report.add_to(report);
        let SolveReport { residual, stopped_because, .. } = self.report;
        report.unconverged_islands += usize::from(stopped_because != StoppedBecause::Tolerance);
        report.out_of_budget_islands += usize::from(stopped_because == StoppedBecause::Budget);
        report.residual = report.residual.max(residual);
    }
}

/// Gives every island that does not rest the share of `budget` that its bodies and contacts are of all.
fn share_budget(solves: &mut [Solve], budget: Option<u64>) {
    let size = |solve: &Solve| if solve.rest.is_some() { 0 } else { (solve.blocks + solve.contacts.len()) as u128 };
    let all: u128 = solves.iter().map(size).sum();
    for solve in solves {
        // No share is larger than the whole, so it fits.
        solve.budget = budget.map(|budget| (u128::from(budget) * size(solve) / all.max(1)) as u64);
    }
}

/// What the next joint of a type remembers.
fn next<'a, J: Joint + 'a>(
    problem: &Problem,
    joints: &mut impl Iterator<Item = &'a J>,
    report: &mut StepReport,
) -> Option<Memory> {
    joints.next().map(|joint| account(problem, joint, report))
}

/// Counts a joint in; answers what it remembers.
fn account(problem: &Problem, joint: &impl Joint, report: &mut StepReport) -> Memory {
    let at = problem.pair(joint);
    report.worst_joint_gap = report.worst_joint_gap.max(joint.gap(at));
    report.worst_joint_tilt = report.worst_joint_tilt.max(joint.tilt(at));
    report.open_joints += usize::from(joint.is_open(at));
    let memory = joint.remember(at);
    Memory { force: finite_or_zero(memory.force), ..memory }
}

/// What a potential remembers must not carry a non-finite number into the next tick.
pub(super) fn finite_or_zero(v: DVec3) -> DVec3 {
    if v.is_finite() { v } else { DVec3::ZERO }
}
