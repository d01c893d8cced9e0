//! The cells that a session may take: what arrives of them, and what is missing to read it.
//!
//! Pure, and bounded by what a session may take and what a world may hold.

use std::{collections::BTreeMap, sync::Arc};

use pita_protocol::{
    WireError, decode,
    dof::{CellDecoder, Frame, GROUPS_MAX, base_of},
    message::{CellGrant, CellId, CellSnapshot, Departure, Keyframes, KeyframesWanted},
};

/// Groups that the keyframes of all cells may have: a world's as often as each reader keeps them, and as many again for
/// bodies that two cells know. Beyond that no server is what it says it is.
const GROUPS_KEPT_MAX: usize = 2 * 8 * GROUPS_MAX;

/// A cell puts a keyframe at least every 32 ticks, the session's own snapshots come every tick: after so many of these
/// without one of those it is silent. Three in a row are rarely lost; less would take losses for silence.
const SILENT_SNAPSHOTS: u32 = 96;

/// Keyframes that come sooner than this, ticks, come because something happened, and so do snapshots in between.
const QUIET_TICKS: u64 = 32;
/// A layer above the first that none of so many keyframes had a snapshot of is silent. Who moves now and then is told of at
/// three ticks in a row, which a layer's turn is among often enough.
const SILENT_KEYFRAMES: u32 = 24;

/// A cell to be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wish {
    /// The cell.
    pub cell: CellId,
    /// How many of its layers, the first ones.
    pub layers: u8,
    /// How often it fell silent. A subscription of before another time is to be made anew.
    pub silences: u32,
}

/// What arrived.
#[derive(Debug)]
pub enum Taken {
    /// The cell as of a tick.
    Frame(CellId, Arc<Frame>, Vec<Departure>),
    /// Not to be read for want of a keyframe, which is [wanted](CellInbox::wanted) now.
    Unreadable,
    /// Of a cell that is not taken any more.
    Foreign,
}

/// What an answer to a question for keyframes came to.
#[derive(Debug, Default)]
pub struct Fetched {
    /// What cells are like then.
    pub frames: Vec<(CellId, Arc<Frame>)>,
    /// How many keyframes that were.
    pub keyframes: usize,
}

/// Receiving side of cells.
#[derive(Debug, Default)]
pub struct CellInbox {
    granted: Vec<CellGrant>,
    /// Tick at which that was said.
    granted_at: u64,
    cells: BTreeMap<CellId, Reading>,
    /// Cells of which a layer has fallen silent since that was asked.
    fallen_silent: u64,
}

#[derive(Debug)]
struct Reading {
    decoder: CellDecoder,
    /// Whether a keyframe is missing.
    is_lost: bool,
    /// Tick of the oldest that is, where that is known. Newer ones may be there: not each is coded against the one before.
    missing: Option<u64>,
    /// Own snapshots of the session since a keyframe was put.
    unheard: u32,
    /// How often that were too many.
    silences: u32,
    heard: Heard,
}

/// Which layers of a cell are heard of.
#[derive(Clone, Copy, Debug, Default)]
struct Heard {
    /// How many of them are taken.
    layers: u8,
    /// Tick of the newest keyframe.
    keyframe: u64,
    /// Keyframes that came because something happened.
    keyframes: u32,
    /// Of each layer above the first, whether there was a snapshot of it: by the trailing zeros of its age, which are as many
    /// for all of one layer.
    ages: u64,
}

impl Heard {
    /// From now on so many layers are taken.
    fn take(&mut self, layers: u8) {
        if self.layers != layers {
            *self = Self { layers, keyframe: self.keyframe, ..Self::default() };
        }
    }

    /// A snapshot of `tick` came. Answers whether it shows that a layer is silent.
    fn note(&mut self, tick: u64, keyframe_age: u8) -> bool {
        if keyframe_age > 0 {
            self.ages |= 1 << keyframe_age.trailing_zeros();
            return false;
        }
        let gap = tick.saturating_sub(self.keyframe);
        self.keyframe = self.keyframe.max(tick);
        self.keyframes += u32::from((1..QUIET_TICKS).contains(&gap));
        if self.keyframes < SILENT_KEYFRAMES {
            return false;
        }
        let is_silent = self.ages.count_ones() + 1 < self.layers.into();
        (self.keyframes, self.ages) = (0, 0);
        is_silent
    }
}

impl Default for Reading {
    /// Nothing is known of it.
    fn default() -> Self {
        Self {
            decoder: CellDecoder::default(),
            is_lost: true,
            missing: None,
            unheard: 0,
            silences: 0,
            heard: Heard::default(),
        }
    }
}

