//! Cells and grants against real decoders, without a network.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use pita_protocol::dof::{CellDecoder, Decoder, Group, Precision, kind};
use pita_protocol::message::{CellGrant, CellSnapshot, InputAck, Snapshot};

use super::*;
use crate::config::ServerConfig;
use crate::crowd::Family;

const TICK_HZ: u16 = 30;
/// From a snapshot to its acknowledgement, ticks.
const ROUND_TRIP: usize = 3;
/// The session's own car.
const OWN: [u32; 2] = [1, 2];

fn settings() -> Settings {
    ServerConfig::built_in().cells.at(TICK_HZ)
}

/// Boxes on a field, one of `moving_one_of` in motion, and a car of two bodies that is the session's own.
struct Field {
    boxes: u32,
    moving_one_of: u32,
    /// Where the car is and how fast it drives along x, m and m/s.
    car: ([f64; 2], f64),
    state: State,
    crowd: Crowd,
}

impl Field {
    fn new(boxes: u32, moving_one_of: u32) -> Self {
        let state = State::new(Precision::default()).unwrap();
        Self { boxes, moving_one_of, car: ([0.0, 0.0], 10.0), state, crowd: Crowd::default() }
    }

    fn at(&mut self, tick: u64) {
        self.state.clear();
        self.crowd.clear();
        let time = tick as f64 / 30.0;
        let ([x, z], speed) = self.car;
        let x = x + speed * time;
        self.add(None, OWN[0], [x, z], Some(0));
        self.add(Some(OWN[0]), OWN[1], [x + 1.0, z + 0.3], None);
        for i in 0..self.boxes {
            let swing = if i % self.moving_one_of == 0 { (3.0 * time + f64::from(i)).sin() } else { 0.0 };
            self.add(None, 10 + i, [f64::from(i % 100) * 3.0 + swing, f64::from(i / 100) * 3.0], None);
        }
    }

    fn add(&mut self, root: Option<u32>, id: u32, [x, z]: [f64; 2], slot: Option<u16>) {
        let q = [x, 0.5, z, 0.0, 0.0, 0.0, 1.0];
        self.state.push(id, kind::RIGID_BODY, None, &[Group::Point, Group::Rotation], &q).unwrap();
        let position = Some([x as f32, 0.5, z as f32]);
        match root {
            Some(root) => assert!(self.crowd.add_member(root)),
            None => self.crowd.add_root(Family { root: id, position, speed: 2.0, importance: 1.0, slot }),
        }
    }
}

/// A session over a perfect connection, and what it has seen.
struct Session {
    own: OwnStream,
    decoder: Decoder,
    cells: BTreeMap<CellId, (u8, CellDecoder)>,
    on_their_way: VecDeque<Option<(u64, u32)>>,
    /// Of each body in a cell that is taken, the tick of its newest state.
    known: BTreeMap<u32, u64>,
    /// What arrived, keyframes that were asked for included, a tick.
    bytes: Vec<usize>,
    /// Snapshots that did not carry the own car.
    without_own: usize,
}

impl Session {
    fn new(bytes_per_s: u32) -> Self {
        Self {
            own: OwnStream::new(Precision::default(), bytes_per_s, TICK_HZ),
            decoder: Decoder::default(),
            cells: BTreeMap::new(),
            on_their_way: vec![None; ROUND_TRIP].into(),
            known: BTreeMap::new(),
            bytes: Vec::new(),
            without_own: 0,
        }
    }

    fn take(&mut self, tick: u64, field: &Field, cells: &Cells) {
        self.own.clear();
        for (body, &family) in field.state.bodies().iter().zip(field.crowd.of_bodies()) {
            let family = &field.crowd.families()[family as usize];
            if family.slot.is_some() {
                self.own.add(&field.state, body, family);
            }
        }
        let mut arrived = 0;
        for published in cells.published() {
            let Some((layers, decoder)) = self.cells.get_mut(&published.cell) else { continue };
            if published.layer < *layers {
                arrived += published.bytes.len();
                let message: CellSnapshot = pita_protocol::decode(&published.bytes).unwrap();
                let frame = decoder.decode(tick, &message.dof, message.keyframe_age == 0).unwrap();
                self.known.extend(frame.bodies().map(|(body, at)| (body.id, at)));
            }
        }
        let acknowledged = self.on_their_way.pop_front().flatten().unwrap_or((0, 0));
        let head = Head { epoch: 1, tick, ack: InputAck::default(), event_sequence: 0, acknowledged };
        let (bytes, _) = self.own.snapshot(&head, cells);
        let snapshot: Snapshot = pita_protocol::decode(&bytes).unwrap();
        let frame = self.decoder.decode(tick, &snapshot.dof).unwrap();
        self.without_own += usize::from(!frame.bodies().map(|(body, _)| body.id).eq(OWN));
        arrived += bytes.len() + snapshot.cells.map_or(0, |granted| self.follow(&granted, cells));
        self.bytes.push(arrived);
        self.on_their_way.push_back(self.decoder.acknowledgement());
    }

