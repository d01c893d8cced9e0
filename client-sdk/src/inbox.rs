//! What one session knows from the snapshots that arrived and the inputs that it sent: newest state, losses, latency.
//!
//! Bounded whatever the server does. Times are parameters; nothing here touches the network.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use pita_protocol::{
    WireError, decode,
    dof::Decoder,
    message::{CellId, FATES_MAX, InputAck, InputFate, JoinAccepted, Keyframes, KeyframesWanted, Snapshot},
};

use crate::{
    bodies::{Bodies, Source},
    cell_inbox::{CellInbox, Taken, Wish},
    input_clock::InputClock,
    line::Line,
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
    inputs: InputClock,
    /// Newest tick that is known, and when it became known.
    newest: (u64, Instant),
    /// For the interpolation buffer, newest last; empty where nobody interpolates.
    recent: VecDeque<Arc<ReceivedSnapshot>>,
    recent_max: usize,
    /// The newest snapshot, where somebody interpolates.
    last: Option<Arc<ReceivedSnapshot>>,
    /// For the clock of what is shown, with the snapshots: how late, and when, s.
    lateness: VecDeque<(f64, f64)>,
    /// Sequence numbers that were sent and not acknowledged, with the time of their send.
    in_flight: VecDeque<(u32, Instant)>,
    /// Newest sequence of which the fate has been counted.
    counted: u32,
    statistics: Statistics,
    decoder: Decoder,
    cells: CellInbox,
    line: Line,
    bodies: Bodies,
    tick_hz: f64,
}

impl Inbox {
    /// Of the session that `accepted` began at `now`; keeps `recent_max` snapshots for interpolation.
    pub fn new(accepted: &JoinAccepted, recent_max: usize, now: Instant) -> Self {
        Self {
            began: now,
            epoch: accepted.epoch,
            ledger: TickLedger::default(),
            clock: TickClock::new(accepted.tick_hz),
            inputs: InputClock::new(),
            newest: (accepted.description.tick, now),
            recent: VecDeque::new(),
            recent_max,
            last: None,
            lateness: VecDeque::new(),
            in_flight: VecDeque::new(),
            counted: 0,
            statistics: Statistics::default(),
            decoder: Decoder::default(),
            cells: CellInbox::default(),
            line: Line::default(),
            bodies: Bodies::default(),
            tick_hz: f64::from(accepted.tick_hz),
        }
    }

    /// Takes a snapshot message, and answers the snapshot where it is the newest.
    pub fn take_snapshot(&mut self, bytes: &[u8], now: Instant) -> Option<Arc<ReceivedSnapshot>> {
        self.statistics.received_bytes += bytes.len() as u64;
        let mut head = match decode::<Snapshot>(bytes) {
            Ok(head) if head.epoch != self.epoch => {
                self.statistics.snapshots_foreign += 1;
                return None;
            }
            Ok(head) if head.tick <= self.latest(now) => head,
            _ => {
                self.statistics.malformed += 1;
                return None;
            }
        };
        let frame = match self.decoder.decode(head.tick, &head.dof) {
            Ok(frame) => frame,
            Err(error) => {
                self.statistics.malformed += 1;
                if error == WireError::Desync {
                    // Acknowledging nothing asks for a snapshot that needs nothing before it.
                    self.decoder = Decoder::default();
                }
                return None;
            }
        };
        let arrival = self.ledger.note(head.tick);
        if arrival == Arrival::Stale {
            return None;
        }
        self.acknowledged(&head.ack, now);
        self.note_lateness(&head, arrival, now);
        self.follow_clock(&head, now);
        if let Some(granted) = head.cells.take() {
            let lost = self.cells.grant(head.tick, granted).unwrap_or_default();
            // Everything goes on in one stream, or in cells: nobody is to flicker meanwhile.
            let goes_over = lost.contains(&CellId::WHOLE) || self.cells.is_taken(CellId::WHOLE);
            for cell in lost {
                if goes_over { self.bodies.await_others(cell, head.tick) } else { self.bodies.forget(cell) }
            }
        }
        self.statistics.cells_fallen_silent += self.cells.note_own_snapshot();
        let layers = self.cells.granted().iter().map(|grant| grant.layers).max().unwrap_or(0);
        self.line.observe(head.tick, self.seconds(now), 1.0 / self.tick_hz, layers);
        self.bodies.take(Source::Own, &frame, &[], |_| false);
        if arrival == Arrival::Late {
            return None;
        }
        let bodies = self.bodies.gather(head.tick);
        let snapshot = Arc::new(ReceivedSnapshot::new(head, bodies, self.tick_hz, now));
        self.newest = (snapshot.tick(), now);
        self.last = (self.recent_max > 0).then(|| Arc::clone(&snapshot));
        self.keep(Arc::clone(&snapshot));
        Some(snapshot)
    }

