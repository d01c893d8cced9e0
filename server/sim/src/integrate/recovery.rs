//! Recovery moves positions only: what overlaps parts, and keeps nothing of the speed at which it does.
//!
//! A contact that starts out deep is solved twice. The first solution, with the depth taken back at a bounded speed, moves
//! Q. The second is that of the same tick with the bodies just touching; it is what Q' and the contacts' forces become, so
//! that momentum is that of a tick without recovery, unless that would leave more energy of motion than the first one: what
//! is wedged in stands still, though a tick in which it just touched would let it go. Only islands with a deep contact pay for it.

use super::StepReport;
use super::spots::Active;
use super::step::{Integrator, Scene, Solve, finite_or_zero};
use crate::dof::{Body, Twist, motion};
use crate::potential::contact::ContactTerm;
use crate::settings::Settings;
use crate::state::State;
use glam::DVec3;

impl Integrator {
    /// After Q and Q' have been written: takes out of Q' what recovery brought.
    pub fn forget_recovery(&mut self, scene: &mut Scene, report: &mut StepReport) {
        let count = self.islands.len();
        self.solves[..count].iter_mut().for_each(|solve| solve.start_over_without_recovery(scene));
        let settings = scene.settings;
        let work_put_in = |solve: &Solve| if settings.audit_energy { solve.problem.work_put_in() } else { 0.0 };
        let deep = self.solves[..count].iter().filter(|solve| solve.first_energy.is_some());
        // The motion that is kept is paid for by what was done on its way, not on the way that recovery went.
        report.work_put_in -= deep.map(work_put_in).sum::<f64>();
        self.solve_again(scene);
        for (island, solve) in self.solves[..count].iter().enumerate() {
            let Some(first_energy) = solve.first_energy else { continue };
            solve.report.add_to(report);
            report.work_put_in += work_put_in(solve);
            let share = (first_energy / solve.problem.kinetic_energy()).sqrt().min(1.0);
            for &member in self.islands.members(island) {
                let active = self.active[member as usize];
                let body = &mut scene.bodies[active.id];
                if body.quarantined {
                    continue;
                }
                if scene.settings.audit_energy {
                    report.work_put_in += solve.work_of_recovery(&active, body, scene.state, scene.settings);
                }
                if let Some(figure) = solve.problem.figures.list().get(active.figure as usize) {
                    body.set_figure_rates(figure.v1.iter().map(|rate| share * rate), scene.state);
                } else if let Some(node) = solve.node(active.start) {
                    let Twist { linear, angular } = solve.problem.frames[active.start as usize].twist();
                    body.keep_twist(node, Twist { linear: share * linear, angular: share * angular }, scene.state);
                }
            }
            solve.take_back_forces(scene);
        }
    }
}

impl Solve {
    /// Where recovery acts, prepares the second solution, which goes on from where the first one ended, unless bodies parted
    /// so fast there that another start is nearer.
    fn start_over_without_recovery(&mut self, scene: &Scene) {
        let contacts = &mut self.problem.terms.contacts;
        if scene.settings.contact.recovery_speed > 0.0 && contacts.iter().any(ContactTerm::recovers) {
            contacts.iter_mut().for_each(|contact| contact.stop_recovery());
            (self.is_pending, self.problem.is_parting) = (true, true);
            self.first_energy = Some(self.problem.kinetic_energy());
        }
    }

    /// By how much more energy the body has where recovery put it than where the second solution would, J.
    fn work_of_recovery(&self, active: &Active, body: &Body, state: &State, settings: &Settings) -> f64 {
        let q = state.q(body.slice);
        let lift = |moment: DVec3| settings.field().energy(body.motion(state).moment - moment);
        if let (Some(own), Some(figure)) = (&body.figure, self.problem.figures.list().get(active.figure as usize)) {
            let stored = |q: &[f64]| own.stored_energy(q, &figure.v1, settings.dt);
            lift(motion(&*own.dof, &figure.q1, &figure.v1).moment) + stored(q) - stored(&figure.q1)
        } else if self.node(active.start).is_some() {
            lift(body.mass * self.problem.poses[active.start as usize].position)
        } else {
            0.0
        }
    }

    /// Contacts remember the forces of the second solution.
    fn take_back_forces(&self, scene: &mut Scene) {
        let (problem, dt) = (&self.problem, self.problem.dt);
        for (term, &source) in problem.terms.contacts.iter().zip(&self.contacts) {
            let force = term.normal_force(dt, problem.pair(term));
            let contact = &mut scene.contacts[source as usize];
            contact.normal_force = finite_or_zero(DVec3::X * force).x;
            contact.load = contact.load.min(contact.normal_force);
            contact.is_settled = false;
        }
    }
}