impl CellInbox {
    /// The session may take these cells, and no others, as of `tick`. Answers those that it took before and lost; `None`
    /// where that was known, or is old.
    pub fn grant(&mut self, tick: u64, granted: Vec<CellGrant>) -> Option<Vec<CellId>> {
        if tick <= self.granted_at || granted == self.granted {
            return None;
        }
        (self.granted, self.granted_at) = (granted, tick);
        let granted = &self.granted;
        let is_granted = |cell: &CellId| granted.binary_search_by_key(cell, |grant| grant.cell).is_ok();
        let lost = self.cells.extract_if(.., |cell, _| !is_granted(cell)).map(|(cell, _)| cell).collect();
        for grant in granted {
            self.cells.entry(grant.cell).or_default();
        }
        Some(lost)
    }

    /// Tick at which that was said last.
    pub fn granted_at(&self) -> u64 {
        self.granted_at
    }

    /// The cells that the session may take, in order.
    pub fn granted(&self) -> &[CellGrant] {
        &self.granted
    }

    /// The cells to be taken, in order, of which as many layers as `allowed` makes of those that are granted.
    pub fn wishes(&mut self, allowed: impl Fn(u8) -> u8) -> Vec<Wish> {
        let Self { granted, cells, .. } = self;
        let wish = |&CellGrant { cell, layers }: &CellGrant| {
            let (reading, layers) = (cells.entry(cell).or_default(), allowed(layers));
            reading.heard.take(layers);
            Wish { cell, layers, silences: reading.silences }
        };
        granted.iter().map(wish).collect()
    }

    /// A snapshot of the session's own arrived. Answers how many cells, or layers of cells, have fallen silent since the last
    /// one: nothing else notices a subscription that came to nothing somewhere on the way, and the cell would be a hole, or
    /// told of at a fraction of its rate, for ever.
    pub fn note_own_snapshot(&mut self) -> u64 {
        let mut fallen_silent = std::mem::take(&mut self.fallen_silent);
        for reading in self.cells.values_mut() {
            reading.unheard += 1;
            if reading.unheard >= SILENT_SNAPSHOTS {
                reading.fall_silent();
                fallen_silent += 1;
            }
        }
        fallen_silent
    }

    /// Whether the session takes `cell`.
    pub fn is_taken(&self, cell: CellId) -> bool {
        self.cells.contains_key(&cell)
    }

    /// Whether a keyframe of `cell` is missing.
    pub fn is_lost(&self, cell: CellId) -> bool {
        self.cells.get(&cell).is_some_and(|reading| reading.is_lost)
    }

    /// Keyframes that are missing.
    pub fn wanted(&self) -> Vec<KeyframesWanted> {
        let lost = self.cells.iter().filter(|(_, reading)| reading.is_lost);
        let wanted = |(&cell, reading): (&CellId, &Reading)| KeyframesWanted {
            cell,
            have: reading
                .missing
                .map_or(reading.decoder.keyframe(), |of| reading.decoder.keyframe_before(of))
                .unwrap_or(0),
        };
        lost.map(wanted).collect()
    }

    /// Takes a message of a cell, of no later tick than `latest`.
    ///
    /// # Errors
    /// [`WireError`] for what no server sends.
    pub fn take(&mut self, bytes: &[u8], latest: u64) -> Result<Taken, WireError> {
        let CellSnapshot { cell, tick, keyframe_age, departures, dof } = decode(bytes)?;
        let Some(reading) = self.cells.get_mut(&cell) else { return Ok(Taken::Foreign) };
        check_tick(tick, latest)?;
        if keyframe_age == 0 {
            reading.unheard = 0;
        }
        if reading.heard.note(tick, keyframe_age) {
            reading.fall_silent();
            self.fallen_silent += 1;
        }
        match reading.decode(tick, &dof, keyframe_age == 0) {
            Ok(frame) => {
                reading.need(tick.saturating_sub(keyframe_age.into()));
                self.check_room(cell)?;
                Ok(Taken::Frame(cell, frame, departures))
            }
            Err(WireError::NoBaseline) => Ok(Taken::Unreadable),
            Err(error) => Err(error),
        }
    }

