//! Publishing for many as the daemon does it: cells once for everybody, and for each client the stream of its own car.

use pita_protocol::dof::State;
use pita_protocol::message::{CellId, InputAck};
use pita_server::cells::{Cells, Head, OwnStream, Settings};
use pita_server::config::ServerConfig;
use pita_server::crowd::{Crowd, Family};

use super::super::EntryError;
use super::stopwatch::cpu_us;
use super::stream::median;
use super::trace::{Placed, Trace};

/// Clients that are served.
const CLIENTS: usize = 200;
/// From a snapshot to its acknowledgement, ticks.
const ROUND_TRIP: u64 = 3;

/// What serving all clients takes.
pub struct FanOut {
    /// Median of a tick's work of the publishing thread: quantisation, all cells, 200 snapshots, as messages. ms.
    pub encode_ms: f64,
    /// Of all cells in the mean, bytes a tick.
    pub cell_bytes: f64,
    /// How many there are.
    pub cells: usize,
    /// Of a client's own snapshot, bytes.
    pub own_bytes: f64,
    /// What a client is sent, cells included, bytes a tick.
    pub client_bytes: f64,
}

/// Serves 200 clients from `trace`, 64 of whose cars are theirs, round by round, in cells of `side_m`.
pub fn run(trace: &Trace, side_m: f32) -> Result<FanOut, EntryError> {
    let hz = u16::try_from(trace.tick_hz)?;
    let config = ServerConfig::built_in();
    let mut cells = Cells::new(Settings { side_m, ..config.cells.at(hz) });
    let budget = config.network.client_bytes_per_s.get();
    let mut clients: Vec<_> = (0..CLIENTS).map(|_| OwnStream::new(trace.precision, budget, hz)).collect();
    let (mut world, mut crowd) = (State::new(trace.precision)?, Crowd::default());
    let (mut cell_bytes, mut own_bytes, mut client_bytes, mut times) = (0, 0, 0, Vec::new());
    let mut seen = std::collections::BTreeSet::<CellId>::new();
    for (bodies, tick) in trace.ticks.iter().zip(1u64..) {
        let ((), us) = cpu_us(|| {
            trace.quantise(bodies, 0..bodies.len(), &mut world);
            gather(bodies, &mut crowd);
            cells.tick(tick, &world, &crowd);
            hand_out(&world, &crowd, &mut clients);
            let acknowledged = (tick.saturating_sub(ROUND_TRIP), u32::MAX);
            let head = Head { epoch: 1, tick, ack: InputAck::default(), event_sequence: 0, acknowledged };
            for client in &mut clients {
                let (own, of_cells) = client.snapshot(&head, &cells);
                own_bytes += own.len();
                client_bytes += own.len() + of_cells;
            }
        });
        cell_bytes += cells.published().iter().map(|published| published.bytes.len()).sum::<usize>();
        seen.extend(cells.published().iter().map(|published| published.cell));
        times.push(us * 1e-3);
    }
    let ticks = trace.ticks.len() as f64;
    Ok(FanOut {
        encode_ms: median(&mut times),
        cell_bytes: cell_bytes as f64 / ticks,
        cells: seen.len(),
        own_bytes: own_bytes as f64 / ticks / CLIENTS as f64,
        client_bytes: client_bytes as f64 / ticks / CLIENTS as f64,
    })
}

/// Cars and everything else, as the daemon tells them apart; the i-th car is of slot i.
fn gather(bodies: &[Placed], crowd: &mut Crowd) {
    crowd.clear();
    let mut cars = 0;
    for (at, body) in bodies.iter().enumerate() {
        if let Some(parent) = body.parent {
            crowd.add_member(bodies[parent].id);
            continue;
        }
        let is_car = bodies.get(at + 1).is_some_and(|next| next.parent == Some(at));
        let slot = is_car.then_some(cars);
        cars += u16::from(is_car);
        let position = Some([0, 1, 2].map(|i| body.q[i] as f32));
        let speed = body.v[..3].iter().map(|v| v * v).sum::<f64>().sqrt() as f32;
        crowd.add_root(Family { root: body.id, position, speed, importance: 1.0, slot });
    }
}

/// Every car to those clients whose number is that of its slot, modulo the cars.
fn hand_out(world: &State, crowd: &Crowd, clients: &mut [OwnStream]) {
    clients.iter_mut().for_each(OwnStream::clear);
    let cars = crowd.families().iter().filter(|family| family.slot.is_some()).count().max(1);
    for (body, &family) in world.bodies().iter().zip(crowd.of_bodies()) {
        let family = &crowd.families()[family as usize];
        let Some(slot) = family.slot else { continue };
        clients.iter_mut().skip(slot.into()).step_by(cars).for_each(|client| client.add(world, body, family));
    }
}
