//! How smoothly other cars move on a screen.

use std::{collections::HashMap, time::Instant};

use glam::Vec3;

use crate::{Roster, WorldState};

/// A car cannot be shown so far from where it was, m: it was put somewhere else.
const SHOWN_MAX: f32 = 10.0;

/// Compares what is shown with what was shown before.
#[derive(Debug, Default)]
pub struct Watcher {
    /// Position and velocity of the root slice of each car.
    last: HashMap<u32, (Vec3, Vec3)>,
    at: Option<Instant>,
}

impl Watcher {
    /// By how much each other car is off where its speed would have taken it since the last look, m.
    pub fn look(&mut self, world: &WorldState, roster: &Roster, own: u32, now: Instant) -> Vec<f32> {
        let elapsed_s = self.at.replace(now).map_or(0.0, |at| now.saturating_duration_since(at).as_secs_f32());
        let others = roster.actors().filter(|actor| actor.kind == super::view::VEHICLE && actor.id != own);
        let roots = others.filter_map(|actor| Some(actor.parts.first()?.slice));
        let mut seen = HashMap::with_capacity(self.last.len());
        let mut jumps = Vec::new();
        for root in roots {
            let Ok(at) = world.slices.binary_search_by_key(&root, |slice| slice.id) else { continue };
            let slice = &world.slices[at];
            let (Some(position), Some(velocity)) = (slice.q.get(..3), slice.v.get(..3)) else { continue };
            let (position, velocity) = (Vec3::from_slice(position), Vec3::from_slice(velocity));
            if let Some((before, speed)) = self.last.get(&root) {
                // The mean of both speeds: a steady turn or a steady start is no jump.
                let jump = position.distance(*before + 0.5 * (velocity + speed) * elapsed_s);
                jumps.extend((jump < SHOWN_MAX).then_some(jump));
            }
            seen.insert(root, (position, velocity));
        }
        self.last = seen;
        jumps
    }
}
