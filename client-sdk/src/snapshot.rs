//! A snapshot as it was received, decoded.

use std::{sync::Arc, time::Instant};

use pita_protocol::{
    dof::{self, Slice},
    message::{InputAck, Snapshot},
};

/// State of all slices after one tick. Numbers are made of it when they are asked for: whoever wants one slice, or none
/// of a snapshot, does not pay for all.
#[derive(Debug)]
pub struct ReceivedSnapshot {
    head: Snapshot,
    frame: Arc<dof::Frame>,
    tick_hz: f64,
    received: Instant,
}

impl ReceivedSnapshot {
    pub(crate) fn new(head: Snapshot, frame: Arc<dof::Frame>, tick_hz: f64, received: Instant) -> Self {
        Self { head, frame, tick_hz, received }
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

    /// All slices, in order of id.
    pub fn slices(&self) -> Vec<Slice> {
        self.frame.slices(self.tick_hz)
    }

    /// Those slices whose ids are in `wanted`, in its order; ids that the snapshot lacks are left out.
    pub fn select(&self, wanted: &[u32]) -> Vec<Slice> {
        wanted.iter().filter_map(|&id| self.frame.slice(id, self.tick_hz)).collect()
    }
}
