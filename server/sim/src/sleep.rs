//! Sleep: an island that has been still for a while leaves the tick until something wakes it.
//!
//! Owns what stillness is, and the groups that sleep and wake together. What sleeping means to lists, trees and
//! potentials is for [`World`](crate::World) to do.

use glam::DVec3;
use slab::Slab;

use crate::dof::{Body, BodyId, DofKind, Inertia, PartPoint};
use crate::settings::SleepSettings;
use crate::state::State;

/// What is still may change its speed by this fraction of the threshold while its time runs: a ball at the top of its
/// flight is slow, and is not at rest.
const STEADY: f64 = 0.5;

/// How still a body has been.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    /// For how long, s.
    still: f64,
    /// Rates when that began.
    rates: Box<[f64]>,
}

impl Rest {
    /// Of a body with so many rates.
    pub fn new(rates: u32) -> Self {
        Self { still: 0.0, rates: vec![0.0; rates as usize].into() }
    }

    /// Something happened to it.
    pub fn reset(&mut self) {
        self.still = 0.0;
    }
}

/// Groups of bodies that fell asleep together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sleepers {
    groups: Slab<Vec<BodyId>>,
    /// Bodies in them.
    pub count: usize,
}

impl Sleepers {
    /// A new group. Answers its key.
    pub fn add(&mut self, bodies: Vec<BodyId>) -> u32 {
        self.count += bodies.len();
        self.groups.insert(bodies) as u32
    }

    /// Dissolves a group.
    pub fn remove(&mut self, group: u32) -> Vec<BodyId> {
        let bodies = self.groups.try_remove(group as usize).unwrap_or_default();
        self.count -= bodies.len();
        bodies
    }

    /// One body of every group.
    pub fn representatives(&self) -> impl Iterator<Item = BodyId> {
        self.groups.iter().filter_map(|(_, bodies)| bodies.first().copied())
    }
}

impl Body {
    /// Looks at a body after a tick of `dt`. Answers for how long it has been still, s.
    pub(crate) fn watch(&mut self, state: &State, settings: &SleepSettings, dt: f64) -> f64 {
        if self.is_slow(state, settings) && self.is_steady(state, settings) {
            self.rest.still += dt;
        } else {
            self.rest.still = 0.0;
            self.rest.rates.copy_from_slice(state.v(self.slice));
        }
        self.rest.still
    }

    /// Whether no part of it is faster than the thresholds.
    fn is_slow(&self, state: &State, settings: &SleepSettings) -> bool {
        let (q, v) = (state.q(self.slice), state.v(self.slice));
        let slow = |linear: DVec3, angular: DVec3| {
            linear.length() <= settings.linear_speed && angular.length() <= settings.angular_speed
        };
        let Some(figure) = &self.figure else {
            let twist = self.twist(state);
            return slow(twist.linear, twist.angular);
        };
        match figure.dof.inertia() {
            Inertia::Points(_) => v.chunks_exact(3).all(|v| slow(DVec3::from_slice(v), DVec3::ZERO)),
            Inertia::Parts(parts) => (0..).zip(parts).all(|(part, inertia)| {
                let twist = figure.dof.frame(PartPoint { part, point: inertia.centre }, q, v).twist();
                slow(twist.linear, twist.angular)
            }),
        }
    }

    /// Whether it is about as fast as when its time began to run.
    fn is_steady(&self, state: &State, settings: &SleepSettings) -> bool {
        let v = state.v(self.slice);
        let (linear, angular) = (STEADY * settings.linear_speed, STEADY * settings.angular_speed);
        if let Some(figure) = &self.figure
            && let Inertia::Parts(_) = figure.dof.inertia()
        {
            // A rate times √(its inertia / mass) is the speed of a point at the radius of gyration.
            let mut changes = v.iter().zip(&self.rest.rates).zip(&figure.masses);
            return changes.all(|((v, before), mass)| (v - before).abs() * (mass / self.mass).sqrt() <= linear);
        }
        let mut changes = v.chunks_exact(3).zip(self.rest.rates.chunks_exact(3)).enumerate();
        changes.all(|(i, (v, before))| {
            let limit = if self.kind == DofKind::RigidBody && i == 1 { angular } else { linear };
            (DVec3::from_slice(v) - DVec3::from_slice(before)).length() <= limit
        })
    }
}
