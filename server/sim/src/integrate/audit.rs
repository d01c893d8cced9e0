//! The audit of a tick's energy: what bodies were given by those who may give.
//!
//! Owns the work of potentials that put energy in: motors, the springs and torques of axles, anti-roll bars and controllers.
//! Contacts, joints and limits may only take, but for what restitution gives back; what springs and elastic bodies hold is part of the world's energy.

use super::problem::{Problem, Terms};
use crate::potential::{Term, Wrench};

impl Problem {
    /// What contacts give back of blows that they took up in the tick before, J: restitution.
    pub(super) fn rebound_work(&self) -> f64 {
        self.terms.contacts.iter().map(|contact| contact.rebound_work(self.dt, self.pair(contact))).sum()
    }

    /// Work that potentials put into the island in the tick that is solved, J.
    pub(super) fn work_put_in(&self) -> f64 {
        let Terms { motors, axles, anti_roll_bars, pds, .. } = &self.terms;
        let axles: f64 = axles.iter().map(|axle| axle.work(self.dt, self.pair(axle))).sum();
        self.work_of(motors) + axles + self.work_of(anti_roll_bars) + self.work_of(pds)
    }

    /// Forces at the end of the tick times the ways that they went.
    pub(super) fn work_of(&self, terms: &[impl Term]) -> f64 {
        let work = |term| {
            let frames = self.pair(term);
            let (_, gradients) = Term::evaluate(term, self.dt, frames);
            let powers = frames
                .iter()
                .zip(&gradients)
                .map(|(frame, Wrench { force, torque })| force.dot(frame.linear) + torque.dot(frame.angular));
            -self.dt * powers.sum::<f64>()
        };
        terms.iter().map(work).sum()
    }
}
