//! Prediction: where a group is expected at a tick, from what the receiver is known to have.
//!
//! Both sides step the same integers along Q', as the axioms say (Q is piecewise linear in time). Q' is not sent: it is
//! what two acknowledged states differ by, and, better in free flight, what a line through many of them says. Three
//! guesses stand side by side, and each group goes by the one that was wrong least of late:
//!
//! - **track**: a line fitted through the states that it was coded against, in fractions of a step;
//! - **last move**: the motion between the two newest states that are acknowledged;
//! - **rest**: it stays.

use super::quantise::{Group, Precision, Quantised, STEPS_MAX, others};
use super::quaternion::Quaternion;

/// Guesses of a group.
pub const GUESSES: usize = 3;
const TRACK: usize = 0;
const LAST_MOVE: usize = 1;
const REST: usize = 2;

/// Fraction bits of a point's track.
const FRACTION: u32 = 12;
/// Fraction bits of a rotation's track, rad.
const RADIANS: u32 = 24;
/// A rotation's offset is kept in 2^20 of a radian.
const OFFSET_SHIFT: u32 = 4;
/// Largest rate of a track, 2^12 of a step, or 2^24 of a radian, a tick.
const RATE_MAX: i64 = 1 << 28;
/// Ticks that a prediction goes ahead at most.
const AHEAD_MAX: i64 = 128;
/// States that a line is fitted through at most; more would not follow what turns.
const FITTED_MAX: u8 = 4;

/// A group at a tick, with what prediction needs to go on from there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupState {
    /// The state.
    pub value: Quantised,
    /// States that the track goes through.
    fitted: u8,
    /// What the track adds to the state, 2^12 of a step, or 2^20 of a radian.
    offset: [i16; 3],
    /// The track's rate a tick, 2^12 of a step, or 2^24 of a radian.
    rate: [i32; 3],
    /// How wrong each guess was of late.
    errors: [u16; GUESSES],
}

/// What is expected of a group.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    /// `None` where all guesses are that it stays.
    guesses: Option<[Guess; GUESSES]>,
    base: Quantised,
    best: usize,
    /// Ticks from the baseline.
    ahead: i64,
}

/// One guess: coordinates in 2^12 of a step, or a rotation.
#[derive(Clone, Copy, Debug)]
enum Guess {
    Linear([i64; 3]),
    Rotation(Quaternion),
}

impl GroupState {
    /// A state without a past.
    pub fn first(value: Quantised) -> Self {
        Self { value, fitted: 1, offset: [0; 3], rate: [0; 3], errors: [16; GUESSES] }
    }

    /// Rates along the track, per second: of each number, of a rotation the angular velocity in the axes of its world.
    pub fn rate(&self, precision: &Precision, tick_hz: f64) -> impl Iterator<Item = f64> {
        let group = self.value.group;
        let unit = match group {
            Group::Rotation => tick_hz / f64::from(1u32 << RADIANS),
            _ => tick_hz / f64::from(1u32 << FRACTION) / precision.steps(group),
        };
        self.rate.into_iter().take(group.components()).map(move |rate| f64::from(rate) * unit)
    }

    /// The error of the guess that it goes by, of 16 to a step.
    pub fn expected_error(&self) -> u16 {
        self.errors[self.best()]
    }

    /// States in a row that lay on the track.
    pub fn fitted(&self) -> u8 {
        self.fitted
    }

    /// Whether the receiver would leave it where it is, for as long as predictions go.
    pub fn is_settled(&self, precision: &Precision) -> bool {
        let half_a_step = match self.value.group {
            Group::Rotation => (1i64 << RADIANS) / i64::from(precision.rotation),
            _ => 1 << (FRACTION - 1),
        };
        let shift = if self.value.group == Group::Rotation { OFFSET_SHIFT } else { 0 };
        let mut tracks = self.offset.iter().zip(self.rate);
        tracks.all(|(&offset, rate)| ((i64::from(offset) << shift) + i64::from(rate) * AHEAD_MAX).abs() < half_a_step)
    }

    fn best(&self) -> usize {
        let [track, last_move, rest] = self.errors;
        if rest < track.min(last_move) {
            REST
        } else if last_move < track {
            LAST_MOVE
        } else {
            TRACK
        }
    }

