//! How much a stream may take: a budget that fills with every tick, and what bodies are likely to take of it.
//!
//! Pure. Costs are learnt from what was coded. Nothing is sent twice to fit: a snapshot that took more than its share is
//! paid back by the next ones, so that the budget holds on average, and nothing waits in a queue.

/// What a body of a state has to tell a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// It is where the receiver has it.
    Nothing,
    /// So many of its groups moved.
    Update {
        /// At least 1.
        groups: u16,
    },
    /// The receiver does not know it yet.
    First {
        /// All that it has.
        groups: u16,
    },
}

/// Bytes of a kind of groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// So many groups
    pub groups: usize,
    /// took so many bytes.
    pub bytes: usize,
}

impl Cost {
    pub(super) fn add(&mut self, groups: usize, bytes: usize) {
        self.groups += groups;
        self.bytes += bytes;
    }
}

/// What the bodies of a snapshot took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spent {
    /// Bodies that the receiver did not know.
    pub first: Cost,
    /// All others, by the groups of them that changed.
    pub updates: Cost,
}

/// Ticks of saving at most: what is left over by quiet ticks is there for the next burst.
const SAVED_TICKS_MAX: f64 = 8.0;
/// Weight of a new observation of a cost.
const LEARNT: f64 = 0.1;

/// The budget of one stream.
#[derive(Clone, Debug)]
pub struct Budget {
    tick_hz: f64,
    bytes_per_tick: f64,
    /// Bytes; negative where the last snapshots took too much.
    saved: f64,
    /// Bytes a group.
    first: f64,
    update: f64,
    /// Bytes of a snapshot that are no body's.
    overhead: f64,
}

impl Budget {
    /// `bytes_per_s` on average.
    pub fn new(bytes_per_s: u32, tick_hz: u16) -> Self {
        let tick_hz = f64::from(tick_hz.max(1));
        let bytes_per_tick = f64::from(bytes_per_s) / tick_hz;
        // As a first guess; a tick or two of snapshots say better.
        let (first, update, overhead) = (6.0, 2.5, 48.0);
        Self { tick_hz, bytes_per_tick, saved: bytes_per_tick, first, update, overhead }
    }

    /// A tick goes by.
    pub fn fill(&mut self) {
        self.saved = (self.saved + self.bytes_per_tick).min(self.bytes_per_tick * SAVED_TICKS_MAX);
    }

    /// Bytes that bodies of the coming snapshot may take.
    pub fn room(&self) -> f64 {
        self.saved - self.overhead
    }

    /// Bytes that a body will likely take.
    pub fn estimate(&self, need: Need) -> f64 {
        match need {
            Need::Nothing => 0.0,
            Need::Update { groups } => f64::from(groups) * self.update,
            Need::First { groups } => f64::from(groups) * self.first,
        }
    }

    /// A snapshot of so many bytes, headers included, was sent.
    pub fn spend(&mut self, bytes: usize, spent: &Spent) {
        // A debt is forgotten after a second: the first snapshot of a world that shows all at once is paid by then.
        self.saved = (self.saved - bytes as f64).max(-self.bytes_per_tick * self.tick_hz);
        let learn = |known: &mut f64, seen: f64| *known += LEARNT * (seen - *known);
        for (known, cost) in [(&mut self.first, spent.first), (&mut self.update, spent.updates)] {
            if cost.groups > 0 {
                learn(known, cost.bytes as f64 / cost.groups as f64);
            }
        }
        learn(&mut self.overhead, bytes.saturating_sub(spent.first.bytes + spent.updates.bytes) as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends what there is room for, at a true cost that the budget has to learn. Answers bytes a second.
    fn sent_per_s(budget: &mut Budget, ticks: usize) -> f64 {
        let mut sent = 0;
        for _ in 0..ticks {
            budget.fill();
            let groups = (budget.room() / budget.estimate(Need::Update { groups: 1 })).max(0.0) as usize;
            let updates = Cost { groups, bytes: groups * 4 };
            budget.spend(updates.bytes + 60, &Spent { updates, ..Spent::default() });
            sent += updates.bytes + 60;
        }
        sent as f64 * 30.0 / ticks as f64
    }

    #[test]
    fn it_holds_on_average_whatever_bodies_cost() {
        for bytes_per_s in [8_000, 64_000, 1_000_000] {
            let mut budget = Budget::new(bytes_per_s, 30);
            let rate = sent_per_s(&mut budget, 300) / f64::from(bytes_per_s);
            assert!((0.9..1.04).contains(&rate), "{rate} of {bytes_per_s}");
        }
    }
}
