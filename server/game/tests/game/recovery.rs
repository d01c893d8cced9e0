//! The arena's own drivers free themselves from wherever they are put, in a stated time.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use pita_game::driver::recovery::{GIVE_UP_TIME, PROGRESS};
use pita_sim::{DQuat, DVec3};

use crate::test_track::{FLAT, FULL_BRAKE, SETTINGS, TestTrack};

const DRIVER: &str = r#"
[[drivers]]
name = "Ada"
route = "square"
speed = 15.0

[routes.square]
corners = [[60.0, 60.0], [-60.0, 60.0], [-60.0, -60.0], [60.0, -60.0]]
"#;

/// Flat ground, a driver in it, and `statics`, aside from where cars start.
fn track(statics: &str) -> TestTrack {
    let ground = FLAT.replace("count = [8, 8]", "count = [8, 8]\ncenter = [0.0, 0.0, 150.0]");
    TestTrack::new(&format!("{ground}\n{statics}\n{DRIVER}"), SETTINGS)
}

fn block(half: [f64; 3], position: [f64; 3]) -> String {
    format!("[[statics]]\nshape.box.half = {half:?}\nmaterial = \"asphalt\"\nposition = {position:?}\n")
}

/// The driver's id: everybody else comes later.
fn driver(track: &TestTrack) -> u32 {
    track.arena.actors().next().unwrap().id
}

/// Time until the driver has come on from `place`, s; he comes from rest, all players brake.
fn frees_himself(what: &str, track: &mut TestTrack, place: DVec3, turn: DQuat) -> f64 {
    let (id, players) = (driver(track), track.arena.actors().filter_map(|info| info.slot).collect::<Vec<_>>());
    track.place_actor(id, place, turn, DVec3::ZERO);
    let most = GIVE_UP_TIME + 2.0;
    for tick in 0..(30.0 * most) as usize {
        players.iter().for_each(|&slot| track.drive(slot, FULL_BRAKE));
        track.tick();
        let car = track.part_of(id, 0);
        assert_eq!(track.quarantined(), 0, "{what}");
        if car.position.distance(place) > PROGRESS {
            let time = tick as f64 / 30.0;
            eprintln!("{what}: free after {time:.1} s");
            return time;
        }
    }
    panic!("{what}: still there after {most} s, {:?}", track.part_of(id, 0));
}

/// Whoever was freed drives on: he comes to a corner of his route.
fn drives_on(what: &str, track: &mut TestTrack) {
    let id = driver(track);
    for _ in 0..60 * 30 {
        track.tick();
        let at = track.part_of(id, 0).position;
        if (at.x.abs() - 60.0).abs() < 10.0 && (at.z.abs() - 60.0).abs() < 10.0 {
            return;
        }
    }
    panic!("{what}: it came to no corner, {:?}", track.part_of(id, 0));
}

const HEIGHT: f64 = 0.54;

