//! The state of a whole stream at a tick: what one side knows that the other has.

use super::predict::GroupState;
use super::quantise::{Group, Precision, Quantised};
use super::residual::Models;
use crate::{WireError, codec::require};

/// Most bodies of a stream.
pub const BODIES_MAX: usize = 16_384;
/// Most groups of a stream.
pub const GROUPS_MAX: usize = 65_536;
/// Most groups of a body.
pub const BODY_GROUPS_MAX: usize = 4096;

/// A body of a state, or of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body {
    /// Names it for as long as it lives; never used twice in a run.
    pub id: u32,
    /// What its numbers mean; see the kinds of [`crate::dof`].
    pub kind: u8,
    /// The body in whose frame its first point and rotation are. It comes before.
    pub parent: Option<u32>,
    /// Where its groups start.
    pub(super) start: u32,
    /// How many groups it has.
    pub(super) groups: u16,
}

/// Everything at one tick in steps, in order of id: what is coded, once for all streams.
#[derive(Clone, Debug)]
pub struct State {
    precision: Precision,
    bodies: Vec<Body>,
    groups: Vec<Quantised>,
}

impl State {
    /// An empty state.
    ///
    /// # Errors
    /// [`WireError::Content`] for a precision out of range.
    pub fn new(precision: Precision) -> Result<Self, WireError> {
        precision.check()?;
        Ok(Self { precision, bodies: Vec::new(), groups: Vec::new() })
    }

    /// Forgets all bodies, and keeps the memory.
    pub fn clear(&mut self) {
        self.bodies.clear();
        self.groups.clear();
    }

    /// How fine the steps are.
    pub fn precision(&self) -> &Precision {
        &self.precision
    }

    /// Appends a body. `numbers` are as many as `layout` says, in its order; of an attached body they are
    /// [relative](super::relative) to its parent.
    ///
    /// # Errors
    /// [`WireError::Content`] where ids do not ascend, a parent does not come before, or there is too much.
    pub fn push(
        &mut self,
        id: u32,
        kind: u8,
        parent: Option<u32>,
        layout: &[Group],
        numbers: &[f64],
    ) -> Result<(), WireError> {
        self.check_room(id, parent, layout.len())?;
        let count: usize = layout.iter().map(|group| group.numbers()).sum();
        require(numbers.len() == count, "numbers of a body", "as many as its layout says")?;
        let (start, groups) = (self.groups.len() as u32, layout.len() as u16);
        let mut rest = numbers;
        for &group in layout {
            let (own, others) = rest.split_at(group.numbers());
            self.groups.push(Quantised::of(group, own, &self.precision));
            rest = others;
        }
        self.bodies.push(Body { id, kind, parent, start, groups });
        Ok(())
    }

    /// Appends a body of another state of the same precision.
    ///
    /// # Errors
    /// As [`State::push`].
    pub fn push_copy(&mut self, from: &Self, body: &Body) -> Result<(), WireError> {
        let groups = from.groups(body);
        self.check_room(body.id, body.parent, groups.len())?;
        let start = self.groups.len() as u32;
        self.groups.extend_from_slice(groups);
        self.bodies.push(Body { start, ..*body });
        Ok(())
    }

    /// Whether a body may come next.
    fn check_room(&self, id: u32, parent: Option<u32>, groups: usize) -> Result<(), WireError> {
        require(self.bodies.last().is_none_or(|last| last.id < id), "slice id", "ascending")?;
        require(id < u32::MAX, "slice id", "below 2^32 - 1")?;
        require(parent.is_none_or(|parent| self.find(parent).is_some()), "parent", "an earlier body")?;
        require(self.bodies.len() < BODIES_MAX, "bodies", "at most 16384")?;
        require(self.groups.len() + groups <= GROUPS_MAX, "groups", "at most 65536")?;
        require((1..=BODY_GROUPS_MAX).contains(&groups), "groups of a body", "1 to 4096")
    }

    /// All bodies, in order of id.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Groups of a body of this state.
    pub fn groups(&self, body: &Body) -> &[Quantised] {
        &self.groups[body.start as usize..][..body.groups.into()]
    }

