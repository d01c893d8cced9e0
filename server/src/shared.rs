//! What the daemon's threads share.
//!
//! The tick thread touches the lock-free parts only: [`Shared::inputs`], [`Shared::boarding`], [`Shared::frames`], [`Shared::reloads`],
//! the counters and [`Shared::phase`]. The locks belong to the network's threads, the publishing thread and the
//! answering thread; nobody holds one while talking to Zenoh.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Thread;

use crossbeam_queue::ArrayQueue;
use pita_game::Reload;
use pita_protocol::Keys;
use pita_protocol::message::{ArenaSource, CellId, Description, Keyframe};

use crate::boarding::Boarding;
use crate::counters::Counters;
use crate::frame::FramePool;
use crate::inputs::InputQueue;
use crate::metrics::Metrics;
use crate::sessions::Sessions;
use crate::stopwatch::Clock;

/// Everything that more than one thread needs.
pub struct Shared {
    /// Key expressions of the arena.
    pub keys: Keys,
    /// Since the start of the daemon.
    pub clock: Clock,
    /// Ticks a second.
    pub tick_hz: u16,
    /// Silence after which a session ends, ms.
    pub input_timeout_ms: u32,
    /// What was sent, received and refused.
    pub counters: Counters,
    /// What changes in the arena: daemon to tick thread.
    pub reloads: ArrayQueue<Reload>,
    /// Network to tick thread.
    pub inputs: InputQueue,
    /// Publishing thread to tick thread, in order.
    pub boarding: ArrayQueue<Boarding>,
    /// Tick thread to publishing thread and back.
    pub frames: FramePool,
    sessions: Mutex<Sessions>,
    metrics: Mutex<Metrics>,
    description: Mutex<Arc<Description>>,
    source: Mutex<Arc<ArenaSource>>,
    keyframes: Mutex<BTreeMap<CellId, Arc<[Keyframe]>>>,
    publisher: OnceLock<Thread>,
    phase: AtomicU8,
}

/// Changes of the arena that may wait for a tick.
const RELOADS: usize = 4;

/// The daemon's life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Ticking, publishing, answering.
    Running = 0,
    /// Still so, but nobody joins any more, and clients are told.
    Closing = 1,
    /// Threads end after what they are at.
    Ended = 2,
}

/// What [`Shared`] starts from.
pub struct Start {
    /// Key expressions of the arena.
    pub keys: Keys,
    /// Since the start of the daemon.
    pub clock: Clock,
    /// Ticks a second.
    pub tick_hz: u16,
    /// Silence after which a session ends, ms.
    pub input_timeout_ms: u32,
    /// Inputs that may wait for a tick.
    pub inputs_max: usize,
    /// Empty slots.
    pub sessions: Sessions,
    /// The world before the first tick.
    pub description: Description,
    /// The arena's file.
    pub source: ArenaSource,
}

impl Shared {
    /// Before the first tick, without sessions.
    pub fn new(start: Start) -> Self {
        // A session of each slot begins, goes on or ends.
        let boarding = ArrayQueue::new(2 * usize::from(start.sessions.slots()).max(1));
        Self {
            keys: start.keys,
            clock: start.clock,
            tick_hz: start.tick_hz,
            input_timeout_ms: start.input_timeout_ms,
            counters: Counters::default(),
            reloads: ArrayQueue::new(RELOADS),
            inputs: InputQueue::new(start.inputs_max),
            boarding,
            frames: FramePool::new(),
            sessions: Mutex::new(start.sessions),
            metrics: Mutex::new(Metrics::new(start.tick_hz)),
            description: Mutex::new(Arc::new(start.description)),
            source: Mutex::new(Arc::new(start.source)),
            keyframes: Mutex::new(BTreeMap::new()),
            publisher: OnceLock::new(),
            phase: AtomicU8::new(Phase::Running as u8),
        }
    }

    /// The sessions. Not for the tick thread.
    pub fn sessions(&self) -> MutexGuard<'_, Sessions> {
        lock(&self.sessions)
    }

    /// The measurements. Not for the tick thread.
    pub fn metrics(&self) -> MutexGuard<'_, Metrics> {
        lock(&self.metrics)
    }

    /// The world as clients have to know it, as of the last published event. Not for the tick thread.
    pub fn description(&self) -> Arc<Description> {
        lock(&self.description).clone()
    }

    /// Replaces [`Shared::description`].
    pub fn set_description(&self, description: Arc<Description>) {
        *lock(&self.description) = description;
    }

    /// The arena's file. Not for the tick thread.
    pub fn source(&self) -> Arc<ArenaSource> {
        lock(&self.source).clone()
    }

    /// Replaces [`Shared::source`].
    pub fn set_source(&self, source: ArenaSource) {
        *lock(&self.source) = Arc::new(source);
    }

    /// What leads to the present keyframe of `cell`. Not for the tick thread.
    pub fn keyframes(&self, cell: CellId) -> Option<Arc<[Keyframe]>> {
        lock(&self.keyframes).get(&cell).cloned()
    }

    /// Replaces [`Shared::keyframes`]; a cell without any is no more.
    pub fn set_keyframes(&self, cell: CellId, keyframes: &[Keyframe]) {
        let mut all = lock(&self.keyframes);
        match keyframes {
            [] => all.remove(&cell),
            some => all.insert(cell, some.into()),
        };
    }

    /// The calling thread is the one that [`Shared::wake_publisher`] wakes.
    pub fn this_thread_publishes(&self) {
        // Called once, by the publishing thread.
        let _ = self.publisher.set(std::thread::current());
    }

    /// Wakes the publishing thread; never waits.
    pub fn wake_publisher(&self) {
        if let Some(thread) = self.publisher.get() {
            thread.unpark();
        }
    }

    /// How far the daemon's life has come.
    pub fn phase(&self) -> Phase {
        match self.phase.load(Ordering::Relaxed) {
            0 => Phase::Running,
            1 => Phase::Closing,
            _ => Phase::Ended,
        }
    }

    /// Goes on to `phase`, and wakes the publishing thread to see it.
    pub fn set_phase(&self, phase: Phase) {
        self.phase.store(phase as u8, Ordering::Relaxed);
        self.wake_publisher();
    }
}

/// Every holder of these locks leaves them consistent at each step, so what a panicking thread left can be read.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
