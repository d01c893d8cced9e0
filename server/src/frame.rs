//! What a tick leaves behind for the publishing thread, and the bounded pool in which frames go round.
//!
//! The tick thread takes an empty frame, copies the state into it and hands it over; the publishing thread gives it
//! back. Once their memory has grown to the size of the world neither side allocates, and neither waits for the other:
//! where no frame is free, the tick leaves none.

use crossbeam_queue::ArrayQueue;
use pita_game::{Arena, ArenaEvent};
use pita_protocol::message::{InputAck, InputCounts, TickRecord};
use pita_protocol::slices;
use pita_sim::DofKind;

use crate::sessions::SessionId;

/// Frames in circulation: one being filled, one being published, and what a publishing thread that was held up for a
/// few ticks leaves waiting.
pub const FRAMES: usize = 8;

/// The world after one tick.
#[derive(Default)]
pub struct Frame {
    /// Number of the tick.
    pub tick: u64,
    /// Hash of the engine's state.
    pub state_hash: u64,
    /// Bodies of the world.
    pub bodies: u32,
    /// Totals since the start.
    pub totals: Totals,
    /// What happened since the last frame, in order.
    pub events: Vec<ArenaEvent>,
    /// What the ticks since the last frame cost; this frame's is the last.
    pub records: Vec<TickRecord>,
    /// Acknowledgements of all players.
    pub acks: Vec<(SessionId, InputAck)>,
    /// From arrival to the tick, of each input that the tick applied, µs.
    pub input_waits_us: Vec<u32>,
    dof: Dof,
}

/// Counts since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Ticks that took longer than their period.
    pub overruns: u64,
    /// Ticks left out.
    pub skipped_ticks: u64,
    /// By how much the world fell behind the clock for good, ns.
    pub given_up_ns: u64,
    /// Bodies quarantined for a non-finite state.
    pub quarantined: u64,
    /// Ticks of which no frame was left, because the publishing thread had all of them.
    pub frames_missed: u64,
    /// What became of the players' inputs.
    pub inputs: InputCounts,
}

/// Q and Q' of every slice in single precision.
#[derive(Default)]
struct Dof {
    heads: Vec<SliceHead>,
    /// Of each slice Q, then Q'.
    numbers: Vec<f32>,
}

#[derive(Clone, Copy)]
struct SliceHead {
    id: u32,
    kind: u8,
    start: u32,
    n_q: u8,
    n_v: u8,
}

impl Frame {
    /// Copies the state of `arena`; events, records and acknowledgements are the caller's.
    pub fn copy_state(&mut self, arena: &Arena) {
        let world = arena.world();
        self.state_hash = world.state_hash();
        self.bodies = u32::try_from(world.body_count()).unwrap_or(u32::MAX);
        self.dof.heads.clear();
        self.dof.numbers.clear();
        for slice in world.slices() {
            if let Some(kind) = kind_on_wire(slice.kind) {
                self.dof.push(slice.serial, kind, slice.q, slice.v);
            }
        }
    }

    /// Packs all slices in order of their id, as [`slices`] says.
    pub fn pack_dof(&mut self, out: &mut Vec<u8>) {
        self.dof.pack(out);
    }

    fn clear(&mut self) {
        self.events.clear();
        self.records.clear();
        self.acks.clear();
        self.input_waits_us.clear();
    }
}

impl Dof {
    fn push(&mut self, id: u32, kind: u8, q: &[f64], v: &[f64]) {
        let start = self.numbers.len() as u32;
        // Kinds have at most 255 numbers: slices::pack checks it.
        self.heads.push(SliceHead { id, kind, start, n_q: q.len() as u8, n_v: v.len() as u8 });
        // A finite number of the engine may be beyond single precision; the wire takes no infinity.
        let single = |x: &f64| x.clamp(f32::MIN.into(), f32::MAX.into()) as f32;
        self.numbers.extend(q.iter().chain(v).map(single));
    }

    fn pack(&mut self, out: &mut Vec<u8>) {
        self.heads.sort_unstable_by_key(|head| head.id);
        for head in &self.heads {
            let (start, n_q) = (head.start as usize, usize::from(head.n_q));
            let (q, v) = self.numbers[start..start + n_q + usize::from(head.n_v)].split_at(n_q);
            slices::pack(head.id, head.kind, q.iter().copied(), v.iter().copied(), out);
        }
    }
}

/// What the wire calls a kind; `None` for those that it does not carry yet, which no arena has.
fn kind_on_wire(kind: DofKind) -> Option<u8> {
    match kind {
        DofKind::Particle => Some(slices::KIND_PARTICLE),
        DofKind::RigidBody => Some(slices::KIND_RIGID_BODY),
        _ => None,
    }
}

/// Frames on their way round.
pub struct FramePool {
    free: ArrayQueue<Box<Frame>>,
    filled: ArrayQueue<Box<Frame>>,
}

impl FramePool {
    /// All frames free.
    pub fn new() -> Self {
        let (free, filled) = (ArrayQueue::new(FRAMES), ArrayQueue::new(FRAMES));
        // Each queue holds all frames there are, so that no push ever finds it full.
        (0..FRAMES).for_each(|_| drop(free.push(Box::default())));
        Self { free, filled }
    }

    /// An empty frame for the tick thread, unless the publishing thread has them all.
    pub fn take_free(&self) -> Option<Box<Frame>> {
        self.free.pop()
    }

    /// Hands a filled frame over.
    pub fn put_filled(&self, frame: Box<Frame>) {
        drop(self.filled.push(frame));
    }

    /// The oldest filled frame.
    pub fn take_filled(&self) -> Option<Box<Frame>> {
        self.filled.pop()
    }

    /// True where no filled frame waits behind the ones taken.
    pub fn is_drained(&self) -> bool {
        self.filled.is_empty()
    }

    /// Gives a frame back, its memory kept.
    pub fn put_free(&self, mut frame: Box<Frame>) {
        frame.clear();
        drop(self.free.push(frame));
    }
}

impl Default for FramePool {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_packed_in_order_of_id_and_always_finite() {
        let mut dof = Dof::default();
        dof.push(9, slices::KIND_PARTICLE, &[1.0, 2.0, 3.0], &[4.0, 5.0, 1e300]);
        dof.push(4, slices::KIND_RIGID_BODY, &[0.5; 7], &[-1e-300; 6]);
        let mut bytes = Vec::new();
        dof.pack(&mut bytes);
        let unpacked = slices::unpack(&bytes).unwrap();
        assert_eq!(unpacked.iter().map(|slice| slice.id).collect::<Vec<_>>(), [4, 9]);
        assert_eq!((unpacked[0].q.len(), unpacked[0].v.len()), (7, 6));
        assert_eq!((&unpacked[1].q[..], unpacked[1].v[2]), (&[1.0, 2.0, 3.0][..], f32::MAX));
    }

    #[test]
    fn frames_go_round_and_run_out() {
        let pool = FramePool::new();
        let frames: Vec<_> = std::iter::from_fn(|| pool.take_free()).collect();
        assert_eq!(frames.len(), FRAMES);
        frames.into_iter().for_each(|frame| pool.put_filled(frame));
        assert!(pool.take_free().is_none() && !pool.is_drained());
        while let Some(mut frame) = pool.take_filled() {
            frame.events.push(ArenaEvent::ActorRemoved(1));
            pool.put_free(frame);
        }
        assert!(pool.is_drained());
        assert!(pool.take_free().is_some_and(|frame| frame.events.is_empty()));
    }
}
