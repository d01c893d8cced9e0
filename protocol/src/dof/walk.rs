//! One snapshot's coded part: the walk over all bodies that both sides make alike.

use super::ans::Coder;
use super::budget::Spent;
use super::frame::{BODIES_MAX, BODY_GROUPS_MAX, Body, Frame, GROUPS_MAX, State};
use super::predict::{Ahead, GroupState};
use super::quantise::{Fineness, Group, Quantised};
use super::residual::{Models, Next};
use crate::{WireError, codec::require};

/// Uses of whole numbers.
mod number {
    pub const REMOVED: usize = 0;
    pub const ADDED: usize = 1;
    pub const GAP: usize = 2;
    pub const PARENT: usize = 3;
    /// And the following: first values by group.
    pub const FIRST: usize = 4;
}

/// Uses of flags.
mod flag {
    pub const CHANGED: usize = 0;
    pub const ATTACHED: usize = 1;
    pub const SAME_LAYOUT: usize = 2;
    pub const SENT: usize = 3;
}

/// What an encoder has to say.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// All bodies that the stream is to have.
    pub state: &'a State,
    /// Of each body of the state, whether this snapshot carries it; empty for all.
    pub chosen: &'a [bool],
}

impl Source<'_> {
    fn carries(&self, index: usize) -> bool {
        self.chosen.is_empty() || self.chosen[index]
    }
}

/// The parts of a walk that do not change.
pub struct Walk<'a, C> {
    /// Reads or writes.
    pub coder: &'a mut C,
    /// What the snapshot is coded against.
    pub base: &'a Frame,
    /// Whether bodies may be left out.
    pub partial: bool,
    /// What is coded; `None` when decoding.
    pub source: Option<Source<'a>>,
    /// What an encoder's bodies took.
    pub spent: &'a mut Spent,
}

impl<'a, C: Coder> Walk<'a, C> {
    /// Codes a snapshot into `next`, a copy of the base but for its tick.
    ///
    /// # Errors
    /// [`WireError`] for data that no encoder writes.
    pub fn run(mut self, next: &mut Frame) -> Result<(), WireError> {
        let changed = self.source().is_some_and(|source| is_changed(self.base, &source));
        if next.models.flag(self.coder, flag::CHANGED, changed) {
            let removed = self.removals(&mut next.models)?;
            let added = self.additions(&mut next.models, removed.len())?;
            self.replace(next, removed, added)?;
        }
        self.updates(next)
    }

