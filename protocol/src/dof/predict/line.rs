//! Tracks of what is three numbers, each on its own: points, joint coordinates, rates, hinges.

use super::super::quantise::{Fineness, Quantised, STEPS_MAX, within};
use super::{AHEAD_MAX, GroupState, Track};

/// Fraction bits of a step.
const FRACTION: u32 = 12;
/// Largest rate, 2^12 of a step a tick.
const RATE_MAX: i64 = 1 << 28;

/// Where a line leads.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// 2^12 of a step; below 2^39 in size.
    place: [i64; 3],
    ahead: i64,
}

impl Track for Line {
    #[inline]
    fn of(state: &GroupState, ahead: i64) -> Self {
        let ahead = ahead.clamp(1, AHEAD_MAX);
        let place = [0, 1, 2].map(|i| {
            let place = (i64::from(state.value.steps[i]) << FRACTION) + i64::from(state.place[i]);
            place + i64::from(state.rate[i]) * ahead
        });
        Self { place, ahead }
    }

    #[inline]
    fn expected(&self, state: &GroupState, fineness: &Fineness) -> Quantised {
        let [a, b, c] = self.place.map(|x| {
            let step = (x + (1 << (FRACTION - 1))) >> FRACTION;
            step.clamp(-i64::from(STEPS_MAX), STEPS_MAX.into()) as i32
        });
        Quantised { steps: [a, b, within(c, fineness.beyond(state.value.group))], ..state.value }
    }

    #[inline]
    fn fit(&self, state: &mut GroupState, _: &Quantised, fineness: &Fineness) -> u64 {
        let [a, b, c] = [0, 1, 2].map(|i| (i64::from(state.value.steps[i]) << FRACTION) - self.place[i]);
        // A hinge's angle comes round: all of a miss but its lowest bits, as many as a turn has, means nothing.
        let beyond = fineness.beyond(state.value.group);
        let round = if beyond > 0 { i64::BITS - i32::BITS - FRACTION + beyond } else { 0 };
        let miss = [a, b, c << round >> round];
        let (place, rate) = state.shares(miss, 1 << FRACTION, self.ahead);
        for (i, miss) in miss.into_iter().enumerate() {
            state.place[i] = (((place - 256) * miss) >> 8) as i32;
            let rate = i64::from(state.rate[i]) + ((rate * miss + (1 << 15)) >> 16);
            state.rate[i] = rate.clamp(-RATE_MAX, RATE_MAX) as i32;
        }
        miss.iter().map(|miss| miss.unsigned_abs()).sum::<u64>() >> (FRACTION - 4)
    }
}

/// Rates of a line, steps a tick.
pub fn rates([x, y, z, _]: [i32; 4]) -> [f64; 3] {
    [x, y, z].map(|rate| f64::from(rate) / f64::from(1u32 << FRACTION))
}
