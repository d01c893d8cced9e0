//! A session: one player or spectator in one arena.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use pita_protocol::{
    dof::Slice,
    message::{Controls, Description, JoinAccepted},
};
use tokio::{task::JoinHandle, time::timeout};

use crate::{
    builder::{ResumeTicket, SessionBuilder},
    error::{ClientError, SessionEnd},
    events::SessionEvent,
    interpolation::Frame,
    join::Declared,
    lock::lock,
    roster::Roster,
    shared::{Interpolation, NewestReceiver, Shared, StatisticsReader},
    snapshot::ReceivedSnapshot,
    statistics::Statistics,
    transport,
    wire::Wire,
};

/// How long [`Session::leave`] waits for the server's word that the session is over. Closing the connection at once
/// could drop the message that says so.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(1);
/// How often the good-bye is said meanwhile: a server drops a packet that follows the last input too closely.
const LEAVE_STEP: Duration = Duration::from_millis(100);

/// The state of the world between two ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldState {
    /// Fractional tick that is shown.
    pub tick: f64,
    /// In order of id.
    pub slices: Vec<Slice>,
}

/// One player or spectator in one arena, over a connection of its own.
///
/// All methods take `&self`: one task may send while another one draws. Dropping a session closes its connection, and
/// the server then takes the player out as lost; [`Session::leave`] says good-bye first.
#[derive(Debug)]
pub struct Session {
    zenoh: zenoh::Session,
    accepted: JoinAccepted,
    shared: Arc<Shared>,
    wire: Arc<Wire>,
    next: tokio::sync::Mutex<NewestReceiver>,
    /// The keeper, and who looks after cells.
    tasks: [JoinHandle<()>; 2],
    _declared: Declared,
}

impl Session {
    /// Connects to `endpoint` (`tcp/HOST:PORT`) and joins the arena there as a player called `name`.
    ///
    /// # Errors
    /// As [`SessionBuilder::connect`].
    pub async fn connect(endpoint: &str, name: &str) -> Result<Self, ClientError> {
        Self::builder(endpoint, name).connect().await
    }

    /// For everything that [`Session::connect`] does not ask.
    pub fn builder(endpoint: &str, name: &str) -> SessionBuilder {
        SessionBuilder::new(endpoint, name)
    }

    pub(crate) fn new(
        zenoh: zenoh::Session,
        accepted: JoinAccepted,
        shared: Arc<Shared>,
        wire: Arc<Wire>,
        tasks: [JoinHandle<()>; 2],
        declared: Declared,
    ) -> Self {
        let next = tokio::sync::Mutex::new(shared.watch_newest());
        Self { zenoh, accepted, shared, wire, next, tasks, _declared: declared }
    }

    /// Number of the session's place on the server.
    pub fn slot(&self) -> u16 {
        self.accepted.slot
    }

    /// The session's own actor; `None` for a spectator.
    pub fn actor(&self) -> Option<u32> {
        self.accepted.actor
    }

    /// What lets this session go on over another connection, should this one be lost.
    pub fn resume_ticket(&self) -> ResumeTicket {
        ResumeTicket::of(&self.accepted)
    }

    /// The arena as it was at the join. Its statics never change; for its actors see [`Session::roster`].
    pub fn description(&self) -> &Description {
        &self.accepted.description
    }

    /// Ticks a second.
    pub fn tick_hz(&self) -> u16 {
        self.accepted.tick_hz
    }

    /// The actors as they are now.
    pub fn roster(&self) -> Arc<Roster> {
        self.shared.roster()
    }

    /// When the next input is due: sent then, it arrives just before the server collects for its tick, as far as the
    /// connection has let the session learn. One tick from now until it has learnt anything.
    pub fn next_input_due(&self) -> Instant {
        let tick = Duration::from_secs_f64(1.0 / f64::from(self.tick_hz()));
        lock(&self.shared.inbox).next_input_due().unwrap_or_else(|| Instant::now() + tick)
    }

    /// Sends `controls` for the first tick that they can reach, with the last few before them in case those were lost, and acknowledges
    /// the newest snapshot. Answers the sequence number under which [`ReceivedSnapshot::ack`] will confirm them. Meant
    /// to be called once a tick, [when it is due](Self::next_input_due); the server ends a session that stays silent for too long.
    ///
    /// # Errors
    /// [`ClientError::BadArgument`] naming a control that is out of range, [`ClientError::Spectator`],
    /// [`ClientError::Ended`], [`ClientError::Transport`].
    pub async fn send(&self, controls: Controls) -> Result<u32, ClientError> {
        if self.accepted.actor.is_none() {
            return Err(ClientError::Spectator);
        }
        if let Some(end) = self.end() {
            return Err(end.into());
        }
        self.wire.send(controls, false).await
    }

