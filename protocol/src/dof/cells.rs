//! Streams that are coded once for everybody: one cannot follow two hundred acknowledgements.
//!
//! ```text
//! tick        1   2 .. 10  11 .. 20  21 ..
//! published   E   d    d   K   d  d  K   d      E: epoch, needs nothing; K: keyframe, coded against the one before;
//!             ╰───┴────┴───╯   │  │  │   │      d: coded against the last keyframe
//!                         ╰────┴──┴──╯   ...
//! ```
//!
//! Nothing is coded against a `d`: one that is lost harms no other. Who lacks a keyframe, and who comes anew, asks for
//! the epoch, the few snapshots from E on that lead to the present keyframe, and begins anew with them.

use std::collections::VecDeque;

use super::frame::State;
use super::stream::Encoder;

/// When keyframes and epochs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cadence {
    /// Ticks from one keyframe to the next, 1 to 100. More of them lets predictions go further astray.
    pub keyframe_ticks: u64,
    /// Keyframes of an epoch, 1 to 100. More of them makes catching up longer.
    pub epoch_keyframes: usize,
}

impl Default for Cadence {
    fn default() -> Self {
        Self { keyframe_ticks: 6, epoch_keyframes: 25 }
    }
}

/// Writes the stream of a cell.
#[derive(Debug)]
pub struct CellEncoder {
    cadence: Cadence,
    encoder: Encoder,
    /// The present epoch's keyframes as they were published, oldest first.
    epoch: VecDeque<(u64, Vec<u8>)>,
}

impl CellEncoder {
    /// A stream that begins with its first snapshot.
    pub fn new(cadence: Cadence) -> Self {
        Self { cadence, encoder: Encoder::default(), epoch: VecDeque::new() }
    }

    /// Codes the snapshot of `tick`, which is newer than all before.
    ///
    /// # Panics
    /// Where `tick` is not newer than all before.
    pub fn encode(&mut self, tick: u64, state: &State) -> Vec<u8> {
        let is_due = |&(last, _): &(u64, Vec<u8>)| tick - last >= self.cadence.keyframe_ticks.clamp(1, 100);
        let is_keyframe = self.epoch.back().is_none_or(is_due);
        if is_keyframe && self.epoch.len() >= self.cadence.epoch_keyframes.clamp(1, 100) {
            self.epoch.clear();
            self.encoder.restart();
        }
        let bytes = self.encoder.encode(tick, state, &[]);
        if is_keyframe {
            // What follows may build on it.
            self.encoder.acknowledge(tick, 0);
            self.epoch.push_back((tick, bytes.clone()));
        } else {
            self.encoder.forget_last();
        }
        bytes
    }

    /// What a newcomer decodes, in order and with a decoder of its own, to follow the stream from the present keyframe
    /// on: ticks and snapshots.
    pub fn epoch(&self) -> impl ExactSizeIterator<Item = (u64, &[u8])> {
        self.epoch.iter().map(|(tick, bytes)| (*tick, bytes.as_slice()))
    }
}
