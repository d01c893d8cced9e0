//! Which cells a session may take, so that its byte budget holds.
//!
//! Pure. Near cells come before far ones and coarse layers before fine ones: a cell at twice the rate counts as one twice
//! as far away. A session that acknowledges late is sent less. Zenoh fans cells out to whoever subscribes: what is granted
//! is what a client that keeps to the protocol takes.

use std::collections::BTreeMap;

use pita_protocol::message::{CellGrant, CellId, GRANTS_MAX};

use super::{Division, Offer, Published, whole};

/// What a connection is never given less than, bytes/s: the own actor, and the nearest cell now and then.
pub const LEAST_BYTES_PER_S: u32 = 8_000;
/// Ticks of saving at most: what is left over by quiet ticks is there for cells to come.
const SAVED_TICKS_MAX: f64 = 8.0;
/// A snapshot that is acknowledged later than this, s, says that the connection takes less than the budget. A round trip of
/// 300 ms with jitter and loss stays below.
const LATE_S: f64 = 0.8;
/// Share of the budget that a connection is given back with every tick in which it keeps up, and that is left of it with
/// every tick in which it does not. To give back takes ten seconds: too fast, and the line is full again at once.
const GIVEN_BACK: f64 = 0.003;
const LEFT: f64 = 0.9;
/// Weight of a new observation of what the session's own snapshots take.
const LEARNT: f64 = 0.05;
/// Ticks from one choice to the next.
const CHOICE_TICKS: u64 = 4;
/// Part of the budget that new layers may fill; those that are there already may fill all of it. What cells cost goes up
/// and down, and who took a layer is not to drop it a moment later.
const FILLED_BY_NEW: f64 = 0.85;
/// Everything in one stream is taken where what comes of it at once fits into the budget of so long, s: in cells it comes
/// bit by bit.
const AT_ONCE_S: f64 = 1.0;
/// Occupied cells at most; the rest of the list is for empty ones beside them.
const OCCUPIED_MAX: usize = GRANTS_MAX / 2;

/// What one session may take.
#[derive(Debug)]
pub struct Grants {
    tick_hz: f64,
    bytes_per_tick: f64,
    least_per_tick: f64,
    /// Part of the budget that the connection takes, 0 to 1.
    share: f64,
    /// Bytes; negative while a new cell is being paid for.
    saved: f64,
    /// Of the session's own snapshots, bytes a tick.
    own: f64,
    /// In order of cell.
    granted: Vec<CellGrant>,
    /// Since which tick.
    since: Option<u64>,
    /// Newest tick that was acknowledged, or that of the first snapshot.
    acknowledged: Option<u64>,
}

impl Grants {
    /// For a session with a budget of `bytes_per_s`.
    pub fn new(bytes_per_s: u32, tick_hz: u16) -> Self {
        let tick_hz = f64::from(tick_hz.max(1));
        let bytes_per_tick = f64::from(bytes_per_s) / tick_hz;
        Self {
            tick_hz,
            bytes_per_tick,
            least_per_tick: f64::from(LEAST_BYTES_PER_S.min(bytes_per_s)) / tick_hz,
            share: 1.0,
            saved: bytes_per_tick * SAVED_TICKS_MAX,
            own: 0.0,
            granted: Vec::new(),
            since: None,
            acknowledged: None,
        }
    }

    /// The session acknowledged the snapshot of `tick`.
    pub fn acknowledge(&mut self, tick: u64) {
        self.acknowledged = self.acknowledged.max(Some(tick));
    }

