//! Streams of snapshots: what is coded against what.
//!
//! ```text
//! ┌───────┬────────────┬───────────┬─────────┬─────────────────────────┬───────────────────────┐
//! │ flags │ base age   │ span      │ check   │ steps: 4 × u32 LE       │ coded bodies          │
//! │ u8    │ u8, flag 0 │ u8, fl. 1 │ u16 LE  │ without flag 0 only     │ n bytes               │
//! └───────┴────────────┴───────────┴─────────┴─────────────────────────┴───────────────────────┘
//! flags: 1 has a baseline (base age ticks older), 2 has an earlier one (span ticks before the baseline), 4 partial
//! ```
//!
//! An [`Encoder`] codes against nothing that was not acknowledged. So a lost, late or repeated snapshot harms no other.

use std::collections::VecDeque;
use std::sync::Arc;

use super::budget::{Need, Spent};
use super::frame::{Frame, State};
use super::predict::GroupState;
use super::quantise::{Precision, Quantised};
use super::range_coder::{self, Coder};
use super::walk::{Source, Walk};
use crate::{WireError, codec::require};

/// Snapshots that an encoder remembers, and a decoder; what is acknowledged later than that starts anew.
pub const HISTORY: usize = 48;
/// Ticks between a snapshot and its baseline at most.
pub const AGE_MAX: u64 = 255;
/// Longest coded snapshot that is looked at, bytes.
pub const SNAPSHOT_MAX: usize = 1 << 20;

const HAS_BASE: u8 = 1;
const HAS_EARLIER: u8 = 2;
const PARTIAL: u8 = 4;

/// Writes a stream for one receiver, or one cell.
#[derive(Debug, Default)]
pub struct Encoder {
    /// Oldest first, each with whether the receiver is known to have it.
    sent: VecDeque<(Frame, bool)>,
    spent: Spent,
}

impl Encoder {
    /// The receiver has the snapshot of `tick`, and of each set bit i of `before` that of `tick − 1 − i`.
    pub fn acknowledge(&mut self, tick: u64, before: u32) {
        for (frame, has) in &mut self.sent {
            *has |= match tick.checked_sub(frame.tick) {
                Some(0) => true,
                Some(age) if age <= 32 => before >> (age - 1) & 1 == 1,
                _ => false,
            };
        }
        // What is older than two that the receiver has is not needed again.
        let newest = self.sent.iter().rposition(|(_, has)| *has);
        let earlier = newest.and_then(|newest| self.sent.range(..newest).rposition(|(_, has)| *has));
        drop(self.sent.drain(..earlier.or(newest).unwrap_or(0)));
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
        assert!(self.sent.back().is_none_or(|(last, _)| last.tick < tick), "ticks ascend");
        let (base, earlier) = self.baselines(tick);
        let (bytes, next, spent) = encode_against(base, earlier, tick, Source { state, chosen });
        self.spent = spent;
        if self.sent.len() == HISTORY {
            self.sent.pop_front();
        }
        self.sent.push_back((next, false));
        bytes
    }

    /// What each body of `state` has to tell the receiver that the snapshot of `tick` is coded for, in their order.
    pub fn needs(&self, tick: u64, state: &State, into: &mut Vec<Need>) {
        into.clear();
        let base = self.baselines(tick).0;
        let mut known = base.map_or(&[][..], |base| &base.bodies).iter().peekable();
        for body in state.bodies() {
            while known.next_if(|known| known.id < body.id).is_some() {}
            let had = known.peek().filter(|known| known.id == body.id).zip(base);
            into.push(match had {
                Some((known, base)) if known.groups == body.groups && known.kind == body.kind => {
                    need(base.groups(known), state.groups(body), state.precision())
                }
                _ => Need::First { groups: body.groups },
            });
        }
    }

    /// What the snapshot that was coded last took.
    pub fn spent(&self) -> &Spent {
        &self.spent
    }

    /// The newest frame that the receiver has, and the one before.
    fn baselines(&self, tick: u64) -> (Option<&Frame>, Option<&Frame>) {
        let mut known = self.sent.iter().rev().filter(|(frame, has)| *has && tick - frame.tick <= AGE_MAX);
        (known.next().map(|(frame, _)| frame), known.next().map(|(frame, _)| frame))
    }

