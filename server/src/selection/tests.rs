//! Selections against real encoders and decoders, without a network.

use pita_protocol::dof::{Decoder, Group, Precision, kind};

use super::*;

const TICK_HZ: u16 = 30;
/// From a snapshot to its acknowledgement, ticks.
const ROUND_TRIP: usize = 3;

/// Boxes on a field, every second one in motion, and a car of two bodies that is the session's own.
struct Field {
    boxes: u32,
    state: State,
    crowd: Crowd,
}

impl Field {
    fn new(boxes: u32) -> Self {
        Self { boxes, state: State::new(Precision::default()).unwrap(), crowd: Crowd::default() }
    }

    fn at(&mut self, tick: u64) {
        self.state.clear();
        self.crowd.clear();
        let time = tick as f64 / 30.0;
        let mut add = |state: &mut State, root: Option<u32>, id: u32, x: f64, z: f64, slot| {
            let q = [x, 0.5, z, 0.0, 0.0, 0.0, 1.0];
            state.push(id, kind::RIGID_BODY, None, &[Group::Point, Group::Rotation], &q).unwrap();
            let position = [x as f32, 0.5, z as f32];
            match root {
                Some(root) => assert!(self.crowd.add_member(root)),
                None => self.crowd.add_root(Family { root: id, position, speed: 2.0, importance: 1.0, slot }),
            }
        };
        add(&mut self.state, None, 1, 10.0 * time, 0.0, Some(0));
        add(&mut self.state, Some(1), 2, 10.0 * time + 1.0, 0.3, None);
        for i in 0..self.boxes {
            let swing = if i % 2 == 0 { (3.0 * time + f64::from(i)).sin() } else { 0.0 };
            add(&mut self.state, None, 10 + i, f64::from(i % 100) * 3.0 + swing, f64::from(i / 100) * 3.0, None);
        }
    }
}

/// What a session over a perfect connection has seen.
struct Seen {
    /// Bytes of each snapshot.
    bytes: Vec<usize>,
    /// Tick from which on all bodies were known.
    complete: Option<u64>,
    /// Ages of bodies in motion at the end, ticks.
    ages: Vec<u64>,
    /// Snapshots that did not carry the own car.
    without_own: usize,
}

fn watch(boxes: u32, bytes_per_s: u32, ticks: u64) -> Seen {
    let mut field = Field::new(boxes);
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    let mut selection = Selection::new(bytes_per_s, TICK_HZ);
    let mut on_their_way = std::collections::VecDeque::from(vec![None; ROUND_TRIP]);
    let mut seen = Seen { bytes: Vec::new(), complete: None, ages: Vec::new(), without_own: 0 };
    for tick in 1..=ticks {
        field.at(tick);
        if let Some(Some((newest, before))) = on_their_way.pop_front() {
            encoder.acknowledge(newest, before);
            selection.acknowledge(newest);
        }
        let chosen = selection.choose(&mut encoder, tick, &field.state, &field.crowd, 0).to_vec();
        let bytes = encoder.encode(tick, &field.state, &chosen);
        selection.sent(bytes.len(), &encoder);
        decoder.decode(tick, &bytes).unwrap();
        let ages: Vec<_> = decoder.view().unwrap().bodies().map(|(body, at)| (body.id, tick - at)).collect();
        seen.without_own += usize::from(ages.iter().any(|&(id, age)| id < 3 && age > 0));
        if ages.len() == field.state.bodies().len() {
            seen.complete.get_or_insert(tick);
        }
        seen.ages = ages.iter().filter(|(id, _)| *id >= 10 && id % 2 == 0).map(|&(_, age)| age).collect();
        seen.bytes.push(bytes.len());
        on_their_way.push_back(decoder.acknowledgement());
    }
    seen
}

#[test]
fn ten_thousand_bodies_arrive_within_the_budget_and_starve_nobody() {
    let seen = watch(10_000, 64_000, 450);
    let complete = seen.complete.expect("all bodies within fifteen seconds");
    let of_second: Vec<usize> = seen.bytes.chunks(30).map(|second| second.iter().sum()).collect();
    // The first second may spend what is saved up at first.
    assert!(of_second.iter().all(|&bytes| bytes < 64_000 * 3 / 2), "{of_second:?}");
    assert!(seen.bytes.iter().sum::<usize>() < 64_000 * 450 / 30 * 11 / 10, "{of_second:?}");
    assert_eq!(seen.without_own, 0, "the own car comes with every snapshot");
    assert!(complete < 400, "complete at tick {complete}, {of_second:?}");
}

#[test]
fn a_small_budget_means_fewer_bodies_each_of_them_new() {
    let (rich, poor) = (watch(600, 64_000, 300), watch(600, 8_000, 300));
    let rate = |seen: &Seen| seen.bytes[150..].iter().sum::<usize>() as f64 / 5.0;
    assert!(rate(&poor) < 8_800.0, "{} bytes/s", rate(&poor));
    assert!(rich.ages.iter().all(|&age| age == 0), "all fit");
    assert_eq!(poor.without_own, 0);
    let oldest = poor.ages.iter().copied().max().unwrap();
    assert!((1..60).contains(&oldest), "{oldest} ticks: nobody is forgotten");
}
