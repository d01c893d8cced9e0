//! What a tick leaves behind for the publishing thread, and the bounded pool in which frames go round.
//!
//! The tick thread takes an empty frame, copies the state into it and hands it over; the publishing thread gives it
//! back. Once their memory has grown to the size of the world neither side allocates, and neither waits for the other:
//! where no frame is free, the tick leaves none.

use crossbeam_queue::ArrayQueue;
use pita_game::{ActorInfo, ArenaEvent, PartInfo};
use pita_protocol::dof::{BODY_GROUPS_MAX, Group, State, kind, relative};
use pita_protocol::message::{InputAck, InputCounts, TickRecord};
use pita_sim::{BlockSize, DofKind, SliceView, World};

use crate::crowd::{Crowd, Family};
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
    /// What the actors of each kind do, in order of their names.
    pub kinds: Vec<KindFigures>,
    /// What the ticks since the last frame cost; this frame's is the last.
    pub records: Vec<TickRecord>,
    /// Acknowledgements of all players.
    pub acks: Vec<(SessionId, InputAck)>,
    /// From arrival to the tick, of each input that the tick applied, µs.
    pub input_waits_us: Vec<u32>,
    dof: Dof,
}

/// What the actors of a kind do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindFigures {
    /// Name of the kind.
    pub kind: &'static str,
    /// How many acted in the last tick.
    pub actors: u32,
    /// Their sporadic jobs since the start.
    pub sporadic: u64,
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
    /// Events that were left out meanwhile, as far as the world's description does without them.
    pub events_dropped: u64,
    /// What became of the players' inputs.
    pub inputs: InputCounts,
}

/// Q of every slice. Q' is not sent: Q is piecewise linear in time.
#[derive(Default)]
struct Dof {
    heads: Vec<SliceHead>,
    /// What the numbers are, slice by slice.
    layouts: Vec<Group>,
    numbers: Vec<f64>,
    /// Further parts of actors.
    attached: Vec<Attached>,
    actors: Vec<ActorHead>,
}

/// A further part of an actor, by its slice.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Attached {
    id: u32,
    /// Slice of the actor's first part.
    root: u32,
    /// Whether it turns about its own z, as the root sees it.
    is_hinged: bool,
}

/// Groups of what turns about its own z.
const HINGED: [Group; 2] = [Group::Point, Group::Hinge];

/// An actor by the slice of its first part.
#[derive(Clone, Copy)]
struct ActorHead {
    root: u32,
    slot: Option<u16>,
    importance: f32,
}

#[derive(Clone, Copy)]
struct SliceHead {
    id: u32,
    kind: u8,
    /// Of its first point, m/s.
    speed: f32,
    groups: Span,
    numbers: Span,
}

/// Where a slice's share of a list is.
#[derive(Clone, Copy)]
struct Span {
    start: u32,
    len: u32,
}

impl Span {
    fn of<T>(self, list: &[T]) -> &[T] {
        &list[self.start as usize..][..self.len as usize]
    }
}

impl Frame {
    /// Copies the state of `world`, in which `actors` are, each with its relevance; events, records and acknowledgements are the caller's.
    pub fn copy_state<'a>(&mut self, world: &World, actors: impl Iterator<Item = (&'a ActorInfo, f32)>) {
        self.state_hash = world.state_hash();
        self.bodies = u32::try_from(world.body_count()).unwrap_or(u32::MAX);
        self.dof.clear();
        for slice in world.slices() {
            self.dof.push(&slice);
        }
        for (actor, importance) in actors {
            if let Some((first, others)) = actor.parts.split_first() {
                self.dof.actors.push(ActorHead { root: first.slice, slot: actor.slot, importance });
                let others = others.iter().filter(|part| part.slice != first.slice);
                let attached =
                    |part: &PartInfo| Attached { id: part.slice, root: first.slice, is_hinged: part.is_hinged };
                self.dof.attached.extend(others.map(attached));
            }
        }
    }

    /// All slices in order of their id, in steps, parts of an actor as seen from its first part; and who they are.
    pub fn quantise(&mut self, into: &mut State, crowd: &mut Crowd) {
        self.dof.quantise(into, crowd);
    }

    fn clear(&mut self) {
        self.events.clear();
        self.records.clear();
        self.acks.clear();
        self.input_waits_us.clear();
    }
}

impl Dof {
    fn clear(&mut self) {
        self.heads.clear();
        self.layouts.clear();
        self.numbers.clear();
        self.attached.clear();
        self.actors.clear();
    }

