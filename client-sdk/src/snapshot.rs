//! A snapshot as it was received, decoded.

use std::time::Instant;

use pita_protocol::{
    dof::Slice,
    message::{InputAck, Snapshot},
};

use crate::bodies::Gathered;

/// State of all slices after one tick, as far as it has arrived: of each the newest, by its own [tick](Slice::tick). Numbers are made of it when they are asked for: whoever wants one slice, or none
/// of a snapshot, does not pay for all.
#[derive(Clone, Debug)]
pub struct ReceivedSnapshot {
    head: Snapshot,
    bodies: Gathered,
    tick_hz: f64,
    received: Instant,
}

impl ReceivedSnapshot {
    pub(crate) fn new(head: Snapshot, bodies: Gathered, tick_hz: f64, received: Instant) -> Self {
        Self { head, bodies, tick_hz, received }
    }

    /// Tick whose end this is.
    pub fn tick(&self) -> u64 {
        self.head.tick
    }

    /// What became of this session's inputs.
    pub fn ack(&self) -> InputAck {
        self.head.ack
    }

    /// Number of the last event before it.
    pub fn event_sequence(&self) -> u32 {
        self.head.event_sequence
    }

    /// When it arrived.
    pub fn received(&self) -> Instant {
        self.received
    }

    /// The same with what has arrived since.
    pub(crate) fn again(&self, bodies: Gathered) -> Self {
        Self { bodies, ..self.clone() }
    }

    /// All slices, in order of id.
    pub fn slices(&self) -> Vec<Slice> {
        self.bodies.bodies.iter().filter_map(|body| self.bodies.slice(body, self.tick_hz)).collect()
    }

    /// Those slices whose ids are in `wanted`, in its order; ids that the snapshot lacks are left out.
    pub fn select(&self, wanted: &[u32]) -> Vec<Slice> {
        let bodies = &self.bodies.bodies;
        let find = |wanted: &u32| Some(&bodies[bodies.binary_search_by_key(wanted, |place| place.id).ok()?]);
        wanted.iter().filter_map(find).filter_map(|body| self.bodies.slice(body, self.tick_hz)).collect()
    }
}
