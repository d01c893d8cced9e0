//! Streams over links that lose, delay, repeat and reorder.

use proptest::prelude::*;

use super::*;
use crate::WireError;

mod cells;
mod hostile;
mod slices;

const RIGID: [Group; 2] = [Group::Point, Group::Rotation];
const HINGED: [Group; 2] = [Group::Point, Group::Hinge];

/// A small deterministic generator: xorshift.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % sides
    }

    /// −1 to 1.
    fn spread(&mut self) -> f64 {
        self.roll(2001) as f64 / 1000.0 - 1.0
    }
}

/// Bodies that fly, spin, bounce and rest; every third is attached to the one before.
struct Toys {
    dice: Dice,
    bodies: Vec<Toy>,
    next_id: u32,
}

struct Toy {
    id: u32,
    parent: Option<u32>,
    q: [f64; 7],
    velocity: [f64; 3],
    spin: f64,
}

impl Toys {
    fn new(seed: u64, count: usize) -> Self {
        let mut toys = Self { dice: Dice(seed | 1), bodies: Vec::new(), next_id: 0 };
        (0..count).for_each(|_| toys.add());
        toys
    }

    fn add(&mut self) {
        let d = &mut self.dice;
        let velocity = [d.spread() * 10.0, d.spread() * 3.0, d.spread() * 10.0];
        let q = [d.spread() * 50.0, d.spread() * 50.0, d.spread() * 50.0, 0.0, 0.0, 0.0, 1.0];
        let parent = self.bodies.last().filter(|_| self.next_id % 3 == 2).map(|toy| toy.id);
        self.bodies.push(Toy { id: self.next_id, parent, q, velocity, spin: d.spread() * 0.3 });
        self.next_id += 1 + d.roll(3) as u32;
    }

    fn step(&mut self) {
        let d = &mut self.dice;
        for toy in &mut self.bodies {
            if d.roll(20) == 0 {
                toy.velocity = if d.roll(3) == 0 { [0.0; 3] } else { [d.spread() * 10.0, 0.0, d.spread() * 10.0] };
                toy.spin = if toy.velocity == [0.0; 3] { 0.0 } else { d.spread() * 0.3 };
            }
            (0..3).for_each(|i| toy.q[i] += toy.velocity[i] / 30.0);
            let (s, c) = (0.5 * toy.spin).sin_cos();
            let [x, y, z, w] = [toy.q[3], toy.q[4], toy.q[5], toy.q[6]];
            // About the body's y, and of what is attached about its z.
            [toy.q[3], toy.q[4], toy.q[5], toy.q[6]] = match toy.parent {
                None => [x * c - z * s, y * c + w * s, z * c + x * s, w * c - y * s],
                Some(_) => [x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s],
            };
        }
    }

    fn state(&self) -> State {
        let mut state = State::new(Precision::default()).unwrap();
        for toy in &self.bodies {
            let parent = toy.parent.filter(|&id| state.find(id).is_some());
            let layout = if toy.parent.is_some() { HINGED } else { RIGID };
            state.push(toy.id, 1, parent, &layout, &toy.q).unwrap();
        }
        state
    }
}

/// What a receiver knows of each body, as an encoder would have quantised it.
fn known(frame: &Frame) -> Vec<(u32, Vec<Quantised>)> {
    frame.bodies().map(|(body, _)| (body.id, frame.groups(body).iter().map(|g| g.value).collect())).collect()
}

fn told(state: &State) -> Vec<(u32, Vec<Quantised>)> {
    state.bodies().iter().map(|body| (body.id, state.groups(body).to_vec())).collect()
}

