//! An island that was not solved may not gain energy.
//!
//! At the solution of a tick the energy of motion grows by no more than the work of what acts: that is implicit Euler, and
//! convex potentials. Short of the solution nothing says so; a state with less incremental potential than the start may
//! move at up to twice the speed, and the next tick starts from that. So where a solve ends early its rates shrink until
//! they are paid for. Contacts, joints and limits may take energy, not give it, but for restitution. What recovery brings is not asked about:
//! Q' forgets it (`recovery`).

use super::problem::{Problem, Terms, Unknown};
use crate::dof::{Node, Twist, motion};
use crate::potential::contact::ContactTerm;

/// What an island has and gets in a tick, J.
#[derive(Clone, Copy, Debug, Default)]
struct Account {
    /// Energy of motion at the start.
    before: f64,
    /// Energy of motion at the candidate.
    now: f64,
    /// Of gravity, outer forces and whatever may push, on the way to the candidate.
    work: f64,
}

impl Problem {
    /// Energy of motion at the candidate, J.
    pub(super) fn kinetic_energy(&self) -> f64 {
        let bodies = self.unknowns.iter().zip(&self.frames).map(|(unknown, frame)| match unknown {
            Unknown::Body(node) => kinetic(node, frame.twist()),
            Unknown::Rates(_) => 0.0,
        });
        let figures = self.figures.list().iter().map(|figure| motion(&*figure.dof, &figure.q1, &figure.v1).energy);
        bodies.sum::<f64>() + figures.sum::<f64>()
    }

    /// The share of the candidate's rates that its energy lets it keep, from 0 to 1. Figures were evaluated there.
    pub(super) fn affordable_share(&self) -> f64 {
        if self.terms.contacts.iter().any(ContactTerm::recovers) {
            return 1.0;
        }
        let mut account = Account::default();
        for (unknown, frame) in self.unknowns.iter().zip(&self.frames) {
            if let Unknown::Body(node) = unknown {
                account.add_body(node, frame.twist());
            }
        }
        for figure in self.figures.list() {
            let [before, now] =
                [(&figure.q0, &figure.v0), (&figure.q1, &figure.v1)].map(|(q, v)| motion(&*figure.dof, q, v));
            account.before += before.energy;
            account.now += now.energy;
            account.work += self.gravity.fall(self.dt).dot(now.momentum) + figure.work(self.dt);
        }
        let Terms { springs, .. } = &self.terms;
        account.work += self.work_put_in() + self.rebound_work() + self.work_of(springs);
        account.share()
    }
}

/// Energy of a body that moves with a twist, J.
fn kinetic(node: &Node, Twist { linear, angular }: Twist) -> f64 {
    0.5 * (node.mass * linear.length_squared() + angular.dot(node.inertia * angular))
}

impl Account {
    fn add_body(&mut self, node: &Node, twist: Twist) {
        // What turns without torque keeps its energy, not its angular velocity.
        self.before += kinetic(node, Twist { angular: node.target.angular, ..node.before });
        self.now += kinetic(node, twist);
        self.work += node.mass * (node.target.linear - node.before.linear).dot(twist.linear);
    }

    /// The largest s up to 1 with s² now ≤ before + s work.
    fn share(&self) -> f64 {
        let Self { before, now, work } = *self;
        let is_paid_for = now <= before + work;
        let share = (work + (work * work + 4.0 * now * before).sqrt()) / (2.0 * now);
        if is_paid_for || !share.is_finite() { 1.0 } else { share.clamp(0.0, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_what_energy_and_work_pay_for() {
        let share = |before, now, work| Account { before, now, work }.share();
        assert_eq!(share(1.0, 1.0, 0.0), 1.0);
        assert_eq!(share(1.0, 4.0, 0.0), 0.5);
        assert_eq!(share(0.0, 4.0, 1.0), 0.25);
        assert_eq!(share(1.0, 4.0, 3.0), 1.0);
        assert_eq!(share(0.0, 4.0, -1.0), 0.0);
        assert_eq!(share(f64::NAN, 4.0, 0.0), 1.0, "left to quarantine");
        for (before, now, work) in [(3.0, 7.0, 2.0), (3.0, 7.0, -2.0)] {
            let s: f64 = share(before, now, work);
            assert!((s * s * now - before - s * work).abs() < 1e-12);
        }
    }
}
