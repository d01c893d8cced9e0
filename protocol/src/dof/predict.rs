//! Prediction: where a group is expected at a tick, from what the receiver is known to have.
//!
//! Both sides step the same integers along Q', as the axioms say (Q is piecewise linear in time). Q' is not sent: it is
//! the slope of a line through the states that a group was coded against, in fractions of a step; for a rotation it is a
//! turn a tick. Two guesses stand side by side, and each group goes by the one that was wrong less of late:
//!
//! - **track**: it goes on along the line;
//! - **rest**: it stays.
//!
//! What has stayed for long has no track: it is **calm**, and costs nothing to predict.

use super::quantise::{Group, Precision, Quantised, STEPS_MAX, others};
use super::quaternion::{ONE, Quaternion};

/// Guesses of a group.
const GUESSES: usize = 2;
const TRACK: usize = 0;
const REST: usize = 1;

/// Fraction bits of a point's track.
const FRACTION: u32 = 12;
/// Largest rate of a point's track, 2^12 of a step a tick.
const RATE_MAX: i64 = 1 << 28;
/// Largest distance of a point's track from its state, and largest miss of it that counts, 2^12 of a step.
const PLACE_MAX: i64 = 1 << 30;
const MISS_MAX: i64 = 1 << 36;
/// Ticks that a prediction goes ahead at most.
const AHEAD_MAX: i64 = 128;
/// States that a line is fitted through at most; more would not follow what turns.
const FITTED_MAX: u8 = 4;
/// What a line through n states takes of a miss, of 2^8: as place, and as rate. n is 2, 3, 4.
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

/// What is expected of a group.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    track: Track,
    goes_by_track: bool,
    /// Ticks from the baseline.
    ahead: i64,
}

/// Where a track leads.
#[derive(Clone, Copy, Debug)]
enum Track {
    /// Nowhere.
    Calm,
    /// Coordinates in 2^12 of a step.
    Line([i64; 3]),
    Rotation(Quaternion),
}

impl GroupState {
    /// A state without a past.
    pub fn first(value: Quantised) -> Self {
        let errors = [STEP_ERROR as u16; GUESSES];
        Self { value, fitted: 0, errors, place: [0; 4], rate: [0; 4] }
    }

    /// Rates along the track, per second: of each number, of a rotation the angular velocity in the axes of its world.
    pub fn rate(&self, precision: &Precision, tick_hz: f64) -> impl Iterator<Item = f64> {
        let group = self.value.group;
        let [x, y, z, w] = self.rate.map(f64::from);
        let unit = match group {
            Group::Rotation => {
                let sine = (x * x + y * y + z * z).sqrt();
                // What does not turn has no axis.
                tick_hz * 2.0 * sine.atan2(w.abs()) * w.signum() / sine.max(1.0)
            }
            _ => tick_hz / f64::from(1u32 << FRACTION) / precision.steps(group),
        };
        [x, y, z].into_iter().take(group.components()).map(move |rate| rate * unit)
    }

    /// The error of the guess that it goes by, of 16 to a step.
    pub fn expected_error(&self) -> u16 {
        self.errors[TRACK].min(self.errors[REST])
    }

    /// Whether it stays where it is for as long as nothing else is said.
    pub fn is_calm(&self) -> bool {
        self.fitted == 0
    }

    /// What is expected `ahead` ticks on.
    pub fn predict(&self, ahead: i64) -> Prediction {
        let ahead = ahead.clamp(1, AHEAD_MAX);
        let track = match self.value.group {
            _ if self.is_calm() => Track::Calm,
            Group::Rotation => {
                let turn = Quaternion(self.rate.map(i64::from)).power(ahead as u32);
                Track::Rotation(turn.times(Quaternion(self.place.map(i64::from))))
            }
            _ => Track::Line([0, 1, 2].map(|i| {
                let place = (i64::from(self.value.steps[i]) << FRACTION) + i64::from(self.place[i]);
                place + i64::from(self.rate[i]) * ahead
            })),
        };
        Prediction { track, goes_by_track: self.errors[TRACK] <= self.errors[REST], ahead }
    }
}

impl Prediction {
    /// The state that is expected after `base`; `largest` is the component that a rotation leaves out, where that is known.
    pub fn expected(&self, base: &GroupState, largest: Option<u8>, precision: &Precision) -> Quantised {
        match &self.track {
            Track::Line(track) if self.goes_by_track => {
                let steps = track.map(|x| {
                    let step = (x + (1 << (FRACTION - 1))) >> FRACTION;
                    step.clamp(-i64::from(STEPS_MAX), STEPS_MAX.into()) as i32
                });
                Quantised { steps, ..base.value }
            }
            Track::Rotation(track) if self.goes_by_track => rounded(track, largest, precision),
            _ if largest.is_none_or(|largest| largest == base.value.largest) => base.value,
            _ => rounded(&Quaternion(base.value.components(precision)), largest, precision),
        }
    }

