//! The scripts drive a kinematic bicycle: no network, no engine.

use std::time::Instant;

use glam::{Quat, Vec3};
use pita_protocol::{
    dof::{Decoder, Encoder, Group, Precision, State, kind},
    message::{ActorDescription, Description, InputAck, PartDescription, Shape, Snapshot},
};

use super::*;
use crate::{
    ReceivedSnapshot, Roster,
    bodies::{Bodies, Source},
};

const DT: f32 = 1.0 / 30.0;
const WHEELBASE: f32 = 2.6;
const LOCK_RAD: f32 = 0.5;

#[derive(Clone, Copy)]
struct Car {
    position: Vec3,
    heading: f32,
    speed: f32,
}

impl Car {
    fn at(x: f32, z: f32) -> Self {
        Self { position: Vec3::new(x, 0.5, z), heading: 0.0, speed: 0.0 }
    }

    fn velocity(&self) -> Vec3 {
        Quat::from_rotation_y(self.heading) * Vec3::X * self.speed
    }

    fn step(&mut self, controls: &Controls) {
        controls.validate().unwrap();
        self.speed = (self.speed + DT * (6.0 * controls.throttle - 9.0 * controls.brake - 0.1 * self.speed)).max(0.0);
        self.heading -= DT * self.speed * (controls.steer * LOCK_RAD).tan() / WHEELBASE;
        self.position += DT * self.velocity();
    }
}

fn roster(count: u32) -> Roster {
    let part = |slice| PartDescription::of_body(slice, Shape::Ball { radius: 1.0 });
    let car = |id| ActorDescription {
        id,
        kind: "vehicle".into(),
        name: format!("car {id}"),
        slot: None,
        parts: vec![part(10 * id)],
    };
    Roster::new(&Description {
        arena: "a".into(),
        title: "A".into(),
        tick: 0,
        event_sequence: 0,
        gravity: [0.0; 3],
        precision: Precision::default(),
        scores: Vec::new(),
        statics: Vec::new(),
        actors: (0..count).map(car).collect(),
    })
}

fn snapshot(tick: u64, cars: &[Car]) -> ReceivedSnapshot {
    let mut state = State::new(Precision::default()).unwrap();
    for (car, id) in cars.iter().zip(0..) {
        let rotation = Quat::from_rotation_y(car.heading).to_array();
        let q = car.position.to_array().into_iter().chain(rotation);
        let numbers: Vec<_> = q.chain(car.velocity().to_array()).chain([0.0; 3]).map(f64::from).collect();
        let layout = [Group::Point, Group::Rotation, Group::Rate, Group::Rate];
        state.push(10 * id, kind::RIGID_BODY, None, &layout, &numbers).unwrap();
    }
    let dof = Encoder::default().encode(tick, &state, &[]);
    let frame = Decoder::default().decode(tick, &dof).unwrap();
    let head = Snapshot { epoch: 0, tick, ack: InputAck::default(), event_sequence: 0, cells: None, dof };
    let mut bodies = Bodies::default();
    bodies.take(Source::Own, &frame, &[], |_| false);
    ReceivedSnapshot::new(head, bodies.gather(tick), 30.0, Instant::now())
}

/// Lets every car be driven for `ticks` and shows each state to `watch`.
fn drive(mut cars: Vec<Car>, mut scripts: Vec<Box<dyn Script>>, ticks: u64, mut watch: impl FnMut(&[Car])) {
    let roster = roster(cars.len() as u32);
    for tick in 1..=ticks {
        let snapshot = snapshot(tick, &cars);
        for ((car, script), id) in cars.iter_mut().zip(&mut scripts).zip(0..) {
            let view = View::of(&snapshot, &roster, id).unwrap();
            car.step(&script.drive(&view, tick));
        }
        watch(&cars);
    }
}

#[test]
fn the_circle_comes_back_to_where_it_was() {
    let (mut path, mut farthest, mut turned) = (0.0, 0.0f32, 0.0);
    drive(vec![Car::at(0.0, 0.0)], vec![ScriptKind::Circle.script(1)], 900, |cars| {
        path += DT * cars[0].speed;
        farthest = farthest.max(cars[0].position.length());
        turned = cars[0].heading;
    });
    assert!(path > 150.0 && farthest < 60.0, "path {path} m, farthest {farthest} m");
    assert!(turned > std::f32::consts::TAU, "left is counter-clockwise: {turned} rad");
}

#[test]
fn wandering_covers_ground_and_stays_about() {
    for seed in 0..20 {
        let (mut path, mut farthest) = (0.0, 0.0f32);
        drive(vec![Car::at(0.0, 0.0)], vec![ScriptKind::Wander.script(seed)], 3000, |cars| {
            path += DT * cars[0].speed;
            farthest = farthest.max(cars[0].position.length());
        });
        assert!(path > 600.0 && farthest < 120.0, "seed {seed}: path {path} m, farthest {farthest} m");
    }
}

#[test]
fn the_same_seed_wanders_the_same_way() {
    let end = |seed| {
        let mut end = Vec3::ZERO;
        drive(vec![Car::at(0.0, 0.0)], vec![ScriptKind::Wander.script(seed)], 600, |cars| end = cars[0].position);
        end
    };
    assert_eq!(end(3), end(3));
    assert!(end(3).distance(end(4)) > 1.0);
}

#[test]
fn the_chase_reaches_the_nearest_and_lets_go() {
    let cars = vec![Car::at(0.0, 0.0), Car::at(30.0, 40.0), Car::at(-90.0, 0.0)];
    let scripts: Vec<Box<dyn Script>> = vec![ScriptKind::Chase.script(5), Box::new(Parked), Box::new(Parked)];
    let (mut nearest, mut last) = (f32::MAX, 0.0);
    drive(cars, scripts, 900, |cars| {
        let distance = cars[0].position.distance(cars[1].position);
        nearest = nearest.min(distance);
        last = distance;
        assert!(cars[0].position.distance(cars[2].position) > 20.0);
    });
    assert!(nearest < 6.0, "came no nearer than {nearest} m");
    assert!(last < 120.0);
}

struct Parked;

impl Script for Parked {
    fn drive(&mut self, _view: &View, _tick: u64) -> Controls {
        Controls::default()
    }
}
