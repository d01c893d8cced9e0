//! Islands that rest: what was in balance where it stood, and to which nothing has happened since, stays as it is.
//!
//! An island is a function of its bodies' state, of the forces on them and of what its contacts remember. Where all bodies
//! stand still, their last tick began and ended like that, and every contact is the one that it was, the tick would be the
//! last one again, to the last bit; so it is not gathered, nor solved. Joints, motors and figures always are.

use glam::DVec3;

use super::spots::Spot;
use super::step::{Integrator, Scene, Solve};
use crate::dof::{Body, Twist};
use crate::island::Islands;
use crate::settings::Settings;
use crate::state::State;

/// What is told of an island that rests.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rest {
    /// Contact points.
    pub contacts: usize,
    /// The deepest of them, m.
    pub depth: f64,
}

/// Stands for the contact points of a body that other potentials act on: without them it would be in balance no more.
const HELD: u32 = u32::MAX;

/// Memory of the search.
#[derive(Default)]
pub(super) struct RestSearch {
    /// Of every island, unless something in it is to be solved.
    islands: Vec<Option<Rest>>,
    /// Contact points of every body, or [`HELD`].
    pub touching: Vec<u32>,
}

impl Integrator {
    /// Finds the islands that rest; they are no longer pending.
    pub(super) fn find_rest(&mut self, scene: &Scene) {
        let Self { islands, active, acting, solves, rest_search, .. } = self;
        let RestSearch { islands: resting, touching } = rest_search;
        resting.clear();
        resting.resize(islands.len(), Some(Rest::default()));
        touching.clear();
        touching.resize(active.len(), 0);
        for body in acting.driven() {
            touching[body as usize] = HELD;
            resting[islands.island_of(body) as usize] = None;
        }
        for on in &acting.touching {
            let points = &scene.contacts[on.points.0 as usize..on.points.1 as usize];
            let mut island = Islands::FREE;
            for body in on.spots.into_iter().filter_map(Spot::body) {
                let count = &mut touching[body as usize];
                *count = count.saturating_add(points.len() as u32);
                island = islands.island_of(body);
            }
            let Some(Some(rest)) = resting.get_mut(island as usize) else { continue };
            rest.contacts += points.len();
            rest.depth = points.iter().map(|point| -point.gap).fold(rest.depth, f64::max);
            if !points.iter().all(|point| point.is_settled) {
                resting[island as usize] = None;
            }
        }
        for ((index, active), &touching) in (0..).zip(active.iter()).zip(touching.iter()) {
            let Some(rest @ Some(_)) = resting.get_mut(islands.island_of(index) as usize) else { continue };
            let body = &scene.bodies[active.id];
            if body.touching != touching || !body.is_balanced(scene.state, scene.settings) {
                *rest = None;
            }
        }
        for (solve, rest) in solves.iter_mut().zip(resting) {
            if let Some(rest) = *rest {
                solve.rest(rest, scene.settings);
            }
        }
    }
}

impl Solve {
    /// Leaves the island as it is.
    fn rest(&mut self, rest: Rest, settings: &Settings) {
        self.problem.clear(settings.dt, settings.field());
        self.problem.stand_still(self.blocks);
        (self.rest, self.is_pending) = (Some(rest), false);
    }
}

impl Body {
    /// Whether it stands still, and did so throughout the last tick, with nothing but gravity to be held against.
    fn is_balanced(&self, state: &State, settings: &Settings) -> bool {
        let held = Twist { linear: -settings.field().fall(settings.dt), angular: DVec3::ZERO };
        let is_free = self.force == DVec3::ZERO && self.torque == DVec3::ZERO;
        self.figure.is_none() && is_free && self.impulse == held && self.twist(state) == Twist::REST
    }
}