#[test]
fn who_is_wedged_under_a_ramp_frees_himself() {
    // Its low end is at −x: the car's nose is where it is just as high as the car.
    let ramp = format!("{}pitch = 12.0\n", block([6.0, 0.2, 3.0], [0.0, 1.3, 0.0]));
    for (x, push) in [(3.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (3.0, 12.0)] {
        let what = format!("under a ramp at {x}, at {push} m/s");
        let mut track = track(&ramp);
        let place = DVec3::new(x, HEIGHT, 0.0);
        let id = driver(&track);
        track.place_actor(id, place, DQuat::from_rotation_y(PI), DVec3::NEG_X * push);
        (0..15).for_each(|_| track.tick());
        let (place, turn) = (track.part_of(id, 0).position, track.part_of(id, 0).rotation);
        frees_himself(&what, &mut track, place, turn);
        drives_on(&what, &mut track);
    }
}

#[test]
fn whose_nose_is_in_a_corner_frees_himself() {
    let corner = block([0.5, 2.0, 10.0], [8.0, 2.0, 0.0]) + &block([10.0, 2.0, 0.5], [0.0, 2.0, 8.0]);
    let mut track = track(&corner);
    frees_himself("in a corner", &mut track, DVec3::new(5.6, HEIGHT, 5.6), DQuat::from_rotation_y(-FRAC_PI_4));
    drives_on("in a corner", &mut track);
}

#[test]
fn who_lies_on_his_roof_or_side_frees_himself() {
    for (what, roll) in [("on its roof", PI), ("on its side", FRAC_PI_2)] {
        let mut track = track("");
        frees_himself(what, &mut track, DVec3::Y * 1.0, DQuat::from_rotation_x(roll));
        drives_on(what, &mut track);
    }
}

/// Nose and tail against parked cars, and walls beside them.
#[test]
fn who_is_between_two_cars_frees_himself() {
    let walls = block([6.0, 1.0, 0.2], [0.0, 1.0, 1.4]) + &block([6.0, 1.0, 0.2], [0.0, 1.0, -1.4]);
    let mut track = track(&walls);
    track.enter(0);
    track.enter(1);
    track.tick();
    for (slot, x) in [(0, 4.0), (1, -4.0)] {
        track.place(slot, DVec3::new(x, HEIGHT, 0.0), DQuat::IDENTITY, DVec3::ZERO);
    }
    frees_himself("between two cars", &mut track, DVec3::Y * HEIGHT, DQuat::IDENTITY);
}

/// On a post that its underside lies on: no wheel touches anything.
#[test]
fn who_is_high_centred_frees_himself() {
    let mut track = track(&block([1.0, 0.7, 0.5], [0.0, 0.7, 0.0]));
    frees_himself("high-centred", &mut track, DVec3::Y * 1.9, DQuat::IDENTITY);
    drives_on("high-centred", &mut track);
}

/// A pit without a way out.
#[test]
fn who_cannot_get_out_is_given_a_new_start() {
    let wall = |x: f64, z: f64| {
        let half = if x == 0.0 { [5.0, 3.0, 0.5] } else { [0.5, 3.0, 5.0] };
        block(half, [x, 3.0, z])
    };
    let mut track = track(&[wall(4.5, 0.0), wall(-4.5, 0.0), wall(0.0, 4.5), wall(0.0, -4.5)].concat());
    let time = frees_himself("in a pit", &mut track, DVec3::Y * HEIGHT, DQuat::IDENTITY);
    assert!(time > 0.8 * GIVE_UP_TIME, "nothing else helps: {time} s");
}

#[test]
fn a_wall_before_the_corner_is_rounded() {
    let mut track = track(&block([0.5, 2.0, 4.0], [-40.0, 2.0, 60.0]));
    let (id, mut least) = (driver(&track), f64::INFINITY);
    for _ in 0..60 * 30 {
        track.tick();
        let at = track.part_of(id, 0).position.with_y(0.0);
        least = least.min(at.distance(DVec3::new(-60.0, 0.0, 60.0)));
    }
    assert!(least < 10.0, "it came no nearer to the corner behind the wall than {least} m");
}

/// Nobody in the town as it ships stays in one place for long.
#[test]
fn drivers_of_the_desert_town_keep_going() {
    let mut track = TestTrack::new(include_str!("../../../../configs/arenas/desert-town.toml"), SETTINGS);
    let cars: Vec<u32> = track.arena.actors().filter(|info| info.kind == "vehicle").map(|info| info.id).collect();
    let mut since = vec![(DVec3::INFINITY, 0usize); cars.len()];
    let mut longest = 0;
    for tick in 0..120 * 30 {
        track.tick();
        for (car, since) in cars.iter().zip(&mut since) {
            let at = track.part_of(*car, 0).position;
            if at.distance(since.0) > PROGRESS || !since.0.is_finite() {
                *since = (at, tick);
            }
            longest = longest.max(tick - since.1);
        }
    }
    let longest = longest as f64 / 30.0;
    // Who is knocked out lies there for three seconds more.
    eprintln!("longest without coming on: {longest} s");
    assert!(longest < GIVE_UP_TIME + 3.5, "somebody did not come on for {longest} s");
}