    /// A slice of more groups than a body may have on the wire is left out, which [`check`] refuses of an arena's own.
    fn push(&mut self, slice: &SliceView<'_>) {
        let (groups, numbers) = (self.layouts.len(), self.numbers.len());
        let kind = kind_on_wire(slice.kind);
        slice.blocks.iter().for_each(|block| self.layouts.extend(groups_of(kind, *block)));
        let len = self.layouts.len() - groups;
        if !(1..=BODY_GROUPS_MAX).contains(&len) {
            return self.layouts.truncate(groups);
        }
        let span = |start: usize, len: usize| Span { start: start as u32, len: len as u32 };
        let speed = match self.layouts[groups] {
            Group::Point => slice.v[..3].iter().map(|v| v * v).sum::<f64>().sqrt() as f32,
            _ => 0.0,
        };
        let (groups, numbers) = (span(groups, len), span(numbers, slice.q.len()));
        self.heads.push(SliceHead { id: slice.serial, kind, speed, groups, numbers });
        self.numbers.extend_from_slice(slice.q);
    }

    fn quantise(&mut self, into: &mut State, crowd: &mut Crowd) {
        self.heads.sort_unstable_by_key(|head| head.id);
        self.attached.sort_unstable();
        self.actors.sort_unstable_by_key(|actor| actor.root);
        into.clear();
        crowd.clear();
        for head in &self.heads {
            let parent = self.parent(head);
            let q = self.q(head);
            let seen = parent.map(|parent| relative(self.q(parent), q));
            let is_hinged = seen.is_some() && self.attached(head.id).is_some_and(|attached| attached.is_hinged);
            let layout = if is_hinged { &HINGED } else { head.groups.of(&self.layouts) };
            let q = seen.as_ref().map_or(q, |seen| &seen[..]);
            let pushed = into.push(head.id, head.kind, parent.map(|parent| parent.id), layout, q);
            // A world of more bodies than a stream may have shows its oldest.
            if pushed.is_err() {
                break;
            }
            if !self.attached(head.id).is_some_and(|attached| crowd.add_member(attached.root)) {
                crowd.add_root(self.family(head));
            }
        }
    }

    /// What is known of the slice `id` where it is a further one of an actor.
    fn attached(&self, id: u32) -> Option<&Attached> {
        let at = self.attached.binary_search_by_key(&id, |attached| attached.id).ok()?;
        Some(&self.attached[at])
    }

    fn family(&self, head: &SliceHead) -> Family {
        let actor = self.actors.binary_search_by_key(&head.id, |actor| actor.root).ok().map(|at| self.actors[at]);
        let position = match head.groups.of(&self.layouts)[0] {
            Group::Point => Some([0, 1, 2].map(|i| self.q(head)[i] as f32)),
            _ => None,
        };
        Family {
            root: head.id,
            position,
            speed: head.speed,
            importance: actor.map_or(1.0, |actor| actor.importance),
            slot: actor.and_then(|actor| actor.slot),
        }
    }

    /// The body in whose frame `head` is coded: an earlier one, both of them rigid.
    fn parent(&self, head: &SliceHead) -> Option<&SliceHead> {
        let root = self.attached(head.id)?.root;
        let parent = self.heads.binary_search_by_key(&root, |head| head.id).ok()?;
        let parent = &self.heads[parent];
        let are_rigid = head.kind == kind::RIGID_BODY && parent.kind == kind::RIGID_BODY;
        (are_rigid && parent.id < head.id).then_some(parent)
    }

    fn q(&self, head: &SliceHead) -> &[f64] {
        head.numbers.of(&self.numbers)
    }
}

/// The groups of a block of coordinates. Three numbers are a point, but of a game's own kind they may be anything.
fn groups_of(kind: u8, block: BlockSize) -> impl Iterator<Item = Group> {
    let (groups, scalars): (&[Group], usize) = match (block.positions, block.rates) {
        (3, 3) if kind != kind::OWN => (&[Group::Point][..], 0),
        (4, 3) => (&[Group::Rotation][..], 0),
        (7, 6) => (&[Group::Point, Group::Rotation][..], 0),
        (positions, _) => (&[][..], usize::from(positions)),
    };
    groups.iter().copied().chain(std::iter::repeat_n(Group::Scalar, scalars))
}

/// Checks that every body of `world` can be sent.
///
/// # Errors
/// What is too large, in words for a person.
pub fn check(world: &World) -> Result<(), String> {
    world.slices().try_for_each(|slice| check_slice(&slice))
}

fn check_slice(slice: &SliceView<'_>) -> Result<(), String> {
    let kind = kind_on_wire(slice.kind);
    let groups: usize = slice.blocks.iter().map(|block| groups_of(kind, *block).count()).sum();
    if groups <= BODY_GROUPS_MAX {
        return Ok(());
    }
    Err(format!(
        "a body of the arena ({:?}) has {groups} points, rotations and joint coordinates, and at most {BODY_GROUPS_MAX} \
         can be sent: make its mesh or lattice coarser",
        slice.kind
    ))
}

