//! Input packets: numbers the frames and repeats the last ones, so that one lost packet loses nothing.
//!
//! Pure: it neither sends nor reads a clock.

use std::collections::VecDeque;

use pita_protocol::message::{Controls, INPUT_FRAMES_MAX, InputFrame, InputPacket};

/// Builds the packets of one session.
#[derive(Debug)]
pub struct Outbox {
    epoch: u32,
    /// Newest last.
    frames: VecDeque<InputFrame>,
}

impl Outbox {
    /// For the session of `epoch`.
    pub fn new(epoch: u32) -> Self {
        Self { epoch, frames: VecDeque::with_capacity(INPUT_FRAMES_MAX) }
    }

    /// Packet with `controls` meant for `tick` as its newest frame, acknowledging what the inbox says.
    /// Answers the sequence number of that frame too.
    pub fn packet(
        &mut self,
        controls: Controls,
        tick: u64,
        acknowledged: (u64, u32),
        leave: bool,
    ) -> (u32, InputPacket) {
        // Reaches its end after four years at 30 Hz; the server then drops what follows as stale.
        let sequence = self.frames.back().map_or(0, |newest| newest.sequence).saturating_add(1);
        if self.frames.len() == INPUT_FRAMES_MAX {
            self.frames.pop_front();
        }
        self.frames.push_back(InputFrame { sequence, tick, controls });
        let frames = self.frames.iter().copied().collect();
        let (snapshot_tick, snapshots_before) = acknowledged;
        (sequence, InputPacket { epoch: self.epoch, snapshot_tick, snapshots_before, leave, frames })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_protocol::Message;

    #[test]
    fn every_packet_is_valid_and_repeats_its_predecessors() {
        let mut outbox = Outbox::new(7);
        for n in 1..=20u32 {
            let (sequence, packet) = outbox.packet(Controls::default(), 100 + u64::from(n), (99, 5), false);
            assert_eq!((sequence, packet.epoch, packet.snapshot_tick, packet.leave), (n, 7, 99, false));
            assert_eq!(packet.validate(), Ok(()));
            assert_eq!(packet.frames.len(), (n as usize).min(INPUT_FRAMES_MAX));
            let oldest = n.saturating_sub(INPUT_FRAMES_MAX as u32) + 1;
            let expected: Vec<u32> = (oldest..=n).collect();
            assert_eq!(packet.frames.iter().map(|f| f.sequence).collect::<Vec<_>>(), expected);
        }
    }
}