    /// Takes a message of a cell. What comes later than the session's own snapshot of that tick is added to it. Answers
    /// whether a keyframe is missing.
    pub fn take_cell(&mut self, bytes: &[u8], now: Instant) -> bool {
        self.statistics.received_bytes += bytes.len() as u64;
        match self.cells.take(bytes, self.latest(now)) {
            Ok(Taken::Frame(cell, frame, departures)) => {
                self.statistics.cells_received += 1;
                self.bodies.take(Source::Cell(cell), &frame, &departures, |to| self.cells.is_taken(to));
                self.refresh(frame.tick());
                return self.cells.is_lost(cell);
            }
            Ok(Taken::Unreadable) => self.statistics.cells_unreadable += 1,
            Ok(Taken::Foreign) => return false,
            Err(_) => self.statistics.malformed += 1,
        }
        true
    }

    /// Takes keyframes that were asked for.
    pub fn take_keyframes(&mut self, answer: &Keyframes, now: Instant) {
        match self.cells.take_keyframes(answer, self.latest(now)) {
            Ok(fetched) => {
                self.statistics.keyframes_fetched += fetched.keyframes as u64;
                for (cell, frame) in fetched.frames {
                    self.bodies.take(Source::Cell(cell), &frame, &[], |_| false);
                }
            }
            Err(_) => self.statistics.malformed += 1,
        }
    }

    /// Changes where others cells or layers are to be taken, or some anew: when the server said which, how many layers less of
    /// each, and how often one fell silent.
    pub fn cells_version(&self) -> (u64, u8, u64) {
        (self.cells.granted_at(), self.line.layers(u8::MAX), self.statistics.cells_fallen_silent)
    }

    /// The cells that the session takes, as granted and as far as the line allows, and the keyframes that it lacks of them.
    pub fn cells_to_do(&mut self) -> (Vec<Wish>, Vec<KeyframesWanted>) {
        (self.cells.wishes(|granted| self.line.layers(granted)), self.cells.wanted())
    }

    /// Fractional tick whose input is due at `now`; `None` before the first snapshot.
    #[cfg(feature = "prediction")]
    pub fn input_phase(&self, now: Instant) -> Option<f64> {
        self.inputs.phase(self.seconds(now), self.clock.period_s())
    }

    /// Takes note of how far a prediction of the own vehicle was off, m.
    #[cfg(feature = "prediction")]
    pub fn count_correction(&mut self, correction_m: f64) {
        self.statistics.correction_um.saturating_record((correction_m * 1e6) as u64);
    }

