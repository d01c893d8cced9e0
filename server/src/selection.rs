//! Whom a session is sent at a tick, within its byte budget.
//!
//! Pure. Every family of bodies waits with a weight of its own, by distance, speed, ownership and what its actor says it
//! matters, and the longest weighted wait goes first. What has nothing new to tell does not wait. So a slow client gets
//! fewer bodies a tick, each as new as can be, and never old ones from a queue.

use pita_protocol::dof::{Budget, Encoder, Need, Priorities, Relevance, State};

use crate::crowd::{Crowd, Family};

/// What a connection is never given less than, bytes/s: the own car and a few others.
pub const LEAST_BYTES_PER_S: u32 = 8_000;

/// The selection of one session.
#[derive(Debug)]
pub struct Selection {
    budget: Budget,
    priorities: Priorities,
    /// Newest tick that was acknowledged, or that of the first snapshot.
    acknowledged: Option<u64>,
    needs: Vec<Need>,
    costs: Vec<f64>,
    /// Priorities and indices of families.
    order: Vec<(f32, usize)>,
    taken: Vec<bool>,
    chosen: Vec<bool>,
}

impl Selection {
    /// For a session with a budget of `bytes_per_s`.
    pub fn new(bytes_per_s: u32, tick_hz: u16) -> Self {
        Self {
            budget: Budget::new(bytes_per_s, LEAST_BYTES_PER_S, tick_hz),
            priorities: Priorities::default(),
            acknowledged: None,
            needs: Vec::new(),
            costs: Vec::new(),
            order: Vec::new(),
            taken: Vec::new(),
            chosen: Vec::new(),
        }
    }

    /// The session acknowledged the snapshot of `tick`.
    pub fn acknowledge(&mut self, tick: u64) {
        self.acknowledged = self.acknowledged.max(Some(tick));
    }

    /// Which bodies of `state` the snapshot of `tick` carries to the session on `slot`; empty for all. To be followed by
    /// [`Selection::sent`].
    pub fn choose(&mut self, encoder: &mut Encoder, tick: u64, state: &State, crowd: &Crowd, slot: u16) -> &[bool] {
        let acknowledged = *self.acknowledged.get_or_insert(tick);
        self.budget.fill(tick.saturating_sub(acknowledged));
        encoder.needs(tick, state, &mut self.needs);
        let families = crowd.families();
        self.add_up_costs(crowd);
        let own = families.iter().position(|family| family.slot == Some(slot));
        let from = own.map(|own| families[own].position);
        let relevances =
            families.iter().enumerate().map(|(i, family)| (family.root, relevance(family, from, own == Some(i))));
        self.priorities.wait(relevances);
        let everything: f64 = self.costs.iter().sum();
        self.chosen.clear();
        if everything <= self.budget.room() {
            (0..families.len()).for_each(|family| self.priorities.sent(family));
            return &self.chosen;
        }
        self.take(own);
        self.chosen.extend(crowd.of_bodies().iter().map(|&family| self.taken[family as usize]));
        &self.chosen
    }

    /// The snapshot that was chosen became a message of so many bytes.
    pub fn sent(&mut self, bytes: usize, encoder: &Encoder) {
        self.budget.spend(bytes, encoder.spent());
    }

    fn add_up_costs(&mut self, crowd: &Crowd) {
        self.costs.clear();
        self.costs.resize(crowd.families().len(), 0.0);
        for (&family, &need) in crowd.of_bodies().iter().zip(&self.needs) {
            self.costs[family as usize] += self.budget.estimate(need);
        }
    }

    /// Takes families with something to tell, highest priority first, until there is no room. The last may take more
    /// than there is, which the next snapshots pay back: else one that is larger than a tick's share never got its turn.
    fn take(&mut self, own: Option<usize>) {
        self.taken.clear();
        self.taken.resize(self.costs.len(), false);
        self.order.clear();
        let waiting = self.priorities.all().enumerate().filter(|(family, _)| self.costs[*family] > 0.0);
        self.order.extend(waiting.map(|(family, (_, priority))| (priority, family)));
        self.order.sort_unstable_by(|(a, i), (b, j)| b.total_cmp(a).then(i.cmp(j)));
        let mut left = self.budget.room();
        if let Some(own) = own {
            left -= self.costs[own];
            self.taken[own] = true;
            self.priorities.sent(own);
        }
        for &(_, family) in &self.order {
            if left <= 0.0 {
                break;
            }
            if !std::mem::replace(&mut self.taken[family], true) {
                left -= self.costs[family];
                self.priorities.sent(family);
            }
        }
    }
}

fn relevance(family: &Family, from: Option<[f32; 3]>, is_own: bool) -> Relevance {
    let square = |from: [f32; 3]| from.iter().zip(family.position).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
    // A spectator is nowhere: to him all are alike.
    let distance = from.map_or(0.0, |from| square(from).sqrt());
    Relevance { distance, speed: family.speed, is_own, importance: family.importance }
}

#[cfg(test)]
mod tests;