    /// What is expected `ahead` ticks on, `earlier` being an acknowledged state of `span` ticks before this one.
    pub fn predict(&self, ahead: i64, earlier: Option<(&Quantised, i64)>, precision: &Precision) -> Prediction {
        let ahead = ahead.clamp(0, AHEAD_MAX);
        let earlier = earlier.filter(|(earlier, _)| earlier.group == self.value.group);
        let is_still = self.rate == [0; 3] && self.offset == [0; 3];
        let guesses = match self.value.group {
            _ if is_still && earlier.is_none_or(|(earlier, _)| *earlier == self.value) => None,
            Group::Rotation => Some(self.rotations(ahead, earlier, precision).map(Guess::Rotation)),
            _ => Some(self.lines(ahead, earlier).map(Guess::Linear)),
        };
        Prediction { guesses, base: self.value, best: self.best(), ahead }
    }

    fn lines(&self, ahead: i64, earlier: Option<(&Quantised, i64)>) -> [[i64; 3]; GUESSES] {
        let rest = self.value.steps.map(|s| i64::from(s) << FRACTION);
        let mut track = rest;
        for (i, x) in track.iter_mut().enumerate() {
            *x += i64::from(self.offset[i]) + i64::from(self.rate[i]) * ahead;
        }
        let mut last_move = track;
        if let Some((earlier, span)) = earlier {
            for (i, x) in last_move.iter_mut().enumerate() {
                let moved = i64::from(self.value.steps[i]) - i64::from(earlier.steps[i]);
                *x = rest[i] + (moved << FRACTION) * ahead / span.max(1);
            }
        }
        [track, last_move, rest]
    }

    fn rotations(
        &self,
        ahead: i64,
        earlier: Option<(&Quantised, i64)>,
        precision: &Precision,
    ) -> [Quaternion; GUESSES] {
        let rest = Quaternion(self.value.components(precision));
        let mut track = rest;
        if self.rate != [0; 3] || self.offset != [0; 3] {
            let turn = |i: usize| i64::from(self.rate[i]) * ahead + (i64::from(self.offset[i]) << OFFSET_SHIFT);
            track = Quaternion::exp([0, 1, 2].map(|i| turn(i).clamp(-(1 << 31), 1 << 31))).times(rest);
        }
        let last_move = match earlier {
            Some((earlier, _)) if (earlier.largest, earlier.steps) == (self.value.largest, self.value.steps) => rest,
            Some((earlier, span)) => {
                let moved = rest.times(Quaternion(earlier.components(precision)).conjugate()).log();
                Quaternion::exp(moved.map(|x| (x * ahead / span.max(1)).clamp(-(1 << 31), 1 << 31))).times(rest)
            }
            None => track,
        };
        [track, last_move, rest]
    }
}

impl Prediction {
    /// The state that is expected; `largest` is the component that a rotation leaves out, where that is known.
    pub fn expected(&self, largest: Option<u8>, precision: &Precision) -> Quantised {
        match &self.guesses {
            Some(guesses) => guesses[self.best].rounded(largest, self.base.group, precision),
            None => self.stay(largest, precision),
        }
    }

    fn stay(&self, largest: Option<u8>, precision: &Precision) -> Quantised {
        match largest {
            Some(largest) if largest != self.base.largest => {
                let rest = Guess::Rotation(Quaternion(self.base.components(precision)));
                rest.rounded(Some(largest), self.base.group, precision)
            }
            _ => self.base,
        }
    }

    /// How far track and last move are apart by component: what is uncertain. Steps.
    pub fn spread(&self) -> [u32; 3] {
        let Some(guesses) = &self.guesses else { return [0; 3] };
        match (guesses[TRACK], guesses[LAST_MOVE]) {
            (Guess::Linear(a), Guess::Linear(b)) => {
                [0, 1, 2].map(|i| ((a[i] - b[i]).unsigned_abs() >> FRACTION) as u32)
            }
            (Guess::Rotation(a), Guess::Rotation(b)) => {
                let apart = (0..4).map(|i| (a.0[i] - b.0[i]).unsigned_abs() >> 20).max();
                [apart.unwrap_or(0) as u32; 3]
            }
            _ => [0; 3],
        }
    }

    /// Which way the group moves, by component: −1, 0 or 1.
    pub fn direction(&self, expected: &Quantised) -> [i32; 3] {
        if expected.largest != self.base.largest {
            return [0; 3];
        }
        [0, 1, 2].map(|i| (expected.steps[i] - self.base.steps[i]).signum())
    }

