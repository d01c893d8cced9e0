//! Who is sent when not everybody fits: priorities that add up until a body's turn comes.

/// What a body's weight is made of. All of it is the sender's choice; receivers know nothing of it. Who is near is a matter
/// of which cells a receiver takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relevance {
    /// m/s.
    pub speed: f32,
    /// Factor that the game sets; 1 is the rule, 0 never.
    pub importance: f32,
}

impl Relevance {
    /// How much priority a tick of waiting is worth.
    pub fn weight(&self) -> f32 {
        // What rests counts a tenth of what drives at 10 m/s.
        let fast = (1.0 + self.speed.max(0.0)) / 11.0;
        let weight = fast.clamp(0.1, 2.0) * self.importance;
        if weight.is_finite() { weight.max(0.0) } else { 0.0 }
    }
}

/// Priorities of one stream.
#[derive(Clone, Debug, Default)]
pub struct Priorities {
    /// In order of id.
    waiting: Vec<(u32, f32)>,
    /// Kept for its memory.
    before: Vec<(u32, f32)>,
}

impl Priorities {
    /// A tick went by for `all`, in order of id; others are forgotten.
    pub fn wait(&mut self, all: impl Iterator<Item = (u32, Relevance)>) {
        std::mem::swap(&mut self.waiting, &mut self.before);
        self.waiting.clear();
        let mut before = self.before.iter().peekable();
        for (id, relevance) in all {
            while before.next_if(|(other, _)| *other < id).is_some() {}
            let waited = before.next_if(|(other, _)| *other == id).map_or(0.0, |(_, waited)| *waited);
            self.waiting.push((id, waited + relevance.weight()));
        }
    }

    /// Priorities of those that [`Priorities::wait`] named, in its order.
    pub fn all(&self) -> impl ExactSizeIterator<Item = (u32, f32)> {
        self.waiting.iter().copied()
    }

    /// Who is at `index` was sent: it waits anew.
    pub fn sent(&mut self, index: usize) {
        if let Some((_, waited)) = self.waiting.get_mut(index) {
            *waited = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_gets_a_turn_and_the_fast_and_important_more_of_them() {
        let relevance = |speed, importance| Relevance { speed, importance };
        let bodies = [relevance(10.0, 1.0), relevance(10.0, 0.3), relevance(0.0, 0.3)];
        let (mut priorities, mut turns) = (Priorities::default(), [0; 3]);
        for _ in 0..1000 {
            priorities.wait((0..).zip(bodies));
            let of: Vec<_> = priorities.all().map(|(_, priority)| priority).collect();
            let next = (0..3).max_by(|&a, &b| of[a].total_cmp(&of[b])).unwrap();
            turns[next] += 1;
            priorities.sent(next);
        }
        assert!(turns[0] > turns[1] && turns[1] > turns[2] && turns[2] > 10, "{turns:?}");
    }

    #[test]
    fn nonsense_weighs_nothing() {
        let wild = Relevance { speed: f32::INFINITY, importance: f32::NAN };
        assert_eq!(wild.weight(), 0.0);
    }
}