    /// Forgets the snapshot that was coded last: it is not sent, or nothing will build on it.
    pub(super) fn forget_last(&mut self) {
        self.sent.pop_back();
    }

    /// The frame that was coded last.
    pub fn last(&self) -> Option<&Frame> {
        self.sent.back().map(|(frame, _)| frame)
    }
}

/// What a body whose groups a receiver has as `had` has to tell it.
fn need(had: &[GroupState], now: &[Quantised], precision: &Precision) -> Need {
    let changed = had.iter().zip(now).filter(|(had, now)| had.value != **now || !had.is_settled(precision)).count();
    if changed == 0 { Need::Nothing } else { Need::Update { groups: changed as u16 } }
}

/// The snapshot of `tick` as bytes, the frame that a receiver has after it, and what bodies took of the bytes.
fn encode_against(
    base: Option<&Frame>,
    earlier: Option<&Frame>,
    tick: u64,
    source: Source<'_>,
) -> (Vec<u8>, Frame, Spent) {
    let partial = source.chosen.iter().any(|carried| !carried);
    let mut bytes = vec![u8::from(partial) * PARTIAL];
    if let Some(base) = base {
        bytes[0] |= HAS_BASE;
        bytes.push((tick - base.tick) as u8);
    }
    let earlier = earlier.and_then(|earlier| Some((earlier, u8::try_from(base?.tick - earlier.tick).ok()?)));
    if let Some((_, span)) = earlier {
        bytes[0] |= HAS_EARLIER;
        bytes.push(span);
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
    let mut next = successor(base, tick);
    let mut coder = range_coder::Encoder::new(&mut bytes);
    let earlier = earlier.map(|(earlier, _)| earlier);
    let mut spent = Spent::default();
    let walk = Walk { coder: &mut coder, base, earlier, partial, source: Some(source), spent: &mut spent };
    // Every error of a walk is about something that a state cannot be.
    walk.run(&mut next).expect("a state that was checked when it was made");
    coder.finish();
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
    pub fn decode(&mut self, tick: u64, bytes: &[u8]) -> Result<&Arc<Frame>, WireError> {
        require(bytes.len() <= SNAPSHOT_MAX, "snapshot", "at most 1 MiB")?;
        let mut header = Header { bytes };
        let [flags] = header.take()?;
        require(flags & !(HAS_BASE | HAS_EARLIER | PARTIAL) == 0, "snapshot flags", "those that are known")?;
        let empty;
        let (mut base, mut earlier) = (None, None);
        if flags & HAS_BASE != 0 {
            let [age] = header.take()?;
            require(age > 0, "age of the baseline", "1 to 255")?;
            base = Some(self.at(tick.checked_sub(age.into()))?);
        }
        if flags & HAS_EARLIER != 0 {
            let [span] = header.take()?;
            let base: &Frame = base.ok_or(WireError::Malformed)?;
            require(span > 0, "span of the baselines", "1 to 255")?;
            earlier = Some(self.at(base.tick.checked_sub(span.into()))?);
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
        let mut next = successor(base, tick);
        let mut coder = range_coder::Decoder::new(header.bytes);
        let partial = flags & PARTIAL != 0;
        let spent = &mut Spent::default();
        Walk { coder: &mut coder, base, earlier, partial, source: None, spent }.run(&mut next)?;
        if coder.is_exhausted() || next.check() != check {
            return Err(WireError::Desync);
        }
        Ok(self.keep(next))
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

    fn keep(&mut self, frame: Frame) -> &Arc<Frame> {
        let frame = Arc::new(frame);
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
        &self.had[at - over]
    }
}

/// A frame for `tick` that goes on from `base`, its bodies still to come.
fn successor(base: &Frame, tick: u64) -> Frame {
    let (bodies, groups) = (base.bodies.len(), base.groups.len());
    Frame {
        tick,
        precision: base.precision,
        bodies: Vec::with_capacity(bodies),
        ticks: Vec::with_capacity(bodies),
        groups: Vec::with_capacity(groups),
        models: base.models.clone(),
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
