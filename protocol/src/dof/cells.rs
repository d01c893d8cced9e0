//! Streams that are coded once for everybody: one cannot follow two hundred acknowledgements.
//!
//! ```text
//! tick        1   2 .. 8   9   10 .. 16  17  18 ..
//! published   E   d    d   K   d     d   K   d      E: epoch, needs nothing; K: keyframe, coded against the one before;
//!             ╰───┴────┴───┴───╯     │   │          d: coded against the newest keyframe that is five ticks old
//!                          ╰─────────┴───╯   ...
//! layer       0   3 2 3 1 3 2 3   0   3 2 ..
//! ```
//!
//! Nothing is coded against a `d`: one that is lost harms no other, and who wants less takes fewer layers. Who lacks a
//! keyframe, and who comes anew, asks for the few that lead from the one that it has, or from E, to the present one; a
//! keyframe that is lost is there before anything needs it, where that takes less than five ticks. Where
//! nothing happens nothing is published but a keyframe now and then.

use std::sync::Arc;

use super::budget::{Need, Spent};
use super::frame::{Frame, State};
use super::stream::{AGE_MAX, Decoder, Encoder};
use crate::WireError;
use crate::cell::Keyframe;

/// Ticks from one keyframe to the next where nothing happens.
const QUIET_TICKS: u64 = 32;
/// An epoch ends where its keyframes have come to so many bytes: an answer to who catches up is a message, too.
const EPOCH_BYTES_MAX: usize = 2 << 20;
/// Most keyframes of an epoch in which little happens: who catches up decodes them all.
const EPOCH_KEYFRAMES_MAX: usize = 400;
/// Groups of new bodies that wait for the next keyframe: until then each snapshot says all of them anew.
const FRESH_GROUPS_MAX: usize = 64;
/// For so many ticks it is said that there is no more news: once for those who lost the last, and once for those who did
/// not, to whom two equal states say that the motion between the two before has ended.
const STILL_TICKS: u64 = 2;
/// Keyframes that a decoder keeps: where each tick is one, snapshots are coded against the fifth before, and late ones
/// against one before that.
const KEYFRAMES_KEPT: usize = 8;

/// When keyframes and epochs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cadence {
    /// Ticks from one keyframe to the next are 2 to the power of this, 0 to 5. More of them lets predictions go further
    /// astray.
    pub keyframe_ticks_log2: u8,
    /// Keyframes of an epoch, 1 to 100, and up to 400 where the others have not come to the bytes of its first: what rests is
    /// not to be said again all the time. More of them makes catching up longer.
    pub epoch_keyframes: usize,
    /// Ticks from a keyframe to the first snapshot that is coded against it, 1 to 8. Who lost it learns of it a tick later,
    /// and has it a round trip after that.
    pub settled_ticks: u8,
    /// An epoch ends where its keyframes have come to so many times the bytes of its first: then to begin anew costs a share
    /// of the stream, and to catch up not many times more than the state itself.
    pub epoch_growth: u8,
}

impl Default for Cadence {
    fn default() -> Self {
        Self { keyframe_ticks_log2: 3, epoch_keyframes: 50, settled_ticks: 5, epoch_growth: 4 }
    }
}

impl Cadence {
    fn keyframe_ticks(self) -> u64 {
        1 << self.keyframe_ticks_log2.min(5)
    }

    /// How many layers there are.
    pub fn layers(self) -> u8 {
        self.keyframe_ticks_log2.min(5) + 1
    }

    /// Layer of the snapshot that comes so many ticks after its keyframe.
    fn layer(self, age: u64) -> u8 {
        // Age 0 has 64 trailing zeros: the keyframe itself.
        self.keyframe_ticks_log2.min(5).saturating_sub(age.trailing_zeros().min(5) as u8)
    }
}

/// What a cell's snapshot of a tick is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Coded against the newest keyframe that has settled.
    Delta,
    /// The same, and others will be coded against it.
    Keyframe,
    /// A keyframe that needs nothing.
    Epoch,
}

/// A snapshot of a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coded {
    /// The bytes.
    pub dof: Vec<u8>,
    /// Layer on which it is published.
    pub layer: u8,
    /// Ticks since the newest keyframe; 0 where it is one.
    pub keyframe_age: u8,
}

