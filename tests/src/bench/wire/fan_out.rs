//! Encoding for many: a cell once for everybody, and for each client the stream of its own car.

use pita_protocol::dof::{Cadence, CellEncoder, Encoder, State};

use super::super::EntryError;
use super::stopwatch::cpu_us;
use super::stream::median;
use super::trace::Trace;

/// Clients that are served.
const CLIENTS: usize = 200;

/// What serving all clients takes.
pub struct FanOut {
    /// Median of a tick's encoding: quantisation, one cell with everything, 200 streams of five bodies. ms.
    pub encode_ms: f64,
    /// Of the cell's snapshots in the mean, bytes.
    pub cell_bytes: f64,
    /// Of a client's own stream, bytes.
    pub own_bytes: f64,
}

/// Serves 200 clients from `trace`, 64 of whose cars are theirs, round by round.
pub fn run(trace: &Trace) -> Result<FanOut, EntryError> {
    let first = trace.ticks.first().ok_or("an empty trace")?;
    let roots: Vec<_> = (0..first.len()).filter(|&at| first.iter().any(|body| body.parent == Some(at))).collect();
    let mut world = State::new(trace.precision)?;
    let mut cars = roots.iter().map(|_| State::new(trace.precision)).collect::<Result<Vec<_>, _>>()?;
    let mut cell = CellEncoder::new(Cadence::default());
    let mut clients: Vec<_> = (0..CLIENTS).map(|_| Encoder::default()).collect();
    let (mut cell_bytes, mut own_bytes, mut times) = (0, 0, Vec::new());
    for (bodies, tick) in trace.ticks.iter().zip(1u64..) {
        let ((), us) = cpu_us(|| {
            trace.quantise(bodies, 0..bodies.len(), &mut world);
            for (car, &root) in cars.iter_mut().zip(&roots) {
                // A car's wheels follow its chassis.
                trace.quantise(bodies, root..root + 5, car);
            }
            cell_bytes += cell.encode(tick, &world).len();
            for (client, encoder) in clients.iter_mut().enumerate() {
                if let Some(seen) = tick.checked_sub(3) {
                    encoder.acknowledge(seen, u32::MAX);
                }
                own_bytes += encoder.encode(tick, &cars[client % cars.len()], &[]).len();
            }
        });
        times.push(us * 1e-3);
    }
    let ticks = trace.ticks.len() as f64;
    Ok(FanOut {
        encode_ms: median(&mut times),
        cell_bytes: cell_bytes as f64 / ticks,
        own_bytes: own_bytes as f64 / ticks / CLIENTS as f64,
    })
}
