//! Events that wait for a frame, on the tick thread: bounded however long the publishing thread is held up.
//!
//! Pure. What the description of the world adds up from is never lost, only what cancels out in it; what was only to be
//! seen or heard goes first. What is left out is counted.

use std::collections::{BTreeMap, BTreeSet};

use pita_game::ArenaEvent;

/// So many events wait as they are: minutes of a busy arena, and more than a tick of one that is read again.
const CROWDED: usize = 2048;

/// Events in order.
#[derive(Debug)]
pub struct EventBacklog {
    events: Vec<ArenaEvent>,
    /// How many may come to wait before they are condensed: twice what cannot be left out, so that it pays.
    condense_at: usize,
    dropped: u64,
}

impl Default for EventBacklog {
    fn default() -> Self {
        Self { events: Vec::new(), condense_at: CROWDED, dropped: 0 }
    }
}

impl EventBacklog {
    /// Appends the `events` of a tick.
    pub fn extend(&mut self, events: &[ArenaEvent]) {
        self.events.extend_from_slice(events);
        if self.events.len() > self.condense_at {
            self.condense();
            self.condense_at = CROWDED.max(2 * self.events.len());
        }
    }

    /// Appends what waits to `into`.
    pub fn hand_over(&mut self, into: &mut Vec<ArenaEvent>) {
        into.append(&mut self.events);
        self.condense_at = CROWDED;
    }

    /// Events that were left out since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Leaves out what makes no difference to the world's description.
    fn condense(&mut self) {
        let before = self.events.len();
        let mut keeps = vec![false; before];
        let (mut removed, mut scored, mut is_anew) = (BTreeMap::new(), BTreeSet::new(), false);
        for (at, event) in self.events.iter().enumerate().rev() {
            keeps[at] = match event {
                ArenaEvent::ActorRemoved(id) => {
                    removed.insert(*id, at);
                    true
                }
                // Who came and went meanwhile was never there.
                ArenaEvent::ActorAdded(actor) => match removed.remove(&actor.id) {
                    Some(gone) => {
                        keeps[gone] = false;
                        false
                    }
                    None => true,
                },
                ArenaEvent::Scored { actor, .. } => !is_anew && scored.insert(*actor),
                ArenaEvent::RoundBegan { .. } => !std::mem::replace(&mut is_anew, true),
                ArenaEvent::Entered { .. } | ArenaEvent::Left { .. } => true,
                ArenaEvent::Effect(_) | ArenaEvent::KnockedOut { .. } | ArenaEvent::RoundEnded { .. } => false,
            };
        }
        let mut keeps = keeps.into_iter();
        self.events.retain(|_| keeps.next() == Some(true));
        self.dropped += (before - self.events.len()) as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_game::ActorInfo;

    fn added(id: u32) -> ArenaEvent {
        ArenaEvent::ActorAdded(ActorInfo { id, kind: "prop", name: String::new(), slot: None, parts: Vec::new() })
    }

    #[test]
    fn a_held_up_publisher_costs_no_more_memory_than_the_world() {
        let mut backlog = EventBacklog::default();
        backlog.extend(&[added(1), ArenaEvent::ActorRemoved(0)]);
        for tick in 0..100_000u32 {
            let id = 10 + tick;
            let points = tick;
            let knock = ArenaEvent::KnockedOut { actor: 1, by: None };
            let events = [added(id), knock, ArenaEvent::Scored { actor: 1, points }, ArenaEvent::ActorRemoved(id)];
            backlog.extend(&events);
            assert!(backlog.events.len() <= CROWDED + events.len(), "{} at {tick}", backlog.events.len());
        }
        let mut rest = Vec::new();
        backlog.hand_over(&mut rest);
        assert_eq!(rest.len() as u64 + backlog.dropped(), 400_002);
        assert!(matches!(rest[..2], [ArenaEvent::ActorAdded(ref actor), ArenaEvent::ActorRemoved(0)] if actor.id == 1));
        let points = rest.iter().rev().find_map(|event| match event {
            ArenaEvent::Scored { points, .. } => Some(*points),
            _ => None,
        });
        assert_eq!(points, Some(99_999));
    }

    #[test]
    fn what_cannot_be_left_out_stays_and_is_not_looked_at_each_tick() {
        let mut backlog = EventBacklog::default();
        for id in 0..10_000 {
            backlog.extend(&[added(id)]);
        }
        assert_eq!((backlog.events.len(), backlog.dropped()), (10_000, 0));
        assert!(backlog.condense_at >= 10_000);
        backlog.extend(&[ArenaEvent::RoundBegan { number: 1 }, ArenaEvent::Scored { actor: 3, points: 2 }]);
        backlog.extend(&[ArenaEvent::RoundBegan { number: 2 }]);
        backlog.condense();
        assert!(matches!(backlog.events[10_000..], [ArenaEvent::RoundBegan { number: 2 }]));
    }
}