/// Writes the stream of a cell.
#[derive(Debug)]
pub struct CellEncoder {
    cadence: Cadence,
    encoder: Encoder,
    /// Takes over from it when the first keyframe of its epoch has settled.
    coming: Option<Encoder>,
    /// The present epoch's keyframes as they were published, oldest first.
    epoch: Vec<Keyframe>,
    needs: Vec<Need>,
    /// Ticks since there was news.
    still: u64,
    /// Whether anything was published since the last keyframe.
    has_told: bool,
    /// Whether many bodies are new.
    is_crowded: bool,
}

impl CellEncoder {
    /// A stream that begins with its first snapshot.
    pub fn new(cadence: Cadence) -> Self {
        let (encoder, epoch, needs) = (Encoder::default(), Vec::new(), Vec::new());
        Self { cadence, encoder, coming: None, epoch, needs, still: 0, has_told: false, is_crowded: false }
    }

    /// What the snapshot of `tick`, which is newer than all before, is to be; `None` where there is nothing to tell.
    /// Each tick is to be asked for once.
    pub fn due(&mut self, tick: u64, state: &State) -> Option<Due> {
        self.settle(tick);
        self.encoder.needs(tick, state, &mut self.needs);
        let Some(age) = self.keyframe_age(tick).filter(|&age| age <= AGE_MAX / 2) else {
            self.still = 0;
            return Some(Due::Epoch);
        };
        let left = self.encoder.baseline(tick).is_some_and(|base| base.bodies().len() != state.bodies().len());
        let has_news = left || self.needs.iter().any(|need| *need != Need::Nothing);
        self.still = if has_news { 0 } else { self.still.saturating_add(1) };
        let has_word = self.still <= STILL_TICKS;
        let fresh = self.needs.iter().map(|need| if let Need::First { groups } = need { *groups } else { 0 });
        self.is_crowded = fresh.map(usize::from).sum::<usize>() > FRESH_GROUPS_MAX;
        let is_time = age >= self.cadence.keyframe_ticks() && (has_word || self.has_told);
        match is_time || self.is_crowded || age >= QUIET_TICKS {
            true if self.is_epoch_full() => Some(Due::Epoch),
            true => Some(Due::Keyframe),
            false => has_word.then_some(Due::Delta),
        }
    }

    /// What each body of the state has to tell, as of [`CellEncoder::due`].
    pub fn needs(&self) -> &[Need] {
        &self.needs
    }

    /// Codes the snapshot of `tick` that is `due`. Of each body of `state` `chosen` says whether it is carried; empty means
    /// all. An epoch carries all, and what is [first](Need::First) has to be carried: so a snapshot without a body says
    /// that it is not in the cell.
    ///
    /// # Panics
    /// Where `tick` is not newer than all before.
    pub fn encode(&mut self, tick: u64, state: &State, due: Due, chosen: &[bool]) -> Coded {
        if due == Due::Epoch {
            return self.begin_epoch(tick, state);
        }
        if due == Due::Keyframe {
            // It continues the present epoch, settled or not.
            self.take_over();
        }
        let age = self.keyframe_age(tick).unwrap_or(0);
        let dof = self.encoder.encode(tick, state, chosen);
        self.has_told = due == Due::Delta;
        if due == Due::Delta {
            self.encoder.forget_last();
            return Coded { dof, layer: self.cadence.layer(age), keyframe_age: age as u8 };
        }
        if self.is_crowded {
            // To say all of them five times more costs more than a loss.
            self.encoder.acknowledge(tick, 0);
        }
        self.epoch.push(Keyframe { tick, dof: dof.clone() });
        Coded { dof, layer: 0, keyframe_age: 0 }
    }

