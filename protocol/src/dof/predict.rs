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

use super::quantise::{Fineness, Group, Precision, Quantised, STEPS_MAX, others};
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
/// Misses of a rotation from this on, of 2^30, are not small: its track begins anew at its value.
const SMALL_MISS: u64 = 1 << 24;
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

/// Where a group's track leads in so many ticks.
#[derive(Clone, Copy, Debug)]
pub struct Track {
    place: Place,
    /// Ticks from the baseline.
    ahead: i64,
}

/// Where a track is.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// Coordinates in 2^12 of a step.
    Line([i64; 3]),
    /// A rotation that has no track.
    Still,
    /// A rotation.
    Turned(Quaternion),
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

    /// Where the track leads in `ahead` ticks.
    #[inline]
    pub fn track(&self, ahead: i64) -> Track {
        let ahead = ahead.clamp(1, AHEAD_MAX);
        let place = match self.value.group {
            Group::Rotation if self.is_calm() => Place::Still,
            Group::Rotation => {
                let turn = Quaternion(self.rate.map(i64::from)).power(ahead as u32);
                Place::Turned(turn.times(Quaternion(self.place.map(i64::from))))
            }
            _ => Place::Line([0, 1, 2].map(|i| {
                let place = (i64::from(self.value.steps[i]) << FRACTION) + i64::from(self.place[i]);
                place + i64::from(self.rate[i]) * ahead
            })),
        };
        Track { place, ahead }
    }

    /// The state that is expected next, by the guess that was less wrong of late.
    #[inline]
    pub fn expected(&self, track: &Track, fineness: &Fineness) -> Quantised {
        match &track.place {
            _ if self.errors[TRACK] > self.errors[REST] => self.value,
            Place::Line(track) => {
                let steps = track.map(|x| {
                    let step = (x + (1 << (FRACTION - 1))) >> FRACTION;
                    step.clamp(-i64::from(STEPS_MAX), STEPS_MAX.into()) as i32
                });
                Quantised { steps, ..self.value }
            }
            Place::Still => self.value,
            Place::Turned(track) => rounded(track, track.largest(), fineness),
        }
    }

    /// The same of a rotation that leaves out its component `largest`.
    #[inline(never)]
    pub fn expected_without(&self, largest: usize, track: &Track, fineness: &Fineness) -> Quantised {
        match &track.place {
            Place::Turned(track) if self.errors[TRACK] <= self.errors[REST] => rounded(track, largest, fineness),
            _ if largest == usize::from(self.value.largest) => self.value,
            _ => rounded(&Quaternion(self.value.components(fineness)), largest, fineness),
        }
    }

    /// Goes on to `value`, which was expected where `track` led.
    #[inline]
    pub fn follow(&mut self, track: &Track, value: Quantised, fineness: &Fineness) {
        let (was_calm, old) = (self.is_calm(), std::mem::replace(&mut self.value, value));
        let moved: u64 = value.steps.iter().zip(old.steps).map(|(a, b)| u64::from(a.abs_diff(b))).sum();
        let moved = if value.largest == old.largest { moved * u64::from(STEP_ERROR) } else { ERROR_MAX };
        self.errors[REST] = learnt(self.errors[REST], moved);
        if moved == 0 && (was_calm || self.errors[REST] == 0) {
            self.fitted = 0;
            self.errors[TRACK] = learnt(self.errors[TRACK], 0);
            (self.place, self.rate) = ([0; 4], [0; 4]);
            return;
        }
        let wrong = match &track.place {
            Place::Line(place) => self.follow_line(place, track.ahead),
            Place::Turned(place) => self.follow_rotation(place, track.ahead, fineness),
            Place::Still => {
                self.rate = Quaternion::NONE.0.map(|x| x as i32);
                self.follow_rotation(&Quaternion(old.components(fineness)), track.ahead, fineness)
            }
        };
        self.errors[TRACK] = learnt(self.errors[TRACK], wrong);
    }

    /// Fits the line to a value that it missed: `track` is where it led in `ahead` ticks. Answers by how much.
    #[inline]
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
    fn follow_rotation(&mut self, track: &Quaternion, ahead: i64, fineness: &Fineness) -> u64 {
        let now = Quaternion(self.value.components(fineness));
        // Half the angle, of 2^30, which is as far as components move.
        let miss = now.times(track.conjugate()).upright().axis();
        let error = (miss.iter().map(|miss| miss.unsigned_abs()).sum::<u64>() * fineness.steps as u64) >> (30 - 4);
        let (place, rate) = self.shares(miss, fineness.step);
        let rate = rate * RECIPROCALS[ahead as usize];
        let bits = miss.iter().fold(0, |bits, m| bits | m.unsigned_abs());
        let (place, miss) = match bits < SMALL_MISS {
            true => (Quaternion::small(miss.map(|m| (place * m) >> 8)).times(*track), miss),
            false => (now, miss.map(|m| m.clamp(-ONE / 2, ONE / 2))),
        };
        let turn = Quaternion(self.rate.map(i64::from));
        let rate = Quaternion::small(miss.map(|m| (rate * m) >> 24)).times(turn).normalised();
        self.place = place.0.map(|x| x as i32);
        self.rate = rate.0.map(|x| x as i32);
        error
    }

    /// Shares of a miss, of 2^8, as place and as rate; who misses by more than one and a half steps begins a new line.
    #[inline]
    fn shares(&mut self, miss: [i64; 3], step: i64) -> (i64, i64) {
        let worst = miss.iter().map(|m| m.abs()).max().unwrap_or(0);
        self.fitted = if 2 * worst > 3 * step { 2 } else { (self.fitted + 1).clamp(2, FITTED_MAX) };
        SHARES[usize::from(self.fitted) - 2]
    }
}

/// An error after another one: a quarter of the old one goes each time.
#[inline]
fn learnt(error: u16, now: u64) -> u16 {
    ((u64::from(error) * 3 + now.min(ERROR_MAX)) / 4) as u16
}

/// The steps of `q` without its component `largest`.
#[inline]
fn rounded(q: &Quaternion, largest: usize, fineness: &Fineness) -> Quantised {
    let scale = if q.0[largest] < 0 { -fineness.steps } else { fineness.steps };
    let steps = others(largest).map(|i| ((q.0[i] * scale + (1 << 29)) >> 30) as i32);
    Quantised { group: Group::Rotation, largest: largest as u8, steps }
}
