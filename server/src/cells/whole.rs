//! When one stream of everything is coded beside the cells.
//!
//! Pure. Who can take all cells is better off with one stream: it has one header, nobody crosses over, and it may build on
//! snapshots that are not as old, since who takes it has no need of few and far between ones.

use std::collections::BTreeMap;

use pita_protocol::dof::Cadence;
use pita_protocol::message::CellId;

use super::stream::Stream;

/// A keyframe every second tick, built upon after a round trip of 100 ms. With so many of them an epoch is longer.
pub const CADENCE: Cadence =
    Cadence { keyframe_ticks_log2: 1, epoch_keyframes: 100, settled_ticks: 4, epoch_growth: 12 };
/// Ticks in which it is found out what cells cost before there is one, and again after there was.
const MEASURED_TICKS: u32 = 32;
/// Part of what a cell may take that all cells together have to be below for there to be one.
const FILLED_BY_NEW: f64 = 0.7;
/// And that it may take itself: one that is full carries some of its bodies at a time, which cells do better, near ones first.
const FILLED: f64 = 0.85;

/// For how long cells have been measured.
#[derive(Debug, Default)]
pub struct Whole {
    measured: u32,
}

impl Whole {
    /// Decides for a tick, by what `streams` took until then, where one may take `most`, bytes a tick. Answers what it is
    /// likely to take, rather more; `None` where there is to be none.
    pub fn decide(&mut self, streams: &BTreeMap<CellId, Stream>, most: f64) -> Option<f64> {
        let cost = |stream: &Stream| stream.rates().iter().sum::<f64>();
        if let Some(whole) = streams.get(&CellId::WHOLE) {
            self.measured = 0;
            return Some(cost(whole)).filter(|cost| *cost <= most * FILLED);
        }
        self.measured = (self.measured + 1).min(MEASURED_TICKS);
        let cells = streams.values().map(cost).sum::<f64>();
        let fits = streams.len() > 1 && cells <= most * FILLED_BY_NEW;
        Some(cells).filter(|_| fits && self.measured == MEASURED_TICKS)
    }
}
