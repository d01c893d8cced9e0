//! Prediction: where a group is expected at a tick, from what the receiver is known to have.
//!
//! Both sides step the same integers along Q', as the axioms say (Q is piecewise linear in time). Q' is not sent: it is
//! the slope of a line through the states that a group was coded against, in fractions of a step; for a rotation it is a
//! turn a tick. Two guesses stand side by side, and each group goes by the one that was wrong less of late:
//!
//! - **track**: it goes on along the line ([`Line`]), or turns on ([`Turn`]);
//! - **rest**: it stays.
//!
//! What has stayed for long has no track: it is **calm**, and costs nothing to predict.

mod line;
mod turn;

use super::quantise::{Group, Precision, Quantised};

pub use line::Line;
pub use turn::Turn;

/// Guesses of a group.
const GUESSES: usize = 2;
const TRACK: usize = 0;
const REST: usize = 1;

/// Ticks that a prediction goes ahead at most.
const AHEAD_MAX: u64 = 128;
/// States that a track is fitted through at most; more would not follow what turns.
const FITTED_MAX: u8 = 4;
/// What a track through n states takes of a miss, of 2^8: as place, and as rate. n is 2, 3, 4. All of it is place where n is
/// 2, so for any other n a place is less than a step from its value.
const SHARES: [(i64, i64); 3] = [(256, 256), (213, 128), (179, 76)];
/// An error of a step.
const STEP_ERROR: u32 = 16;
/// Largest error that is remembered.
const ERROR_MAX: u64 = 1000 * STEP_ERROR as u64;

/// 1/n of 2^16, rounded down, for n = 1, 2, ...
static RECIPROCALS: [i64; AHEAD_MAX as usize + 1] = {
    let mut table = [1 << 16; AHEAD_MAX as usize + 1];
    let mut n = 1;
    while n < table.len() {
        table[n] = (1 << 16) / n as i64;
        n += 1;
    }
    table
};

/// How far a prediction goes ahead.
#[derive(Clone, Copy, Debug)]
pub struct Ahead {
    /// 1 to [`AHEAD_MAX`].
    ticks: i64,
    /// 2^16 over them.
    reciprocal: i64,
}

impl Ahead {
    /// So many ticks, or the most that a prediction goes.
    #[inline]
    pub fn of(ticks: u64) -> Self {
        let ticks = ticks.clamp(1, AHEAD_MAX);
        Self { ticks: ticks as i64, reciprocal: RECIPROCALS[ticks as usize] }
    }
}

/// Where a group's track leads in so many ticks.
pub trait Track {
    /// The state that is expected next, by the guess that was less wrong of late.
    fn expected(&self, state: &GroupState) -> Quantised;

    /// By how much a group moved from `old` to `new`, of 16 to a step.
    fn moved(&self, old: &Quantised, new: &Quantised) -> u64;

    /// Fits the track of `state`, which is at its new value, to where it led; `old` was the value before. Answers by how much
    /// it missed, of 16 to a step.
    fn fit(&self, state: &mut GroupState, old: &Quantised) -> u64;
}

/// A group at a tick, with what prediction needs to go on from there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupState {
    /// The state.
    pub value: Quantised,
    /// States that the track goes through; 0 for what is calm.
    fitted: u8,
    /// How wrong each guess was of late, of 16 to a step.
    errors: [u16; GUESSES],
    /// Where the track is at this tick: 2^12 of a step beyond the value, or a rotation's quaternion, of 2^30.
    place: [i32; 4],
    /// The track's rate a tick: 2^12 of a step, or the quaternion of a rotation's turn, of 2^30.
    rate: [i32; 4],
}

impl GroupState {
    /// A state without a past.
    pub fn first(value: Quantised) -> Self {
        let errors = [STEP_ERROR as u16; GUESSES];
        Self { value, fitted: 0, errors, place: [0; 4], rate: [0; 4] }
    }

    /// Rates along the track, per second: of each number, of a rotation the angular velocity in the axes of its world.
    pub fn rate(&self, precision: &Precision, tick_hz: f64) -> impl Iterator<Item = f64> {
        let rates = match self.value.group {
            Group::Rotation => turn::angular_velocity(self.rate).map(|rate| rate * tick_hz),
            Group::Hinge => {
                let [x, y, angle] = line::rates(self.rate).map(|rate| rate * tick_hz);
                let tilt = [x, y].map(|rate| rate / precision.steps(Group::Hinge));
                self.value.hinge(precision).angular_velocity(tilt, angle / precision.hinge_steps())
            }
            group => line::rates(self.rate).map(|rate| rate * tick_hz / precision.steps(group)),
        };
        rates.into_iter().take(self.value.group.components())
    }

    /// The error of the guess that it goes by, of 16 to a step.
    #[inline]
    pub fn expected_error(&self) -> u16 {
        self.errors[TRACK].min(self.errors[REST])
    }

    /// Whether it stays where it is for as long as nothing else is said.
    #[inline]
    pub fn is_calm(&self) -> bool {
        self.fitted == 0
    }

    /// Goes on to `value`, which was expected where `track` led.
    #[inline(always)]
    pub fn follow(&mut self, track: &impl Track, value: Quantised) {
        let (was_calm, old) = (self.is_calm(), std::mem::replace(&mut self.value, value));
        let moved = track.moved(&old, &value);
        self.errors[REST] = learnt(self.errors[REST], moved);
        if moved == 0 && (was_calm || self.errors[REST] == 0) {
            self.fitted = 0;
            self.errors[TRACK] = learnt(self.errors[TRACK], 0);
            (self.place, self.rate) = ([0; 4], [0; 4]);
            return;
        }
        let wrong = track.fit(self, &old);
        self.errors[TRACK] = learnt(self.errors[TRACK], wrong);
    }

    #[inline]
    fn goes_by_rest(&self) -> bool {
        self.errors[TRACK] > self.errors[REST]
    }

    /// Shares of what a track missed by: as place, of 2^8, and as rate, of 2^16. A track that missed by `far` begins anew.
    #[inline]
    fn shares(&mut self, far: bool, ahead: Ahead) -> (i64, i64) {
        self.fitted = if far { 2 } else { (self.fitted + 1).clamp(2, FITTED_MAX) };
        let (place, rate) = SHARES[usize::from(self.fitted) - 2];
        (place, (rate * ahead.reciprocal) >> 8)
    }
}

/// An error after another one: a quarter of the old one goes each time.
#[inline]
fn learnt(error: u16, now: u64) -> u16 {
    ((u64::from(error) * 3 + now.min(ERROR_MAX)) / 4) as u16
}
