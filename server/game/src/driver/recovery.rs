//! How the arena's drivers get out of where they are stuck, however they came there.
//!
//! What counts is the way that a car made of its own will: not speed, for it may turn its wheels or be pushed to and fro,
//! and not the way back, for it may drive at the same wall again. A driver who is stuck backs out and goes round what is in
//! the way; then jumps and boosts; and in the end asks to be put to a spawn point, at the latest [`GIVE_UP_TIME`] after the
//! last progress.

use glam::DVec3;

use super::Motion;
use crate::Controls;

/// So far from where it was before it has come on, m: more than a car's length.
pub const PROGRESS: f64 = 5.0;
/// Who has not come on for so long is given a new start, s: backing out and a jump take ten.
pub const GIVE_UP_TIME: f64 = 12.0;

/// Slower than this while it should drive is stuck, m/s.
const STUCK_SPEED: f64 = 0.5;
/// So long it may be so slow before it does something, s.
const STUCK_TIME: f64 = 2.0;
/// So long it may be so slow on its way round what was in the way, s.
const DETOUR_STUCK_TIME: f64 = 0.7;
/// So long it may turn about one place, s: a car that is pushed by others is not slow.
const TURNING_TIME: f64 = 6.0;
/// So long it backs out, s, and by so much longer each time that it is stuck soon again; after so many times it tries the
/// other side.
const BACK_TIME: f64 = 1.5;
const BACK_MORE: f64 = 0.7;
const BACK_MOST: u32 = 4;
/// So long it then drives on past what was in the way, s, and longer likewise.
const DETOUR_TIME: f64 = 1.5;
/// So long it pushes itself up and on by all that it has, s.
const LEAP_TIME: f64 = 1.2;
/// Whoever was not stuck for so long is free, s.
const FREE_TIME: f64 = 8.0;
/// Who was stuck so often without being free is given a new start: it shuttles before something that it cannot round.
const TRIES_MAX: u32 = 8;
/// So long it may lie on its side or roof before it asks for a reset, s: longer than cars take that get up by
/// themselves.
const OVERTURNED_TIME: f64 = 5.0;

/// What a driver knows of being stuck.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recovery {
    /// Where it last had come on, m; unknown before the first tick.
    start: Option<DVec3>,
    /// Since then, s.
    here_for: f64,
    stuck_for: f64,
    manoeuvre: Manoeuvre,
    free_for: f64,
    /// How often it was stuck without being free since.
    tries: u32,
    /// How often without having come on since.
    tries_here: u32,
    overturned_for: f64,
}

/// What it does about it, and for how long still, s.
#[derive(Clone, Copy, Debug, Default)]
enum Manoeuvre {
    /// Nothing: it drives as it wants to.
    #[default]
    None,
    /// Drives backwards; then passes what is in the way for so long.
    Back { left: f64, then_pass: f64 },
    /// Passes what was in the way.
    Pass { left: f64 },
    /// Jumps and boosts.
    Leap { left: f64 },
}

impl Recovery {
    /// The controls that are `wanted`, unless the car is stuck: then those that free it. `None` where it gives up and is to
    /// be put somewhere else.
    pub fn watch(&mut self, motion: &Motion, wanted: Controls, dt: f64) -> Option<Controls> {
        self.measure(motion, dt);
        if self.here_for > GIVE_UP_TIME || self.tries > TRIES_MAX {
            *self = Self::default();
            return None;
        }
        self.overturned_for = if motion.upright() < 0.5 { self.overturned_for + dt } else { 0.0 };
        if self.overturned_for > OVERTURNED_TIME {
            self.overturned_for = 0.0;
            return Some(Controls { reset: true, ..Controls::default() });
        }
        let is_slow = motion.velocity.length() < STUCK_SPEED;
        Some(self.manoeuvre(is_slow, wanted, dt))
    }

    /// Counts the way that it makes while it drives as it wants to, and passing what was in the way.
    fn measure(&mut self, motion: &Motion, dt: f64) {
        self.here_for += dt;
        let start = *self.start.get_or_insert(motion.position);
        let is_own_way = matches!(self.manoeuvre, Manoeuvre::None | Manoeuvre::Pass { .. });
        if is_own_way && motion.position.distance(start) > PROGRESS {
            (self.start, self.here_for, self.tries_here) = (Some(motion.position), 0.0, 0);
        }
    }

    fn manoeuvre(&mut self, is_slow: bool, wanted: Controls, dt: f64) -> Controls {
        // To one side, ever farther, and then to the other: what is in the way may be longer on one of them.
        let side = if (self.tries / BACK_MOST).is_multiple_of(2) { 1.0 } else { -1.0 };
        match &mut self.manoeuvre {
            Manoeuvre::Back { left, then_pass } => {
                *left -= dt;
                if *left <= 0.0 {
                    (self.manoeuvre, self.stuck_for) = (Manoeuvre::Pass { left: *then_pass }, 0.0);
                }
                Controls { throttle: 0.6, reverse: true, steer: -side, ..Controls::default() }
            }
            Manoeuvre::Pass { left } => {
                *left -= dt;
                self.stuck_for = if is_slow { self.stuck_for + dt } else { 0.0 };
                if *left <= 0.0 {
                    self.manoeuvre = Manoeuvre::None;
                } else if self.stuck_for > DETOUR_STUCK_TIME {
                    self.is_stuck();
                }
                Controls { throttle: 0.4, brake: 0.0, steer: 0.5 * side, ..wanted }
            }
            Manoeuvre::Leap { left } => {
                *left -= dt;
                if *left <= 0.0 {
                    self.manoeuvre = Manoeuvre::None;
                }
                Controls { throttle: 1.0, steer: 0.5 * side, boost: true, jump: true, ..Controls::default() }
            }
            Manoeuvre::None => {
                self.look_out(is_slow && wanted.throttle > 0.0, dt);
                wanted
            }
        }
    }

    /// Drives as it wants to: is it stuck?
    fn look_out(&mut self, is_slow: bool, dt: f64) {
        self.free_for += dt;
        if self.free_for > FREE_TIME {
            self.tries = 0;
        }
        self.stuck_for = if is_slow { self.stuck_for + dt } else { 0.0 };
        let turns = self.here_for > TURNING_TIME && self.tries_here == 0;
        if self.stuck_for > STUCK_TIME || turns {
            self.is_stuck();
        }
    }

    /// Backs out, and where that did not help leaps, and so on by turns.
    fn is_stuck(&mut self) {
        (self.tries, self.tries_here) = (self.tries + 1, self.tries_here + 1);
        (self.stuck_for, self.free_for) = (0.0, 0.0);
        let more = BACK_MORE * f64::from(self.tries % BACK_MOST);
        self.manoeuvre = match self.tries_here.is_multiple_of(2) {
            true => Manoeuvre::Leap { left: LEAP_TIME },
            false => Manoeuvre::Back { left: BACK_TIME + more, then_pass: DETOUR_TIME + more },
        };
    }
}
