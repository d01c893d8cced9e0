//! Streams of snapshots: what is coded against what.
//!
//! ```text
//! ┌───────┬────────────┬─────────┬─────────────────────────┬───────────────────────┐
//! │ flags │ base age   │ check   │ steps: 4 × u32 LE       │ coded bodies          │
//! │ u8    │ u8, flag 1 │ u16 LE  │ without flag 1 only     │ n bytes               │
//! └───────┴────────────┴─────────┴─────────────────────────┴───────────────────────┘
//! flags: 1 has a baseline (base age ticks older), 4 partial
//! ```
//!
//! An [`Encoder`] codes against nothing that was not acknowledged. So a lost, late or repeated snapshot harms no other.

use std::collections::VecDeque;
use std::sync::Arc;

use super::ans::{self, Coder};
use super::budget::{Need, Spent};
use super::frame::{Frame, State};
use super::predict::GroupState;
use super::quantise::{Precision, Quantised};
use super::walk::{Source, Walk};
use crate::{WireError, codec::require};

/// Snapshots that an encoder remembers, and a decoder; what is acknowledged later than that starts anew.
pub const HISTORY: usize = 48;
/// Groups of all snapshots that an encoder remembers, but for the newest two: a client that acknowledges nothing costs
/// 15 MB at most. Of ten thousand bodies these are 13 snapshots, a round trip of 0.4 s.
const REMEMBERED_MAX: usize = 1 << 18;
/// Ticks between a snapshot and its baseline at most.
pub const AGE_MAX: u64 = 255;
/// Longest coded snapshot that is looked at, bytes.
pub const SNAPSHOT_MAX: usize = 1 << 20;

const HAS_BASE: u8 = 1;
const PARTIAL: u8 = 4;

/// Tick of what the snapshot of `tick` is coded against; `None` where it needs nothing, or is no snapshot.
pub fn base_of(tick: u64, bytes: &[u8]) -> Option<u64> {
    match bytes {
        [flags, age, ..] if flags & HAS_BASE != 0 => tick.checked_sub((*age).into()),
        _ => None,
    }
}

/// Writes a stream for one receiver, or one cell.
#[derive(Debug, Default)]
pub struct Encoder {
    /// Oldest first.
    sent: VecDeque<Sent>,
    spent: Spent,
    /// Memory for what is being coded.
    choices: Vec<(u16, u16)>,
}

#[derive(Debug)]
struct Sent {
    frame: Frame,
    /// Whether the receiver is known to have it.
    is_had: bool,
}

impl Encoder {
    /// The receiver has the snapshot of `tick`, and of each set bit i of `before` that of `tick − 1 − i`.
    pub fn acknowledge(&mut self, tick: u64, before: u32) {
        for Sent { frame, is_had } in &mut self.sent {
            *is_had |= match tick.checked_sub(frame.tick) {
                Some(0) => true,
                Some(age) if age <= 32 => before >> (age - 1) & 1 == 1,
                _ => false,
            };
        }
        // What is older than one that the receiver has is not needed again.
        let newest = self.sent.iter().rposition(|sent| sent.is_had);
        drop(self.sent.drain(..newest.unwrap_or(0)));
    }

    /// The receiver lost the thread: the next snapshot needs nothing before it.
    pub fn restart(&mut self) {
        self.sent.clear();
    }

    /// Codes the snapshot of `tick`, which is newer than all before. `chosen` says for each body of the state whether it
    /// is carried; empty means all. What is left out keeps the state that it had, or stays unknown.
    ///
    /// # Panics
    /// Where `tick` is not newer than all before.
    pub fn encode(&mut self, tick: u64, state: &State, chosen: &[bool]) -> Vec<u8> {
        assert!(self.sent.back().is_none_or(|last| last.frame.tick < tick), "ticks ascend");
        let mut choices = std::mem::take(&mut self.choices);
        let (bytes, frame, spent) = encode_against(self.baseline(tick), tick, Source { state, chosen }, &mut choices);
        self.choices = choices;
        self.spent = spent;
        let remembered = |sent: &VecDeque<Sent>| sent.iter().map(|sent| sent.frame.groups.len()).sum::<usize>();
        while self.sent.len() == HISTORY || (self.sent.len() > 1 && remembered(&self.sent) > REMEMBERED_MAX) {
            self.sent.pop_front();
        }
        self.sent.push_back(Sent { frame, is_had: false });
        bytes
    }

