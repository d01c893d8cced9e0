//! What Zenoh's threads, the keeper and the owner of a session have in common.

use std::{
    sync::{Arc, Mutex},
    time::Instant,
};

#[cfg(feature = "prediction")]
use pita_protocol::message::Controls;
use pita_protocol::{
    Message, kind_of,
    message::{CellSnapshot, JoinAccepted},
};
use tokio::sync::{Notify, watch};

#[cfg(feature = "prediction")]
use crate::prediction::{Predictor, body_state};
use crate::{
    error::SessionEnd,
    events::EventQueue,
    inbox::Inbox,
    interpolation::{InterpolationBuffer, Playback},
    lock::lock,
    roster::Roster,
    snapshot::ReceivedSnapshot,
    statistics::Statistics,
};

/// States to interpolate between, and the clock of what is shown.
#[derive(Debug)]
pub struct Interpolation {
    pub buffer: InterpolationBuffer,
    pub playback: Playback,
}

/// Sees the newest snapshot change.
pub type NewestReceiver = watch::Receiver<Option<Arc<ReceivedSnapshot>>>;

/// What Zenoh's threads, the keeper and the owner of a session have in common. Locks are held for short computations
/// only, never across an await.
#[derive(Debug)]
pub struct Shared {
    pub inbox: Mutex<Inbox>,
    pub events: EventQueue,
    /// Told where other cells may be taken, or keyframes are missing.
    pub cells_changed: Notify,
    roster: Mutex<Arc<Roster>>,
    newest: watch::Sender<Option<Arc<ReceivedSnapshot>>>,
    end: watch::Sender<Option<SessionEnd>>,
    pub interpolation: Option<Mutex<Interpolation>>,
    #[cfg(feature = "prediction")]
    pub prediction: Option<Mutex<Predictor>>,
}

impl Shared {
    pub fn new(accepted: &JoinAccepted, recent_max: usize, interpolation: Option<Interpolation>) -> Self {
        Self {
            inbox: Mutex::new(Inbox::new(accepted, recent_max, Instant::now())),
            events: EventQueue::default(),
            cells_changed: Notify::new(),
            roster: Mutex::new(Arc::new(Roster::new(&accepted.description))),
            newest: watch::Sender::new(None),
            end: watch::Sender::new(None),
            interpolation: interpolation.map(Mutex::new),
            #[cfg(feature = "prediction")]
            prediction: None,
        }
    }

    /// Takes what came on the key of the session's snapshots: cells come along where it asked for that.
    pub fn take_own(&self, bytes: &[u8], now: Instant) {
        match kind_of(bytes) {
            Some(CellSnapshot::KIND) => self.take_cell(bytes, now),
            _ => self.take_snapshot(bytes, now),
        }
    }

    fn take_snapshot(&self, bytes: &[u8], now: Instant) {
        let (snapshot, is_changed) = {
            let mut inbox = lock(&self.inbox);
            let before = inbox.cells_version();
            let snapshot = inbox.take_snapshot(bytes, now);
            (snapshot, inbox.cells_version() != before)
        };
        if is_changed {
            self.cells_changed.notify_one();
        }
        let Some(snapshot) = snapshot else { return };
        self.newest.send_if_modified(|newest| {
            // Another thread of Zenoh may have come in between with a newer one.
            let is_newer = newest.as_ref().is_none_or(|newest| newest.tick() < snapshot.tick());
            if is_newer {
                *newest = Some(snapshot);
            }
            is_newer
        });
    }

    pub fn take_cell(&self, bytes: &[u8], now: Instant) {
        if lock(&self.inbox).take_cell(bytes, now) {
            self.cells_changed.notify_one();
        }
    }

    pub fn newest(&self) -> Option<Arc<ReceivedSnapshot>> {
        self.newest.borrow().clone()
    }

    /// Predicts the own vehicle up to `tick`, for which `controls` are: from where the newest snapshot says that it was.
    #[cfg(feature = "prediction")]
    pub fn predict(&self, tick: u64, controls: &Controls) {
        let Some(predictor) = &self.prediction else { return };
        let mut predictor = lock(predictor);
        let seen =
            self.newest().and_then(|snapshot| Some((snapshot.tick(), own_bodies(&snapshot, predictor.slices())?)));
        if let Some((seen, bodies)) = seen
            && let Some(correction_m) = predictor.reconcile(seen, bodies)
        {
            lock(&self.inbox).count_correction(correction_m);
        }
        predictor.drive(tick, controls);
    }

    /// Waits, on the receiver's behalf, for a snapshot that it has not seen.
    pub async fn newer(next: &mut NewestReceiver) -> Arc<ReceivedSnapshot> {
        while next.changed().await.is_ok() {
            if let Some(snapshot) = next.borrow_and_update().clone() {
                return snapshot;
            }
        }
        // The sender lives as long as the session, so this is not reached while anybody waits.
        std::future::pending().await
    }

    pub fn watch_newest(&self) -> NewestReceiver {
        self.newest.subscribe()
    }

    pub fn roster(&self) -> Arc<Roster> {
        Arc::clone(&lock(&self.roster))
    }

    /// Changes the roster; those who hold an earlier one keep it as it was.
    pub fn with_roster<T>(&self, change: impl FnOnce(&mut Roster) -> T) -> T {
        change(Arc::make_mut(&mut lock(&self.roster)))
    }

    pub fn end(&self) -> Option<SessionEnd> {
        self.end.borrow().clone()
    }

    /// Waits for the session's end.
    pub async fn ended(&self) -> SessionEnd {
        let told = self.end.subscribe().wait_for(Option::is_some).await.ok().and_then(|end| end.clone());
        match told {
            Some(end) => end,
            // As above: the sender is ours.
            None => std::future::pending().await,
        }
    }

    /// Ends the session. The first end counts, and no event comes after it.
    pub fn finish(&self, end: SessionEnd) {
        self.end.send_if_modified(|present| {
            let first = present.is_none();
            present.get_or_insert(end);
            first
        });
        self.events.close();
    }
}

/// The bodies of `slices`, in that order; `None` where the snapshot does not carry one.
#[cfg(feature = "prediction")]
fn own_bodies(snapshot: &ReceivedSnapshot, slices: &[u32]) -> Option<Vec<pita_game::BodyState>> {
    let slices_now = snapshot.select(slices).into_iter().filter(|slice| slice.tick == snapshot.tick());
    let bodies: Vec<_> = slices_now.filter_map(|slice| body_state(&slice)).collect();
    (bodies.len() == slices.len()).then_some(bodies)
}

/// The counts of a session that somebody else owns.
#[derive(Debug)]
pub struct StatisticsReader(pub Arc<Shared>);

impl StatisticsReader {
    pub fn read(&self) -> Statistics {
        lock(&self.0.inbox).statistics()
    }
}
