//! Inputs and what becomes of them.
//!
//! A client numbers its inputs and says for which tick each is meant; a packet repeats the last few, so that one lost
//! packet loses nothing. The server holds an input until its tick comes, applies one that is late at once unless a newer
//! one was applied, and tells in every snapshot what became of the last ones ([`InputAck`]) and with how much time to
//! spare the newest arrived, by which the client adapts its lead.

use serde::{Deserialize, Serialize};

use crate::codec::{Message, WireError, require};

/// Most input frames in one packet: the newest and its predecessors.
pub const INPUT_FRAMES_MAX: usize = 8;
/// Fates in an acknowledgement: that of its sequence and its predecessors. As many snapshots may be lost in a row
/// without an input's fate being lost.
pub const FATES_MAX: usize = 8;

/// The state of a player's controls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Controls {
    /// 0 to 1.
    pub throttle: f32,
    /// 0 to 1.
    pub brake: f32,
    /// −1 (left) to 1 (right).
    pub steer: f32,
    /// Bit set of [`buttons`].
    pub buttons: u16,
}

/// Bits of [`Controls::buttons`].
pub mod buttons {
    /// Drive backwards.
    pub const REVERSE: u16 = 1;
    /// Block the rear wheels.
    pub const HANDBRAKE: u16 = 2;
    /// Put the vehicle back on its wheels where it is; acts when it is pressed.
    pub const RESET: u16 = 4;
    /// Push from behind as long as the tank lasts.
    pub const BOOST: u16 = 8;
    /// Jump; acts when it is pressed.
    pub const JUMP: u16 = 16;
    /// Fire the weapon that is at hand.
    pub const FIRE: u16 = 32;
    /// Take the next weapon; acts when it is pressed.
    pub const NEXT_WEAPON: u16 = 64;
}

impl Controls {
    /// Whether a button of [`buttons`] is held.
    pub fn holds(&self, button: u16) -> bool {
        self.buttons & button != 0
    }

    /// # Errors
    /// [`WireError::Content`] for a value that is not finite or out of range.
    pub fn validate(&self) -> Result<(), WireError> {
        require((0.0..=1.0).contains(&self.throttle), "throttle", "0 to 1")?;
        require((0.0..=1.0).contains(&self.brake), "brake", "0 to 1")?;
        require((-1.0..=1.0).contains(&self.steer), "steer", "-1 to 1")
    }
}

/// Controls at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFrame {
    /// Strictly increasing within a session, from 1.
    pub sequence: u32,
    /// Tick for which the client meant it.
    pub tick: u64,
    /// The controls.
    pub controls: Controls,
}

/// Put on [`input`](crate::Keys::input), sealed by [`seal`](crate::seal::seal).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputPacket {
    /// [`JoinAccepted::epoch`](crate::message::JoinAccepted::epoch) of the session.
    pub epoch: u32,
    /// Newest snapshot that this client decoded: its acknowledgement. 0 where it has none, or lost the thread: the next
    /// snapshot then needs nothing before it.
    pub snapshot_tick: u64,
    /// Bit i: it also decoded the snapshot of `snapshot_tick` − 1 − i.
    pub snapshots_before: u32,
    /// The client leaves; nothing follows.
    pub leave: bool,
    /// The newest frame last, before it those that may have been lost.
    pub frames: Vec<InputFrame>,
}

impl Message for InputPacket {
    const KIND: u8 = 4;
    const MAX_BYTES: usize = 512;
    fn validate(&self) -> Result<(), WireError> {
        require((1..=INPUT_FRAMES_MAX).contains(&self.frames.len()), "frames", "1 to 8")?;
        let ascending = self.frames.windows(2).all(|w| w[0].sequence < w[1].sequence);
        require(ascending && self.frames[0].sequence > 0, "sequence", "ascending from 1")?;
        self.frames.iter().try_for_each(|frame| frame.controls.validate())
    }
}

