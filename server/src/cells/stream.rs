//! The stream of one cell: what is in it, what of that is sent, and what it costs.

use std::collections::VecDeque;

use pita_protocol::dof::{BODIES_MAX, Body, CellEncoder, Due, Precision, State};
use pita_protocol::message::{CellId, CellSnapshot, Departure, Keyframe, LAYERS_MAX};

use super::Settings;
use super::selection::Selection;
use crate::crowd::{Crowd, Family};

/// For so many ticks a cell says who went over to another one: that none of these snapshots arrives is unlikely.
const TOLD_TICKS: u64 = 16;
/// For so many ticks an empty cell goes on saying so.
const EMPTY_TICKS: u64 = 64;
/// Weight of a tick in what a layer costs: two seconds at 30 Hz count.
const MEASURED: f64 = 1.0 / 64.0;
/// Share that a tick has in what it cost to begin anew, which comes in one piece and then not for a long time: as it is, it
/// would make a cell look dear that costs next to nothing, and who takes it would drop it each time.
const ANEW: f64 = 1.0 / 256.0;

/// A snapshot of a cell, ready to be sent.
#[derive(Debug)]
pub struct Published {
    /// The cell.
    pub cell: CellId,
    /// On which layer.
    pub layer: u8,
    /// The message.
    pub bytes: Vec<u8>,
    /// Whether it is a keyframe.
    pub is_keyframe: bool,
}

/// One cell.
#[derive(Debug)]
pub struct Stream {
    cell: CellId,
    state: State,
    crowd: Crowd,
    encoder: CellEncoder,
    selection: Selection,
    departures: VecDeque<(u64, Departure)>,
    /// Of each layer, bytes a tick.
    rates: [f64; LAYERS_MAX as usize],
    /// Bytes of keyframes that need nothing, as far as they are not in that yet.
    anew: f64,
    /// Last tick with a body in it.
    alive: u64,
}

impl Stream {
    /// An empty cell.
    pub fn new(cell: CellId, settings: &Settings, precision: Precision) -> Self {
        Self {
            cell,
            // Of a state that has this precision already.
            state: State::new(precision).expect("a precision that was checked"),
            crowd: Crowd::default(),
            encoder: CellEncoder::new(settings.cadence),
            selection: Selection::new(settings.bytes_per_s, settings.tick_hz),
            departures: VecDeque::new(),
            rates: [0.0; LAYERS_MAX as usize],
            anew: 0.0,
            alive: 0,
        }
    }

    /// The same, of which it is known what it is likely to take, bytes a tick.
    pub fn expected(mut self, rate: f64) -> Self {
        self.rates[0] = rate;
        self
    }

    /// A tick begins: nobody is in it yet.
    pub fn clear(&mut self) {
        self.state.clear();
        self.crowd.clear();
    }

    /// The next body of `world`, one of `family`, is in it.
    pub fn add(&mut self, world: &State, body: &Body, family: &Family) {
        // A body whose parent found no room has none either; a part of a world that fits does.
        if self.state.push_copy(world, body).is_ok() && !self.crowd.add_member(family.root) {
            self.crowd.add_root(*family);
        }
    }

    /// Those of `bodies` went over to another cell.
    pub fn left(&mut self, tick: u64, to: CellId, bodies: Vec<u32>) {
        self.departures.push_back((tick, Departure { to, bodies }));
    }

    /// Codes the snapshot of `tick`, where there is something to tell.
    pub fn publish(&mut self, tick: u64) -> Option<Published> {
        if !self.state.bodies().is_empty() {
            self.alive = tick;
        }
        self.forget_departures(tick);
        self.selection.fill();
        let due = self.encoder.due(tick, &self.state);
        let published = due.map(|due| self.code(tick, due));
        self.measure(due, published.as_ref());
        published
    }

    fn measure(&mut self, due: Option<Due>, published: Option<&Published>) {
        let bytes = published.map_or(0.0, |published| published.bytes.len() as f64);
        let mut of_layers = [0.0; LAYERS_MAX as usize];
        match due {
            Some(Due::Epoch) => self.anew += bytes,
            _ => of_layers[published.map_or(0, |published| published.layer.into())] = bytes,
        }
        let share = ANEW * self.anew;
        self.anew -= share;
        of_layers[0] += share;
        for (rate, bytes) in self.rates.iter_mut().zip(of_layers) {
            *rate += MEASURED * (bytes - *rate);
        }
    }

    fn code(&mut self, tick: u64, due: Due) -> Published {
        let chosen = self.selection.choose(self.encoder.needs(), &self.crowd);
        let coded = self.encoder.encode(tick, &self.state, due, chosen);
        let departures = self.departures.iter().map(|(_, departure)| departure.clone()).collect();
        let (layer, keyframe_age) = (coded.layer, coded.keyframe_age);
        let message = CellSnapshot { cell: self.cell, tick, keyframe_age, departures, dof: coded.dof };
        let bytes = pita_protocol::encode(&message);
        // To begin anew is no body's news: who takes the cell pays for it, and bodies go on moving meanwhile.
        if due != Due::Epoch {
            self.selection.sent(bytes.len(), self.encoder.spent());
        }
        Published { cell: self.cell, layer, bytes, is_keyframe: keyframe_age == 0 }
    }

    /// Whether it has been empty for so long that everybody knows.
    pub fn is_over(&self, tick: u64) -> bool {
        tick.saturating_sub(self.alive) > EMPTY_TICKS
    }

    /// What leads to its present keyframe.
    pub fn epoch(&self) -> &[Keyframe] {
        self.encoder.epoch()
    }

    /// Bytes that who comes anew is sent at once.
    pub fn catch_up(&self) -> usize {
        self.epoch().iter().map(|keyframe| keyframe.dof.len()).sum()
    }

    /// Bytes of its first keyframe, which come at once to all who take it when the next epoch begins.
    pub fn first(&self) -> usize {
        self.epoch().first().map_or(0, |keyframe| keyframe.dof.len())
    }

    /// Of each layer, bytes a tick.
    pub fn rates(&self) -> &[f64; LAYERS_MAX as usize] {
        &self.rates
    }

    /// What happened long ago, or would be more than a message holds, everybody knows or has to see for himself.
    fn forget_departures(&mut self, tick: u64) {
        let count =
            |departures: &VecDeque<(u64, Departure)>| departures.iter().map(|(_, d)| d.bodies.len()).sum::<usize>();
        while self.departures.front().is_some_and(|(at, _)| at + TOLD_TICKS < tick)
            || count(&self.departures) > BODIES_MAX
        {
            self.departures.pop_front();
        }
    }
}
