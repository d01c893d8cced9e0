//! Which ticks arrived: counts losses, and tells the new from the late and the repeated.
//!
//! Pure. Remembers [`WINDOW`] ticks, whatever arrives.

/// Ticks behind the newest for which a late arrival still fills its gap.
pub const WINDOW: u64 = 128;

/// What an arrival is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Newer than everything before.
    Newest,
    /// Overtaken by a newer one, and not seen before.
    Late,
    /// Seen before, or older than the window.
    Stale,
}

/// Counts of arrivals by tick.
#[derive(Clone, Debug, Default)]
pub struct TickLedger {
    newest: Option<u64>,
    /// Bit `i` is set when tick `newest − i` arrived.
    seen: u128,
    received: u64,
    missed: u64,
    stale: u64,
}

impl TickLedger {
    /// Distinct ticks that arrived.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Ticks between the first and the newest that did not arrive.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Arrivals that were repeated or too old to be of use.
    pub fn stale(&self) -> u64 {
        self.stale
    }

    /// Takes note of one arrival.
    pub fn note(&mut self, tick: u64) -> Arrival {
        let Some(newest) = self.newest else {
            (self.newest, self.seen, self.received) = (Some(tick), 1, 1);
            return Arrival::Newest;
        };
        if tick > newest {
            let ahead = tick - newest;
            self.seen = if ahead < WINDOW { self.seen << ahead | 1 } else { 1 };
            self.newest = Some(tick);
            self.received += 1;
            self.missed = self.missed.saturating_add(ahead - 1);
            return Arrival::Newest;
        }
        let behind = newest - tick;
        if behind >= WINDOW || self.seen >> behind & 1 == 1 || self.missed == 0 {
            self.stale += 1;
            return Arrival::Stale;
        }
        self.seen |= 1 << behind;
        self.received += 1;
        self.missed -= 1;
        Arrival::Late
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        /// Whatever the order, within the window: received + missed = span of ticks, repeats are stale.
        #[test]
        fn counts_agree_with_a_set(offsets in prop::collection::vec(0u64..WINDOW, 1..200)) {
            let mut ledger = TickLedger::default();
            // The lowest tick comes first, so that nothing lies before the first arrival.
            let ticks: Vec<u64> = std::iter::once(0).chain(offsets).map(|o| 5000 + o).collect();
            ticks.iter().for_each(|&t| { ledger.note(t); });
            let distinct: BTreeSet<u64> = ticks.iter().copied().collect();
            let span = distinct.last().unwrap() - distinct.first().unwrap() + 1;
            prop_assert_eq!(ledger.received(), distinct.len() as u64);
            prop_assert_eq!(ledger.missed(), span - distinct.len() as u64);
            prop_assert_eq!(ledger.stale(), (ticks.len() - distinct.len()) as u64);
        }

        #[test]
        fn any_ticks_are_survived(ticks in prop::collection::vec(any::<u64>(), 0..50)) {
            let mut ledger = TickLedger::default();
            ticks.iter().for_each(|&t| { ledger.note(t); });
            prop_assert_eq!(ledger.received() + ledger.stale(), ticks.len() as u64);
            prop_assert_eq!(ledger.newest, ticks.iter().copied().max());
        }
    }

    #[test]
    fn a_late_arrival_fills_its_gap() {
        let mut ledger = TickLedger::default();
        assert_eq!([1, 2, 4, 3, 3].map(|t| ledger.note(t)), {
            use Arrival::{Late, Newest, Stale};
            [Newest, Newest, Newest, Late, Stale]
        });
        assert_eq!((ledger.received(), ledger.missed(), ledger.stale()), (4, 0, 1));
    }
}
