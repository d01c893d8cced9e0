//! One world of bodies, by whichever stream they came: the session's own and those of cells.
//!
//! Pure. Of each body the newest state counts, and the own actor's is that of the own stream. A body belongs to one cell
//! at a time. Where a cell lacks one that it had, the cell says whether it went over to another: then it stays until that
//! one tells of it, carried on along Q', and does not flicker; else it is no more.

use std::{
    collections::{BTreeMap, VecDeque, btree_map::Entry},
    sync::{Arc, Weak},
};

use crate::interpolation::rates_between;

use pita_protocol::{
    dof::{BODIES_MAX, Frame, GROUPS_MAX, Slice},
    message::{CellId, Departure},
};

/// For so many ticks a body that went over is waited for.
const AWAITED_TICKS: u64 = 32;
/// Q' is what two states differ by that are no more ticks apart; else it is as the stream tracks it.
const APART_TICKS: u64 = 16;

/// Groups of frames that bodies may be of, 70 MB at most, and how many such frames: a full cell carries some of its bodies
/// at a time, so that each may have its newest state from another one. Of the largest world these are sixteen frames, of
/// one that fills a budget some seconds.
const HELD_GROUPS_MAX: usize = 16 * GROUPS_MAX;
const HELD_FRAMES_MAX: usize = 2048;

/// Where a state comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The session's own stream.
    Own,
    /// That of a cell.
    Cell(CellId),
}

/// A body.
#[derive(Debug)]
struct Known {
    source: Source,
    frame: Arc<Frame>,
    /// Of its state.
    tick: u64,
    /// Since when the cell lacks it that had it last.
    awaited_since: Option<u64>,
    /// Its state before that, and of which tick.
    before: Option<(Arc<Frame>, u64)>,
}

/// All bodies.
#[derive(Debug, Default)]
pub struct Bodies {
    bodies: BTreeMap<u32, Known>,
    newest: BTreeMap<Source, Arc<Frame>>,
    /// Frames that were taken, oldest first, as far as somebody has them still, each with its groups.
    held: VecDeque<(Source, Weak<Frame>, usize)>,
    held_groups: usize,
}

/// All bodies at a moment, in order of id, each by the place of its frame.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// Where states are.
    pub frames: Vec<Arc<Frame>>,
    /// In order of id.
    pub bodies: Vec<Place>,
}

/// Where the state of a body is.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Its id.
    pub id: u32,
    /// Index of the frame.
    frame: u32,
    /// Index of the frame that has its state before.
    before: Option<u32>,
}

impl Gathered {
    /// The slice of one of [`Gathered::bodies`]. Between two states of a cell Q is linear, so they say what Q' is; what the
    /// stream tracks from keyframe to keyframe lags behind who turns, and of a cell's newcomer it knows nothing.
    pub fn slice(&self, place: &Place, tick_hz: f64) -> Option<Slice> {
        let mut slice = self.frames[place.frame as usize].slice(place.id, tick_hz)?;
        let before = place.before.and_then(|before| self.frames[before as usize].slice(place.id, tick_hz));
        if let Some(rates) = before.and_then(|before| rates_between(&before, &slice, 1.0 / tick_hz)) {
            slice.v = rates;
        }
        Some(slice)
    }

    /// Index of `frame`. Neighbours in order of id are often of the same; there are few.
    fn place(&mut self, frame: &Arc<Frame>) -> u32 {
        let found = self.frames.iter().rposition(|known| Arc::ptr_eq(known, frame));
        found.unwrap_or_else(|| {
            self.frames.push(Arc::clone(frame));
            self.frames.len() - 1
        }) as u32
    }
}

impl Known {
    /// Is of `old` no more, but of `newest`; answers whether that has it.
    fn let_go(&mut self, id: u32, old: &Arc<Frame>, newest: Option<&Arc<Frame>>) -> bool {
        self.before.take_if(|(frame, _)| Arc::ptr_eq(frame, old));
        if !Arc::ptr_eq(&self.frame, old) {
            return true;
        }
        let Some((newest, tick)) = newest.and_then(|newest| Some((newest, newest.tick_of_body(id)?))) else {
            return false;
        };
        (self.frame, self.tick, self.before) = (Arc::clone(newest), tick, None);
        true
    }
}

