//! The way of an input from the network to the tick thread.
//!
//! Owns the gate that every received packet passes: its length, its seal, its content, its session; what is refused is
//! counted by reason. What passes goes into a bounded lock-free queue. The gate runs on Zenoh's threads and never
//! blocks on the tick thread; the tick thread never waits for it.

use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam_queue::ArrayQueue;
use pita_protocol::message::{InputFrame, InputPacket};
use pita_protocol::seal::{self, TAG_BYTES};
use pita_protocol::{Message, WireError};

use crate::counters::Counters;
use crate::sessions::{InputRefusal, Received, SessionId};
use crate::shared::Shared;

/// An authentic, fresh input on its way to the tick thread.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Whose it is.
    pub id: SessionId,
    /// The input.
    pub frame: InputFrame,
    /// When it came, ns of the daemon's clock.
    pub at_ns: u64,
}

/// Where arrivals wait for the next tick.
pub struct InputQueue {
    arrivals: ArrayQueue<Arrival>,
    tick: AtomicU64,
}

impl InputQueue {
    /// Room for `capacity` arrivals between two ticks.
    pub fn new(capacity: usize) -> Self {
        Self { arrivals: ArrayQueue::new(capacity), tick: AtomicU64::new(0) }
    }

    /// The tick thread begins to collect for `tick`: calls `each` for what waits, in order of arrival. Looks at no more
    /// than fits into the queue, so that it ends even while more comes in.
    pub fn collect(&self, tick: u64, mut each: impl FnMut(Arrival)) {
        self.tick.store(tick, Ordering::Relaxed);
        for _ in 0..self.arrivals.capacity() {
            match self.arrivals.pop() {
                Some(arrival) => each(arrival),
                None => break,
            }
        }
    }

    fn tick(&self) -> u64 {
        self.tick.load(Ordering::Relaxed)
    }
}

/// Takes one packet that came in on `key_expr`.
pub fn receive(shared: &Shared, key_expr: &str, payload: &zenoh::bytes::ZBytes) {
    shared.counters.received_bytes.add(payload.len() as u64);
    if let Err(refusal) = admit(shared, key_expr, payload) {
        count(&shared.counters, &refusal);
    }
}

/// Why a packet went no further.
#[derive(Debug)]
enum Refused {
    Wire(WireError),
    Session(InputRefusal),
}

fn admit(shared: &Shared, key_expr: &str, payload: &zenoh::bytes::ZBytes) -> Result<(), Refused> {
    let no_session = || Refused::Session(InputRefusal::NoSession);
    // Its length comes first: putting fragments together allocates.
    let max = InputPacket::MAX_BYTES + TAG_BYTES;
    if payload.len() > max {
        return Err(Refused::Wire(WireError::TooLong { bytes: payload.len(), max }));
    }
    let slot = shared.keys.slot_of_input(key_expr).ok_or_else(no_session)?;
    let key = shared.sessions().key(slot).cloned().ok_or_else(no_session)?;
    let packet = seal::open(&payload.to_bytes(), &key, key_expr).map_err(Refused::Wire)?;
    let received =
        shared.sessions().receive(slot, &packet, shared.inputs.tick(), shared.clock.ms()).map_err(Refused::Session)?;
    match received {
        Received::Left => shared.wake_publisher(),
        Received::Inputs(fresh) => {
            let (id, at_ns) = (SessionId { slot, epoch: packet.epoch }, shared.clock.ns());
            for &frame in fresh {
                let arrival = Arrival { id, frame, at_ns };
                shared.inputs.arrivals.push(arrival).map_err(|_| Refused::Session(InputRefusal::Flood))?;
            }
        }
    }
    Ok(())
}

fn count(counters: &Counters, refused: &Refused) {
    let counter = match refused {
        Refused::Wire(WireError::TooLong { .. }) => &counters.input_too_long,
        Refused::Wire(WireError::Version { .. }) => &counters.input_version,
        Refused::Wire(WireError::Content { .. }) => &counters.input_content,
        Refused::Wire(WireError::Forged) => &counters.input_forged,
        Refused::Session(InputRefusal::NoSession) => &counters.input_no_session,
        Refused::Wire(
            WireError::Malformed
            | WireError::Kind { .. }
            | WireError::ArenaName
            | WireError::NoBaseline
            | WireError::Desync,
        ) => &counters.input_malformed,
        Refused::Session(InputRefusal::Stale) => &counters.input_stale,
        Refused::Session(InputRefusal::Flood) => &counters.input_flood,
    };
    counter.add(1);
}