    /// Those of `published` that the session may take.
    pub fn granted<'a>(&self, published: &'a [Published]) -> impl Iterator<Item = &'a Published> {
        published.iter().filter(|published| self.layers(published.cell) > published.layer)
    }

    /// A tick goes by, in which `published` was. Answers the bytes of it that the session was granted.
    pub fn fill(&mut self, tick: u64, published: &[Published]) -> usize {
        let acknowledged = *self.acknowledged.get_or_insert(tick);
        let is_late = tick.saturating_sub(acknowledged) as f64 > LATE_S * self.tick_hz;
        self.share = if is_late { self.share * LEFT } else { (self.share + GIVEN_BACK).min(1.0) };
        self.share = self.share.max(self.least_per_tick / self.bytes_per_tick.max(1.0));
        let fill = self.bytes_per_tick * self.share;
        let bytes = self.granted(published).map(|published| published.bytes.len()).sum();
        self.saved = (self.saved + fill - bytes as f64).min(fill * SAVED_TICKS_MAX);
        bytes
    }

    /// A snapshot of its own of so many bytes was sent.
    pub fn spend(&mut self, bytes: usize) {
        self.saved -= bytes as f64;
        self.own += LEARNT * (bytes as f64 - self.own);
    }

    /// Chooses anew, every few ticks: of what is on `offer`, in order of cell, for who looks `from` there. Who has no place
    /// sees all alike.
    pub fn choose(&mut self, tick: u64, offers: &[Offer], layers: u8, from: Option<[f32; 3]>, division: &Division) {
        if self.since.is_some() && !tick.is_multiple_of(CHOICE_TICKS) {
            return;
        }
        let (whole, cells) = match offers.iter().position(|offer| offer.cell == CellId::WHOLE) {
            Some(at) => (Some(&offers[at]), [&offers[..at], &offers[at + 1..]].concat()),
            None => (None, offers.to_vec()),
        };
        let granted = match whole.map_or(0, |whole| self.afford(whole)) {
            layers @ 1.. => vec![CellGrant { cell: CellId::WHOLE, layers }],
            0 => with_neighbours(&self.take(&cells, layers, from, division), &cells),
        };
        if self.since.is_none() || granted != self.granted {
            self.granted = granted;
            self.since = Some(tick);
        }
    }

    /// What the session has to be told, unless it is known to know: it acknowledged the snapshot of `acknowledged`.
    pub fn untold(&self, acknowledged: Option<u64>) -> Option<&[CellGrant]> {
        let since = self.since?;
        acknowledged.is_none_or(|tick| tick < since).then_some(&self.granted)
    }

    fn layers(&self, cell: CellId) -> u8 {
        self.granted.binary_search_by_key(&cell, |grant| grant.cell).map_or(0, |at| self.granted[at].layers)
    }

    /// How many layers of everything in one stream fit into the budget; pays for it where it is new, which it is only to a
    /// connection that keeps up, and as a whole.
    fn afford(&mut self, whole: &Offer) -> u8 {
        let (had, most) = (self.layers(CellId::WHOLE), self.bytes_per_tick * self.share - self.own);
        let at_once = self.bytes_per_tick * self.tick_hz * AT_ONCE_S;
        if had == 0 {
            let fits = whole.rates.iter().sum::<f64>() <= most * FILLED_BY_NEW && (whole.catch_up as f64) <= at_once;
            let is_paid = fits && self.share >= 1.0 && self.saved > 0.0;
            self.saved -= if is_paid { whole.catch_up as f64 } else { 0.0 };
            return if is_paid { whole::CADENCE.layers() } else { 0 };
        }
        if whole.first as f64 > at_once {
            return 0;
        }
        let mut sum = 0.0;
        let fits = |&layer: &u8| {
            sum += whole.rates[usize::from(layer)];
            sum <= if had > layer { most } else { most * FILLED_BY_NEW }
        };
        (0..whole::CADENCE.layers()).take_while(fits).count() as u8
    }

    /// Layers of occupied cells, as far as the budget goes.
    fn take(
        &mut self,
        offers: &[Offer],
        layers: u8,
        from: Option<[f32; 3]>,
        division: &Division,
    ) -> BTreeMap<CellId, u8> {
        let distance = |offer: &Offer| division.distance(from, offer.cell) + 0.5 * division.side_m();
        let wish = |(at, offer): (usize, &Offer)| {
            let near = distance(offer);
            (0..layers).map(move |layer| (near * f32::from(1u16 << layer), layer, at))
        };
        let mut wishes: Vec<_> = offers.iter().enumerate().flat_map(wish).collect();
        wishes.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let most = self.bytes_per_tick * self.share - self.own;
        let (mut sum, mut taken) = (0.0, BTreeMap::new());
        for (_, layer, at) in wishes {
            let offer = &offers[at];
            let had = self.layers(offer.cell);
            if taken.get(&offer.cell).copied().unwrap_or(0) != layer {
                // One below it did not fit.
                continue;
            }
            let is_first = taken.is_empty();
            if layer == 0 && !is_first && (taken.len() == OCCUPIED_MAX || (had == 0 && self.saved <= 0.0)) {
                continue;
            }
            let cost = offer.rates[usize::from(layer)];
            let limit = if had > layer { most } else { most * FILLED_BY_NEW };
            if sum + cost <= limit || is_first {
                sum += cost;
                taken.insert(offer.cell, layer + 1);
                if had == 0 && layer == 0 {
                    self.saved -= offer.catch_up as f64;
                }
            }
        }
        taken
    }
}

/// With the empty cells beside those that are `taken`: who comes in there is seen at once.
fn with_neighbours(taken: &BTreeMap<CellId, u8>, offers: &[Offer]) -> Vec<CellGrant> {
    let mut all = taken.clone();
    for (cell, &layers) in taken.iter().filter(|(cell, _)| **cell != CellId::EVERYWHERE) {
        // Those with the lowest number are no squares.
        let beside = |x: i16| [x.saturating_sub(1).max(-i16::MAX), x, x.saturating_add(1)];
        for (x, z) in beside(cell.x).into_iter().flat_map(|x| beside(cell.z).map(|z| (x, z))) {
            let cell = CellId { x, z };
            let is_empty = offers.binary_search_by_key(&cell, |offer| offer.cell).is_err();
            if is_empty && (all.len() < GRANTS_MAX || all.contains_key(&cell)) {
                let known = all.entry(cell).or_insert(0);
                *known = layers.max(*known);
            }
        }
    }
    all.into_iter().map(|(cell, layers)| CellGrant { cell, layers }).collect()
}