    /// How late the first snapshots came after the newest before each, and when, s, since this was last asked.
    pub fn drain_lateness(&mut self) -> Vec<(f64, f64)> {
        self.lateness.drain(..).collect()
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

    /// Tick for which an input is that is sent at `now`.
    pub fn input_tick(&self, now: Instant) -> u64 {
        // Before the first snapshot the tick of the join is the best that is known.
        self.inputs.tick_at(self.seconds(now), self.clock.period_s()).unwrap_or(self.newest.0 + 1)
    }

    /// When the input of the next tick is due; `None` before the first snapshot.
    pub fn next_input_due(&self) -> Option<Instant> {
        let due_s = self.inputs.next_due_s(self.clock.period_s())?;
        Some(self.began + Duration::try_from_secs_f64(due_s.max(0.0)).unwrap_or_default())
    }

    /// Takes note of an input packet that goes out at `now`, its newest input meant for `tick`.
    pub fn note_sent(&mut self, sequence: u32, tick: u64, bytes: usize, now: Instant) {
        let seconds = self.seconds(now);
        self.inputs.note_sent(sequence, tick, seconds);
        if let Some(seen) = self.clock.tick_at(seconds) {
            let lead_s = (tick as f64 - seen) * self.clock.period_s();
            self.statistics.lead_us.saturating_record((lead_s.max(0.0) * 1e6) as u64);
        }
        self.statistics.inputs_sent += 1;
        self.statistics.sent_bytes += bytes as u64;
        if self.in_flight.len() == IN_FLIGHT_MAX {
            self.in_flight.pop_front();
        }
        self.in_flight.push_back((sequence, now));
    }

    /// What an input packet acknowledges: the tick of the newest snapshot, 0 for none, and a bit for each before it.
    pub fn acknowledgement(&self) -> (u64, u32) {
        self.decoder.acknowledgement().unwrap_or((0, 0))
    }

    /// How long nothing newer arrived.
    pub fn silent_for(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.newest.1)
    }