impl Bodies {
    /// Takes what `source` says, if it is newer than what it said before. `departures` tell who went over to which cell,
    /// and `is_taken` which cells tell of theirs.
    pub fn take(
        &mut self,
        source: Source,
        frame: &Arc<Frame>,
        departures: &[Departure],
        is_taken: impl Fn(CellId) -> bool,
    ) {
        if self.newest.get(&source).is_some_and(|newest| newest.tick() >= frame.tick()) {
            return;
        }
        let before = self.newest.insert(source, Arc::clone(frame));
        for (body, tick) in frame.bodies() {
            self.take_body(source, frame, body.id, tick);
        }
        self.hold(source, frame);
        let Some(before) = before else { return };
        let to: BTreeMap<u32, CellId> =
            departures.iter().flat_map(|departure| departure.bodies.iter().map(|&id| (id, departure.to))).collect();
        for (body, _) in before.bodies().filter(|(body, _)| frame.find(body.id).is_none()) {
            let is_awaited = to.get(&body.id).is_some_and(|to| is_taken(*to));
            self.lack_body(source, body.id, is_awaited.then_some(frame.tick()));
        }
    }

    /// Forgets what only the cell knows: it is not taken any more.
    pub fn forget(&mut self, cell: CellId) {
        self.newest.remove(&Source::Cell(cell));
        self.bodies.retain(|_, known| known.source != Source::Cell(cell));
    }

    /// What only the cell knows another source is to tell of: as of `tick` it is not taken any more.
    pub fn await_others(&mut self, cell: CellId, tick: u64) {
        self.newest.remove(&Source::Cell(cell));
        let of_cell = self.bodies.values_mut().filter(|known| known.source == Source::Cell(cell));
        of_cell.for_each(|known| known.awaited_since = Some(tick));
    }

    /// All bodies as of `tick`, the present one.
    pub fn gather(&mut self, tick: u64) -> Gathered {
        self.bodies.retain(|_, known| known.awaited_since.is_none_or(|since| tick < since + AWAITED_TICKS));
        let mut gathered = Gathered::default();
        for (&id, known) in &self.bodies {
            let near = |(_, at): &&(Arc<Frame>, u64)| known.source != Source::Own && known.tick - at <= APART_TICKS;
            let before = known.before.as_ref().filter(near).map(|(frame, _)| gathered.place(frame));
            let frame = gathered.place(&known.frame);
            gathered.bodies.push(Place { id, frame, before });
        }
        gathered
    }

    fn take_body(&mut self, source: Source, frame: &Arc<Frame>, id: u32, tick: u64) {
        let mut known = Known { source, frame: Arc::clone(frame), tick, awaited_since: None, before: None };
        let count = self.bodies.len();
        match self.bodies.entry(id) {
            Entry::Vacant(entry) if count < BODIES_MAX => drop(entry.insert(known)),
            Entry::Vacant(_) => {}
            Entry::Occupied(mut entry) => {
                let had = entry.get();
                let is_owns = self.newest.get(&Source::Own).is_some_and(|own| own.find(id).is_some());
                if source == Source::Own || (!is_owns && tick > had.tick) {
                    known.before = match had.tick < tick {
                        true => Some((Arc::clone(&had.frame), had.tick)),
                        false => had.before.clone().filter(|(_, at)| *at < tick),
                    };
                    entry.insert(known);
                } else if !is_owns && source != had.source && had.awaited_since.is_some() {
                    // What rests is told of as of some ticks ago: its state is no newer, but somebody has it again.
                    let had = entry.get_mut();
                    (had.source, had.awaited_since) = (source, None);
                }
            }
        }
    }

    /// Bounds what the frames take that bodies are of: who is of one that is too old goes over to its source's newest, which
    /// has the state of the last keyframe.
    fn hold(&mut self, source: Source, frame: &Arc<Frame>) {
        self.held.push_back((source, Arc::downgrade(frame), frame.group_count()));
        self.held_groups += frame.group_count();
        let mut spared = 0;
        while self.held.len() > HELD_FRAMES_MAX || self.held_groups > HELD_GROUPS_MAX {
            let Some((source, old, groups)) = self.held.pop_front() else { return };
            let is_newest =
                self.newest.get(&source).is_some_and(|newest| std::ptr::eq(Arc::as_ptr(newest), old.as_ptr()));
            if is_newest && spared < self.newest.len() {
                // A quiet cell's; all others go before it.
                spared += 1;
                self.held.push_back((source, old, groups));
                continue;
            }
            self.held_groups -= groups;
            if is_newest {
                self.newest.remove(&source);
            }
            if let Some(old) = old.upgrade() {
                let newest = self.newest.get(&source);
                self.bodies.retain(|id, known| known.let_go(*id, &old, newest));
            }
        }
    }

