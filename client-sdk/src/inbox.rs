//! What one session knows from the snapshots that arrived and the inputs that it sent: newest state, losses, latency.
//!
//! Bounded whatever the server does. Times are parameters; nothing here touches the network.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use pita_protocol::{
    decode,
    message::{JoinAccepted, Snapshot},
};

use crate::{
    snapshot::ReceivedSnapshot,
    statistics::Statistics,
    tick_clock::TickClock,
    tick_ledger::{Arrival, TickLedger},
};

/// Inputs that wait for their acknowledgement; the oldest are forgotten first. Eight seconds at 30 Hz.
const IN_FLIGHT_MAX: usize = 256;

/// A snapshot may be ahead of what time allows by so much, s; what is further ahead is malformed. Without a bound one
/// wrong tick number would make everything after it look old.
const AHEAD_MAX_S: f64 = 10.0;

/// Receiving side of a session.
#[derive(Debug)]
pub struct Inbox {
    began: Instant,
    /// Of the session; snapshots for another one are not taken.
    epoch: u32,
    ledger: TickLedger,
    clock: TickClock,
    /// Newest tick that is known, and when it became known.
    newest: (u64, Instant),
    /// For the interpolation buffer, newest last; empty where nobody interpolates.
    recent: VecDeque<Arc<ReceivedSnapshot>>,
    recent_max: usize,
    /// Sequence numbers that were sent and not acknowledged, with the time of their send.
    in_flight: VecDeque<(u32, Instant)>,
    statistics: Statistics,
    /// Snapshots whose slices could not be read, which shows only when somebody asks for them.
    malformed_slices: Arc<AtomicU64>,
}

impl Inbox {
    /// Of the session that `accepted` began at `now`; keeps `recent_max` snapshots for interpolation.
    pub fn new(accepted: &JoinAccepted, recent_max: usize, now: Instant) -> Self {
        Self {
            began: now,
            epoch: accepted.epoch,
            ledger: TickLedger::default(),
            clock: TickClock::new(accepted.tick_hz),
            newest: (accepted.description.tick, now),
            recent: VecDeque::new(),
            recent_max,
            in_flight: VecDeque::new(),
            statistics: Statistics::default(),
            malformed_slices: Arc::default(),
        }
    }

    /// Takes a snapshot message, and answers the snapshot where it is the newest.
    pub fn take_snapshot(&mut self, bytes: &[u8], now: Instant) -> Option<Arc<ReceivedSnapshot>> {
        self.statistics.received_bytes += bytes.len() as u64;
        let head = match decode::<Snapshot>(bytes) {
            Ok(head) if head.epoch != self.epoch => {
                self.statistics.snapshots_foreign += 1;
                return None;
            }
            Ok(head) if self.is_plausible(head.tick, now) => head,
            _ => {
                self.statistics.malformed += 1;
                return None;
            }
        };
        let arrival = self.ledger.note(head.tick);
        if arrival == Arrival::Stale {
            return None;
        }
        self.acknowledged(head.ack.sequence, now);
        self.clock.observe(head.tick, self.seconds(now));
        let snapshot = Arc::new(ReceivedSnapshot::new(head, now, Arc::clone(&self.malformed_slices)));
        if self.recent_max > 0 {
            if self.recent.len() == self.recent_max {
                self.recent.pop_front();
            }
            self.recent.push_back(Arc::clone(&snapshot));
        }
        if arrival == Arrival::Late {
            return None;
        }
        self.newest = (snapshot.tick(), now);
        Some(snapshot)
    }

    /// Takes note of an event message of so many bytes.
    pub fn count_event_bytes(&mut self, bytes: usize) {
        self.statistics.received_bytes += bytes as u64;
    }

    /// Counts a message that could not be used.
    pub fn count_malformed(&mut self) {
        self.statistics.malformed += 1;
    }

    /// Counts a new event.
    pub fn count_event(&mut self) {
        self.statistics.events_received += 1;
    }

    /// Counts events that did not arrive.
    pub fn count_missed_events(&mut self, missed: u32) {
        self.statistics.events_missed += u64::from(missed);
    }

    /// Takes note of an input packet that goes out at `now`.
    pub fn note_sent(&mut self, sequence: u32, bytes: usize, now: Instant) {
        self.statistics.inputs_sent += 1;
        self.statistics.sent_bytes += bytes as u64;
        if self.in_flight.len() == IN_FLIGHT_MAX {
            self.in_flight.pop_front();
        }
        self.in_flight.push_back((sequence, now));
    }

    /// Newest tick that is known, from a snapshot or from the join.
    pub fn newest_tick(&self) -> u64 {
        self.newest.0
    }