    /// Takes an answer to what was asked for, of no later tick than `latest`.
    ///
    /// # Errors
    /// [`WireError`] for what no server sends.
    pub fn take_keyframes(&mut self, answer: &Keyframes, latest: u64) -> Result<Fetched, WireError> {
        let mut fetched = Fetched::default();
        for of_cell in &answer.cells {
            let Some(reading) = self.cells.get_mut(&of_cell.cell) else { continue };
            // Where there is nothing, or nothing newer, the stream itself says the rest.
            (reading.is_lost, reading.missing) = (false, None);
            let mut newest = None;
            for keyframe in &of_cell.keyframes {
                check_tick(keyframe.tick, latest)?;
                match reading.decode(keyframe.tick, &keyframe.dof, true) {
                    Ok(frame) => newest = Some(frame),
                    // What it was asked for with is forgotten meanwhile: all of them, then.
                    Err(WireError::NoBaseline) => {
                        (reading.decoder, reading.missing) = (CellDecoder::default(), None);
                        break;
                    }
                    Err(error) => return Err(error),
                }
                fetched.keyframes += 1;
            }
            fetched.frames.extend(newest.map(|frame| (of_cell.cell, frame)));
            self.check_room(of_cell.cell)?;
        }
        Ok(fetched)
    }

    /// Forgets what it has of `cell` where all cells together are more than a world holds.
    fn check_room(&mut self, cell: CellId) -> Result<(), WireError> {
        let groups = self.cells.values().map(|reading| reading.decoder.group_count()).sum::<usize>();
        if groups <= GROUPS_KEPT_MAX {
            return Ok(());
        }
        if let Some(reading) = self.cells.get_mut(&cell) {
            (reading.decoder, reading.is_lost) = (CellDecoder::default(), true);
        }
        Err(WireError::Content { field: "groups of all cells", allowed: "those of one world" })
    }
}

/// One tick that is far too late would make everything after it look old.
fn check_tick(tick: u64, latest: u64) -> Result<(), WireError> {
    let wrong = WireError::Content { field: "tick", allowed: "not ahead of the clock" };
    if tick <= latest { Ok(()) } else { Err(wrong) }
}

impl Reading {
    /// It is to be subscribed to anew, and what was missed asked for.
    fn fall_silent(&mut self) {
        (self.unheard, self.is_lost) = (0, true);
        self.silences = self.silences.wrapping_add(1);
    }

    fn decode(&mut self, tick: u64, dof: &[u8], is_keyframe: bool) -> Result<Arc<Frame>, WireError> {
        let decoded = self.decoder.decode(tick, dof, is_keyframe);
        self.is_lost |= decoded.is_err();
        match &decoded {
            Err(WireError::Desync) => (self.decoder, self.missing) = (CellDecoder::default(), None),
            Err(WireError::NoBaseline) => base_of(tick, dof).into_iter().for_each(|base| self.miss(base)),
            _ => {}
        }
        decoded
    }

    /// Snapshots to come will need the keyframe of `tick`.
    fn need(&mut self, tick: u64) {
        if !self.decoder.has(tick) {
            self.miss(tick);
        }
        self.missing.take_if(|missing| self.decoder.has(*missing));
        self.is_lost = self.missing.is_some();
    }

