//! Drives at the nearest other car.

use pita_protocol::message::Controls;

use super::{Script, View, Wander, towards};

/// Speed that is held, m/s.
const SPEED: f32 = 10.0;
/// Nearer than this the other one is caught, m: about a car's length between centres.
const CAUGHT: f32 = 5.0;
/// After a catch it lets go for so many ticks, else all cars end in one heap.
const LET_GO_TICKS: u64 = 90;
/// The other's motion is led by so much, s.
const LEAD_S: f32 = 0.4;

/// Chases the nearest car; wanders while there is none, and for a while after it caught one.
#[derive(Debug)]
pub struct Chase {
    idle: Wander,
    free_until: u64,
}

impl Chase {
    /// `seed` is for the time between chases.
    pub fn new(seed: u64) -> Self {
        Self { idle: Wander::new(seed), free_until: 0 }
    }
}

impl Script for Chase {
    fn drive(&mut self, view: &View, tick: u64) -> Controls {
        let own = &view.own;
        let distance = |other: &super::Body| other.position.distance_squared(own.position);
        let others = if tick < self.free_until { Vec::new() } else { view.others() };
        let Some(nearest) = others.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return self.idle.drive(view, tick);
        };
        if distance(&nearest) < CAUGHT * CAUGHT {
            self.free_until = tick.saturating_add(LET_GO_TICKS);
        }
        towards(own, own.heading_to(nearest.position + nearest.velocity * LEAD_S), SPEED)
    }
}
