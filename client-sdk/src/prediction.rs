//! Prediction of one's own vehicle: it answers the controls at once, and comes to be where the server says it is.
//!
//! Every input steps the arena's own logic here, for the tick that the input is meant for. A snapshot says where the
//! car really was some ticks ago: where the prediction for that tick was off, it starts again from there with the inputs
//! since. What is shown goes over to the new prediction smoothly, and at once where it is far off. Others are not
//! predicted: a collision with one comes as a correction. Pure: no clock, no network.

use std::{collections::VecDeque, time::Duration};

use glam::{DQuat, DVec3};
use pita_game::{ArenaSettings, BodyState, CarState, Controls as GameControls, Rehearsal};
use pita_protocol::{
    dof::{Group, Slice, kind},
    message::{ArenaSource, Controls},
};

/// Ticks that are kept: more than any lead; a prediction further ahead than that begins anew.
const PAST_MAX: usize = 64;
/// Below these a prediction was right: a few steps of the wire, m, m/s, rad. Speeds come as differences of positions.
const RIGHT_M: f64 = 0.02;
const RIGHT_M_PER_S: f64 = 0.3;
const RIGHT_RAD: f64 = 0.015;
/// Within these the car is still the one that was predicted, but for a push, m, m/s.
const NEAR_M: f64 = 0.5;
const NEAR_M_PER_S: f64 = 2.0;
/// What is shown goes over to a new prediction with this time constant.
const SMOOTHING: Duration = Duration::from_millis(100);
/// Further off than this it jumps, m: it was put somewhere else.
const SNAP_M: f64 = 2.0;
/// Shown ahead of the newest prediction for at most so long, ticks.
const EXTRAPOLATED_MAX: f64 = 2.0;

/// One's own vehicle, ahead of the server.
#[derive(Debug)]
pub struct Predictor {
    rehearsal: Rehearsal,
    /// Slices of the car's bodies, chassis first.
    slices: Vec<u32>,
    period_s: f64,
    /// In order of tick, without gaps; the oldest is the newest that the server confirmed.
    past: VecDeque<Predicted>,
    /// What is shown beyond what is predicted.
    offset: DVec3,
    turn: DQuat,
}

#[derive(Debug)]
struct Predicted {
    tick: u64,
    controls: GameControls,
    state: CarState,
}

impl Predictor {
    /// Of the car whose bodies have `slices`, in the arena of `source`.
    ///
    /// # Errors
    /// Text that says what is wrong with the arena.
    pub fn new(source: &ArenaSource, tick_hz: u16, slices: Vec<u32>) -> Result<Self, String> {
        let settings = ArenaSettings { tick_hz, threads: 1 };
        let read = |name: &str| {
            let found = source.files.iter().find(|file| file.name == name);
            found.map(|file| file.content.clone()).ok_or_else(|| "the server did not send it".to_owned())
        };
        let rehearsal = Rehearsal::from_toml_with(&source.toml, &settings, read);
        let rehearsal = rehearsal.map_err(|error| error.to_string())?;
        let period_s = 1.0 / f64::from(tick_hz);
        Ok(Self { rehearsal, slices, period_s, past: VecDeque::new(), offset: DVec3::ZERO, turn: DQuat::IDENTITY })
    }

    /// Slices of the car's bodies.
    pub fn slices(&self) -> &[u32] {
        &self.slices
    }

    /// The car is to be driven by `controls` at `tick`; those before it hold until then.
    pub fn drive(&mut self, tick: u64, controls: &Controls) {
        let Some(newest) = self.past.back() else { return };
        let (held, controls) = (newest.controls, to_game(controls));
        if tick.saturating_sub(newest.tick) > PAST_MAX as u64 {
            return self.past.clear();
        }
        for ahead in newest.tick + 1..=tick {
            self.step(ahead, if ahead == tick { controls } else { held });
        }
        let settled = (-self.period_s / SMOOTHING.as_secs_f64()).exp();
        self.offset *= settled;
        self.turn = DQuat::IDENTITY.slerp(self.turn, settled);
    }