    /// Takes what is granted; answers the bytes of the keyframes that it asks for.
    fn follow(&mut self, granted: &[CellGrant], cells: &Cells) -> usize {
        self.cells.retain(|cell, _| granted.iter().any(|grant| grant.cell == *cell));
        let mut bytes = 0;
        for grant in granted {
            let (layers, _) = self.cells.entry(grant.cell).or_insert_with(|| {
                let mut decoder = CellDecoder::default();
                for keyframe in cells.epoch(grant.cell) {
                    bytes += keyframe.dof.len();
                    let frame = decoder.decode(keyframe.tick, &keyframe.dof, true).unwrap();
                    self.known.extend(frame.bodies().map(|(body, at)| (body.id, at)));
                }
                (0, decoder)
            });
            *layers = grant.layers;
        }
        bytes
    }

    fn bytes_per_s(&self, from: usize) -> f64 {
        let bytes = &self.bytes[from..];
        bytes.iter().sum::<usize>() as f64 * f64::from(TICK_HZ) / bytes.len() as f64
    }

    fn occupied(&self, cells: &Cells) -> BTreeSet<CellId> {
        self.cells.keys().copied().filter(|cell| !cells.epoch(*cell).is_empty()).collect()
    }
}

fn watch(field: &mut Field, bytes_per_s: u32, ticks: u64) -> (Session, Cells) {
    let (mut cells, mut session) = (Cells::new(settings()), Session::new(bytes_per_s));
    for tick in 1..=ticks {
        field.at(tick);
        cells.tick(tick, &field.state, &field.crowd);
        session.take(tick, field, &cells);
    }
    (session, cells)
}

#[test]
fn ten_thousand_bodies_arrive_within_the_budget_and_starve_nobody() {
    let mut field = Field::new(10_000, 20);
    let (session, _) = watch(&mut field, 64_000, 240);
    let of_second: Vec<usize> = session.bytes.chunks(30).map(|second| second.iter().sum()).collect();
    // The first second may spend what is saved up at first.
    assert!(of_second.iter().all(|&bytes| bytes < 64_000 * 3 / 2), "{of_second:?}");
    assert!(session.bytes_per_s(0) < 64_000.0 * 1.05, "{of_second:?}");
    assert_eq!(session.without_own, 0, "the own car comes with every snapshot");
    assert_eq!(session.known.len(), 10_002, "{of_second:?}");
}

#[test]
fn a_small_budget_means_fewer_cells_and_the_nearest_always() {
    let seen = [8_000, 64_000].map(|bytes_per_s| watch(&mut Field::new(4_000, 2), bytes_per_s, 300));
    let [(poor, cells), (rich, _)] = &seen;
    assert!(poor.bytes_per_s(150) < 8_000.0 * 1.1, "{} bytes/s", poor.bytes_per_s(150));
    assert!(rich.bytes_per_s(150) < 64_000.0 * 1.05, "{} bytes/s", rich.bytes_per_s(150));
    let [few, many] = [poor, rich].map(|session| session.occupied(cells));
    assert!(few.len() < many.len() && few.is_subset(&many), "{few:?} {many:?}");
    let here = CellId { x: 1, z: 0 };
    assert!(few.contains(&here), "{few:?}");
    assert_eq!(poor.without_own, 0);
}