    /// `source` has this body no more; since `awaited` another one should have it.
    fn lack_body(&mut self, source: Source, id: u32, awaited: Option<u64>) {
        if let Entry::Occupied(mut entry) = self.bodies.entry(id)
            && entry.get().source == source
        {
            match awaited {
                Some(_) => entry.get_mut().awaited_since = awaited,
                None => drop(entry.remove()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_protocol::dof::{Decoder, Encoder, Group, Precision, State, kind};

    const A: CellId = CellId { x: 0, z: 0 };
    const B: CellId = CellId { x: 1, z: 0 };

    /// A frame of `tick` with these bodies, at x = tick.
    fn frame(tick: u64, ids: &[u32]) -> Arc<Frame> {
        let mut state = State::new(Precision::default()).unwrap();
        for &id in ids {
            state.push(id, kind::PARTICLE, None, &[Group::Point], &[tick as f64, 0.0, 0.0]).unwrap();
        }
        Decoder::default().decode(tick, &Encoder::default().encode(tick, &state, &[])).unwrap()
    }

    /// Ids with the ticks of their states.
    fn seen(bodies: &mut Bodies, tick: u64) -> Vec<(u32, u64)> {
        let gathered = bodies.gather(tick);
        let slices = gathered.bodies.iter().filter_map(|body| gathered.slice(body, 30.0));
        slices.map(|slice| (slice.id, slice.tick)).collect()
    }

    fn take(bodies: &mut Bodies, source: Source, tick: u64, ids: &[u32], departed: &[u32]) {
        let departures = [Departure { to: B, bodies: departed.to_vec() }];
        bodies.take(source, &frame(tick, ids), &departures, |cell| cell == A || cell == B);
    }

    #[test]
    fn who_goes_over_to_another_stream_stays_until_that_tells_or_is_silent() {
        let mut bodies = Bodies::default();
        take(&mut bodies, Source::Cell(A), 5, &[1, 2], &[]);
        bodies.await_others(A, 6);
        assert_eq!(seen(&mut bodies, 8), [(1, 5), (2, 5)]);
        take(&mut bodies, Source::Cell(CellId::WHOLE), 9, &[1], &[]);
        assert_eq!(seen(&mut bodies, 9), [(1, 9), (2, 5)]);
        assert_eq!(seen(&mut bodies, 6 + AWAITED_TICKS), [(1, 9)]);
    }

    /// A cell at rest says so each 32 ticks; what is asked for meanwhile is older than what another stream has told.
    #[test]
    fn who_rests_does_not_vanish_because_the_stream_that_has_it_now_told_of_it_before() {
        let mut bodies = Bodies::default();
        take(&mut bodies, Source::Cell(CellId::WHOLE), 20, &[1, 2], &[]);
        bodies.await_others(CellId::WHOLE, 21);
        take(&mut bodies, Source::Cell(A), 18, &[1], &[]);
        assert_eq!(seen(&mut bodies, 21), [(1, 20), (2, 20)]);
        assert_eq!(seen(&mut bodies, 21 + AWAITED_TICKS), [(1, 20)]);
        take(&mut bodies, Source::Cell(A), 60, &[], &[]);
        assert_eq!(seen(&mut bodies, 60), []);
    }

    #[test]
    fn the_newest_state_counts_and_the_own_actor_is_of_the_own_stream() {
        let mut bodies = Bodies::default();
        take(&mut bodies, Source::Cell(A), 5, &[1, 2], &[]);
        take(&mut bodies, Source::Own, 4, &[1], &[]);
        take(&mut bodies, Source::Cell(A), 6, &[1, 2], &[]);
        take(&mut bodies, Source::Cell(A), 3, &[1, 2, 3], &[]);
        assert_eq!(seen(&mut bodies, 6), [(1, 4), (2, 6)]);
    }

    #[test]
    fn who_goes_over_does_not_flicker_whichever_cell_speaks_first() {
        for arrives_first in [false, true] {
            let mut bodies = Bodies::default();
            take(&mut bodies, Source::Cell(A), 5, &[2, 3], &[]);
            take(&mut bodies, Source::Cell(B), 5, &[], &[]);
            if arrives_first {
                take(&mut bodies, Source::Cell(B), 6, &[3], &[]);
            }
            take(&mut bodies, Source::Cell(A), 6, &[2], &[3]);
            assert_eq!(seen(&mut bodies, 6), [(2, 6), (3, if arrives_first { 6 } else { 5 })]);
            take(&mut bodies, Source::Cell(B), 7, &[3], &[]);
            take(&mut bodies, Source::Cell(A), 7, &[2], &[3]);
            assert_eq!(seen(&mut bodies, 7), [(2, 7), (3, 7)]);
            // An old word of the cell that it left brings it back neither here nor after its end.
            take(&mut bodies, Source::Cell(B), 8, &[], &[]);
            assert_eq!(seen(&mut bodies, 8), [(2, 7)]);
        }
    }

    #[test]
    fn velocities_are_what_states_differ_by_across_cells_too() {
        let mut bodies = Bodies::default();
        take(&mut bodies, Source::Cell(A), 5, &[3], &[]);
        let speed = |bodies: &mut Bodies, tick: u64| {
            let gathered = bodies.gather(tick);
            gathered.slice(&gathered.bodies[0], 30.0).unwrap().v[0]
        };
        assert_eq!(speed(&mut bodies, 5), 0.0, "one state says nothing");
        take(&mut bodies, Source::Cell(B), 7, &[3], &[]);
        assert!((speed(&mut bodies, 7) - 30.0).abs() < 0.1);
        take(&mut bodies, Source::Cell(B), 8, &[3], &[]);
        assert!((speed(&mut bodies, 8) - 30.0).abs() < 0.1);
        take(&mut bodies, Source::Cell(B), 9 + APART_TICKS, &[3], &[]);
        assert_eq!(speed(&mut bodies, 9 + APART_TICKS), 0.0, "too long ago");
    }

    /// A full cell of many bodies that says of one at a time something new.
    #[test]
    fn the_frames_that_bodies_are_of_are_bounded() {
        let (mut bodies, mut encoder, mut decoder) = (Bodies::default(), Encoder::default(), Decoder::default());
        let count = 20_000u64.min(BODIES_MAX as u64);
        let mut state = State::new(Precision::default()).unwrap();
        let layout = [Group::Scalar; 4];
        let mut chosen = vec![true; count as usize];
        for tick in 1..60u64 {
            state.clear();
            (0..count as u32).for_each(|id| state.push(id, kind::OWN, None, &layout, &[tick as f64; 4]).unwrap());
            let dof = encoder.encode(tick, &state, &chosen);
            encoder.acknowledge(tick, 0);
            chosen.fill(false);
            chosen[tick as usize] = true;
            bodies.take(Source::Cell(A), &decoder.decode(tick, &dof).unwrap(), &[], |_| true);
            let frames = bodies.gather(tick).frames;
            let groups: usize = frames.iter().map(|frame| frame.group_count()).sum();
            assert!(groups <= HELD_GROUPS_MAX, "{groups} groups of {} frames at {tick}", frames.len());
        }
        // Nobody is lost by that.
        assert_eq!(bodies.gather(60).bodies.len() as u64, count);
    }

    #[test]
    fn what_is_gone_goes_at_once_and_who_never_arrives_in_the_end() {
        let mut bodies = Bodies::default();
        take(&mut bodies, Source::Cell(A), 5, &[1, 2, 3], &[]);
        take(&mut bodies, Source::Cell(A), 6, &[1], &[3]);
        assert_eq!(seen(&mut bodies, 6), [(1, 6), (3, 5)]);
        assert_eq!(seen(&mut bodies, 6 + AWAITED_TICKS), [(1, 6)]);
        // To a cell that is not taken nobody goes over.
        let away = [Departure { to: CellId { x: 9, z: 9 }, bodies: vec![1] }];
        bodies.take(Source::Cell(A), &frame(40, &[]), &away, |cell| cell == A);
        assert_eq!(seen(&mut bodies, 40), []);
    }

    #[test]
    fn a_cell_that_is_not_taken_any_more_takes_its_bodies_with_it() {
        let mut bodies = Bodies::default();
        take(&mut bodies, Source::Own, 5, &[1], &[]);
        take(&mut bodies, Source::Cell(A), 5, &[1, 2], &[]);
        take(&mut bodies, Source::Cell(B), 5, &[3], &[]);
        bodies.forget(A);
        assert_eq!(seen(&mut bodies, 5), [(1, 5), (3, 5)]);
    }
}
