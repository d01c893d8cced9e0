//! Interest cells: the world in squares, each coded once a tick for everybody who looks there.
//!
//! Pure. Owns the division of the world, the streams of all cells, the grants, which say what cells a session may take
//! within its byte budget, and what it is sent beside them. Knows no network; `publish` puts what comes out.

mod division;
mod grants;
mod own_stream;
mod selection;
mod stream;
mod whole;

use std::collections::BTreeMap;

use pita_protocol::dof::{Cadence, State};
use pita_protocol::message::{CellId, Keyframe, LAYERS_MAX};

use crate::crowd::Crowd;
use division::Division;
use grants::Grants;
pub use grants::LEAST_BYTES_PER_S;
pub use own_stream::{Head, OwnStream};
pub use stream::Published;
use stream::Stream;
use whole::Whole;

/// Most cells, 50 kB each and more; whoever is outside them is in the cell of what has no place, which all take.
const CELLS_MAX: usize = 1024;

/// How the world is divided and sent.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Side of a cell, m.
    pub side_m: f32,
    /// When keyframes are.
    pub cadence: Cadence,
    /// Most that one cell takes, bytes/s; a cell with more to tell carries some of its bodies at a time.
    pub bytes_per_s: u32,
    /// Ticks a second.
    pub tick_hz: u16,
}

/// What a cell costs who takes it.
#[derive(Clone, Copy, Debug)]
struct Offer {
    /// The cell.
    pub cell: CellId,
    /// Of each layer, bytes a tick.
    pub rates: [f64; LAYERS_MAX as usize],
    /// Bytes that are sent at once to who takes it anew.
    pub catch_up: usize,
    /// And to everybody when it begins anew, about.
    pub first: usize,
}

/// All cells.
#[derive(Debug)]
pub struct Cells {
    settings: Settings,
    division: Division,
    streams: BTreeMap<CellId, Stream>,
    published: Vec<Published>,
    offers: Vec<Offer>,
    over: Vec<CellId>,
    whole: Whole,
}

impl Cells {
    /// No cells yet.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            division: Division::new(settings.side_m),
            streams: BTreeMap::new(),
            published: Vec::new(),
            offers: Vec::new(),
            over: Vec::new(),
            whole: Whole::default(),
        }
    }

    /// Divides the world of `tick` and codes it, cell by cell.
    pub fn tick(&mut self, tick: u64, world: &State, crowd: &Crowd) {
        let Self { settings, division, streams, published, offers, over, whole } = self;
        let (families, of_bodies) = (crowd.families(), crowd.of_bodies());
        let expected = whole.decide(streams, f64::from(settings.bytes_per_s) / f64::from(settings.tick_hz));
        let had = streams.remove(&CellId::WHOLE);
        over.clear();
        over.extend(had.as_ref().filter(|_| expected.is_none()).map(|_| CellId::WHOLE));
        let mut all = expected.map(|expected| {
            let settings = Settings { cadence: whole::CADENCE, ..*settings };
            had.unwrap_or_else(|| Stream::new(CellId::WHOLE, &settings, *world.precision()).expected(expected))
        });
        streams.values_mut().chain(&mut all).for_each(Stream::clear);
        // In order of family.
        let mut moved: Vec<(usize, CellId, Vec<u32>)> = Vec::new();
        division.follow(families, |family, from| moved.push((family, from, Vec::new())));
        for (body, &family) in world.bodies().iter().zip(of_bodies) {
            let mut cell = division.cell_of(family as usize);
            if streams.len() >= CELLS_MAX && !streams.contains_key(&cell) {
                cell = CellId::EVERYWHERE;
            }
            if let Ok(at) = moved.binary_search_by_key(&(family as usize), |(family, ..)| *family) {
                moved[at].2.push(body.id);
            }
            let stream = streams.entry(cell).or_insert_with(|| Stream::new(cell, settings, *world.precision()));
            stream.add(world, body, &families[family as usize]);
            if let Some(all) = &mut all {
                all.add(world, body, &families[family as usize]);
            }
        }
        for (family, from, bodies) in moved {
            if let Some(stream) = streams.get_mut(&from) {
                stream.left(tick, division.cell_of(family), bodies);
            }
        }
        streams.extend(all.map(|all| (CellId::WHOLE, all)));
        published.clear();
        published.extend(streams.values_mut().filter_map(|stream| stream.publish(tick)));
        over.extend(streams.extract_if(.., |_, stream| stream.is_over(tick)).map(|(cell, _)| cell));
        offers.clear();
        let offer = |(&cell, stream): (&CellId, &Stream)| {
            let (rates, catch_up, first) = (*stream.rates(), stream.catch_up(), stream.first());
            Offer { cell, rates, catch_up, first }
        };
        offers.extend(streams.iter().map(offer));
    }

    /// Snapshots of the last tick, in order of cell.
    pub fn published(&self) -> &[Published] {
        &self.published
    }

    /// Cells that the last tick did away with, because nothing is in them any more.
    pub fn over(&self) -> &[CellId] {
        &self.over
    }

    /// What there is to be taken, in order of cell: [`CellId::WHOLE`] and nothing else is everything.
    fn offers(&self) -> &[Offer] {
        &self.offers
    }

    /// The squares.
    fn division(&self) -> &Division {
        &self.division
    }

    /// How many layers a cell has.
    fn layers(&self) -> u8 {
        self.settings.cadence.layers()
    }

    /// What leads to the present keyframe of a cell.
    pub fn epoch(&self, cell: CellId) -> &[Keyframe] {
        self.streams.get(&cell).map_or(&[], Stream::epoch)
    }

    /// Forgets everything: nobody looks.
    pub fn clear(&mut self) {
        self.over.clear();
        self.over.extend(self.streams.keys());
        self.streams.clear();
        self.published.clear();
        self.offers.clear();
        self.whole = Whole::default();
    }
}

#[cfg(test)]
mod tests;