#[test]
fn who_is_elsewhere_takes_other_cells() {
    let mut cells = Cells::new(settings());
    let (mut west, mut east) = (Session::new(12_000), Session::new(12_000));
    let mut field = Field::new(6_000, 2);
    for tick in 1..=200 {
        for (session, car) in [(&mut west, 0.0), (&mut east, 290.0)] {
            field.car = ([car, 90.0], 0.0);
            field.at(tick);
            if car == 0.0 {
                cells.tick(tick, &field.state, &field.crowd);
            }
            session.take(tick, &field, &cells);
        }
    }
    let [west, east] = [west, east].map(|session| session.occupied(&cells));
    assert!(west.contains(&CellId { x: 0, z: 1 }) && !west.contains(&CellId { x: 4, z: 1 }), "{west:?}");
    assert!(east.contains(&CellId { x: 4, z: 1 }) && !east.contains(&CellId { x: 0, z: 1 }), "{east:?}");
}

#[test]
fn a_body_belongs_to_one_cell_and_the_one_that_it_left_says_where_it_went() {
    let mut field = Field::new(0, 1);
    field.car.1 = 40.0;
    let mut cells = Cells::new(settings());
    let mut decoders: BTreeMap<CellId, (CellDecoder, BTreeSet<u32>)> = BTreeMap::new();
    let mut crossings = Vec::new();
    for tick in 1..=300u64 {
        field.at(tick);
        cells.tick(tick, &field.state, &field.crowd);
        for published in cells.published().iter().filter(|published| published.cell != CellId::WHOLE) {
            let message: CellSnapshot = pita_protocol::decode(&published.bytes).unwrap();
            let (decoder, has) = decoders.entry(message.cell).or_default();
            let frame = decoder.decode(tick, &message.dof, message.keyframe_age == 0).unwrap();
            let had = std::mem::replace(has, frame.bodies().map(|(body, _)| body.id).collect());
            if had.len() > has.len() {
                let departure = message.departures.last().expect("it says where");
                assert_eq!(departure.bodies, OWN);
                crossings.push((message.cell.x, departure.to.x));
            }
        }
        let owners: Vec<_> = decoders.iter().filter(|(_, (_, has))| has.iter().eq(&OWN)).collect();
        assert_eq!(owners.len(), 1, "tick {tick}");
        let others = decoders.values().filter(|(_, has)| has.is_empty()).count();
        assert_eq!(others + 1, decoders.len(), "a car is in one piece");
    }
    assert_eq!(crossings, [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6)]);
    assert!(cells.epoch(CellId { x: 0, z: 0 }).is_empty(), "what is long empty is no more");
}

#[test]
fn a_crowded_cell_keeps_to_its_bytes_and_everybody_has_a_turn() {
    let (mut field, settings) = (Field::new(400, 1), Settings { side_m: 4096.0, bytes_per_s: 4_000, ..settings() });
    let (mut cells, mut decoder, mut known) = (Cells::new(settings), CellDecoder::default(), BTreeMap::new());
    let mut bytes = 0;
    for tick in 1..=300 {
        field.at(tick);
        if tick == 200 {
            field.add(None, 50_000, [5.0, 5.0], None);
        }
        cells.tick(tick, &field.state, &field.crowd);
        for published in cells.published().iter().filter(|published| published.cell == CellId { x: 0, z: 0 }) {
            let message: CellSnapshot = pita_protocol::decode(&published.bytes).unwrap();
            let frame = decoder.decode(tick, &message.dof, message.keyframe_age == 0).unwrap();
            for (body, at) in frame.bodies() {
                let known = known.entry(body.id).or_insert(at);
                *known = at.max(*known);
            }
            bytes += if tick > 100 { published.bytes.len() } else { 0 };
        }
        if tick == 200 {
            assert_eq!(known.get(&50_000), Some(&200), "who is new is there at once");
        }
    }
    // What begins anew carries everybody, and is not counted.
    assert!(bytes as f64 / 200.0 * 30.0 < 4_000.0 * 1.6, "{bytes} bytes in 200 ticks");
    let oldest = known.iter().filter(|(id, _)| **id < 50_000).map(|(_, at)| 300 - at).max().unwrap();
    assert!((2..60).contains(&oldest), "{oldest} ticks");
}