    pub(super) fn find(&self, id: u32) -> Option<&Body> {
        self.bodies.binary_search_by_key(&id, |body| body.id).ok().map(|at| &self.bodies[at])
    }
}

/// What a receiver has after a snapshot: of every body the newest state that it was sent, and the models.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    pub(super) tick: u64,
    pub(super) precision: Precision,
    pub(super) bodies: Vec<Body>,
    /// Tick of each body's state.
    pub(super) ticks: Vec<u64>,
    pub(super) groups: Vec<GroupState>,
    pub(super) models: Box<Models>,
}

impl Frame {
    /// Nothing at all: what a snapshot without a baseline starts from.
    pub fn empty(precision: Precision) -> Self {
        Self { tick: 0, precision, bodies: Vec::new(), ticks: Vec::new(), groups: Vec::new(), models: Box::default() }
    }

    /// Forgets all bodies, and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.bodies.clear();
        self.ticks.clear();
        self.groups.clear();
    }

    /// Tick of the snapshot.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// How fine its steps are.
    pub fn precision(&self) -> &Precision {
        &self.precision
    }

    /// All bodies that the receiver has, in order of id, each with the tick of its state.
    pub fn bodies(&self) -> impl ExactSizeIterator<Item = (&Body, u64)> {
        self.bodies.iter().zip(self.ticks.iter().copied())
    }

    /// The body with this id.
    pub fn find(&self, id: u32) -> Option<&Body> {
        self.bodies.binary_search_by_key(&id, |body| body.id).ok().map(|at| &self.bodies[at])
    }

    /// How many groups it has: what it takes of memory.
    pub fn group_count(&self) -> usize {
        self.groups.len()
    }

    /// Groups of a body of this frame.
    pub fn groups(&self, body: &Body) -> &[GroupState] {
        &self.groups[body.start as usize..][..body.groups.into()]
    }

    /// Whether `body` of this frame is in `state`.
    pub(super) fn is_in(&self, body: &Body, state: &State) -> bool {
        state.find(body.id).is_some_and(|now| self.is_same(body, state, now))
    }

    /// Whether `body` of this frame and `now` of `state` are one; of another shape under the same id they are not.
    pub(super) fn is_same(&self, body: &Body, state: &State, now: &Body) -> bool {
        let shape = |body: &Body| (body.id, body.kind, body.parent, body.groups);
        let groups = || self.groups(body).iter().zip(state.groups(now));
        shape(body) == shape(now) && groups().all(|(had, now)| had.value.group == now.group)
    }

    /// Sum of hashes of all that the receiver has, folded to 16 bits: a desync is noticed at once.
    pub fn check(&self) -> u16 {
        let mut sum = 0u64;
        for (index, group) in self.groups.iter().enumerate() {
            let Quantised { largest, steps: [a, b, c], group } = group.value;
            let what = (index as u32) << 5 | (group as u32) << 2 | u32::from(largest);
            sum = sum.wrapping_add(mixed([a as u32, b as u32, c as u32, what]));
        }
        for (body, tick) in self.bodies() {
            let parent = body.parent.map_or(0, |parent| parent + 1);
            sum = sum.wrapping_add(mixed([body.id, tick as u32, u32::from(body.kind) << 24 | body.start, parent]));
        }
        (sum >> 48) as u16
    }
}

/// A hash of four numbers: its parts do not wait for each other.
#[inline]
fn mixed([a, b, c, d]: [u32; 4]) -> u64 {
    const FACTORS: [u64; 3] = [0x9E37_79B9_7F4A_7C15, 0xBF58_476D_1CE4_E5B9, 0x94D0_49BB_1331_11EB];
    let pair = |low: u32, high: u32| u64::from(high) << 32 | u64::from(low);
    let sum = pair(a, b).wrapping_mul(FACTORS[0]).wrapping_add(pair(c, d).wrapping_mul(FACTORS[1]));
    (sum ^ sum >> 32).wrapping_mul(FACTORS[2])
}
