//! Work that need not run in each tick, spread over the ticks: the talk's "process certain behaviours sporadically".
//!
//! An actor's phase follows from its id alone, so that the same run does the same work in the same ticks.

/// Whether actor `id` does its sporadic work of `period` ticks in `tick`; a period of 0 counts as 1.
pub fn is_due(id: u32, tick: u64, period: u32) -> bool {
    let period = u64::from(period.max(1));
    (tick + phase(id, period)).is_multiple_of(period)
}

/// From 0 to below `period`.
///
/// Multiples of the golden ratio are spread evenly, however many there are, and evenly still where ids go up by 2, as
/// those of things that come in pairs do.
fn phase(id: u32, period: u64) -> u64 {
    const GOLDEN: u32 = 0x9E37_79B9;
    (u64::from(id.wrapping_mul(GOLDEN)) * period) >> 32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_actor_is_due_once_a_period_and_all_of_them_evenly() {
        for (period, stride) in [(1, 1), (2, 2), (7, 1), (8, 2), (8, 5), (30, 1)] {
            let ids: Vec<u32> = (0..20 * period).map(|i| 17 + stride * i).collect();
            for &id in &ids {
                let due = (100..100 + 3 * u64::from(period)).filter(|&tick| is_due(id, tick, period)).count();
                assert_eq!(due, 3, "actor {id}, every {period}");
            }
            for tick in 0..u64::from(period) {
                let due = ids.iter().filter(|&&id| is_due(id, tick, period)).count();
                assert!((14..=26).contains(&due), "{due} of {} actors in tick {tick} of {period}", ids.len());
            }
        }
        assert!(is_due(3, 5, 0), "a period of nothing is every tick");
    }
}