/// What the wire calls a kind.
fn kind_on_wire(kind: DofKind) -> u8 {
    match kind {
        DofKind::Particle => kind::PARTICLE,
        DofKind::RigidBody => kind::RIGID_BODY,
        DofKind::Articulated => kind::ARTICULATED,
        DofKind::Natural => kind::NATURAL,
        DofKind::FiniteElements => kind::FINITE_ELEMENTS,
        DofKind::Lattice => kind::LATTICE,
        DofKind::Own(_) => kind::OWN,
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
    use pita_protocol::dof::Precision;

    use super::*;

    #[test]
    fn slices_come_in_order_of_id_and_parts_as_their_first_part_sees_them() {
        let (mut dof, mut crowd) = (Dof::default(), Crowd::default());
        let mut push = |serial, kind, (positions, rates), q: &[f64]| {
            dof.push(&SliceView { serial, kind, blocks: &[BlockSize { positions, rates }], q, v: &[3.0, 4.0, 0.0] });
        };
        push(9, DofKind::RigidBody, (7, 6), &[12.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]);
        push(5, DofKind::Particle, (3, 3), &[1.0, 2.0, f64::NAN]);
        push(4, DofKind::RigidBody, (7, 6), &[10.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0]);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        push(10, DofKind::RigidBody, (7, 6), &[10.0, 2.0, 3.0, half, half, 0.0, 0.0]);
        push(11, DofKind::Own("clock"), (1, 1), &[0.5]);
        let attached = |id, is_hinged| Attached { id, root: 4, is_hinged };
        dof.attached.extend([attached(5, true), attached(9, true), attached(10, true)]);
        dof.actors.push(ActorHead { root: 4, slot: Some(7), importance: 2.0 });
        let mut state = State::new(Precision::default()).unwrap();
        dof.quantise(&mut state, &mut crowd);
        assert_eq!(crowd.of_bodies(), [0, 0, 0, 0, 1]);
        let car = Family { root: 4, position: Some([10.0, 2.0, 3.0]), speed: 5.0, importance: 2.0, slot: Some(7) };
        let clock = Family { root: 11, position: None, speed: 0.0, importance: 1.0, slot: None };
        assert_eq!(crowd.families(), [car, clock]);
        let bodies: Vec<_> = state.bodies().iter().map(|body| (body.id, body.parent)).collect();
        assert_eq!(bodies, [(4, None), (5, None), (9, Some(4)), (10, Some(4)), (11, None)]);
        // Half a turn about y.
        assert_eq!(state.groups(&state.bodies()[2])[0].steps, [-2000, 0, 0]);
        assert_eq!(state.groups(&state.bodies()[1])[0].steps, [1000, 2000, 0]);
        // One has its axis upside down, so there is no angle about it; the other is a quarter of a turn on.
        let turned = [2, 3].map(|body| state.groups(&state.bodies()[body])[1]);
        assert_eq!((turned[0].group, turned[1].group, turned[1].steps), (Group::Rotation, Group::Hinge, [0, 0, 1024]));
    }

    #[test]
    fn every_kind_is_a_row_of_groups() {
        let block = |positions, rates| BlockSize { positions, rates };
        let groups =
            |kind, blocks: &[BlockSize]| -> Vec<_> { blocks.iter().flat_map(|&b| groups_of(kind, b)).collect() };
        // A sheep in independent coordinates: a free root and three ball joints; then a hinge and a universal joint.
        let sheep = groups(kind::ARTICULATED, &[block(7, 6), block(4, 3), block(4, 3), block(4, 3)]);
        assert_eq!(sheep, [Group::Point, Group::Rotation, Group::Rotation, Group::Rotation, Group::Rotation]);
        assert_eq!(groups(kind::ARTICULATED, &[block(1, 1), block(2, 2)]), [Group::Scalar; 3]);
        assert_eq!(groups(kind::NATURAL, &[block(3, 3); 13]), [Group::Point; 13]);
        assert_eq!(groups(kind::OWN, &[block(3, 3)]), [Group::Scalar; 3]);
    }

    #[test]
    fn what_cannot_be_sent_is_refused_by_name() {
        let check = |nodes| {
            let blocks = vec![BlockSize { positions: 3, rates: 3 }; nodes];
            check_slice(&SliceView { serial: 1, kind: DofKind::Lattice, blocks: &blocks, q: &[], v: &[] })
        };
        assert_eq!(check(BODY_GROUPS_MAX), Ok(()));
        let said = check(BODY_GROUPS_MAX + 1).unwrap_err();
        assert!(said.contains("Lattice") && said.contains("4097") && said.contains("4096"), "{said}");
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