    /// The server says that after `tick` the car's bodies were `bodies`. Answers by how much the newest prediction moved
    /// for it, m; `None` where there was none for that tick.
    pub fn reconcile(&mut self, tick: u64, bodies: Vec<BodyState>) -> Option<f64> {
        let newest = self.past.back().map(|newest| newest.tick);
        if newest.is_none_or(|newest| newest < tick) {
            self.begin(tick, bodies);
            return None;
        }
        while self.past.front().is_some_and(|oldest| oldest.tick < tick) {
            self.past.pop_front();
        }
        let confirmed = self.past.front_mut().filter(|oldest| oldest.tick == tick)?;
        if is_right(&confirmed.state.bodies, &bodies) {
            return Some(0.0);
        }
        confirmed.state.bodies = moved(&confirmed.state.bodies, bodies);
        let before = chassis(self.past.back()?)?;
        self.replay();
        let after = chassis(self.past.back()?)?;
        self.show_smoothly(before, after);
        Some(before.position.distance(after.position))
    }

    /// The car's bodies as they are to be shown at a fractional tick, in order of slice.
    pub fn at(&self, tick: f64) -> Option<Vec<Slice>> {
        let after = self.past.partition_point(|predicted| (predicted.tick as f64) < tick);
        let (from, to, part) = match (self.past.get(after.wrapping_sub(1)), self.past.get(after)) {
            (Some(from), Some(to)) => (from, to, tick - from.tick as f64),
            (None, Some(oldest)) => (oldest, oldest, 0.0),
            (Some(newest), None) => (newest, newest, (tick - newest.tick as f64).min(EXTRAPOLATED_MAX)),
            (None, None) => return None,
        };
        let is_between = from.tick != to.tick;
        let bodies = from.state.bodies.iter().zip(&to.state.bodies).map(|(a, b)| match is_between {
            true => BodyState {
                position: a.position.lerp(b.position, part),
                rotation: a.rotation.slerp(b.rotation, part),
                ..*b
            },
            false => carried_on(a, part * self.period_s),
        });
        let bodies: Vec<BodyState> = bodies.collect();
        let pivot = bodies.first()?.position;
        let mut shown: Vec<Slice> =
            self.slices.iter().zip(&bodies).map(|(&id, body)| self.shown(id, body, to.tick, pivot)).collect();
        shown.sort_unstable_by_key(|slice| slice.id);
        Some(shown)
    }

    fn begin(&mut self, tick: u64, bodies: Vec<BodyState>) {
        self.past.clear();
        let state = CarState { bodies, memory: self.rehearsal.state().memory };
        if self.rehearsal.set_state(&state) {
            self.past.push_back(Predicted { tick, controls: GameControls::default(), state });
        }
        (self.offset, self.turn) = (DVec3::ZERO, DQuat::IDENTITY);
    }

    fn step(&mut self, tick: u64, controls: GameControls) {
        self.rehearsal.step(controls);
        if self.past.len() == PAST_MAX {
            self.past.pop_front();
        }
        self.past.push_back(Predicted { tick, controls, state: self.rehearsal.state() });
    }

    /// Predicts again everything after the oldest state.
    fn replay(&mut self) {
        let Some(oldest) = self.past.front() else { return };
        if !self.rehearsal.set_state(&oldest.state) {
            return self.past.clear();
        }
        for predicted in self.past.iter_mut().skip(1) {
            self.rehearsal.step(predicted.controls);
            predicted.state = self.rehearsal.state();
        }
    }

    fn show_smoothly(&mut self, before: BodyState, after: BodyState) {
        self.offset += before.position - after.position;
        self.turn = (self.turn * before.rotation * after.rotation.inverse()).normalize();
        if self.offset.length() > SNAP_M || !self.turn.is_finite() {
            (self.offset, self.turn) = (DVec3::ZERO, DQuat::IDENTITY);
        }
    }

    fn shown(&self, id: u32, body: &BodyState, tick: u64, pivot: DVec3) -> Slice {
        let position = pivot + self.offset + self.turn * (body.position - pivot);
        let rotation = self.turn * body.rotation;
        let q = position.as_vec3().to_array().into_iter().chain(rotation.as_quat().to_array()).collect();
        let v = body.velocity.as_vec3().to_array().into_iter().chain(body.angular_velocity.as_vec3().to_array());
        let groups = vec![Group::Point, Group::Rotation];
        Slice { id, kind: kind::RIGID_BODY, tick, groups, q, v: v.collect() }
    }
}

