//! The elastic beam: how far its tip sags.

use super::{Figure, Unit, Verdict, mean};
use crate::yardstick::scene::Beam;
use crate::yardstick::trace::Trace;

/// Mean height of the tip over the last 5 s, m, against its start. Beam theory says -0.147; linear tetrahedra are
/// stiffer.
const SAG: std::ops::Range<f64> = -0.18..-0.07;
/// Lowest the tip may swing, m.
const LOWEST: f64 = -0.45;
/// Records of the last 5 s.
const LAST: usize = 150;

pub fn judge(beam: &Beam, trace: &Trace) -> Verdict {
    let tip_from = beam.size.x - 0.01;
    let tip: Vec<usize> = (0..trace.bodies()).filter(|&node| trace.record(0)[node].position.x > tip_from).collect();
    let height = |record: usize| mean(tip.iter().map(|&node| trace.record(record)[node].position.y));
    let heights: Vec<f64> = (0..trace.records()).map(|record| height(record) - height(0)).collect();
    let sag = mean(heights.iter().rev().take(LAST).copied());
    // A height that is no number has to fail, and `min` would pass over it.
    let lowest = if sag.is_nan() { sag } else { heights.iter().copied().fold(0.0, f64::min) };
    Verdict::new(
        SAG.contains(&sag) && lowest > LOWEST,
        [
            Figure { label: "tip", key: "tip_mean_m", value: sag, unit: Unit::Millimetres },
            Figure { label: "lowest", key: "tip_lowest_m", value: lowest, unit: Unit::Millimetres },
        ],
    )
}