    /// What each body of `state` has to tell the receiver that the snapshot of `tick` is coded for, in their order.
    pub fn needs(&self, tick: u64, state: &State, into: &mut Vec<Need>) {
        into.clear();
        let base = self.baseline(tick);
        let mut known = base.map_or(&[][..], |base| &base.bodies).iter().peekable();
        for body in state.bodies() {
            while known.next_if(|known| known.id < body.id).is_some() {}
            let had = known.peek().filter(|known| known.id == body.id).zip(base);
            into.push(match had {
                Some((known, base)) if base.is_same(known, state, body) => need(base.groups(known), state.groups(body)),
                _ => Need::First { groups: body.groups },
            });
        }
    }

    /// What the snapshot that was coded last took.
    pub fn spent(&self) -> &Spent {
        &self.spent
    }

    /// What the snapshot of `tick` is coded against: the newest that the receiver has.
    pub(super) fn baseline(&self, tick: u64) -> Option<&Frame> {
        let newest = self.sent.iter().rev().find(|sent| sent.is_had).map(|sent| &sent.frame);
        newest.filter(|newest| tick - newest.tick <= AGE_MAX)
    }

    /// Forgets the snapshot that was coded last: it is not sent, or nothing will build on it.
    pub(super) fn forget_last(&mut self) {
        self.sent.pop_back();
    }

    /// How many snapshots it could be told of.
    #[cfg(test)]
    pub(super) fn remembered(&self) -> usize {
        self.sent.len()
    }

    /// The frame that was coded last.
    pub fn last(&self) -> Option<&Frame> {
        self.sent.back().map(|sent| &sent.frame)
    }
}

/// What a body whose groups a receiver has as `had` has to tell it. That these are still on a track, which takes dozens of
/// snapshots to calm down, is nothing to tell: a receiver shows what it was told, not where the track leads.
fn need(had: &[GroupState], now: &[Quantised]) -> Need {
    let changed = had.iter().zip(now).filter(|(had, now)| had.value != **now).count();
    if changed == 0 { Need::Nothing } else { Need::Update { groups: changed as u16 } }
}

/// The snapshot of `tick` as bytes, the frame that a receiver has after it, and what bodies took of the bytes.
fn encode_against(
    base: Option<&Frame>,
    tick: u64,
    source: Source<'_>,
    choices: &mut Vec<(u16, u16)>,
) -> (Vec<u8>, Frame, Spent) {
    let partial = source.chosen.iter().any(|carried| !carried);
    let mut bytes = vec![u8::from(partial) * PARTIAL];
    if let Some(base) = base {
        bytes[0] |= HAS_BASE;
        bytes.push((tick - base.tick) as u8);
    }
    let check_at = bytes.len();
    bytes.extend([0; 2]);
    let empty;
    let base = match base {
        Some(base) => base,
        None => {
            empty = Frame::empty(*source.state.precision());
            let p = empty.precision;
            [p.point, p.rotation, p.scalar, p.rate].iter().for_each(|steps| bytes.extend(steps.to_le_bytes()));
            &empty
        }
    };
    let mut next = Frame { tick, ..base.clone() };
    let mut coder = ans::Encoder::new(choices);
    let mut spent = Spent::default();
    let walk = Walk { coder: &mut coder, base, partial, source: Some(source), spent: &mut spent };
    // Every error of a walk is about something that a state cannot be.
    walk.run(&mut next).expect("a state that was checked when it was made");
    coder.finish(&mut bytes);
    bytes[check_at..check_at + 2].copy_from_slice(&next.check().to_le_bytes());
    (bytes, next, spent)
}

/// Reads a stream.
#[derive(Debug, Default)]
pub struct Decoder {
    /// Oldest first.
    had: VecDeque<Arc<Frame>>,
}