/// What became of a session's inputs, as of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputAck {
    /// Newest sequence that was applied; 0 before the first.
    pub sequence: u32,
    /// Tick at which it was applied.
    pub tick: u64,
    /// What became of it and of those before it.
    pub fates: InputFates,
    /// Newest sequence that arrived, applied yet or not.
    pub received: u32,
    /// How long before its tick collected inputs it arrived, ms; negative where it was late.
    pub slack_ms: i16,
}

/// What became of all inputs that any player sent, counted by the server.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputCounts {
    /// Applied at the tick that they were meant for.
    pub in_time: u64,
    /// Applied at a later tick.
    pub late: u64,
    /// Not applied, because a newer one was.
    pub superseded: u64,
    /// Refused, because they were meant for a tick too far ahead.
    pub early: u64,
    /// Never arrived.
    pub missing: u64,
}

/// What became of one input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputFate {
    /// It did not arrive, or too much arrived with it.
    Missing,
    /// Applied, so many ticks after the one that it was meant for, at most [`InputFate::LATE_MAX`].
    Applied {
        /// 0 where it was in time.
        late_ticks: u8,
    },
    /// It came late, and a newer one had been applied, or a newer one was meant for the same tick.
    Superseded,
    /// Refused: it was meant for a tick too far ahead.
    Early,
}

impl InputFate {
    /// Lateness is told up to here, ticks.
    pub const LATE_MAX: u8 = 252;

    fn code(self) -> u8 {
        match self {
            Self::Missing => 0,
            Self::Applied { late_ticks } => 1 + late_ticks.min(Self::LATE_MAX),
            Self::Superseded => 254,
            Self::Early => 255,
        }
    }

    fn of(code: u8) -> Self {
        match code {
            0 => Self::Missing,
            254 => Self::Superseded,
            255 => Self::Early,
            late => Self::Applied { late_ticks: late - 1 },
        }
    }
}

/// Fates of the inputs up to one sequence, newest first; a byte each: 0 missing, 1 + n applied n ticks late, 254
/// superseded, 255 early.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFates([u8; FATES_MAX]);

impl InputFates {
    /// Of the input `behind` the newest one; `None` from [`FATES_MAX`] on.
    pub fn get(&self, behind: usize) -> Option<InputFate> {
        self.0.get(behind).copied().map(InputFate::of)
    }

    /// Sets the fate of the input `behind` the newest one; nothing happens from [`FATES_MAX`] on.
    pub fn set(&mut self, behind: usize, fate: InputFate) {
        if let Some(code) = self.0.get_mut(behind) {
            *code = fate.code();
        }
    }

    /// The newest sequence is `newer` further now; those in between are missing until they are [set](Self::set).
    pub fn advance(&mut self, newer: usize) {
        let newer = newer.min(FATES_MAX);
        self.0.copy_within(..FATES_MAX - newer, newer);
        self.0[..newer].fill(InputFate::Missing.code());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fates_are_kept_by_their_distance_from_the_newest() {
        let mut fates = InputFates::default();
        fates.set(0, InputFate::Applied { late_ticks: 2 });
        fates.advance(3);
        fates.set(0, InputFate::Applied { late_ticks: 0 });
        fates.set(1, InputFate::Early);
        fates.set(FATES_MAX, InputFate::Superseded);
        let expected = [InputFate::Applied { late_ticks: 0 }, InputFate::Early, InputFate::Missing];
        assert_eq!([0, 1, 2].map(|behind| fates.get(behind)), expected.map(Some));
        assert_eq!(fates.get(3), Some(InputFate::Applied { late_ticks: 2 }));
        assert_eq!(fates.get(FATES_MAX), None);
        fates.advance(usize::MAX);
        assert_eq!(fates, InputFates::default());
    }

    #[test]
    fn every_byte_is_a_fate_and_every_fate_a_byte() {
        for code in 0..=u8::MAX {
            assert_eq!(InputFate::of(code).code(), code);
        }
        assert_eq!(InputFate::Applied { late_ticks: 255 }.code(), InputFate::Applied { late_ticks: 252 }.code());
    }
}