    /// The state after `base`, now that the value is known.
    pub fn update(&self, base: &GroupState, value: Quantised, precision: &Precision) -> GroupState {
        let mut next = GroupState { value, ..*base };
        let rounded = |guess: usize| match &self.guesses {
            Some(guesses) => guesses[guess].rounded(Some(value.largest), value.group, precision),
            None => self.stay(Some(value.largest), precision),
        };
        for (guess, error) in next.errors.iter_mut().enumerate() {
            let wrong: u32 = value.steps.iter().zip(rounded(guess).steps).map(|(a, b)| a.abs_diff(b)).sum();
            // A step counts 16, and a quarter of the old error goes each time.
            *error = ((u32::from(*error) * 3 + wrong.min(1000) * 16) / 4) as u16;
        }
        if self.guesses.is_none() && value == self.base {
            next.fitted = (next.fitted + 1).min(FITTED_MAX);
            return next;
        }
        let (miss, step) = self.miss(&value, precision);
        next.follow(miss, step, self.ahead);
        next
    }

    /// By how much the track missed `value`, and what a step is, both in fractions.
    fn miss(&self, value: &Quantised, precision: &Precision) -> ([i64; 3], i64) {
        let track = match &self.guesses {
            Some(guesses) => guesses[TRACK],
            None if value.group == Group::Rotation => Guess::Rotation(Quaternion(self.base.components(precision))),
            None => Guess::Linear(self.base.steps.map(|s| i64::from(s) << FRACTION)),
        };
        match track {
            Guess::Linear(track) => {
                ([0, 1, 2].map(|i| (i64::from(value.steps[i]) << FRACTION) - track[i]), 1 << FRACTION)
            }
            Guess::Rotation(track) => {
                let off = Quaternion(value.components(precision)).times(track.conjugate());
                // Twice the vector part is the angle, where it is small: from 2^30 to 2^24.
                let sign = if off.0[3] < 0 { -1 } else { 1 };
                // Rotations turn by up to two steps where a component moves by one.
                ([0, 1, 2].map(|i| (sign * off.0[i]) >> 5), (2 << RADIANS) / i64::from(precision.rotation))
            }
        }
    }
}

impl GroupState {
    /// Fits the track to a state that it missed by `miss` after `ahead` ticks.
    fn follow(&mut self, miss: [i64; 3], step: i64, ahead: i64) {
        let ahead = ahead.max(1);
        let worst = miss.iter().map(|m| m.abs()).max().unwrap_or(0);
        self.fitted = if 2 * worst > 3 * step { 2 } else { (self.fitted + 1).min(FITTED_MAX) };
        // A line through n states at equal distances takes these shares of a miss, as place and as rate.
        let n = i64::from(self.fitted);
        let (place, rate) = (2 * (2 * n - 1) * 256 / (n * (n + 1)), 6 * 256 / (n * (n + 1)));
        let shift = if self.value.group == Group::Rotation { OFFSET_SHIFT } else { 0 };
        for (i, m) in miss.into_iter().enumerate() {
            let left = ((place - 256) * m / 256) >> shift;
            self.offset[i] = left.clamp(i16::MIN.into(), i16::MAX.into()) as i16;
            let moved = i64::from(self.rate[i]) + rate * m / (256 * ahead);
            self.rate[i] = moved.clamp(-RATE_MAX, RATE_MAX) as i32;
        }
    }
}

impl Guess {
    fn rounded(&self, largest: Option<u8>, group: Group, precision: &Precision) -> Quantised {
        match self {
            Self::Linear(x) => {
                let round =
                    |x: i64| ((x + (1 << (FRACTION - 1))) >> FRACTION).clamp(-i64::from(STEPS_MAX), STEPS_MAX.into());
                Quantised { group, largest: 0, steps: x.map(|x| round(x) as i32) }
            }
            Self::Rotation(q) => {
                let own = || (1..4).fold(0, |best, i| if q.0[i].abs() > q.0[best].abs() { i } else { best });
                let largest = largest.map_or_else(own, usize::from);
                let sign = if q.0[largest] < 0 { -1 } else { 1 };
                let scale = i64::from(precision.rotation);
                let round = |i: usize| (sign * q.0[i] * scale + (1 << 29)) >> 30;
                Quantised { group, largest: largest as u8, steps: others(largest).map(|i| round(i) as i32) }
            }
        }
    }
}