    /// Estimated tick of the server at `now`, fractional, and `now` in the seconds of lateness; `None` before the first
    /// snapshot.
    pub fn tick_at(&self, now: Instant) -> Option<(f64, f64)> {
        let seconds = self.seconds(now);
        Some((self.clock.tick_at(seconds)?, seconds))
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
            ..self.statistics.clone()
        }
    }

    /// The latest tick that the server can have reached.
    fn latest(&self, now: Instant) -> u64 {
        let (newest, since) = self.newest;
        let elapsed_s = now.saturating_duration_since(since).as_secs_f64();
        let allowed_s = 2.0 * elapsed_s + AHEAD_MAX_S;
        newest.saturating_add((allowed_s / self.clock.period_s()) as u64)
    }

    /// Keeps `snapshot` for interpolation, instead of what there was of its tick.
    fn keep(&mut self, snapshot: Arc<ReceivedSnapshot>) {
        self.recent.pop_back_if(|last| last.tick() == snapshot.tick());
        if self.recent_max == 0 {
            return;
        }
        if self.recent.len() == self.recent_max {
            self.recent.pop_front();
        }
        self.recent.push_back(snapshot);
    }

    /// Something of `tick` arrived after the newest snapshot: it is shown with that.
    fn refresh(&mut self, tick: u64) {
        if let Some(last) = self.last.clone().filter(|last| self.recent_max > 0 && tick <= last.tick()) {
            let bodies = self.bodies.gather(last.tick());
            self.keep(Arc::new(last.again(bodies)));
        }
    }

    fn acknowledged(&mut self, ack: &InputAck, now: Instant) {
        self.count_fates(ack);
        while let Some((sequence, sent)) = self.in_flight.pop_front_if(|(sent, _)| *sent <= ack.sequence) {
            let fate = ack.fates.get((ack.sequence - sequence) as usize);
            // What was passed over has no effect to wait for; of what is further back nothing is known.
            if let Some(InputFate::Applied { .. }) | None = fate {
                let micros = u64::try_from(now.saturating_duration_since(sent).as_micros()).unwrap_or(u64::MAX);
                self.statistics.latency_us.saturating_record(micros);
            }
        }
    }

    fn count_fates(&mut self, ack: &InputAck) {
        for behind in (0..ack.sequence.saturating_sub(self.counted) as usize).take(FATES_MAX) {
            match ack.fates.get(behind) {
                Some(InputFate::Applied { late_ticks: 0 }) => self.statistics.inputs_in_time += 1,
                Some(InputFate::Applied { .. }) => self.statistics.inputs_late += 1,
                Some(InputFate::Superseded) => self.statistics.inputs_superseded += 1,
                Some(InputFate::Early) => self.statistics.inputs_early += 1,
                Some(InputFate::Missing) => self.statistics.inputs_missing += 1,
                None => {}
            }
        }
        self.counted = self.counted.max(ack.sequence);
    }

    /// A tick is late until something as new is there: a lost one counts until the next comes.
    fn note_lateness(&mut self, head: &Snapshot, arrival: Arrival, now: Instant) {
        let seconds = self.seconds(now);
        if arrival != Arrival::Newest || self.recent_max == 0 {
            return;
        }
        if let Some(expected_s) = self.clock.expected_s(head.tick.min(self.newest.0 + 1)) {
            if self.lateness.len() == self.recent_max {
                self.lateness.pop_front();
            }
            self.lateness.push_back((seconds - expected_s, seconds));
        }
    }

    /// Both clocks learn from a snapshot: when the server ticks, and when inputs have to leave.
    fn follow_clock(&mut self, head: &Snapshot, now: Instant) {
        let seconds = self.seconds(now);
        let late_s = self.clock.observe(head.tick, seconds);
        self.statistics.jitter_us.saturating_record((late_s.abs() * 1e6) as u64);
        let period_s = self.clock.period_s();
        let slack_s = f64::from(head.ack.slack_ms) * 1e-3;
        self.inputs.note_slack(head.ack.received, slack_s, period_s, seconds);
        if let Some(seen_s) = self.clock.expected_s(0) {
            self.inputs.follow(seen_s, period_s, seconds);
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
        Message,
        dof::{Encoder, Precision, State},
        encode,
        message::Description,
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
            precision: Precision::default(),
            scores: Vec::new(),
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
        let mut ack = InputAck { sequence: ack, tick, ..InputAck::default() };
        (0..FATES_MAX).for_each(|behind| ack.fates.set(behind, InputFate::Applied { late_ticks: 0 }));
        let state = State::new(Precision::default()).unwrap();
        let dof = Encoder::default().encode(tick, &state, &[]);
        encode(&Snapshot { epoch: EPOCH, tick, ack, event_sequence: 0, cells: None, dof })
    }

    #[test]
    fn only_the_newest_is_answered_and_every_head_counts() {
        let now = Instant::now();
        let mut inbox = inbox(100, 4, now);
        let answered = [101, 103, 102, 103, 104].map(|t| inbox.take_snapshot(&message(t, 0), now).map(|s| s.tick()));
        assert_eq!(answered, [Some(101), Some(103), None, None, Some(104)]);
        let counts = inbox.statistics();
        assert_eq!((counts.snapshots_received, counts.snapshots_missed, counts.snapshots_stale), (4, 0, 1));
        assert_eq!(inbox.drain_recent().iter().map(|s| s.tick()).collect::<Vec<_>>(), [101, 103, 104]);
        assert!(inbox.drain_recent().is_empty());
    }

    #[test]
    fn latency_runs_from_the_send_to_the_first_acknowledging_snapshot() {
        let start = Instant::now();
        let mut inbox = inbox(0, 0, start);
        for sequence in 1..=3 {
            inbox.note_sent(sequence, 4, 50, start + PERIOD * sequence);
        }
        inbox.take_snapshot(&message(4, 2), start + PERIOD * 4);
        inbox.take_snapshot(&message(5, 2), start + PERIOD * 5);
        let latency = inbox.statistics().latency_us;
        assert_eq!(latency.len(), 2);
        assert!(latency.max().abs_diff(99_000) < 2_000 && latency.min().abs_diff(66_000) < 1_000);
        inbox.take_snapshot(&message(6, 3), start + PERIOD * 6);
        let counts = inbox.statistics();
        assert_eq!((counts.latency_us.len(), counts.inputs_in_time), (3, 3));
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
                inbox.take_snapshot(&[&[pita_protocol::PROTOCOL_VERSION as u8, Snapshot::KIND][..], &bytes].concat(), now);
            }
            for (tick, ack) in acks {
                inbox.note_sent(1, tick, 1, now);
                inbox.take_snapshot(&message(tick, ack), now);
            }
        }

        #[test]
        fn memory_is_bounded(count in 1u64..600) {
            let now = Instant::now();
            let mut inbox = inbox(0, 3, now);
            for tick in 1..=count {
                inbox.note_sent(tick as u32, tick, 1, now);
                inbox.take_snapshot(&message(tick, 0), now);
            }
            prop_assert!(inbox.in_flight.len() <= IN_FLIGHT_MAX && inbox.recent.len() <= 3);
        }
    }
}
