//! How the arena's drivers get out of where they are stuck.

use super::Motion;
use crate::Controls;

/// Slower than this while it should drive is stuck, m/s.
const STUCK_SPEED: f64 = 0.5;
/// So long it may be stuck before it backs out, s.
const STUCK_TIME: f64 = 2.0;
/// So long it backs out, s, and by so much longer each time that it is stuck soon again; after so many times it tries the
/// other side.
const BACK_TIME: f64 = 1.5;
const BACK_MORE: f64 = 0.7;
const BACK_MOST: u32 = 4;
/// So long it then drives on past what was in the way, s, and longer likewise.
const DETOUR_TIME: f64 = 1.5;
/// Whoever was not stuck for so long is free, s.
const FREE_TIME: f64 = 8.0;
/// So long it may lie on its side or roof before it asks for a reset, s: longer than cars take that get up by
/// themselves.
const OVERTURNED_TIME: f64 = 5.0;

/// What a driver knows of being stuck.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recovery {
    stuck_for: f64,
    back_for: f64,
    detour_for: f64,
    free_for: f64,
    /// How often it backed out without being free since.
    tries: u32,
    overturned_for: f64,
}

impl Recovery {
    /// The controls that are `wanted`, unless the car is stuck: then those that free it. Backs out and goes round
    /// what is in the way; asks for a reset where the car lies on its side or roof for long.
    pub fn watch(&mut self, motion: &Motion, wanted: Controls, dt: f64) -> Controls {
        self.overturned_for = if motion.upright() < 0.5 { self.overturned_for + dt } else { 0.0 };
        if self.overturned_for > OVERTURNED_TIME {
            self.overturned_for = 0.0;
            return Controls { reset: true, ..Controls::default() };
        }
        // To one side, ever farther, and then to the other: what is in the way may be longer on one of them.
        let side = if (self.tries / BACK_MOST).is_multiple_of(2) { 1.0 } else { -1.0 };
        if self.back_for > 0.0 {
            self.back_for -= dt;
            return Controls { throttle: 0.6, reverse: true, steer: -side, ..Controls::default() };
        }
        if self.detour_for > 0.0 {
            self.detour_for -= dt;
            return Controls { throttle: 0.4, brake: 0.0, steer: 0.5 * side, ..wanted };
        }
        self.free_for += dt;
        if self.free_for > FREE_TIME {
            self.tries = 0;
        }
        let is_stuck = wanted.throttle > 0.0 && motion.velocity.length() < STUCK_SPEED;
        self.stuck_for = if is_stuck { self.stuck_for + dt } else { 0.0 };
        if self.stuck_for > STUCK_TIME {
            self.tries = self.tries.saturating_add(1);
            (self.stuck_for, self.free_for) = (0.0, 0.0);
            let more = BACK_MORE * f64::from(self.tries % BACK_MOST);
            (self.back_for, self.detour_for) = (BACK_TIME + more, DETOUR_TIME + more);
        }
        wanted
    }
}
