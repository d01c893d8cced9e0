//! The parts that run: Zenoh's declarations and the three threads.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use pita_game::Arena;
use tokio::sync::mpsc::{Receiver, UnboundedReceiver, UnboundedSender, channel, unbounded_channel};
use zenoh::Wait;
use zenoh::sample::SampleKind;

use super::DaemonError;
use crate::admin::{Doorkeeper, Order};
use crate::answers::{Answering, Asker, Question, Work};
use crate::config::{ServerConfig, Tick};
use crate::drivers::Drivers;
use crate::pacer::Pacer;
use crate::publish::Publishing;
use crate::sessions::SessionId;
use crate::shared::{Phase, Shared};
use crate::{inputs, tick_thread};

/// Longest wait for Zenoh to close; it can hang (zenoh#2675).
const CLOSE_TIMEOUT: Duration = Duration::from_secs(2);

/// Orders that may wait for the daemon's own loop.
const ORDERS_MAX: usize = 4;

/// What the daemon's own loop has to see to.
pub enum Happening {
    /// A thread ended by itself.
    ThreadEnded(&'static str),
    /// Somebody who may wants something done.
    Ordered(Order),
}

/// Everything that runs.
pub struct Serving {
    session: zenoh::Session,
    asker: Asker,
    threads: Vec<JoinHandle<()>>,
    ended: UnboundedReceiver<&'static str>,
    orders: Receiver<Order>,
}

impl Serving {
    /// Starts threads, then opens the doors.
    pub fn start(
        config: &ServerConfig,
        arena: Arena,
        doorkeeper: Doorkeeper,
        shared: &Arc<Shared>,
        session: zenoh::Session,
    ) -> Result<Self, DaemonError> {
        let (ordering, orders) = channel(ORDERS_MAX);
        let (answering, asker) = Answering::new(shared.clone(), doorkeeper, ordering);
        let publishing =
            Publishing::new(shared.clone(), session.clone(), asker.clone(), config.cells.at(shared.tick_hz))?;
        let (ending, ended) = unbounded_channel();
        let mut threads = vec![
            spawn("answering", &ending, move || answering.run())?,
            spawn("publishing", &ending, move || publishing.run())?,
        ];
        declare(shared, &session, &asker)?;
        let drivers = drivers(config, shared);
        let (tick, shared) = (config.tick, shared.clone());
        threads.push(spawn("tick", &ending, move || tick_thread::run(arena, drivers, pacer(tick, &shared), shared))?);
        Ok(Self { session, asker, threads, ended, orders })
    }

    /// Waits for what happens next that the daemon's own loop has to see to.
    pub async fn next(&mut self) -> Happening {
        tokio::select! {
            name = self.ended.recv() => Happening::ThreadEnded(name.unwrap_or("last")),
            Some(order) = self.orders.recv() => Happening::Ordered(order),
        }
    }

    /// Ends threads and network.
    pub async fn stop(self, shared: &Shared) {
        shared.set_phase(Phase::Ended);
        self.asker.tell(Work::Stop);
        for thread in self.threads {
            // Where one panicked it has said so itself.
            let _ = tokio::task::block_in_place(|| thread.join());
        }
        if tokio::time::timeout(CLOSE_TIMEOUT, self.session.close()).await.is_err() {
            tracing::warn!("Zenoh did not close within {} s", CLOSE_TIMEOUT.as_secs());
        }
    }
}

/// Declares what clients reach; all of it lives as long as the session.
fn declare(shared: &Arc<Shared>, session: &zenoh::Session, asker: &Asker) -> zenoh::Result<()> {
    let keys = &shared.keys;
    for (key, question) in [
        (keys.describe(), Question::Describe),
        (keys.source(), Question::Source),
        (keys.status(), Question::Status),
        (keys.ticks(), Question::Ticks),
        (keys.admin(), Question::Admin),
        (keys.join(), Question::Join),
        (keys.all_says(), Question::Say),
        (keys.keyframes(), Question::Keyframes),
    ] {
        let asker = asker.clone();
        session.declare_queryable(key).callback(move |query| asker.ask(question, query)).background().wait()?;
    }
    let receiving = shared.clone();
    session
        .declare_subscriber(keys.all_inputs())
        .callback(move |sample| inputs::receive(&receiving, sample.key_expr().as_str(), sample.payload()))
        .background()
        .wait()?;
    let watching = shared.clone();
    session
        .liveliness()
        .declare_subscriber(keys.all_live())
        .history(true)
        .callback(move |sample| token_changed(&watching, sample.key_expr().as_str(), sample.kind()))
        .background()
        .wait()
}

fn token_changed(shared: &Shared, key: &str, kind: SampleKind) {
    let Some((slot, epoch)) = shared.keys.session_of_live(key) else { return };
    let (id, now_ms) = (SessionId { slot, epoch }, shared.clock.ms());
    match kind {
        SampleKind::Put => shared.sessions().token_appeared(id, now_ms),
        SampleKind::Delete => {
            shared.sessions().token_disappeared(id, now_ms);
            shared.wake_publisher();
        }
    }
}

fn drivers(config: &ServerConfig, shared: &Shared) -> Drivers {
    let coast_ms = u64::from(config.sessions.coast_after_ms.get());
    let ticks = (coast_ms * u64::from(shared.tick_hz)).div_ceil(1000);
    Drivers::new(shared.sessions().slots(), ticks, 1_000_000_000 / u64::from(shared.tick_hz))
}

fn pacer(tick: Tick, shared: &Shared) -> Pacer {
    Pacer::new(tick.tick_hz.hz(), tick.when_behind, tick.behind_ticks_max.get(), shared.clock.ns())
}

/// Tells its name when it goes, even in a panic.
struct Ending(&'static str, UnboundedSender<&'static str>);

impl Drop for Ending {
    fn drop(&mut self) {
        // In the orderly end nobody listens any more.
        let _ = self.1.send(self.0);
    }
}

fn spawn(
    name: &'static str,
    ending: &UnboundedSender<&'static str>,
    work: impl FnOnce() + Send + 'static,
) -> std::io::Result<JoinHandle<()>> {
    let ending = Ending(name, ending.clone());
    std::thread::Builder::new().name(name.to_owned()).spawn(move || {
        let _ending = ending;
        work();
    })
}
