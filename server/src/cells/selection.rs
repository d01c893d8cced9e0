//! Which bodies a cell's snapshot carries, within the cell's byte budget.
//!
//! Pure. Every family of bodies that has something to tell waits with a weight of its own, by speed and what its actor says
//! it matters, and the longest weighted wait goes first. Who has nothing to tell is carried anyway, which costs next to
//! nothing, and so is who is new, so that a snapshot says who is in the cell.

use pita_protocol::dof::{Budget, Need, Priorities, Relevance, Spent};

use crate::crowd::{Crowd, Family};

/// The selection of one cell.
#[derive(Debug)]
pub struct Selection {
    budget: Budget,
    priorities: Priorities,
    costs: Vec<f64>,
    /// Priorities and indices of families.
    order: Vec<(f32, usize)>,
    taken: Vec<bool>,
    chosen: Vec<bool>,
}

impl Selection {
    /// For a cell that may take `bytes_per_s` at its full rate.
    pub fn new(bytes_per_s: u32, tick_hz: u16) -> Self {
        Self {
            budget: Budget::new(bytes_per_s, tick_hz),
            priorities: Priorities::default(),
            costs: Vec::new(),
            order: Vec::new(),
            taken: Vec::new(),
            chosen: Vec::new(),
        }
    }

    /// A tick goes by.
    pub fn fill(&mut self) {
        self.budget.fill();
    }

    /// Which bodies, with these `needs`, the snapshot of this tick carries; empty for all. To be followed by
    /// [`Selection::sent`].
    pub fn choose(&mut self, needs: &[Need], crowd: &Crowd) -> &[bool] {
        let families = crowd.families();
        self.costs.clear();
        self.costs.resize(families.len(), 0.0);
        self.taken.clear();
        self.taken.resize(families.len(), false);
        for (&family, &need) in crowd.of_bodies().iter().zip(needs) {
            self.costs[family as usize] += self.budget.estimate(need);
            self.taken[family as usize] |= matches!(need, Need::First { .. });
        }
        self.priorities.wait(families.iter().map(|family| (family.root, relevance(family))));
        self.chosen.clear();
        if self.costs.iter().sum::<f64>() <= self.budget.room() {
            (0..families.len()).for_each(|family| self.priorities.sent(family));
            return &self.chosen;
        }
        self.take();
        self.chosen.extend(crowd.of_bodies().iter().map(|&family| self.taken[family as usize]));
        &self.chosen
    }

    /// The snapshot that was chosen became a message of so many bytes.
    pub fn sent(&mut self, bytes: usize, spent: &Spent) {
        self.budget.spend(bytes, spent);
    }

    /// Takes families, those that are new or have nothing to tell and then by priority, until there is no room. The last
    /// may take more than there is, which the next snapshots pay back: else one that is larger than a tick's share never
    /// got its turn.
    fn take(&mut self) {
        let mut left = self.budget.room();
        self.order.clear();
        for (family, (_, priority)) in self.priorities.all().enumerate() {
            if self.taken[family] || self.costs[family] == 0.0 {
                left -= self.costs[family];
                self.taken[family] = true;
            } else {
                self.order.push((priority, family));
            }
        }
        self.order.sort_unstable_by(|(a, i), (b, j)| b.total_cmp(a).then(i.cmp(j)));
        for &(_, family) in &self.order {
            if left <= 0.0 {
                break;
            }
            left -= self.costs[family];
            self.taken[family] = true;
        }
        let taken = self.taken.iter().enumerate().filter(|(_, taken)| **taken);
        taken.for_each(|(family, _)| self.priorities.sent(family));
    }
}

fn relevance(family: &Family) -> Relevance {
    Relevance { speed: family.speed, importance: family.importance }
}