#[test]
fn a_world_that_is_scattered_far_and_wide_makes_no_more_cells_than_are_bounded() {
    let mut cells = Cells::new(settings());
    let mut field = Field::new(0, 1);
    for tick in 1..=2 {
        field.at(tick);
        (0..3000).for_each(|i| field.add(None, 10 + i, [f64::from(i % 60) * 100.0, f64::from(i / 60) * 100.0], None));
        cells.tick(tick, &field.state, &field.crowd);
    }
    let mut seen = BTreeSet::new();
    for cell in cells.streams.keys().copied().collect::<Vec<_>>() {
        let mut decoder = CellDecoder::default();
        for keyframe in cells.epoch(cell) {
            let frame = decoder.decode(keyframe.tick, &keyframe.dof, true).unwrap();
            seen.extend(frame.bodies().map(|(body, _)| body.id));
        }
    }
    assert!(cells.streams.len() <= CELLS_MAX + 1, "{} cells", cells.streams.len());
    assert_eq!(seen.len(), 3002, "everybody is somewhere");
}

/// Everything fits: soon it comes in one stream, for less. Where there is more than a cell may take it goes on in cells.
#[test]
fn who_can_have_everything_takes_it_in_one_stream_and_others_do_not() {
    let whole = |session: &Session| session.cells.keys().eq(&[CellId::WHOLE]);
    let mut field = Field::new(2000, 5);
    let (mut cells, mut rich, mut poor) = (Cells::new(settings()), Session::new(64_000), Session::new(8_000));
    let mut of_cells = 0.0;
    for tick in 1..=400 {
        if tick == 300 {
            field.moving_one_of = 1;
        }
        field.at(tick);
        cells.tick(tick, &field.state, &field.crowd);
        rich.take(tick, &field, &cells);
        poor.take(tick, &field, &cells);
        assert!(!whole(&poor), "tick {tick}");
        match tick {
            30 => of_cells = rich.bytes_per_s(20),
            31..40 | 300..400 => {}
            400 => assert!(!whole(&rich)),
            _ => assert_eq!(whole(&rich), tick >= 40, "tick {tick}"),
        }
    }
    let in_one = rich.bytes[200..300].iter().sum::<usize>() as f64 * 0.3;
    assert!(in_one < 0.9 * of_cells, "{in_one} and {of_cells} bytes/s");
    let oldest = rich.known.values().min();
    assert!(rich.known.len() == 2002 && oldest > Some(&340), "{oldest:?}");
}

/// Ten thousand bodies at rest cost next to nothing, but to say them all at once is seconds of a small budget.
#[test]
fn a_newcomer_to_a_world_at_rest_is_not_sent_more_at_once_than_its_budget() {
    let mut field = Field::new(10_000, 100_000);
    field.car.1 = 0.5;
    let mut cells = Cells::new(settings());
    let mut sessions: [Option<Session>; 2] = [None, None];
    for tick in 1..=700u64 {
        field.at(tick);
        cells.tick(tick, &field.state, &field.crowd);
        for (session, bytes_per_s) in sessions.iter_mut().zip([8_000, 64_000]).filter(|_| tick > 200) {
            session.get_or_insert_with(|| Session::new(bytes_per_s)).take(tick, &field, &cells);
        }
    }
    for (session, bytes_per_s) in sessions.into_iter().flatten().zip([8_000, 64_000]) {
        let of_second: Vec<usize> = session.bytes.chunks(30).map(|second| second.iter().sum()).collect();
        assert!(of_second.iter().all(|&bytes| bytes < bytes_per_s * 2), "{bytes_per_s}: {of_second:?}");
        assert_eq!(session.known.len(), 10_002, "{bytes_per_s}: {of_second:?}");
    }
}

#[test]
fn beside_the_last_square_is_no_other_stream() {
    let mut cells = Cells::new(Settings { side_m: 1.0, ..settings() });
    let (mut session, mut field) = (Session::new(64_000), Field::new(0, 1));
    for tick in 1..=20 {
        field.car = ([-32766.5, 32766.5], 0.0);
        field.at(tick);
        cells.tick(tick, &field.state, &field.crowd);
        session.take(tick, &field, &cells);
    }
    assert!(session.cells.contains_key(&CellId { x: -32767, z: 32766 }), "{:?}", session.cells.keys());
    assert!(session.cells.keys().all(|cell| cell.x > i16::MIN), "{:?}", session.cells.keys());
}