    /// How long nothing newer arrived.
    pub fn silent_for(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.newest.1)
    }

    /// Estimated tick of the server at `now`, fractional; `None` before the first snapshot.
    pub fn tick_at(&self, now: Instant) -> Option<f64> {
        self.clock.tick_at(self.seconds(now))
    }

    /// Snapshots that arrived since this was last asked, oldest first, as far as they are kept.
    pub fn drain_recent(&mut self) -> Vec<Arc<ReceivedSnapshot>> {
        self.recent.drain(..).collect()
    }

    /// All counts.
    pub fn statistics(&self) -> Statistics {
        Statistics {
            snapshots_received: self.ledger.received(),
            snapshots_missed: self.ledger.missed(),
            snapshots_stale: self.ledger.stale(),
            malformed: self.statistics.malformed + self.malformed_slices.load(Ordering::Relaxed),
            ..self.statistics.clone()
        }
    }

    fn is_plausible(&self, tick: u64, now: Instant) -> bool {
        let (newest, since) = self.newest;
        let elapsed_s = now.saturating_duration_since(since).as_secs_f64();
        let allowed_s = 2.0 * elapsed_s + AHEAD_MAX_S;
        tick.saturating_sub(newest) as f64 * self.clock.period_s() <= allowed_s
    }

    fn acknowledged(&mut self, sequence: u32, now: Instant) {
        while let Some((_, sent)) = self.in_flight.pop_front_if(|(sent, _)| *sent <= sequence) {
            let micros = u64::try_from(now.saturating_duration_since(sent).as_micros()).unwrap_or(u64::MAX);
            self.statistics.latency_us.saturating_record(micros);
        }
    }

    fn seconds(&self, now: Instant) -> f64 {
        now.saturating_duration_since(self.began).as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_protocol::{
        encode,
        message::{Description, InputAck},
        seal::SessionKey,
    };
    use proptest::prelude::*;

    const EPOCH: u32 = 9;

    const PERIOD: Duration = Duration::from_millis(33);

    /// Of a session that began at `tick`.
    fn inbox(tick: u64, recent_max: usize, now: Instant) -> Inbox {
        let description = Description {
            arena: String::new(),
            title: String::new(),
            tick,
            event_sequence: 0,
            gravity: [0.0; 3],
            statics: Vec::new(),
            actors: Vec::new(),
        };
        let session_key = SessionKey([0; 32]);
        let accepted = JoinAccepted {
            slot: 0,
            epoch: EPOCH,
            session_key,
            tick_hz: 30,
            input_timeout_ms: 5000,
            actor: None,
            description,
        };
        Inbox::new(&accepted, recent_max, now)
    }

    fn message(tick: u64, ack: u32) -> Vec<u8> {
        let ack = InputAck { sequence: ack, tick };
        encode(&Snapshot { epoch: EPOCH, tick, ack, event_sequence: 0, dof: Vec::new() })
    }

    #[test]
    fn only_the_newest_is_answered_and_every_head_counts() {
        let now = Instant::now();
        let mut inbox = inbox(100, 4, now);
        let answered = [101, 103, 102, 103, 104].map(|t| inbox.take_snapshot(&message(t, 0), now).map(|s| s.tick()));
        assert_eq!(answered, [Some(101), Some(103), None, None, Some(104)]);
        let counts = inbox.statistics();
        assert_eq!((counts.snapshots_received, counts.snapshots_missed, counts.snapshots_stale), (4, 0, 1));
        assert_eq!(inbox.drain_recent().iter().map(|s| s.tick()).collect::<Vec<_>>(), [101, 103, 102, 104]);
        assert!(inbox.drain_recent().is_empty());
    }

    #[test]
    fn latency_runs_from_the_send_to_the_first_acknowledging_snapshot() {
        let start = Instant::now();
        let mut inbox = inbox(0, 0, start);
        for sequence in 1..=3 {
            inbox.note_sent(sequence, 50, start + PERIOD * sequence);
        }
        inbox.take_snapshot(&message(4, 2), start + PERIOD * 4);
        inbox.take_snapshot(&message(5, 2), start + PERIOD * 5);
        let latency = inbox.statistics().latency_us;
        assert_eq!(latency.len(), 2);
        assert!(latency.max().abs_diff(99_000) < 2_000 && latency.min().abs_diff(66_000) < 1_000);
        inbox.take_snapshot(&message(6, 3), start + PERIOD * 6);
        assert_eq!(inbox.statistics().latency_us.len(), 3);
    }

    #[test]
    fn a_tick_that_cannot_be_is_malformed_and_hides_nothing() {
        let now = Instant::now();
        let mut inbox = inbox(100, 0, now);
        assert!(inbox.take_snapshot(&message(u64::MAX, 0), now).is_none());
        assert!(inbox.take_snapshot(&message(101, 0), now).is_some());
        assert_eq!(inbox.statistics().malformed, 1);
        // After a pause of a minute a jump of a minute is no surprise.
        assert!(inbox.take_snapshot(&message(101 + 1800, 0), now + Duration::from_secs(60)).is_some());
    }

    proptest! {
        #[test]
        fn random_messages_never_panic(
            messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 0..20),
            acks in prop::collection::vec((any::<u64>(), any::<u32>()), 0..20),
        ) {
            let now = Instant::now();
            let mut inbox = inbox(0, 2, now);
            for bytes in messages {
                inbox.take_snapshot(&[&[1, 5][..], &bytes].concat(), now);
            }
            for (tick, ack) in acks {
                inbox.note_sent(1, 1, now);
                inbox.take_snapshot(&message(tick, ack), now);
            }
        }

        #[test]
        fn memory_is_bounded(count in 1u64..600) {
            let now = Instant::now();
            let mut inbox = inbox(0, 3, now);
            for tick in 1..=count {
                inbox.note_sent(tick as u32, 1, now);
                inbox.take_snapshot(&message(tick, 0), now);
            }
            prop_assert!(inbox.in_flight.len() <= IN_FLIGHT_MAX && inbox.recent.len() <= 3);
        }
    }
}