fn chassis(predicted: &Predicted) -> Option<BodyState> {
    predicted.state.bodies.first().copied()
}

/// Whether the chassis was predicted well enough; wheels spin too fast to be compared.
fn is_right(predicted: &[BodyState], real: &[BodyState]) -> bool {
    let (Some(a), Some(b)) = (predicted.first(), real.first()) else { return false };
    a.position.distance(b.position) < RIGHT_M
        && a.velocity.distance(b.velocity) < RIGHT_M_PER_S
        && a.rotation.angle_between(b.rotation) < RIGHT_RAD
}

/// The car as it was predicted, moved to where its chassis is: speeds of single bodies come over the wire as differences
/// of rounded positions, and wheels whose spin does not fit their car brake it. `real` itself where they are far apart.
fn moved(predicted: &[BodyState], real: Vec<BodyState>) -> Vec<BodyState> {
    let (Some(&from), Some(&to)) = (predicted.first(), real.first()) else { return real };
    let is_near = from.position.distance(to.position) < NEAR_M && from.velocity.distance(to.velocity) < NEAR_M_PER_S;
    if !is_near || predicted.len() != real.len() {
        return real;
    }
    let turn = to.rotation * from.rotation.inverse();
    let faster = to.velocity - turn * from.velocity;
    let moved = |body: &BodyState| BodyState {
        position: to.position + turn * (body.position - from.position),
        rotation: (turn * body.rotation).normalize(),
        velocity: turn * body.velocity + faster,
        angular_velocity: turn * body.angular_velocity,
    };
    predicted.iter().map(moved).collect()
}

fn carried_on(body: &BodyState, seconds: f64) -> BodyState {
    let turn = DQuat::from_scaled_axis(body.angular_velocity * seconds);
    BodyState { position: body.position + body.velocity * seconds, rotation: turn * body.rotation, ..*body }
}

/// State of a rigid body as it came over the wire; `None` for other kinds.
pub fn body_state(slice: &Slice) -> Option<BodyState> {
    if slice.kind != kind::RIGID_BODY {
        return None;
    }
    let mut numbers = slice.q.iter().chain(&slice.v).map(|&x| f64::from(x));
    let mut next = || numbers.next();
    let position = DVec3::new(next()?, next()?, next()?);
    let rotation = DQuat::from_xyzw(next()?, next()?, next()?, next()?).normalize();
    let velocity = DVec3::new(next()?, next()?, next()?);
    let angular_velocity = DVec3::new(next()?, next()?, next()?);
    rotation.is_finite().then_some(BodyState { position, rotation, velocity, angular_velocity })
}