    /// The state after `base`, now that the value is known.
    pub fn update(&self, base: &GroupState, value: Quantised, precision: &Precision) -> GroupState {
        let is_same = value.largest == base.value.largest;
        let moved: u64 = value.steps.iter().zip(base.value.steps).map(|(a, b)| u64::from(a.abs_diff(b))).sum();
        let moved = if is_same { moved * u64::from(STEP_ERROR) } else { ERROR_MAX };
        let mut next = GroupState { value, ..*base };
        next.errors[REST] = learnt(base.errors[REST], moved);
        if moved == 0 && (base.is_calm() || next.errors[REST] == 0) {
            next.fitted = 0;
            next.errors[TRACK] = learnt(base.errors[TRACK], 0);
            (next.place, next.rate) = ([0; 4], [0; 4]);
            return next;
        }
        let wrong = match (value.group, &self.track) {
            (Group::Rotation, Track::Rotation(track)) => next.follow_rotation(track, self.ahead, precision),
            (Group::Rotation, _) => {
                next.rate = Quaternion::NONE.0.map(|x| x as i32);
                next.follow_rotation(&Quaternion(base.value.components(precision)), self.ahead, precision)
            }
            (_, Track::Line(track)) => next.follow_line(track, self.ahead),
            _ => next.follow_line(&base.value.steps.map(|step| i64::from(step) << FRACTION), self.ahead),
        };
        next.errors[TRACK] = learnt(base.errors[TRACK], wrong);
        next
    }
}

impl GroupState {
    /// Fits the line to a value that it missed: `track` is where it led in `ahead` ticks. Answers by how much.
    fn follow_line(&mut self, track: &[i64; 3], ahead: i64) -> u64 {
        let miss = [0, 1, 2].map(|i| {
            let miss = (i64::from(self.value.steps[i]) << FRACTION) - track[i];
            miss.clamp(-MISS_MAX, MISS_MAX)
        });
        let (place, rate) = self.shares(miss, 1 << FRACTION);
        let rate = rate * RECIPROCALS[ahead as usize];
        for (i, miss) in miss.into_iter().enumerate() {
            let beyond = ((place - 256) * miss) >> 8;
            self.place[i] = beyond.clamp(-PLACE_MAX, PLACE_MAX) as i32;
            let rate = i64::from(self.rate[i]) + ((rate * miss + (1 << 23)) >> 24);
            self.rate[i] = rate.clamp(-RATE_MAX, RATE_MAX) as i32;
        }
        miss.iter().map(|miss| miss.unsigned_abs()).sum::<u64>() >> (FRACTION - 4)
    }

    /// The same for a rotation.
    fn follow_rotation(&mut self, track: &Quaternion, ahead: i64, precision: &Precision) -> u64 {
        let now = Quaternion(self.value.components(precision));
        let Quaternion([x, y, z, _]) = now.times(track.conjugate()).upright();
        // Half the angle, of 2^30, which is as far as components move.
        let miss = [x, y, z];
        let steps = i64::from(precision.rotation);
        let error = (miss.iter().map(|miss| miss.unsigned_abs()).sum::<u64>() * steps.unsigned_abs()) >> (30 - 4);
        let (place, rate) = self.shares(miss, ONE / steps);
        let rate = rate * RECIPROCALS[ahead as usize];
        let place = match self.fitted {
            2 => now,
            _ => Quaternion::small(miss.map(|m| (place * m) >> 8)).times(*track),
        };
        let turn = Quaternion(self.rate.map(i64::from));
        let rate = Quaternion::small(miss.map(|m| (rate * m) >> 24)).times(turn).normalised();
        self.place = place.0.map(|x| x as i32);
        self.rate = rate.0.map(|x| x as i32);
        error
    }

    /// Shares of a miss, of 2^8, as place and as rate; who misses by more than one and a half steps begins a new line.
    fn shares(&mut self, miss: [i64; 3], step: i64) -> (i64, i64) {
        let worst = miss.iter().map(|m| m.abs()).max().unwrap_or(0);
        self.fitted = if 2 * worst > 3 * step { 2 } else { (self.fitted + 1).clamp(2, FITTED_MAX) };
        SHARES[usize::from(self.fitted) - 2]
    }
}

/// An error after another one: a quarter of the old one goes each time.
fn learnt(error: u16, now: u64) -> u16 {
    ((u64::from(error) * 3 + now.min(ERROR_MAX)) / 4) as u16
}

fn rounded(q: &Quaternion, largest: Option<u8>, precision: &Precision) -> Quantised {
    let own = || (1..4).fold(0, |best, i| if q.0[i].abs() > q.0[best].abs() { i } else { best });
    let largest = largest.map_or_else(own, usize::from);
    let sign = if q.0[largest] < 0 { -1 } else { 1 };
    let scale = sign * i64::from(precision.rotation);
    let steps = others(largest).map(|i| ((q.0[i] * scale + (1 << 29)) >> 30) as i32);
    Quantised { group: Group::Rotation, largest: largest as u8, steps }
}