impl Decoder {
    /// Decodes the snapshot of `tick`.
    ///
    /// # Errors
    /// [`WireError::Malformed`] and [`WireError::Content`] for what no encoder writes, [`WireError::NoBaseline`] where
    /// this side does not have what the snapshot is coded against, [`WireError::Desync`] where the states differ. After
    /// an error all is as before.
    pub fn decode(&mut self, tick: u64, bytes: &[u8]) -> Result<Arc<Frame>, WireError> {
        require(bytes.len() <= SNAPSHOT_MAX, "snapshot", "at most 1 MiB")?;
        let mut header = Header { bytes };
        let [flags] = header.take()?;
        require(flags & !(HAS_BASE | PARTIAL) == 0, "snapshot flags", "those that are known")?;
        let empty;
        let mut base = None;
        if flags & HAS_BASE != 0 {
            let [age] = header.take()?;
            require(age > 0, "age of the baseline", "1 to 255")?;
            base = Some(self.at(tick.checked_sub(age.into()))?);
        }
        let check = u16::from_le_bytes(header.take()?);
        let base = match base {
            Some(base) => base,
            None => {
                let mut steps = || Ok::<_, WireError>(u32::from_le_bytes(header.take()?));
                let precision = Precision { point: steps()?, rotation: steps()?, scalar: steps()?, rate: steps()? };
                precision.check()?;
                empty = Frame::empty(precision);
                &empty
            }
        };
        let mut next = Frame { tick, ..base.clone() };
        let mut coder = ans::Decoder::new(header.bytes);
        let partial = flags & PARTIAL != 0;
        let spent = &mut Spent::default();
        Walk { coder: &mut coder, base, partial, source: None, spent }.run(&mut next)?;
        if !coder.is_finished() || next.check() != check {
            return Err(WireError::Desync);
        }
        Ok(self.keep(next))
    }

    /// How many frames it keeps.
    #[cfg(test)]
    pub(super) fn remembered(&self) -> usize {
        self.had.len()
    }

    /// Groups of all frames that it keeps.
    pub(super) fn group_count(&self) -> usize {
        self.had.iter().map(|frame| frame.group_count()).sum()
    }

    /// Forgets the frames of the ticks that `wanted` does not want.
    pub(super) fn retain(&mut self, wanted: impl Fn(u64) -> bool) {
        self.had.retain(|frame| wanted(frame.tick));
    }

    /// The newest frame.
    pub fn newest(&self) -> Option<&Frame> {
        self.had.back().map(Arc::as_ref)
    }

    /// What is to be acknowledged: the newest tick, and a bit for each of the 32 before it. `None` before the first.
    pub fn acknowledgement(&self) -> Option<(u64, u32)> {
        let newest = self.newest()?.tick;
        let ages = self.had.iter().map(|frame| newest - frame.tick).filter(|age| (1..=32).contains(age));
        Some((newest, ages.fold(0, |bits, age| bits | 1 << (age - 1))))
    }

    fn at(&self, tick: Option<u64>) -> Result<&Frame, WireError> {
        let tick = tick.ok_or(WireError::NoBaseline)?;
        let at = self.had.binary_search_by_key(&tick, |frame| frame.tick).map_err(|_| WireError::NoBaseline)?;
        Ok(&self.had[at])
    }

    fn keep(&mut self, frame: Frame) -> Arc<Frame> {
        let frame = Arc::new(frame);
        let kept = Arc::clone(&frame);
        let at = match self.had.binary_search_by_key(&frame.tick, |had| had.tick) {
            Ok(at) => {
                self.had[at] = frame;
                at
            }
            Err(at) => {
                self.had.insert(at, frame);
                at
            }
        };
        let over = self.had.len().saturating_sub(HISTORY).min(at);
        self.had.drain(..over);
        kept
    }
}

struct Header<'a> {
    bytes: &'a [u8],
}

impl Header<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let (head, rest) = self.bytes.split_first_chunk::<N>().ok_or(WireError::Malformed)?;
        self.bytes = rest;
        Ok(*head)
    }
}