/// Runs a stream for `ticks` over a link of up to `delay_max` ticks each way that loses `lost` of 100 and repeats some.
/// Every decoded snapshot must be the sender's state of that tick. Answers bytes a snapshot and decoded snapshots.
fn run(seed: u64, ticks: u64, delay_max: u64, lost: u64, churn: bool) -> (usize, usize) {
    let mut toys = Toys::new(seed, 40);
    let mut dice = Dice(seed.wrapping_mul(77) | 1);
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    let (mut there, mut back) = (Vec::new(), Vec::new());
    let (mut bytes, mut decoded) = (0, 0);
    let mut states = Vec::new();
    for tick in 1..=ticks {
        toys.step();
        if churn && dice.roll(5) == 0 {
            toys.add();
            let gone = dice.roll(toys.bodies.len() as u64) as usize;
            toys.bodies.remove(gone);
        }
        let state = toys.state();
        for (_, (newest, before)) in back.extract_if(.., |(due, _)| *due <= tick) {
            encoder.acknowledge(newest, before);
        }
        let snapshot = encoder.encode(tick, &state, &[]);
        bytes += snapshot.len();
        states.push(told(&state));
        for _ in 0..1 + u64::from(dice.roll(10) == 0) {
            if dice.roll(100) >= lost {
                there.push((tick + dice.roll(delay_max + 1), tick, snapshot.clone()));
            }
        }
        for (_, of, snapshot) in there.extract_if(.., |(due, ..)| *due <= tick) {
            match decoder.decode(of, &snapshot) {
                Ok(frame) => {
                    assert_eq!(known(&frame), states[of as usize - 1], "tick {of}");
                    decoded += 1;
                }
                // Late: what it needs is forgotten.
                Err(error) => assert!(error == WireError::NoBaseline && of + 40 < tick, "tick {of} at {tick}: {error}"),
            }
        }
        if let Some(ack) = decoder.acknowledgement().filter(|_| dice.roll(100) >= lost) {
            back.push((tick + 1 + dice.roll(delay_max + 1), ack));
        }
    }
    (bytes / ticks as usize, decoded)
}

#[test]
fn a_stream_survives_loss_delay_repetition_and_reordering() {
    let (clean, decoded) = run(1, 300, 0, 0, false);
    assert!(decoded >= 300);
    let (lossy, decoded) = run(1, 300, 5, 20, false);
    assert!(decoded > 200, "{decoded}");
    assert!(clean < 250 && lossy < 4 * clean, "{clean} and {lossy} bytes");
    run(2, 300, 3, 50, true);
    run(3, 300, 8, 80, true);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_link_will_do(seed: u64, delay in 0u64..12, lost in 0u64..90, churn: bool) {
        run(seed, 60, delay, lost, churn);
    }
}

#[test]
fn bodies_that_are_left_out_keep_their_older_state_until_they_are_sent() {
    let mut toys = Toys::new(5, 30);
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    let mut dice = Dice(99);
    for tick in 1..200 {
        toys.step();
        let state = toys.state();
        let chosen: Vec<_> = state.bodies().iter().map(|_| dice.roll(3) == 0).collect();
        let whole = tick > 190;
        let snapshot = encoder.encode(tick, &state, if whole { &[] } else { &chosen });
        let frame = decoder.decode(tick, &snapshot).unwrap();
        let known = known(&frame);
        for (body, groups) in told(&state).into_iter().zip(&chosen).filter(|(_, sent)| whole || **sent).map(|(b, _)| b)
        {
            assert!(known.contains(&(body, groups)), "tick {tick}");
        }
        if dice.roll(4) > 0 {
            encoder.acknowledge(tick, u32::MAX);
        }
        if whole {
            assert_eq!(known, told(&state));
        }
    }
}

#[test]
fn what_a_silent_receiver_costs_is_bounded() {
    let toys = Toys::new(3, 6000);
    let (state, mut encoder, mut decoder) = (toys.state(), Encoder::default(), Decoder::default());
    let mut snapshots: Vec<_> = (1..30).map(|tick| (tick, encoder.encode(tick, &state, &[]))).collect();
    assert!(encoder.remembered() < 25, "{} snapshots", encoder.remembered());
    // One that is still remembered is as good as ever, one that is not as good as none.
    decoder.decode(1, &snapshots.remove(0).1).unwrap();
    encoder.acknowledge(1, 0);
    let whole = encoder.encode(30, &state, &[]);
    let (tick, newer) = snapshots.pop().unwrap();
    decoder.decode(tick, &newer).unwrap();
    encoder.acknowledge(tick, 0);
    let small = encoder.encode(31, &state, &[]);
    assert!(small.len() * 10 < whole.len(), "{} of {}", small.len(), whole.len());
    assert!(decoder.decode(30, &whole).is_ok() && decoder.decode(31, &small).is_ok());
}