    /// What an encoder has to say; a decoder is compiled without it.
    #[inline]
    fn source(&self) -> Option<Source<'a>> {
        self.source.filter(|_| C::WRITES)
    }

    /// Takes bodies out of `next`, and puts others in.
    fn replace(&mut self, next: &mut Frame, removed: Vec<usize>, added: Vec<Added>) -> Result<(), WireError> {
        let (mut removed, mut added) = (removed.into_iter().peekable(), added.into_iter().peekable());
        next.clear();
        for (index, body) in self.base.bodies.iter().enumerate() {
            if removed.next_if_eq(&index).is_some() {
                continue;
            }
            while let Some(new) = added.next_if(|new| new.id < body.id) {
                self.first(next, new)?;
            }
            require(added.peek().is_none_or(|new| new.id != body.id), "added body", "not there yet")?;
            next.bodies.push(Body { start: next.groups.len() as u32, ..*body });
            next.ticks.push(self.base.ticks[index]);
            next.groups.extend_from_slice(self.base.groups(body));
        }
        added.try_for_each(|new| self.first(next, new))
    }

    /// Indices in the base of those that are gone.
    fn removals(&mut self, models: &mut Models) -> Result<Vec<usize>, WireError> {
        let gone: Vec<_> = match self.source() {
            Some(Source { state, .. }) => {
                let is_gone = |&i: &usize| !self.base.is_in(&self.base.bodies[i], state);
                (0..self.base.bodies.len()).filter(is_gone).collect()
            }
            None => Vec::new(),
        };
        let count = models.number(self.coder, number::REMOVED, gone.len() as u32) as usize;
        require(count <= self.base.bodies.len(), "removed bodies", "at most those that are there")?;
        let mut removed = Vec::with_capacity(count);
        let mut after = 0;
        for k in 0..count {
            let gap = gone.get(k).map_or(0, |&index| index - after);
            after += models.number(self.coder, number::GAP, gap as u32) as usize;
            require(after < self.base.bodies.len(), "removed body", "one that is there")?;
            removed.push(after);
            after += 1;
        }
        Ok(removed)
    }

    /// Those that are new, without groups' values.
    fn additions(&mut self, models: &mut Models, removed: usize) -> Result<Vec<Added>, WireError> {
        let new: Vec<_> = self.source().map(|source| fresh(self.base, &source).collect()).unwrap_or_default();
        let count = models.number(self.coder, number::ADDED, new.len() as u32) as usize;
        require(self.base.bodies.len() - removed + count <= BODIES_MAX, "bodies", "at most 16384")?;
        let mut added: Vec<Added> = Vec::new();
        let (mut after, mut groups) = (0u32, 0);
        for k in 0..count {
            let (body, layout) = new.get(k).map_or((None, Vec::new()), |&body| {
                let groups = self.source().map(|s| s.state.groups(body)).unwrap_or_default();
                (Some(body), groups.iter().map(|g| g.group).collect())
            });
            let gap = body.map_or(0, |body| body.id - after);
            let id = after.checked_add(models.number(self.coder, number::GAP, gap)).ok_or(WireError::Malformed)?;
            after = id.checked_add(1).ok_or(WireError::Malformed)?;
            let same = added
                .last()
                .is_some_and(|last| body.is_some_and(|body| last.kind == body.kind && last.layout == layout));
            let parent = self.parent(models, id, body)?;
            let same = models.flag(self.coder, flag::SAME_LAYOUT, same);
            let (kind, layout) = match added.last() {
                Some(last) if same => (last.kind, last.layout.clone()),
                None if same => return Err(WireError::Malformed),
                _ => self.layout(body.map_or(0, |body| body.kind), &layout)?,
            };
            // A bit says that a body has as many groups as the one before.
            groups += layout.len();
            require(groups <= GROUPS_MAX, "groups of new bodies", "at most 65536")?;
            added.push(Added { id, kind, parent, layout });
        }
        Ok(added)
    }

    fn parent(&mut self, models: &mut Models, id: u32, body: Option<&Body>) -> Result<Option<u32>, WireError> {
        let parent = body.and_then(|body| body.parent);
        if !models.flag(self.coder, flag::ATTACHED, parent.is_some()) {
            return Ok(None);
        }
        let back = parent.map_or(0, |parent| id - parent - 1);
        let back = models.number(self.coder, number::PARENT, back);
        Ok(Some(id.checked_sub(back).and_then(|id| id.checked_sub(1)).ok_or(WireError::Malformed)?))
    }

    fn layout(&mut self, kind: u8, groups: &[Group]) -> Result<(u8, Vec<Group>), WireError> {
        let kind = self.coder.raw(kind.into(), 8) as u8;
        let count = self.coder.raw(groups.len() as u32, 16) as usize;
        require((1..=BODY_GROUPS_MAX).contains(&count), "groups of a body", "1 to 4096")?;
        let code = |i: usize| groups.get(i).map_or(0, |&group| group as u32);
        Ok((kind, (0..count).map(|i| self.group(code(i))).collect::<Result<_, _>>()?))
    }

    fn group(&mut self, code: u32) -> Result<Group, WireError> {
        let group = Group::ALL.get(self.coder.raw(code, 3) as usize).copied();
        group.ok_or(WireError::Content { field: "group", allowed: "0 to 4" })
    }

    /// A body that the receiver does not have yet.
    fn first(&mut self, next: &mut Frame, added: Added) -> Result<(), WireError> {
        require(next.groups.len() + added.layout.len() <= GROUPS_MAX, "groups", "at most 65536")?;
        let source = self.source().and_then(|s| Some(s.state.groups(s.state.find(added.id)?)));
        let (start, written, fineness) = (next.groups.len(), self.coder.written(), next.precision.fineness());
        // Points are likely to be near the last point of this body, the first one near the first of the body before.
        let mut before = next.bodies.last().map(|body| next.groups[body.start as usize].value);
        for (i, &group) in added.layout.iter().enumerate() {
            let value = source.map(|groups| groups[i]);
            let near = if group == Group::Point { before } else { None };
            let near = near.filter(|near| near.group == Group::Point).map_or([0; 3], |near| near.steps);
            let value = first_value(self.coder, &mut next.models, group, near, value, &fineness)?;
            next.groups.push(GroupState::first(value));
            before = if group == Group::Point { Some(value) } else { before };
        }
        self.spent.first.add(added.layout.len(), self.coder.written() - written);
        let groups = added.layout.len() as u16;
        next.bodies.push(Body { id: added.id, kind: added.kind, parent: added.parent, start: start as u32, groups });
        next.ticks.push(next.tick);
        Ok(())
    }

    /// All bodies of the base that stay; those that are of this tick are new.
    fn updates(&mut self, next: &mut Frame) -> Result<(), WireError> {
        let Frame { tick, precision, bodies, ticks, groups, models } = next;
        let fineness = precision.fineness();
        let (mut neighbour, mut cursor) = (0, 0);
        // Nearly all were told at the same tick.
        let (mut last, mut ahead) = (*tick, Ahead::of(0));
        for (body, told) in bodies.iter().zip(ticks).filter(|(_, told)| **told != *tick) {
            let source = self.source_of(body.id, &mut cursor);
            if self.partial && !models.flag(self.coder, flag::SENT, source.is_some_and(|(sent, _)| sent)) {
                continue;
            }
            if *told != last {
                (last, ahead) = (*told, Ahead::of(*tick - *told));
            }
            *told = *tick;
            let states = &mut groups[body.start as usize..][..body.groups.into()];
            let now = source.map(|(_, now)| now);
            neighbour = self.body(models, states, ahead, neighbour, now, &fineness)?;
        }
        Ok(())
    }

    /// What an encoder has to say of a body of the base, and whether it is to say it; `cursor` is where it has the one
    /// before.
    #[inline]
    fn source_of(&self, id: u32, cursor: &mut usize) -> Option<(bool, &'a [Quantised])> {
        let source = self.source()?;
        let bodies = source.state.bodies();
        *cursor += bodies[*cursor..].iter().take_while(|known| known.id < id).count();
        let found = bodies.get(*cursor).filter(|found| found.id == id)?;
        Some((source.carries(*cursor), source.state.groups(found)))
    }

    /// A body; `neighbour` is by how much the one before was off. Answers by how much this one is.
    #[inline]
    fn body(
        &mut self,
        models: &mut Models,
        states: &mut [GroupState],
        ahead: Ahead,
        neighbour: u32,
        now: Option<&[Quantised]>,
        fineness: &Fineness,
    ) -> Result<u32, WireError> {
        if states.iter().all(GroupState::is_calm) {
            let stirs = now.is_some_and(|now| states.iter().zip(now).any(|(state, now)| state.value != *now));
            if !models.stirs(self.coder, neighbour, stirs) {
                return Ok(0);
            }
        }
        let (mut moved, mut changed, written) = (0, 0, self.coder.written());
        let mut next = Next { ahead, near: 0, value: None, fineness };
        for (i, state) in states.iter_mut().enumerate() {
            let old = state.value;
            next.value = now.map(|now| &now[i]);
            let size = models.group(self.coder, state, &next)?;
            next.near = 1 + usize::from(size > 0);
            moved += size;
            changed += usize::from(C::WRITES && state.value != old);
        }
        if C::WRITES {
            self.spent.updates.add(changed, self.coder.written() - written);
        }
        Ok(moved)
    }
}