    /// A keyframe that needs nothing. What was there before serves until it has settled.
    fn begin_epoch(&mut self, tick: u64, state: &State) -> Coded {
        let mut encoder = Encoder::default();
        let dof = encoder.encode(tick, state, &[]);
        encoder.acknowledge(tick, 0);
        let goes_on = !self.is_crowded && self.keyframe_age(tick).is_some_and(|age| age <= AGE_MAX / 2);
        match goes_on {
            true => self.coming = Some(encoder),
            false => (self.encoder, self.coming) = (encoder, None),
        }
        self.epoch.clear();
        self.epoch.push(Keyframe { tick, dof: dof.clone() });
        self.has_told = false;
        Coded { dof, layer: 0, keyframe_age: 0 }
    }

    /// From now on snapshots are coded against the newest keyframe that is old enough.
    fn settle(&mut self, tick: u64) {
        let settled = self
            .epoch
            .iter()
            .rev()
            .map(|keyframe| keyframe.tick)
            .find(|of| tick - of >= self.cadence.settled_ticks.into());
        if let Some(keyframe) = settled {
            self.take_over();
            self.encoder.acknowledge(keyframe, 0);
        }
    }

    /// The encoder of the present epoch is the only one.
    fn take_over(&mut self) {
        if let Some(coming) = self.coming.take() {
            self.encoder = coming;
        }
    }

    /// Ticks since the newest keyframe.
    fn keyframe_age(&self, tick: u64) -> Option<u64> {
        self.epoch.last().map(|last| tick - last.tick)
    }

    /// What the snapshot that was coded last took.
    pub fn spent(&self) -> &Spent {
        self.encoder.spent()
    }

    /// What leads to the present keyframe, oldest first: what a newcomer decodes to follow the stream from there on.
    pub fn epoch(&self) -> &[Keyframe] {
        &self.epoch
    }

    fn is_epoch_full(&self) -> bool {
        let Some(first) = self.epoch.first() else { return true };
        let bytes: usize = self.epoch.iter().map(|keyframe| keyframe.dof.len()).sum();
        let is_long = self.epoch.len() >= self.cadence.epoch_keyframes.clamp(1, 100);
        (is_long && bytes >= 2 * first.dof.len())
            || self.epoch.len() >= EPOCH_KEYFRAMES_MAX
            || bytes > first.dof.len() * (1 + usize::from(self.cadence.epoch_growth))
            || bytes > EPOCH_BYTES_MAX
    }
}

/// Reads the stream of a cell.
#[derive(Debug, Default)]
pub struct CellDecoder {
    decoder: Decoder,
    /// Ticks of the keyframes that it has, oldest first.
    keyframes: Vec<u64>,
}

impl CellDecoder {
    /// Decodes the snapshot of `tick`.
    ///
    /// # Errors
    /// As [`Decoder::decode`]: [`WireError::NoBaseline`] where the keyframe is missing that it is coded against. After
    /// [`WireError::Desync`] the reader is to begin anew.
    pub fn decode(&mut self, tick: u64, dof: &[u8], is_keyframe: bool) -> Result<Arc<Frame>, WireError> {
        let frame = self.decoder.decode(tick, dof)?;
        match self.keyframes.binary_search(&tick) {
            Err(at) if is_keyframe => self.keyframes.insert(at, tick),
            _ => {}
        }
        let over = self.keyframes.len().saturating_sub(KEYFRAMES_KEPT);
        self.keyframes.drain(..over);
        self.decoder.retain(|tick| self.keyframes.binary_search(&tick).is_ok());
        Ok(frame)
    }

    /// How many frames it keeps.
    #[cfg(test)]
    pub(super) fn frames(&self) -> usize {
        self.decoder.remembered()
    }

    /// Groups of all frames that it keeps: what it takes of memory.
    pub fn group_count(&self) -> usize {
        self.decoder.group_count()
    }

    /// Whether it has the keyframe of `tick`, or one that old is of no use any more.
    pub fn has(&self, tick: u64) -> bool {
        self.keyframes.first().is_some_and(|oldest| tick < *oldest) || self.keyframes.binary_search(&tick).is_ok()
    }

    /// Tick of the newest keyframe before `tick`.
    pub fn keyframe_before(&self, tick: u64) -> Option<u64> {
        self.keyframes.iter().rev().copied().find(|of| *of < tick)
    }

    /// Tick of the newest keyframe.
    pub fn keyframe(&self) -> Option<u64> {
        self.keyframes.last().copied()
    }
}
