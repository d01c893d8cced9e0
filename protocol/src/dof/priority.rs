//! Who is sent when not everybody fits: priorities that add up until a body's turn comes.

use std::collections::BTreeMap;

/// What a body's weight is made of. All of it is the sender's choice; receivers know nothing of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relevance {
    /// From the receiver's own body, m.
    pub distance: f32,
    /// m/s.
    pub speed: f32,
    /// Whether it is the receiver's own.
    pub is_own: bool,
    /// Factor that the game sets; 1 is the rule, 0 never.
    pub importance: f32,
}

impl Relevance {
    /// How much priority a tick of waiting is worth.
    pub fn weight(&self) -> f32 {
        // The own body outweighs everything else together.
        let own = if self.is_own { 1e6 } else { 1.0 };
        // What is 20 m away counts half of what is near, and what rests a tenth of what drives at 10 m/s.
        let near = 20.0 / (20.0 + self.distance.max(0.0));
        let fast = (1.0 + self.speed.max(0.0)) / 11.0;
        let weight = own * near * fast.clamp(0.1, 2.0) * self.importance;
        if weight.is_finite() { weight.max(0.0) } else { 0.0 }
    }
}

/// Priorities of one receiver.
#[derive(Clone, Debug, Default)]
pub struct Priorities {
    waiting: BTreeMap<u32, f32>,
}

impl Priorities {
    /// A tick went by for the body `id`.
    pub fn wait(&mut self, id: u32, relevance: &Relevance) {
        *self.waiting.entry(id).or_default() += relevance.weight();
    }

    /// The priority of the body `id`.
    pub fn of(&self, id: u32) -> f32 {
        self.waiting.get(&id).copied().unwrap_or(0.0)
    }

    /// The body `id` was sent: it waits anew.
    pub fn sent(&mut self, id: u32) {
        self.waiting.insert(id, 0.0);
    }

    /// Forgets all bodies but those that `keep` names.
    pub fn retain(&mut self, keep: impl Fn(u32) -> bool) {
        self.waiting.retain(|&id, _| keep(id));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_gets_a_turn_and_the_near_and_fast_more_of_them() {
        let relevance = |distance, speed| Relevance { distance, speed, is_own: false, importance: 1.0 };
        let bodies = [relevance(0.0, 10.0), relevance(100.0, 10.0), relevance(100.0, 0.0)];
        let (mut priorities, mut turns) = (Priorities::default(), [0; 3]);
        for _ in 0..1000 {
            for (body, id) in bodies.iter().zip(0..) {
                priorities.wait(id, body);
            }
            let next = (0..3).max_by(|&a, &b| priorities.of(a).total_cmp(&priorities.of(b))).unwrap();
            turns[next as usize] += 1;
            priorities.sent(next);
        }
        assert!(turns[0] > turns[1] && turns[1] > turns[2] && turns[2] > 10, "{turns:?}");
    }

    #[test]
    fn nonsense_weighs_nothing() {
        let wild = Relevance { distance: f32::NAN, speed: f32::INFINITY, is_own: true, importance: f32::NAN };
        assert_eq!(wild.weight(), 0.0);
    }
}