#[test]
fn an_encoder_knows_what_a_receiver_lacks() {
    let (mut encoder, mut needs) = (Encoder::default(), Vec::new());
    let state = |x: f64, bodies: u32| {
        let mut state = State::new(Precision::default()).unwrap();
        for id in 0..bodies {
            let q = [f64::from(id) + if id == 1 { x } else { 0.0 }, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            state.push(id, kind::RIGID_BODY, None, &[Group::Point, Group::Rotation], &q).unwrap();
        }
        state
    };
    encoder.needs(1, &state(0.0, 2), &mut needs);
    assert_eq!(needs, [Need::First { groups: 2 }; 2]);
    for tick in 1..4 {
        encoder.encode(tick, &state(0.0, 2), &[]);
        encoder.acknowledge(tick, 0);
    }
    assert_eq!(encoder.spent().first.groups, 0);
    encoder.needs(4, &state(0.5, 3), &mut needs);
    assert_eq!(needs, [Need::Nothing, Need::Update { groups: 1 }, Need::First { groups: 2 }]);
    encoder.encode(4, &state(0.5, 3), &[true, false, true]);
    let spent = *encoder.spent();
    assert_eq!((spent.first.groups, spent.updates.groups), (2, 0));
    assert!((2..20).contains(&spent.first.bytes), "{spent:?}");
}

/// A wheel whose axis is bent by more than a right angle, and back, in between lost snapshots.
#[test]
fn a_hinge_that_is_bent_too_far_goes_as_a_rotation() {
    let (mut encoder, mut decoder, mut needs) = (Encoder::default(), Decoder::default(), Vec::new());
    let mut kinds = Vec::new();
    for tick in 1..=60u64 {
        let (t, half) = (tick as f64, 0.025 * tick as f64);
        // Over half a turn about x, while it turns about its z.
        let (bent, upright, sine, cosine) = (half.sin(), half.cos(), (0.4 * t).sin(), (0.4 * t).cos());
        let q = [1.0, 0.0, 0.5, bent * cosine, -bent * sine, upright * sine, upright * cosine];
        let mut state = State::new(Precision::default()).unwrap();
        state.push(1, kind::RIGID_BODY, None, &RIGID, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).unwrap();
        state.push(2, kind::RIGID_BODY, Some(1), &HINGED, &q).unwrap();
        let group = state.groups(&state.bodies()[1])[1].group;
        encoder.needs(tick, &state, &mut needs);
        let is_new = tick == 1 || kinds.last().is_some_and(|last| *last != group);
        assert!(!is_new || needs[1] == Need::First { groups: 2 }, "tick {tick}: {needs:?}");
        kinds.push(group);
        let snapshot = encoder.encode(tick, &state, &[]);
        let frame = decoder.decode(tick, &snapshot).unwrap();
        let slice = frame.slice(2, 30.0).unwrap();
        assert_eq!(slice.groups, RIGID);
        let dot: f64 = (3..7).map(|i| f64::from(slice.q[i]) * q[i]).sum();
        let off = (3..7).map(|i| (f64::from(slice.q[i]) * dot.signum() - q[i]).powi(2)).sum::<f64>().sqrt();
        assert!((4.0 * (0.5 * off).asin()).to_degrees() < 0.14, "tick {tick}: {off}");
        encoder.acknowledge(tick, 0);
    }
    let hinged = kinds.iter().filter(|group| **group == Group::Hinge).count();
    assert_eq!((hinged, kinds[0]), (31, Group::Hinge));
}

/// A wheel that goes round with a little noise: what is learnt of it does not break where its angle begins anew.
#[test]
fn a_wheel_that_goes_round_costs_next_to_nothing() {
    let (mut encoder, mut decoder, mut dice) = (Encoder::default(), Decoder::default(), Dice(3));
    let mut bytes = 0;
    for tick in 1..=300u64 {
        let (sine, cosine) = (0.5 * (tick as f64 + 0.001 * dice.spread())).sin_cos();
        let mut state = State::new(Precision::default()).unwrap();
        state.push(1, kind::RIGID_BODY, None, &HINGED, &[0.0, 0.0, 0.0, 0.0, 0.0, sine, cosine]).unwrap();
        let snapshot = encoder.encode(tick, &state, &[]);
        let frame = decoder.decode(tick, &snapshot).unwrap();
        encoder.acknowledge(tick.saturating_sub(2), 0);
        if tick > 100 {
            bytes += snapshot.len();
            let rate = frame.slice(1, 30.0).unwrap().v[5];
            assert!((rate - 30.0).abs() < 0.1, "tick {tick}: {rate} rad/s");
        }
    }
    // Of each 4 are no coded state.
    let bytes = bytes as f64 / 200.0;
    assert!(bytes < 5.5, "{bytes} bytes a snapshot");
}

#[test]
fn what_rests_costs_next_to_nothing() {
    let toys = Toys::new(8, 1000);
    let state = toys.state();
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    let sizes: Vec<_> = (1..60)
        .map(|tick| {
            let snapshot = encoder.encode(tick, &state, &[]);
            decoder.decode(tick, &snapshot).unwrap();
            encoder.acknowledge(tick, 0);
            snapshot.len()
        })
        .collect();
    assert!(sizes[0] > 5000 && *sizes.last().unwrap() < 16, "{sizes:?}");
}

#[test]
fn a_decoder_without_the_baseline_says_so_and_a_restart_heals_it() {
    let mut toys = Toys::new(11, 10);
    let mut encoder = Encoder::default();
    let mut decoder = Decoder::default();
    for tick in 1..10 {
        toys.step();
        encoder.encode(tick, &toys.state(), &[]);
        encoder.acknowledge(tick, 0);
    }
    let snapshot = encoder.encode(10, &toys.state(), &[]);
    assert_eq!(decoder.decode(10, &snapshot).unwrap_err(), WireError::NoBaseline);
    encoder.restart();
    let snapshot = encoder.encode(11, &toys.state(), &[]);
    assert_eq!(known(&decoder.decode(11, &snapshot).unwrap()), told(&toys.state()));
}

#[test]
fn a_full_stream_may_change_as_a_whole() {
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    for tick in 1..4u32 {
        let mut state = State::new(Precision::default()).unwrap();
        let ids = (0..BODIES_MAX as u32).map(|i| u32::MAX - 1 - 3 * BODIES_MAX as u32 + tick * BODIES_MAX as u32 - i);
        for id in ids.rev().filter(|&id| id < u32::MAX) {
            state.push(id, kind::PARTICLE, None, &[Group::Point], &[f64::from(tick), 0.0, 0.0]).unwrap();
        }
        let snapshot = encoder.encode(tick.into(), &state, &[]);
        assert_eq!(known(&decoder.decode(tick.into(), &snapshot).unwrap()), told(&state));
        encoder.acknowledge(tick.into(), 0);
    }
    let refused = State::new(Precision::default()).unwrap().push(u32::MAX, 0, None, &[Group::Point], &[0.0; 3]);
    assert!(matches!(refused, Err(WireError::Content { field: "slice id", .. })), "{refused:?}");
}

#[test]
fn quantisation_keeps_its_bounds() {
    let mut dice = Dice(7);
    let precision = Precision { point: 1000, rotation: 1500, scalar: 1000, rate: 200 };
    for _ in 0..10_000 {
        let raw = [0; 4].map(|_: i32| dice.spread());
        let length = raw.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length < 0.1 {
            continue;
        }
        let unit = raw.map(|x| x / length);
        let mut back = Vec::new();
        Quantised::of(Group::Rotation, &unit, &precision).numbers(&precision, &mut back);
        let dot: f64 = unit.iter().zip(&back).map(|(a, b)| a * b).sum();
        let angle = 2.0 * dot.abs().min(1.0).acos().to_degrees();
        assert!(angle < 0.14, "{angle} degrees");
        let point = [dice.spread() * 5000.0, dice.spread(), 0.0];
        back.clear();
        Quantised::of(Group::Point, &point, &precision).numbers(&precision, &mut back);
        assert!(point.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 0.000_501));
    }
    for wild in [f64::NAN, f64::INFINITY, -1e300] {
        let Quantised { steps, .. } = Quantised::of(Group::Rotation, &[wild; 4], &precision);
        assert!(steps.iter().all(|s| s.abs() <= 1500));
    }
}
