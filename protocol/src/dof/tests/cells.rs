//! Streams of cells: who watches which layers, loses what, and what is said where nothing happens.

use super::*;

/// A receiver of a cell's first `layers` layers over a link that loses `lost` of 100, and what it lacked.
struct Watcher {
    decoder: CellDecoder,
    layers: u8,
    lost: u64,
    dice: Dice,
    decoded: usize,
    unreadable: usize,
    asked: usize,
    /// When the answer comes.
    answer_at: Option<u64>,
}

impl Watcher {
    fn new(layers: u8, lost: u64) -> Self {
        let (decoder, dice) = (CellDecoder::default(), Dice(5));
        Self { decoder, layers, lost, dice, decoded: 0, unreadable: 0, asked: 0, answer_at: None }
    }

    /// Takes what was coded, unless it is lost; asks for keyframes where it has to, which takes three ticks. What it decodes
    /// has to be `state`.
    fn take(&mut self, tick: u64, coded: &Coded, encoder: &CellEncoder, state: &State) {
        if self.answer_at.take_if(|at| *at <= tick).is_some() {
            let have = encoder.epoch().iter().position(|keyframe| Some(keyframe.tick) == self.decoder.keyframe());
            for keyframe in &encoder.epoch()[have.map_or(0, |have| have + 1)..] {
                self.decoder.decode(keyframe.tick, &keyframe.dof, true).unwrap();
            }
        }
        if coded.layer >= self.layers || self.dice.roll(100) < self.lost {
            return;
        }
        let newest = tick - u64::from(coded.keyframe_age);
        if coded.keyframe_age > 0 && !self.decoder.has(newest) && self.answer_at.is_none() {
            (self.asked, self.answer_at) = (self.asked + 1, Some(tick + 3));
        }
        match self.decoder.decode(tick, &coded.dof, coded.keyframe_age == 0) {
            Ok(frame) => {
                assert_eq!(known(&frame), told(state));
                self.decoded += 1;
            }
            Err(error) => {
                assert_eq!(error, WireError::NoBaseline);
                self.unreadable += 1;
            }
        }
    }
}

#[test]
fn a_cell_survives_loss_and_who_lacks_a_keyframe_catches_up() {
    let mut toys = Toys::new(31, 60);
    let mut encoder = CellEncoder::new(Cadence::default());
    let [mut all, mut half, mut keyframes, mut late] =
        [(4, 20), (3, 20), (1, 0), (4, 0)].map(|(l, p)| Watcher::new(l, p));
    let mut layers = [0; 4];
    for tick in 1..400 {
        toys.step();
        if tick % 50 == 0 {
            toys.add();
            toys.bodies.remove(0);
        }
        let state = toys.state();
        let Some(due) = encoder.due(tick, &state) else { panic!("toys are never all at rest") };
        let coded = encoder.encode(tick, &state, due, &[]);
        layers[usize::from(coded.layer)] += 1;
        for watcher in [&mut all, &mut half, &mut keyframes] {
            watcher.take(tick, &coded, &encoder, &state);
        }
        if tick > 300 {
            late.take(tick, &coded, &encoder, &state);
        }
    }
    assert_eq!(layers, [50, 50, 100, 199]);
    let found = |watcher: &Watcher| (watcher.decoded, watcher.unreadable, watcher.asked);
    let all_found = found(&all);
    assert!(all.decoded > 290 && (5..20).contains(&all.asked) && all.unreadable < 12, "{all_found:?}");
    assert!(half.decoded > 140 && half.unreadable < 12, "{:?}", found(&half));
    assert_eq!(found(&keyframes), (50, 0, 0));
    assert_eq!(found(&late), (96, 3, 1));
    assert!(all.decoder.frames() <= 8, "keyframes alone are kept");
}

#[test]
fn a_cell_tells_what_went_and_came_back_and_then_is_quiet() {
    let state = |x: f64, bodies: u32| {
        let mut state = State::new(Precision::default()).unwrap();
        for id in 0..bodies {
            let q = [f64::from(id) + x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            state.push(id, kind::RIGID_BODY, None, &RIGID, &q).unwrap();
        }
        state
    };
    let (mut encoder, mut decoder) = (CellEncoder::new(Cadence::default()), CellDecoder::default());
    let mut told_at = Vec::new();
    let mut seen = None;
    for tick in 1..200 {
        let now = match tick {
            20 => state(0.1, 2),
            40.. => state(0.0, 1),
            _ => state(0.0, 2),
        };
        if let Some(due) = encoder.due(tick, &now) {
            let coded = encoder.encode(tick, &now, due, &[]);
            seen = Some(decoder.decode(tick, &coded.dof, coded.keyframe_age == 0).unwrap());
            told_at.push((tick, coded.layer));
        }
        assert_eq!(known(seen.as_ref().unwrap()), told(&now), "tick {tick}, told at {told_at:?}");
    }
    assert!(told_at.len() < 40, "{told_at:?}");
    let gaps = told_at.windows(2).map(|pair| pair[1].0 - pair[0].0);
    assert!(gaps.max().unwrap() <= 32, "{told_at:?}");
}

#[test]
fn a_crowd_that_appears_at_once_is_a_keyframe() {
    let mut encoder = CellEncoder::new(Cadence::default());
    let few = Toys::new(4, 3).state();
    let mut many = Toys::new(4, 200);
    let due = encoder.due(1, &few).unwrap();
    let epoch = encoder.encode(1, &few, due, &[]);
    let due = encoder.due(3, &many.state()).unwrap();
    assert_eq!(due, Due::Keyframe);
    let crowd = encoder.encode(3, &many.state(), due, &[]);
    assert!(epoch.keyframe_age == 0 && (crowd.layer, crowd.keyframe_age) == (0, 0));
    // What is coded against it is smaller. Its epoch is full, and the next one begins anew.
    many.step();
    assert_eq!(encoder.due(4, &many.state()), Some(Due::Delta));
    assert!(encoder.encode(4, &many.state(), Due::Delta, &[]).dof.len() < crowd.dof.len());
    assert_eq!(encoder.due(20, &many.state()), Some(Due::Epoch));
}

#[test]
fn every_cadence_can_be_followed() {
    for keyframe_ticks_log2 in 0..=5 {
        let mut toys = Toys::new(77, 20);
        let cadence = Cadence { keyframe_ticks_log2, epoch_keyframes: 12, ..Cadence::default() };
        let mut encoder = CellEncoder::new(cadence);
        let mut watcher = Watcher::new(cadence.layers(), 0);
        for tick in 1..300 {
            toys.step();
            let state = toys.state();
            let Some(due) = encoder.due(tick, &state) else { panic!("toys are never all at rest") };
            let coded = encoder.encode(tick, &state, due, &[]);
            watcher.take(tick, &coded, &encoder, &state);
        }
        let found = (watcher.decoded, watcher.unreadable, watcher.asked);
        assert_eq!(found, (299, 0, 0), "keyframes each {} ticks", 1 << keyframe_ticks_log2);
    }
}