/// A body that is new.
struct Added {
    id: u32,
    kind: u8,
    parent: Option<u32>,
    layout: Vec<Group>,
}

/// Bodies of the source that the receiver does not have and gets.
fn fresh<'a>(base: &'a Frame, source: &Source<'a>) -> impl Iterator<Item = &'a Body> {
    let source = *source;
    let bodies = source.state.bodies().iter().enumerate();
    let is_new = |body: &Body| base.find(body.id).is_none_or(|old| !base.is_in(old, source.state));
    bodies.filter(move |(index, body)| source.carries(*index) && is_new(body)).map(|(_, body)| body)
}

fn is_changed(base: &Frame, source: &Source) -> bool {
    let (had, now) = (&base.bodies, source.state.bodies());
    if had.len() == now.len() && had.iter().zip(now).all(|(had, now)| base.is_same(had, source.state, now)) {
        return false;
    }
    had.iter().any(|body| !base.is_in(body, source.state)) || fresh(base, source).next().is_some()
}

fn first_value(
    coder: &mut impl Coder,
    models: &mut Models,
    group: Group,
    near: [i32; 3],
    value: Option<Quantised>,
    fineness: &Fineness,
) -> Result<Quantised, WireError> {
    let value = value.unwrap_or(Quantised { group, largest: 0, steps: near });
    let mut read = Quantised { group, largest: 0, steps: [0; 3] };
    if group == Group::Rotation {
        read.largest = coder.raw(value.largest.into(), 2) as u8;
    }
    for (i, near) in near.into_iter().enumerate().take(group.components()) {
        let step = models.signed(coder, number::FIRST + group as usize, value.steps[i] - near);
        read.steps[i] = near.saturating_add(step);
    }
    read.check(fineness)?;
    Ok(read)
}