    /// Says `text`, 1 to 200 bytes, to everybody: it comes to them, and back to this session, as
    /// [`Event::Said`](crate::Event::Said). Reliable, unlike snapshots.
    ///
    /// # Errors
    /// [`ClientError::NotSaid`] where it was too much of late, or nothing to read; [`ClientError::BadArgument`] for its
    /// length, [`ClientError::Ended`], [`ClientError::Transport`].
    pub async fn say(&self, text: &str) -> Result<(), ClientError> {
        match self.end() {
            Some(end) => Err(end.into()),
            None => self.wire.say(text).await,
        }
    }

    /// The newest snapshot, if one has arrived.
    pub fn latest_snapshot(&self) -> Option<Arc<ReceivedSnapshot>> {
        self.shared.newest()
    }

    /// Waits for a snapshot that is newer than the one this answered last. Who reads too slowly misses some, and always
    /// gets the newest.
    ///
    /// # Errors
    /// How the session ended, once it has.
    pub async fn next_snapshot(&self) -> Result<Arc<ReceivedSnapshot>, SessionEnd> {
        let mut next = self.next.lock().await;
        tokio::select! {
            biased;
            end = self.shared.ended() => Err(end),
            snapshot = Shared::newer(&mut next) => Ok(snapshot),
        }
    }

    /// The world as it is to be shown at `now`: as far behind the server as [settings](crate::InterpolationSettings) and
    /// network ask for, and interpolated between snapshots. `None` before the first snapshot, and for a session built without
    /// interpolation.
    pub fn world_at(&self, now: Instant) -> Option<WorldState> {
        let interpolation = self.shared.interpolation.as_ref()?;
        let (recent, lateness, tick) = {
            let mut inbox = lock(&self.shared.inbox);
            (inbox.drain_recent(), inbox.drain_lateness(), inbox.tick_at(now))
        };
        let mut interpolation = lock(interpolation);
        let Interpolation { buffer, playback } = &mut *interpolation;
        for snapshot in recent {
            // One that cannot be read has been counted, and is a gap like a lost one.
            buffer.insert(Frame { tick: snapshot.tick(), slices: snapshot.slices() });
        }
        lateness.into_iter().for_each(|(late_s, at_s)| playback.observe(late_s, at_s));
        let (newest, now_s) = tick?;
        let tick = playback.tick(newest, now_s);
        Some(WorldState { tick, slices: buffer.sample(tick)? })
    }

    /// The own vehicle's bodies as they are to be shown at `now`: predicted from the inputs so far, ahead of everything
    /// else that is shown. In order of slice. `None` before the first input that follows a snapshot, and for a session
    /// built without [prediction](SessionBuilder::prediction).
    #[cfg(feature = "prediction")]
    pub fn own_vehicle_at(&self, now: Instant) -> Option<Vec<Slice>> {
        let phase = lock(&self.shared.inbox).input_phase(now)?;
        // The input of a tick leaves as its phase begins, and takes the car to the tick's end.
        lock(self.shared.prediction.as_ref()?).at(phase - 1.0)
    }

    /// How far behind the newest state [`Session::world_at`] shows the world, as the network asks for it now.
    pub fn interpolation_delay(&self) -> Option<Duration> {
        let interpolation = self.shared.interpolation.as_ref()?;
        Some(Duration::from_secs_f64(lock(interpolation).playback.delay_s()))
    }

    /// Waits for the next event. `None` once the session has ended and all events have been read.
    pub async fn next_event(&self) -> Option<SessionEvent> {
        self.shared.events.next().await
    }

    /// How the session ended, if it has.
    pub fn end(&self) -> Option<SessionEnd> {
        self.shared.end()
    }

    /// All counts since the session began.
    pub fn statistics(&self) -> Statistics {
        lock(&self.shared.inbox).statistics()
    }

    /// Reads the counts, also while somebody else owns the session and after it has gone.
    pub(crate) fn statistics_reader(&self) -> StatisticsReader {
        StatisticsReader(Arc::clone(&self.shared))
    }

    /// Says good-bye, waits until the server has taken the player out, and closes the connection. Takes at most a few
    /// seconds, whatever the server does.
    pub async fn leave(self) -> Statistics {
        if self.end().is_none() {
            self.say_good_bye().await;
        }
        transport::close(&self.zenoh).await;
        self.statistics()
    }

    async fn say_good_bye(&self) {
        let until = tokio::time::Instant::now() + LEAVE_TIMEOUT;
        while tokio::time::Instant::now() < until {
            if let Err(error) = self.wire.send(Controls::default(), true).await {
                tracing::debug!("leaving: {error}");
                return;
            }
            if timeout(LEAVE_STEP, self.shared.ended()).await.is_ok() {
                return;
            }
        }
        tracing::debug!("the server did not confirm within {LEAVE_TIMEOUT:?} that slot {} left", self.slot());
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}