/// Controls in the words of the game.
fn to_game(input: &Controls) -> GameControls {
    GameControls::of([input.throttle, input.brake, input.steer], input.buttons)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLICES: [u32; 5] = [10, 11, 12, 13, 14];

    fn predictor() -> Predictor {
        let source = ArenaSource { toml: pita_game::Arena::DEFAULT.to_owned(), files: Vec::new() };
        Predictor::new(&source, 30, SLICES.to_vec()).unwrap()
    }

    fn controls(tick: u64) -> Controls {
        Controls { throttle: 0.7, steer: if tick % 40 < 20 { 0.5 } else { -0.5 }, ..Controls::default() }
    }

    /// The server: a rehearsal of its own, as it was after every tick.
    fn server(ticks: u64) -> Vec<Vec<BodyState>> {
        let mut rehearsal =
            Rehearsal::from_toml(pita_game::Arena::DEFAULT, &ArenaSettings { tick_hz: 30, threads: 1 }).unwrap();
        let mut past = vec![rehearsal.state().bodies];
        for tick in 1..=ticks {
            rehearsal.step(to_game(&controls(tick)));
            past.push(rehearsal.state().bodies);
        }
        past
    }

    #[test]
    fn what_nothing_disturbs_is_predicted_without_corrections() {
        let (real, mut predictor) = (server(150), predictor());
        assert_eq!((predictor.at(1.0), predictor.reconcile(0, real[0].clone())), (None, None));
        for tick in 1..=150u64 {
            predictor.drive(tick, &controls(tick));
            if let Some(seen) = tick.checked_sub(5) {
                let correction = predictor.reconcile(seen, real[seen as usize].clone()).unwrap();
                assert!(correction < 0.01, "{correction} m at tick {tick}");
            }
        }
        let shown = predictor.at(150.0).unwrap();
        assert_eq!(shown.iter().map(|slice| slice.id).collect::<Vec<_>>(), SLICES);
        assert!((f64::from(shown[0].q[0]) - real[150][0].position.x).abs() < 0.02);
        assert!(predictor.past.len() < 10);
    }

    /// Ground that is a mesh: without its file there is no prediction, with it the car stands on it.
    #[test]
    fn meshes_come_with_the_arena() {
        use pita_protocol::message::SourceFile;
        let toml = "name = \"hill\"\ntitle = \"Hill\"\nmax_players = 2\n[materials.rock]\nfriction = 1.0\n\
                    [[statics]]\nmesh = \"hill.obj\"\nmaterial = \"rock\"\n[[spawns]]\nposition = [0.0, 5.0, 0.0]\n";
        let mut source = ArenaSource { toml: toml.to_owned(), files: Vec::new() };
        let missing = Predictor::new(&source, 30, SLICES.to_vec()).unwrap_err();
        assert!(missing.contains("hill.obj") && missing.contains("did not send it"), "{missing}");
        let hill = "v -50 5 -50\nv 50 5 -50\nv 50 5 50\nv -50 5 50\nf 1 4 3\nf 1 3 2\n";
        source.files.push(SourceFile { name: "hill.obj".to_owned(), content: hill.into() });
        let mut predictor = Predictor::new(&source, 30, SLICES.to_vec()).unwrap();
        predictor.reconcile(0, predictor.rehearsal.state().bodies);
        (1..=30).for_each(|tick| predictor.drive(tick, &Controls::default()));
        let height = predictor.at(30.0).unwrap()[0].q[1];
        assert!((5.3..5.8).contains(&height), "{height}");
    }

    #[test]
    fn a_push_is_taken_over_smoothly_and_a_leap_at_once() {
        let (real, mut predictor) = (server(60), predictor());
        predictor.reconcile(0, real[0].clone());
        (1..=30).for_each(|tick| predictor.drive(tick, &controls(tick)));
        let pushed = |by: f64| -> Vec<BodyState> {
            real[25].iter().map(|b| BodyState { position: b.position + DVec3::Z * by, ..*b }).collect()
        };
        let before = predictor.at(30.0).unwrap()[0].q.clone();
        let correction = predictor.reconcile(25, pushed(0.5)).unwrap();
        assert!((correction - 0.5).abs() < 0.1, "{correction}");
        let after = predictor.at(30.0).unwrap()[0].q.clone();
        assert!((0..3).all(|i| (before[i] - after[i]).abs() < 1e-3), "{before:?} to {after:?}");
        (31..=45).for_each(|tick| predictor.drive(tick, &controls(tick)));
        assert!(predictor.offset.length() < 0.01, "it has gone over");
        predictor.reconcile(40, pushed(50.0));
        assert_eq!(predictor.offset, DVec3::ZERO);
    }

    #[test]
    fn what_cannot_be_is_survived() {
        let mut predictor = predictor();
        predictor.drive(5, &controls(5));
        let real = server(1);
        predictor.reconcile(100, real[0].clone());
        predictor.drive(u64::MAX, &controls(1));
        assert_eq!(predictor.at(3.0), None, "too far ahead to be stepped");
        predictor.reconcile(100, real[0].clone());
        assert_eq!(predictor.reconcile(3, Vec::new()), None);
        predictor.drive(101, &controls(1));
        predictor.reconcile(100, vec![BodyState { position: DVec3::NAN, ..real[0][0] }; 5]);
        predictor.reconcile(101, Vec::new());
        predictor.drive(102, &controls(1));
    }
}
