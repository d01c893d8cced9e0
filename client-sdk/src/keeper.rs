//! The background task of a session: applies events to the roster, reads the roster again after a gap, and notices
//! when the server is gone.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use pita_protocol::{
    Keys, decode,
    message::{Controls, Description, Event, EventMessage},
};
use tokio::sync::mpsc;

use crate::{
    error::SessionEnd, events::SessionEvent, lock::lock, roster::Reconciled, shared::Shared, transport, wire::Wire,
};

/// Events between Zenoh's thread and the keeper. One that finds no room is a gap, like any other loss.
pub const EVENTS_MAX: usize = 1024;

/// How often the keeper looks for silence and for announced events that did not arrive.
const CHECK_PERIOD: Duration = Duration::from_millis(250);

/// How long a description is waited for, before it is asked for again.
const DESCRIBE_TIMEOUT: Duration = Duration::from_secs(1);

/// What arrives on the event key: the message and its length, or nothing where it could not be read.
type Arrived = (usize, Option<EventMessage>);

/// Receiving end of the events.
pub struct Incoming(pub mpsc::Receiver<Arrived>);

/// Reads an event message on Zenoh's thread and passes it on.
pub fn forward(bytes: &[u8], events: &mpsc::Sender<Arrived>) {
    // No room: the next event shows the gap.
    let _ = events.try_send((bytes.len(), decode(bytes).ok()));
}

/// Keeps one session's roster and end up to date.
pub struct Keeper {
    pub zenoh: zenoh::Session,
    pub keys: Keys,
    pub slot: u16,
    /// The session's own actor.
    pub actor: Option<u32>,
    /// Number of the last event before the session.
    pub joined_at: u32,
    pub loss_timeout: Duration,
    /// How often something is sent for a session whose owner sends nothing.
    pub keep_alive: Option<Duration>,
    pub shared: Arc<Shared>,
    pub wire: Arc<Wire>,
}

impl Keeper {
    /// Runs until the session ends.
    pub async fn run(self, Incoming(mut events): Incoming) {
        let mut checks = tokio::time::interval(CHECK_PERIOD);
        checks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
        let mut alive = tokio::time::interval(self.keep_alive.unwrap_or(CHECK_PERIOD));
        alive.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
        let mut announced = 0;
        let mut is_bereft = false;
        while self.shared.end().is_none() {
            tokio::select! {
                arrived = events.recv() => match arrived {
                    Some(arrived) => self.take(arrived),
                    None => break,
                },
                _ = checks.tick() => {
                    self.check(&mut announced).await;
                    self.check_actor(&mut is_bereft);
                }
                _ = alive.tick(), if self.keep_alive.is_some() => {
                    let _ = self.wire.send(Controls::default(), false).await;
                }
            }
        }
    }

    fn take(&self, (bytes, message): Arrived) {
        let mut inbox = lock(&self.shared.inbox);
        inbox.count_event_bytes(bytes);
        let Some(message) = message else {
            inbox.count_malformed();
            return;
        };
        drop(inbox);
        // Apart from the roster: a description that overtook this event does not tell of an end.
        let end = (message.sequence > self.joined_at).then(|| self.end_by(&message.event)).flatten();
        if self.shared.with_roster(|roster| roster.apply(&message)) {
            lock(&self.shared.inbox).count_event();
            self.shared.events.push(SessionEvent::Happened(message.event));
        }
        if let Some(end) = end {
            self.shared.finish(end);
        }
    }

    fn end_by(&self, event: &Event) -> Option<SessionEnd> {
        match event {
            Event::Closing { reason } => Some(SessionEnd::Closed { reason: reason.clone() }),
            Event::Left { slot, reason } if *slot == self.slot => Some(SessionEnd::Removed { reason: reason.clone() }),
            _ => None,
        }
    }

    /// `announced` is the number of the last event that snapshots had told of at the previous check: by now it has
    /// arrived, or it never will.
    async fn check(&self, announced: &mut u32) {
        let silent_for = lock(&self.shared.inbox).silent_for(Instant::now());
        if silent_for > self.loss_timeout {
            self.shared.finish(SessionEnd::Lost { silent_for });
            return;
        }
        self.shared.with_roster(|roster| roster.note_announced(*announced));
        if self.shared.roster().is_behind() {
            self.reconcile().await;
        }
        *announced = self.shared.newest().map_or(0, |snapshot| snapshot.event_sequence());
    }

    /// Ends a session whose own actor is gone: events that told why are lost. One check later than it is noticed, because
    /// the word on the session follows that on its actor.
    fn check_actor(&self, is_bereft: &mut bool) {
        let is_gone = self.actor.is_some_and(|actor| self.shared.roster().actor(actor).is_none());
        if is_gone && *is_bereft {
            self.shared.finish(SessionEnd::Removed { reason: "its actor was taken out".to_owned() });
        }
        *is_bereft = is_gone;
    }

    async fn reconcile(&self) {
        let asked = transport::ask(&self.zenoh, &self.keys.describe(), "describe", Vec::new(), DESCRIBE_TIMEOUT).await;
        let description: Description = match asked {
            Ok(Some(description)) => description,
            Ok(None) => return,
            Err(error) => {
                tracing::debug!("reading the roster again: {error}");
                lock(&self.shared.inbox).count_malformed();
                return;
            }
        };
        let reconciled = self.shared.with_roster(|roster| roster.reconcile(&description));
        if let Some(Reconciled { missed, changes }) = reconciled {
            lock(&self.shared.inbox).count_missed_events(missed);
            self.shared.events.push(SessionEvent::Resynchronised { missed });
            changes.into_iter().for_each(|change| self.shared.events.push(SessionEvent::Happened(change)));
        }
    }
}
