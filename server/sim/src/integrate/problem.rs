//! One island: its bodies, its potentials, and the residual that Newton makes zero.

use glam::DVec3;

use super::block::Entry;
use crate::dof::{Node, Twist};
use crate::potential::axle::AxleTerm;
use crate::potential::ball_joint::BallJointTerm;
use crate::potential::contact::ContactTerm;
use crate::potential::pd::PdTerm;
use crate::potential::spring::SpringTerm;
use crate::potential::{Candidate, FIXED, NodeIndex, Term, Trial, Wrench};

/// The potentials of an island, by type.
#[derive(Default)]
pub(crate) struct Terms {
    pub contacts: Vec<ContactTerm>,
    pub springs: Vec<SpringTerm>,
    pub ball_joints: Vec<BallJointTerm>,
    pub axles: Vec<AxleTerm>,
    pub pds: Vec<PdTerm>,
}

/// Something to be done with every potential, in a fixed order.
pub(super) trait Visitor {
    fn visit<T: Term>(&mut self, terms: &mut [T]);
}

impl Terms {
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        visitor.visit(&mut self.contacts);
        visitor.visit(&mut self.springs);
        visitor.visit(&mut self.ball_joints);
        visitor.visit(&mut self.axles);
        visitor.visit(&mut self.pds);
    }

    pub fn clear(&mut self) {
        self.contacts.clear();
        self.springs.clear();
        self.ball_joints.clear();
        self.axles.clear();
        self.pds.clear();
    }
}

/// An island. Bodies are in elimination order.
#[derive(Default)]
pub(crate) struct Problem {
    pub dt: f64,
    pub nodes: Vec<Node>,
    pub terms: Terms,
    /// The candidate state; after solving, the state at the end of the tick.
    pub trial: Vec<Trial>,
}

impl Problem {
    /// The candidate that the trial holds.
    pub fn candidate(&self) -> Candidate<'_> {
        Candidate { dt: self.dt, trial: &self.trial }
    }

    /// Moves the trial to the twists `u`.
    pub(super) fn move_to<const D: usize>(&mut self, u: &[Entry<D>]) {
        self.trial.clear();
        self.trial.extend(self.nodes.iter().zip(u).map(|(node, u)| {
            let twist = twist_of(u);
            Trial { pose: node.pose(twist, self.dt), twist }
        }));
    }

    /// Incremental potential ½ |u − u*|²_M + Φ at the trial, J, and its gradient, the residual, in kg m/s and kg m²/s.
    pub(super) fn evaluate<const D: usize>(&mut self, residual: &mut Vec<Entry<D>>) -> f64 {
        residual.clear();
        let mut energy = 0.0;
        for (node, trial) in self.nodes.iter().zip(&self.trial) {
            let linear = trial.twist.linear - node.target.linear;
            let angular = trial.twist.angular - node.target.angular;
            let momentum = Wrench { force: node.mass * linear, torque: node.inertia * angular };
            energy += 0.5 * (momentum.force.dot(linear) + momentum.torque.dot(angular));
            let mut entry = [0.0; D];
            add_wrench(&mut entry, momentum, 1.0);
            residual.push(entry);
        }
        let candidate = Candidate { dt: self.dt, trial: &self.trial };
        let mut visitor = Evaluate { candidate, residual, energy };
        self.terms.visit(&mut visitor);
        visitor.energy
    }

    /// Takes what is frozen during a Newton iteration from the trial.
    pub(super) fn relinearise(&mut self) {
        let candidate = Candidate { dt: self.dt, trial: &self.trial };
        self.terms.visit(&mut Relinearise { candidate });
    }

    /// Tells the potentials which step the linear model proposes.
    pub(super) fn propose<const D: usize>(&mut self, step: &[Entry<D>]) {
        self.terms.visit(&mut Propose { step, dt: self.dt });
    }

    /// Largest residual of any body in energy norm, as a speed of the body, m/s.
    pub(super) fn residual_speed<const D: usize>(&self, residual: &[Entry<D>]) -> f64 {
        let squared = |(node, entry): (&Node, &Entry<D>)| {
            let Twist { linear, angular } = twist_of(entry);
            let turning = if node.rotates { angular.dot(node.inverse_inertia * angular) } else { 0.0 };
            (linear.length_squared() / node.mass + turning) / node.mass
        };
        self.nodes
            .iter()
            .zip(residual)
            .map(squared)
            .fold(0.0, |worst: f64, x| if x > worst || x.is_nan() { x } else { worst })
            .sqrt()
    }
}

struct Evaluate<'a, const D: usize> {
    candidate: Candidate<'a>,
    residual: &'a mut Vec<Entry<D>>,
    energy: f64,
}

impl<const D: usize> Visitor for Evaluate<'_, D> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let (energy, wrenches) = term.evaluate(&self.candidate);
            self.energy += energy;
            for (node, wrench) in term.nodes().into_iter().zip(wrenches) {
                if node != FIXED {
                    add_wrench(&mut self.residual[node as usize], wrench, self.candidate.dt);
                }
            }
        }
    }
}

struct Relinearise<'a> {
    candidate: Candidate<'a>,
}

impl Visitor for Relinearise<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            term.relinearise(&self.candidate);
        }
    }
}

struct Propose<'a, const D: usize> {
    step: &'a [Entry<D>],
    dt: f64,
}

impl<const D: usize> Visitor for Propose<'_, D> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        let displacement = |node: NodeIndex| {
            if node == FIXED {
                return Twist::default();
            }
            let Twist { linear, angular } = twist_of(&self.step[node as usize]);
            Twist { linear: linear * self.dt, angular: angular * self.dt }
        };
        for term in terms {
            term.propose(term.nodes().map(displacement));
        }
    }
}

/// A body's share of a vector as a twist; without rotation where D is 3.
pub(super) fn twist_of<const D: usize>(entry: &Entry<D>) -> Twist {
    let angular = if D == 6 { DVec3::from_slice(&entry[3..]) } else { DVec3::ZERO };
    Twist { linear: DVec3::from_slice(entry), angular }
}

/// A twist as a body's share of a vector.
pub(super) fn entry_of<const D: usize>(twist: Twist) -> Entry<D> {
    let mut entry = [0.0; D];
    add_wrench(&mut entry, Wrench { force: twist.linear, torque: twist.angular }, 1.0);
    entry
}

fn add_wrench<const D: usize>(entry: &mut Entry<D>, wrench: Wrench, factor: f64) {
    for (i, x) in wrench.force.to_array().into_iter().enumerate() {
        entry[i] += factor * x;
    }
    if D == 6 {
        for (i, x) in wrench.torque.to_array().into_iter().enumerate() {
            entry[3 + i] += factor * x;
        }
    }
}