    /// The keyframe of `tick` is not there.
    fn miss(&mut self, tick: u64) {
        (self.is_lost, self.missing) = (true, Some(self.missing.map_or(tick, |missing| missing.min(tick))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_protocol::{
        dof::{BODIES_MAX, Cadence, CellEncoder, Due, Group, Precision, State, kind},
        encode,
        message::{CellKeyframes, Keyframe},
    };
    use proptest::prelude::*;

    const CELL: CellId = CellId { x: 2, z: -1 };

    fn granted(cells: &[CellId]) -> Vec<CellGrant> {
        cells.iter().map(|&cell| CellGrant { cell, layers: 4 }).collect()
    }

    fn state(x: f64) -> State {
        let mut state = State::new(Precision::default()).unwrap();
        state.push(1, kind::PARTICLE, None, &[Group::Point], &[x, 0.0, 0.0]).unwrap();
        state
    }

    fn next(encoder: &mut CellEncoder, tick: u64) -> Vec<u8> {
        let state = state(tick as f64);
        let due = encoder.due(tick, &state).expect("it moves");
        let coded = encoder.encode(tick, &state, due, &[]);
        let (departures, keyframe_age) = (Vec::new(), coded.keyframe_age);
        encode(&CellSnapshot { cell: CELL, tick, keyframe_age, departures, dof: coded.dof })
    }

    #[test]
    fn a_cell_without_a_keyframe_is_silent_and_one_at_rest_is_not() {
        let (mut encoder, mut inbox) = (CellEncoder::new(Cadence::default()), CellInbox::default());
        inbox.grant(1, granted(&[CELL]));
        let silences = |inbox: &mut CellInbox| inbox.wishes(|layers| layers)[0].silences;
        for tick in 1..=400 {
            if let Some(due) = encoder.due(tick, &state(1.0)) {
                let coded = encoder.encode(tick, &state(1.0), due, &[]);
                let (departures, keyframe_age) = (Vec::new(), coded.keyframe_age);
                let message = CellSnapshot { cell: CELL, tick, keyframe_age, departures, dof: coded.dof };
                inbox.take(&encode(&message), 999).unwrap();
            }
            assert_eq!((inbox.note_own_snapshot(), silences(&mut inbox)), (0, 0));
        }
        assert!(inbox.wanted().is_empty());
        let fallen: Vec<u64> = (0..SILENT_SNAPSHOTS).map(|_| inbox.note_own_snapshot()).collect();
        assert_eq!(fallen.iter().sum::<u64>(), 1);
        // It is to be subscribed to anew, once, and what was missed asked for.
        assert_eq!((silences(&mut inbox), inbox.wanted().len(), inbox.note_own_snapshot()), (1, 1, 0));
    }

    /// Of four layers each is cut off in turn, in a cell where somebody moves all the time, and in one where somebody does now
    /// and then.
    #[test]
    fn a_layer_that_is_silent_is_noticed_and_one_with_nothing_to_tell_is_not() {
        for (every, cut) in
            [(1, None), (1, Some(1)), (1, Some(2)), (1, Some(3)), (13, None), (13, Some(1)), (13, Some(3))]
        {
            let (mut encoder, mut inbox) = (CellEncoder::new(Cadence::default()), CellInbox::default());
            inbox.grant(1, granted(&[CELL]));
            assert_eq!(inbox.wishes(|layers| layers)[0].silences, 0);
            let mut fallen = 0;
            for tick in 1..=800u64 {
                let state = state((tick - tick % every) as f64);
                let Some(due) = encoder.due(tick, &state) else { continue };
                let coded = encoder.encode(tick, &state, due, &[]);
                if Some(coded.layer) != cut {
                    let (departures, keyframe_age) = (Vec::new(), coded.keyframe_age);
                    let message = CellSnapshot { cell: CELL, tick, keyframe_age, departures, dof: coded.dof };
                    inbox.take(&encode(&message), 999).unwrap();
                }
                fallen += inbox.note_own_snapshot();
            }
            let silences = inbox.wishes(|layers| layers)[0].silences;
            assert_eq!((fallen > 0, silences > 0), (cut.is_some(), cut.is_some()), "{every} {cut:?}: {fallen}");
            // Who takes fewer layers hears of fewer.
            inbox.wishes(|_| 1);
            assert_eq!(inbox.cells[&CELL].heard.layers, 1);
        }
    }

    #[test]
    fn a_newcomer_asks_and_reads_on_and_asks_again_where_a_keyframe_is_lost() {
        let (mut encoder, mut inbox) = (CellEncoder::new(Cadence::default()), CellInbox::default());
        (1..=20).for_each(|tick| drop(next(&mut encoder, tick)));
        assert!(matches!(inbox.take(&next(&mut encoder, 21), 99), Ok(Taken::Foreign)));
        assert_eq!(inbox.grant(21, granted(&[CELL])), Some(vec![]));
        assert_eq!(inbox.grant(21, granted(&[])), None, "as old as the last");
        let answer = |encoder: &CellEncoder, wanted: &[KeyframesWanted]| {
            let mut answer = Keyframes::default();
            wanted.iter().for_each(|&wanted| answer.push(wanted, encoder.epoch()));
            answer
        };
        assert!(matches!(inbox.take(&next(&mut encoder, 22), 99), Ok(Taken::Unreadable)));
        assert_eq!(inbox.wanted(), [KeyframesWanted { cell: CELL, have: 0 }]);
        let frames = inbox.take_keyframes(&answer(&encoder, &inbox.wanted()), 99).unwrap().frames;
        assert_eq!((frames[0].0, frames[0].1.tick()), (CELL, 17));
        assert!(inbox.wanted().is_empty());
        assert!(matches!(inbox.take(&next(&mut encoder, 23), 99), Ok(Taken::Frame(..))));
        assert!(inbox.wanted().is_empty());
        // That of tick 25 does not arrive. What comes soon after can be read without it, and tells of it.
        (24..=25).for_each(|tick| drop(next(&mut encoder, tick)));
        assert!(matches!(inbox.take(&next(&mut encoder, 26), 99), Ok(Taken::Frame(..))));
        assert_eq!(inbox.wanted(), [KeyframesWanted { cell: CELL, have: 17 }]);
        (27..=29).for_each(|tick| drop(next(&mut encoder, tick)));
        assert!(matches!(inbox.take(&next(&mut encoder, 30), 99), Ok(Taken::Unreadable)));
        assert_eq!(inbox.take_keyframes(&answer(&encoder, &inbox.wanted()), 99).unwrap().keyframes, 1);
        assert!(matches!(inbox.take(&next(&mut encoder, 31), 99), Ok(Taken::Frame(..))));
        assert_eq!(inbox.grant(32, Vec::new()), Some(vec![CELL]));
        assert!(matches!(inbox.take(&next(&mut encoder, 32), 99), Ok(Taken::Foreign)));
    }

    /// Keyframes every second tick that are used from the fourth on: two chains side by side, of which one goes on where the
    /// other is cut.
    #[test]
    fn a_keyframe_is_asked_for_though_newer_ones_are_there() {
        let cadence = Cadence { keyframe_ticks_log2: 1, settled_ticks: 4, ..Cadence::default() };
        let (mut encoder, mut inbox) = (CellEncoder::new(cadence), CellInbox::default());
        inbox.grant(1, granted(&[CELL]));
        let (mut asked, mut unreadable, mut answer_at) = (0, 0, u64::MAX);
        for tick in 1..=200 {
            let message = next(&mut encoder, tick);
            if tick == answer_at {
                let mut answer = Keyframes::default();
                inbox.wanted().iter().for_each(|&wanted| answer.push(wanted, encoder.epoch()));
                inbox.take_keyframes(&answer, 999).unwrap();
                answer_at = u64::MAX;
            }
            // Every seventh keyframe is lost, and now and then what tells of it, too.
            if tick % 14 != 1 && tick % 28 != 2 {
                unreadable += usize::from(matches!(inbox.take(&message, 999), Ok(Taken::Unreadable)));
            }
            if !inbox.wanted().is_empty() && answer_at == u64::MAX {
                (asked, answer_at) = (asked + 1, tick + 4);
            }
        }
        assert!((10..20).contains(&asked) && unreadable < 40, "{asked} questions, {unreadable} not to be read");
        assert!(inbox.take(&next(&mut encoder, 201), 999).is_ok());
    }

    #[test]
    fn a_tick_that_cannot_be_hides_nothing() {
        let (mut encoder, mut inbox) = (CellEncoder::new(Cadence::default()), CellInbox::default());
        inbox.grant(1, granted(&[CELL]));
        assert!(matches!(inbox.take(&next(&mut encoder, 10), 9), Err(WireError::Content { field: "tick", .. })));
        let keyframes = Keyframe { tick: 10, dof: encoder.epoch()[0].dof.clone() };
        let answer = Keyframes { cells: vec![CellKeyframes { cell: CELL, keyframes: vec![keyframes] }] };
        assert!(inbox.take_keyframes(&answer, 9).is_err());
        assert_eq!(inbox.take_keyframes(&answer, 10).unwrap().keyframes, 1);
    }

    #[test]
    fn cells_that_hold_more_than_a_world_are_refused() {
        let mut inbox = CellInbox::default();
        let cells: Vec<CellId> = (0..24).map(|x| CellId { x, z: 0 }).collect();
        inbox.grant(1, granted(&cells));
        let mut state = State::new(Precision::default()).unwrap();
        let layout = [Group::Scalar; 4];
        (0..BODIES_MAX as u32).for_each(|id| state.push(id, kind::OWN, None, &layout, &[0.0; 4]).unwrap());
        let dof = CellEncoder::new(Cadence::default()).encode(5, &state, Due::Epoch, &[]).dof;
        let mut refused = 0;
        for cell in cells {
            let departures = Vec::new();
            let taken =
                inbox.take(&encode(&CellSnapshot { cell, tick: 5, keyframe_age: 0, departures, dof: dof.clone() }), 9);
            refused += usize::from(taken.is_err());
        }
        let groups: usize = inbox.cells.values().map(|reading| reading.decoder.group_count()).sum();
        assert_eq!((groups, refused), (GROUPS_KEPT_MAX, 24 - 16));
    }

    proptest! {
        #[test]
        fn random_messages_never_panic(body: Vec<u8>, dof: Vec<u8>, tick: u64, keyframe_age: u8) {
            let mut inbox = CellInbox::default();
            inbox.grant(1, granted(&[CELL]));
            let head = [pita_protocol::PROTOCOL_VERSION as u8, <CellSnapshot as pita_protocol::Message>::KIND];
            let _ = inbox.take(&[&head[..], &body].concat(), u64::MAX);
            let message = CellSnapshot { cell: CELL, tick, keyframe_age, departures: Vec::new(), dof };
            let _ = inbox.take(&encode(&message), u64::MAX);
        }
    }
}
