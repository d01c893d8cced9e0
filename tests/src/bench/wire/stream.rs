//! One stream over a modelled link: what it costs, how long it takes, how far off it is.

use std::collections::VecDeque;

use pita_protocol::dof::{Decoder, Encoder, Frame, State};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::super::EntryError;
use super::stopwatch::cpu_us;
use super::trace::{Placed, Trace};

/// A link.
#[derive(Clone, Copy)]
pub struct Link {
    /// From a snapshot to its acknowledgement, ms: whole ticks of it are how old a baseline is at least.
    pub round_trip_ms: u32,
    /// Share of snapshots, and of acknowledgements, that are lost.
    pub loss: f64,
}

/// What a stream came to.
#[derive(Default)]
pub struct Cost {
    /// Bytes of all snapshots, from the stream's own header on.
    pub bytes: usize,
    /// Snapshots.
    pub snapshots: usize,
    /// Of encoding a snapshot, µs, in order of time.
    pub encode_us: Vec<f64>,
    /// Of decoding one.
    pub decode_us: Vec<f64>,
    /// Worst of all bodies at rest, mm and degrees.
    pub rest: (f64, f64),
    /// Worst of all bodies in motion, mm and degrees.
    pub motion: (f64, f64),
}

impl Cost {
    /// Bytes of a snapshot in the mean.
    pub fn mean_bytes(&self) -> f64 {
        self.bytes as f64 / self.snapshots.max(1) as f64
    }
}

/// The middle one of `times`.
pub fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

/// Ticks at the start that are not counted: the stream's models learn, and the first snapshot is whole.
const WARM_UP_TICKS: usize = 60;

/// Codes `trace` for one receiver over `link`.
///
/// # Errors
/// Where a snapshot that arrives cannot be decoded.
pub fn run(trace: &Trace, link: Link) -> Result<Cost, EntryError> {
    let behind = (link.round_trip_ms * trace.tick_hz).div_ceil(1000) as usize;
    let mut random = StdRng::seed_from_u64(5);
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    let mut on_their_way = VecDeque::new();
    let mut state = State::new(trace.precision)?;
    let mut cost = Cost::default();
    for (at, bodies) in trace.ticks.iter().enumerate() {
        let tick = at as u64 + 1;
        trace.quantise(bodies, 0..bodies.len(), &mut state);
        if on_their_way.len() >= behind
            && let Some(Some((newest, before))) = on_their_way.pop_front()
        {
            encoder.acknowledge(newest, before);
        }
        let (bytes, encode_us) = cpu_us(|| encoder.encode(tick, &state, &[]));
        let is_lost = random.random_bool(link.loss);
        let counts = at >= WARM_UP_TICKS;
        if counts {
            cost.bytes += bytes.len();
            cost.snapshots += 1;
            cost.encode_us.push(encode_us);
        }
        if !is_lost {
            let (frame, decode_us) = cpu_us(|| decoder.decode(tick, &bytes));
            let frame = frame?;
            if counts {
                cost.decode_us.push(decode_us);
                cost.compare(&frame, bodies, trace);
            }
        }
        let heard = !random.random_bool(link.loss);
        on_their_way.push_back(decoder.acknowledgement().filter(|_| heard));
    }
    Ok(cost)
}

impl Cost {
    fn compare(&mut self, frame: &Frame, bodies: &[Placed], trace: &Trace) {
        for (slice, body) in frame.slices(trace.tick_hz.into()).iter().zip(bodies) {
            let off = (0..3).map(|i| (f64::from(slice.q[i]) - body.q[i]).powi(2)).sum::<f64>().sqrt() * 1e3;
            let dot: f64 = (3..7).map(|i| f64::from(slice.q[i]) * body.q[i]).sum();
            // Of single precision quaternions: acos would make 0.03 degrees of their rounding.
            let chord = (3..7).map(|i| (f64::from(slice.q[i]) * dot.signum() - body.q[i]).powi(2)).sum::<f64>().sqrt();
            let turned = (4.0 * (0.5 * chord).asin()).to_degrees();
            let worst = if body.is_moving() { &mut self.motion } else { &mut self.rest };
            *worst = (worst.0.max(off), worst.1.max(turned));
        }
    }
}
