//! Players on their way into the arena and out of it.
//!
//! Sessions live on the network's side, players in the arena; a [`Boarding`] goes from here to there and the arena's
//! answer comes back as an event that names only the slot. The [`Ledger`] knows what was sent for each slot and so
//! which session an answer is about. Pure.

use std::collections::VecDeque;

use crate::sessions::SessionId;

/// A player enters or leaves the arena, on the way to the tick thread.
#[derive(Debug)]
pub enum Boarding {
    /// Takes its seat.
    Enter {
        /// The session.
        id: SessionId,
        /// Name to show.
        name: String,
    },
    /// Keeps its seat under another id; the arena is not told.
    Resume {
        /// The session until now.
        from: SessionId,
        /// The session from now on.
        to: SessionId,
    },
    /// Leaves it.
    Leave {
        /// Slot of the session.
        slot: u16,
        /// For a person.
        reason: String,
    },
}

/// What was sent and is not answered yet, slot by slot.
pub struct Ledger {
    slots: Vec<VecDeque<Sent>>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Sent {
    Enter(SessionId),
    Leave,
}

/// What it means that the arena says of a slot that its player is out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Out {
    /// The player was in and left.
    Left,
    /// The player did not get in.
    Refused(SessionId),
}

impl Ledger {
    /// Nothing sent.
    pub fn new(slots: u16) -> Self {
        Self { slots: (0..slots).map(|_| VecDeque::new()).collect() }
    }

    /// `boarding` is sent now.
    pub fn sent(&mut self, boarding: &Boarding) {
        let (slot, sent) = match boarding {
            Boarding::Enter { id, .. } => (id.slot, Sent::Enter(*id)),
            Boarding::Leave { slot, .. } => (*slot, Sent::Leave),
            Boarding::Resume { .. } => return,
        };
        if let Some(open) = self.slots.get_mut(usize::from(slot)) {
            open.push_back(sent);
        }
    }

    /// The session `from` is `to` now. Answers whether its way in is still open.
    pub fn resumed(&mut self, from: SessionId, to: SessionId) -> bool {
        let open = self.slots.get_mut(usize::from(from.slot)).into_iter().flatten();
        let entering = open.filter(|sent| **sent == Sent::Enter(from));
        entering.map(|sent| *sent = Sent::Enter(to)).count() > 0
    }

    /// The arena says that the player of `slot` is in: which session that is.
    pub fn entered(&mut self, slot: u16) -> Option<SessionId> {
        let open = self.slots.get_mut(usize::from(slot))?;
        match open.front() {
            Some(&Sent::Enter(id)) => {
                open.pop_front();
                Some(id)
            }
            Some(Sent::Leave) | None => None,
        }
    }

    /// The arena says that the player of `slot` is out.
    pub fn out(&mut self, slot: u16) -> Out {
        let Some(open) = self.slots.get_mut(usize::from(slot)) else { return Out::Left };
        let Some(Sent::Enter(id)) = open.pop_front() else { return Out::Left };
        // A leave behind it finds nobody in the slot and is not answered.
        if open.front() == Some(&Sent::Leave) {
            open.pop_front();
        }
        Out::Refused(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: SessionId = SessionId { slot: 1, epoch: 1 };
    const B: SessionId = SessionId { slot: 1, epoch: 2 };

    fn ledger(sent: &[Sent]) -> Ledger {
        let mut ledger = Ledger::new(2);
        for sent in sent {
            ledger.sent(&match sent {
                Sent::Enter(id) => Boarding::Enter { id: *id, name: String::new() },
                Sent::Leave => Boarding::Leave { slot: 1, reason: String::new() },
            });
        }
        ledger
    }

    #[test]
    fn answers_are_matched_with_the_session_that_they_are_about() {
        let mut ledger = ledger(&[Sent::Enter(A), Sent::Leave, Sent::Enter(B)]);
        assert_eq!(ledger.entered(1), Some(A));
        assert_eq!(ledger.out(1), Out::Left);
        assert_eq!(ledger.entered(1), Some(B));
        assert_eq!(ledger.entered(1), None, "nothing more was sent");
    }

    #[test]
    fn a_resumed_session_is_answered_under_its_new_name() {
        let mut ledger = ledger(&[Sent::Enter(A)]);
        assert!(ledger.resumed(A, B));
        assert_eq!(ledger.entered(1), Some(B));
        assert!(!ledger.resumed(B, A), "it is in");
    }

    #[test]
    fn a_refused_player_does_not_answer_for_the_next() {
        let mut ledger = ledger(&[Sent::Enter(A), Sent::Leave, Sent::Enter(B)]);
        assert_eq!(ledger.out(1), Out::Refused(A));
        assert_eq!(ledger.entered(1), Some(B));
        assert_eq!((ledger.entered(7), ledger.out(7)), (None, Out::Left));
    }
}
