//! Tracks of what is three numbers, each on its own: points, joint coordinates, rates, hinges.

use super::super::quantise::{Fineness, Quantised, STEPS_MAX, within};
use super::{Ahead, GroupState, STEP_ERROR, Track};
use crate::WireError;

/// Fraction bits of a step.
const FRACTION: u32 = 12;
/// Largest rate, 2^12 of a step a tick.
const RATE_MAX: i64 = 1 << 28;

/// A line that misses by more begins anew: one and a half steps.
const FAR_MISS: u64 = 3 << (FRACTION - 1);

/// Where a line leads.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// From the value, 2^12 of a step; below 2^37 in size.
    way: [i64; 3],
    ahead: Ahead,
    /// High bits of the last number that mean nothing.
    beyond: u32,
}

impl Line {
    /// That of `state`.
    #[inline]
    pub fn of(state: &GroupState, ahead: Ahead, fineness: &Fineness) -> Self {
        let way = [0, 1, 2].map(|i| i64::from(state.place[i]) + i64::from(state.rate[i]) * ahead.ticks);
        Self { way, ahead, beyond: fineness.beyond(state.value.group) }
    }

    /// Brings the last number of a sum of steps round.
    ///
    /// # Errors
    /// [`WireError::Content`] for what no state has.
    #[inline]
    pub fn bound(&self, value: &mut Quantised) -> Result<(), WireError> {
        value.steps[2] = within(value.steps[2], self.beyond);
        value.check_size()
    }

    /// Steps from `old` to `new`.
    #[inline]
    fn steps(&self, old: &Quantised, new: &Quantised) -> [i32; 3] {
        let [a, b, c] = [0, 1, 2].map(|i| new.steps[i] - old.steps[i]);
        [a, b, within(c, self.beyond)]
    }
}

impl Track for Line {
    #[inline]
    fn expected(&self, state: &GroupState) -> Quantised {
        // Either guess is as likely, so no branch: what rests goes no way.
        let goes = i64::from(state.goes_by_rest()) - 1;
        let [a, b, c] = [0, 1, 2].map(|i| {
            let way = ((self.way[i] & goes) + (1 << (FRACTION - 1))) >> FRACTION;
            let step = i64::from(state.value.steps[i]) + way;
            step.clamp(-i64::from(STEPS_MAX), STEPS_MAX.into()) as i32
        });
        Quantised { steps: [a, b, within(c, self.beyond)], ..state.value }
    }

    #[inline]
    fn moved(&self, old: &Quantised, new: &Quantised) -> u64 {
        let steps: u32 = self.steps(old, new).iter().map(|step| step.unsigned_abs()).sum();
        u64::from(steps) * u64::from(STEP_ERROR)
    }

    #[inline(always)]
    fn fit(&self, state: &mut GroupState, old: &Quantised) -> u64 {
        let steps = self.steps(old, &state.value);
        let [a, b, c] = [0, 1, 2].map(|i| (i64::from(steps[i]) << FRACTION) - self.way[i]);
        // A hinge's angle comes round: all of a miss but its lowest bits, as many as a turn has, means nothing.
        let round = if self.beyond > 0 { i64::BITS - i32::BITS - FRACTION + self.beyond } else { 0 };
        let miss = [a, b, c << round >> round];
        let sizes = miss.map(i64::unsigned_abs);
        let worst = sizes.into_iter().fold(0, u64::max);
        let (place, rate) = state.shares(worst > FAR_MISS, self.ahead);
        for (i, miss) in miss.into_iter().enumerate() {
            state.place[i] = (((place - 256) * miss) >> 8) as i32;
            let rate = i64::from(state.rate[i]) + ((rate * miss + (1 << 15)) >> 16);
            state.rate[i] = rate.clamp(-RATE_MAX, RATE_MAX) as i32;
        }
        sizes.iter().sum::<u64>() >> (FRACTION - 4)
    }
}

/// Rates of a line, steps a tick.
pub fn rates([x, y, z, _]: [i32; 4]) -> [f64; 3] {
    [x, y, z].map(|rate| f64::from(rate) / f64::from(1u32 << FRACTION))
}
