//! Tracks of rotations: a turn that goes on.

use super::super::quantise::{Fineness, Group, Quantised, others};
use super::super::quaternion::{ONE, Quaternion};
use super::{Ahead, ERROR_MAX, GroupState, STEP_ERROR, Track};

/// Misses from this on, of 2^30, are not small: a track begins anew at its value.
const SMALL_MISS: u64 = 1 << 24;

/// Where a rotation's track leads.
#[derive(Clone, Copy, Debug)]
pub struct Turn<'a> {
    /// `None` without a track.
    place: Option<Quaternion>,
    ahead: Ahead,
    fineness: &'a Fineness,
}

impl<'a> Turn<'a> {
    /// That of `state`.
    #[inline]
    pub fn of(state: &GroupState, ahead: Ahead, fineness: &'a Fineness) -> Self {
        let place = (!state.is_calm()).then(|| {
            let turn = Quaternion(state.rate.map(i64::from)).power(ahead.ticks as u32);
            turn.times(Quaternion(state.place.map(i64::from)))
        });
        Self { place, ahead, fineness }
    }

    /// What is [expected](GroupState::expected) of a rotation that leaves out its component `largest`.
    #[inline(never)]
    pub fn expected_without(&self, largest: usize, state: &GroupState) -> Quantised {
        match &self.place {
            Some(place) if !state.goes_by_rest() => rounded(place, largest, self.fineness),
            _ if largest == usize::from(state.value.largest) => state.value,
            _ => rounded(&Quaternion(state.value.components(self.fineness)), largest, self.fineness),
        }
    }
}

impl Track for Turn<'_> {
    #[inline]
    fn expected(&self, state: &GroupState) -> Quantised {
        match &self.place {
            Some(place) if !state.goes_by_rest() => rounded(place, place.largest(), self.fineness),
            _ => state.value,
        }
    }

    #[inline]
    fn moved(&self, old: &Quantised, new: &Quantised) -> u64 {
        let steps: u64 = new.minus(old, self.fineness).iter().map(|step| u64::from(step.unsigned_abs())).sum();
        if new.largest == old.largest { steps * u64::from(STEP_ERROR) } else { ERROR_MAX }
    }

    fn fit(&self, state: &mut GroupState, old: &Quantised) -> u64 {
        let fineness = self.fineness;
        let (track, turn) = match self.place {
            Some(place) => (place, Quaternion(state.rate.map(i64::from))),
            None => (Quaternion(old.components(fineness)), Quaternion::NONE),
        };
        let now = Quaternion(state.value.components(fineness));
        // Half the angle, of 2^30, which is as far as components move.
        let miss = now.times(track.conjugate()).upright().axis();
        let wrong = (miss.iter().map(|miss| miss.unsigned_abs()).sum::<u64>() * fineness.steps as u64) >> (30 - 4);
        // A step and a half.
        let far = miss.iter().any(|miss| 2 * miss.abs() > 3 * fineness.step);
        let (place, rate) = state.shares(far, self.ahead);
        let bits = miss.iter().fold(0, |bits, m| bits | m.unsigned_abs());
        let (place, miss) = match bits < SMALL_MISS {
            true => (Quaternion::small(miss.map(|m| (place * m) >> 8)).times(track), miss),
            false => (now, miss.map(|m| m.clamp(-ONE / 2, ONE / 2))),
        };
        let turn = Quaternion::small(miss.map(|m| (rate * m) >> 16)).times(turn).normalised();
        state.place = place.0.map(|x| x as i32);
        state.rate = turn.0.map(|x| x as i32);
        wrong
    }
}

/// Angular velocity of what turns by the quaternion `rate` a tick, rad a tick.
pub fn angular_velocity(rate: [i32; 4]) -> [f64; 3] {
    let [x, y, z, w] = rate.map(f64::from);
    let sine = (x * x + y * y + z * z).sqrt();
    // What does not turn has no axis.
    let unit = 2.0 * sine.atan2(w.abs()) * w.signum() / sine.max(1.0);
    [x, y, z].map(|rate| rate * unit)
}

/// The steps of `q` without its component `largest`.
#[inline]
fn rounded(q: &Quaternion, largest: usize, fineness: &Fineness) -> Quantised {
    let scale = if q.0[largest] < 0 { -fineness.steps } else { fineness.steps };
    let steps = others(largest).map(|i| ((q.0[i] * scale + (1 << 29)) >> 30) as i32);
    Quantised { group: Group::Rotation, largest: largest as u8, steps }
}
