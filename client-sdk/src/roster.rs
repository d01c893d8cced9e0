//! Which actors there are, kept up to date by events.
//!
//! Pure. Events carry numbers without gaps; after a gap the roster is [behind](Roster::is_behind) until a description
//! that is at least as new has been [reconciled](Roster::reconcile).

use std::{collections::BTreeMap, sync::Arc};

use pita_protocol::message::{ActorDescription, Description, Event, EventMessage};

/// Most actors that are kept, so that a server cannot fill this process's memory by adding actors for ever.
/// More than a snapshot can have slices.
pub const ACTORS_MAX: usize = 65_536;

/// The actors of an arena, by id.
#[derive(Clone, Debug)]
pub struct Roster {
    actors: BTreeMap<u32, Arc<ActorDescription>>,
    /// Points of this round, by actor.
    scores: BTreeMap<u32, u32>,
    event_sequence: u32,
    /// Events that did not arrive since the last description.
    missing: u32,
    /// Newest event that is known to have happened.
    announced: u32,
}

/// What a description changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Reconciled {
    /// Events that the roster never saw.
    pub missed: u32,
    /// Additions and removals that lead from the old roster to the new one.
    pub changes: Vec<Event>,
}

impl Roster {
    /// As the description says.
    pub fn new(description: &Description) -> Self {
        let known = description.actors.iter().take(ACTORS_MAX);
        Self {
            actors: known.map(|actor| (actor.id, Arc::new(actor.clone()))).collect(),
            scores: description.scores.iter().copied().take(ACTORS_MAX).collect(),
            event_sequence: description.event_sequence,
            missing: 0,
            announced: description.event_sequence,
        }
    }

    /// All actors, in order of id.
    pub fn actors(&self) -> impl Iterator<Item = &Arc<ActorDescription>> {
        self.actors.values()
    }

    /// The actor of this id.
    pub fn actor(&self, id: u32) -> Option<&Arc<ActorDescription>> {
        self.actors.get(&id)
    }

    /// Points of an actor in this round.
    pub fn points(&self, id: u32) -> u32 {
        self.scores.get(&id).copied().unwrap_or(0)
    }

    /// Slice that says where the actor is: the one of its first part.
    pub fn root_slice(&self, id: u32) -> Option<u32> {
        Some(self.actors.get(&id)?.parts.first()?.slice)
    }

    /// Number of the last event that is contained.
    pub fn event_sequence(&self) -> u32 {
        self.event_sequence
    }

    /// Whether events are missing, so that a description has to be asked for.
    pub fn is_behind(&self) -> bool {
        self.missing > 0 || self.announced > self.event_sequence
    }

    /// Notes that events up to `announced` have happened, and should have arrived by now.
    pub fn note_announced(&mut self, announced: u32) {
        self.announced = self.announced.max(announced);
    }

    /// Applies an event, and answers whether it was new. Events after a gap are applied too: what they say is true
    /// whatever was missed.
    pub fn apply(&mut self, message: &EventMessage) -> bool {
        if message.sequence <= self.event_sequence {
            return false;
        }
        self.missing = self.missing.saturating_add(message.sequence - self.event_sequence - 1);
        self.event_sequence = message.sequence;
        match &message.event {
            Event::ActorAdded(actor) if self.actors.len() < ACTORS_MAX => {
                self.actors.insert(actor.id, Arc::new(actor.clone()));
            }
            Event::ActorRemoved { id } => {
                self.actors.remove(id);
                self.scores.remove(id);
            }
            Event::Scored { actor, points } if self.scores.len() < ACTORS_MAX => {
                self.scores.insert(*actor, *points);
            }
            Event::RoundBegan { .. } => self.scores.clear(),
            _ => {}
        }
        true
    }

    /// Takes over a description. `None` where it is older than the events that were applied: ask again.
    pub fn reconcile(&mut self, description: &Description) -> Option<Reconciled> {
        let unseen = description.event_sequence.checked_sub(self.event_sequence)?;
        let new = Self::new(description);
        let removed = self.actors.keys().filter(|id| !new.actors.contains_key(id));
        let added = new.actors.values().filter(|actor| !self.actors.contains_key(&actor.id));
        let changes = removed
            .map(|&id| Event::ActorRemoved { id })
            .chain(added.map(|actor| Event::ActorAdded(actor.as_ref().clone())))
            .collect();
        let missed = self.missing.saturating_add(unseen);
        *self = new;
        Some(Reconciled { missed, changes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_protocol::dof::Precision;

    fn actor(id: u32) -> ActorDescription {
        ActorDescription { id, kind: "vehicle".into(), name: format!("car {id}"), slot: None, parts: Vec::new() }
    }

    fn description(event_sequence: u32, ids: &[u32]) -> Description {
        Description {
            arena: "a".into(),
            title: "A".into(),
            tick: 0,
            event_sequence,
            gravity: [0.0; 3],
            precision: Precision::default(),
            scores: Vec::new(),
            statics: Vec::new(),
            actors: ids.iter().map(|&id| actor(id)).collect(),
        }
    }

    fn ids(roster: &Roster) -> Vec<u32> {
        roster.actors().map(|a| a.id).collect()
    }

    fn event(sequence: u32, event: Event) -> EventMessage {
        EventMessage { sequence, tick: 0, event }
    }

    #[test]
    fn events_in_order_are_applied_once() {
        let mut roster = Roster::new(&description(4, &[1]));
        let events = [
            (event(4, Event::ActorRemoved { id: 1 }), false),
            (event(5, Event::ActorAdded(actor(2))), true),
            (event(5, Event::ActorAdded(actor(3))), false),
            (event(6, Event::ActorRemoved { id: 1 }), true),
        ];
        for (event, is_new) in events {
            assert_eq!(roster.apply(&event), is_new, "{event:?}");
        }
        assert_eq!((ids(&roster), roster.is_behind()), (vec![2], false));
    }

    #[test]
    fn a_gap_asks_for_a_description_that_is_new_enough() {
        let mut roster = Roster::new(&description(1, &[1]));
        assert!(roster.apply(&event(4, Event::ActorAdded(actor(9)))));
        assert!(roster.is_behind());
        assert_eq!(roster.reconcile(&description(3, &[1])), None);
        let changes = vec![Event::ActorRemoved { id: 1 }, Event::ActorAdded(actor(5))];
        assert_eq!(roster.reconcile(&description(5, &[5, 9])), Some(Reconciled { missed: 3, changes }));
        assert_eq!((ids(&roster), roster.is_behind()), (vec![5, 9], false));
    }

    #[test]
    fn points_are_of_this_round() {
        let mut roster = Roster::new(&Description { scores: vec![(1, 3)], ..description(1, &[1, 2]) });
        let scored = Event::Scored { actor: 2, points: 5 };
        assert!(roster.apply(&event(2, scored)));
        assert_eq!((roster.points(1), roster.points(2)), (3, 5));
        assert!(roster.apply(&event(3, Event::RoundBegan { number: 2 })));
        assert_eq!((roster.points(1), roster.points(2)), (0, 0));
    }

    #[test]
    fn an_announced_event_is_missing_until_it_comes() {
        let mut roster = Roster::new(&description(1, &[]));
        roster.note_announced(1);
        assert!(!roster.is_behind());
        roster.note_announced(2);
        assert!(roster.is_behind());
        assert!(roster.apply(&event(2, Event::ActorAdded(actor(1)))));
        assert!(!roster.is_behind());
    }
}
