//! What a session tells its owner, in a bounded queue.

use std::{collections::VecDeque, sync::Mutex};

use pita_protocol::message::Event;
use tokio::sync::Notify;

use crate::lock::lock;

/// Events that wait to be read; the oldest are dropped first. The roster does not depend on anybody reading them.
const WAITING_MAX: usize = 1024;

/// Something that a session tells its owner.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionEvent {
    /// Something happened in the arena.
    Happened(Event),
    /// So many events did not arrive. The roster has been read again; the [`Happened`](Self::Happened) that follow lead
    /// from the old one to the new one. Joins and leaves among the lost events stay unknown.
    Resynchronised {
        /// Events that did not arrive.
        missed: u32,
    },
    /// The owner read too slowly: so many older events were dropped.
    Overflowed {
        /// Events that were dropped.
        dropped: u64,
    },
}

/// Queue between a session and its owner.
#[derive(Debug, Default)]
pub struct EventQueue {
    waiting: Mutex<Waiting>,
    changed: Notify,
}

#[derive(Debug, Default)]
struct Waiting {
    events: VecDeque<SessionEvent>,
    dropped: u64,
    closed: bool,
}

impl EventQueue {
    /// Appends an event.
    pub fn push(&self, event: SessionEvent) {
        let mut waiting = lock(&self.waiting);
        if waiting.events.len() == WAITING_MAX {
            waiting.events.pop_front();
            waiting.dropped += 1;
        }
        waiting.events.push_back(event);
        drop(waiting);
        self.changed.notify_one();
    }

    /// Nothing will be appended any more.
    pub fn close(&self) {
        lock(&self.waiting).closed = true;
        self.changed.notify_one();
    }

    /// The next event; `None` once the queue is closed and read to its end.
    pub async fn next(&self) -> Option<SessionEvent> {
        loop {
            {
                let mut waiting = lock(&self.waiting);
                if waiting.dropped > 0 {
                    return Some(SessionEvent::Overflowed { dropped: std::mem::take(&mut waiting.dropped) });
                }
                if let Some(event) = waiting.events.pop_front() {
                    return Some(event);
                }
                if waiting.closed {
                    // Wakes the next reader, who then sees the same.
                    self.changed.notify_one();
                    return None;
                }
            }
            // A push or close between the lock and here leaves its permit, so that it is not missed.
            self.changed.notified().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(slot: u16) -> SessionEvent {
        SessionEvent::Happened(Event::Left { slot, reason: "left".into() })
    }

    #[tokio::test]
    async fn a_slow_reader_is_told_what_it_lost() {
        let queue = EventQueue::default();
        (0..WAITING_MAX as u16 + 2).for_each(|slot| queue.push(left(slot)));
        queue.close();
        assert_eq!(queue.next().await, Some(SessionEvent::Overflowed { dropped: 2 }));
        for slot in 2..WAITING_MAX as u16 + 2 {
            assert_eq!(queue.next().await, Some(left(slot)));
        }
        assert_eq!(queue.next().await, None);
        assert_eq!(queue.next().await, None);
    }
}
