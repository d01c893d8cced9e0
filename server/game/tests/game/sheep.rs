//! Sheep: a flock walks, flees a car, is thrown about, gets up again, and stays where it belongs; in all three forms.

use pita_game::{ActorInfo, ArenaSettings, Controls};
use pita_sim::{DVec3, PartPoint};

use crate::test_track::{FLAT, SETTINGS, TestTrack};

/// Ground with one spawn point, from which a car drives along x.
const ROAD: &str = r#"
name = "road"
title = "A road"
max_players = 1
materials.asphalt.friction = 1.0
materials.wool.friction = 0.6

[[statics]]
shape.half_space = {}
material = "asphalt"

[[spawns]]
position = [-28.0, 0.0, 0.0]
"#;

const WOOL: &str = "\n[materials.wool]\nfriction = 0.6\n";

/// `count` rows of `count` sheep 3 m apart from (x, z) on, with more keys.
fn flock(count: usize, [x, z]: [f64; 2], keys: &str) -> String {
    format!(
        "[[actors]]\nkind = \"sheep\"\nposition = [{x:.1}, 0.0, {z:.1}]\n\
         copies = [{count}, 1, {count}]\nspacing = [3.0, 0.0, 3.0]\n{keys}\n"
    )
}

/// The forms, as files have them.
const FORMS: [&str; 3] = ["form = \"natural\"", "form = \"articulated\"", "form = \"rigid\""];

fn sheep(track: &TestTrack) -> Vec<ActorInfo> {
    track.arena.actors().filter(|actor| actor.kind == "sheep").cloned().collect()
}

/// Place, m, and uprightness of each sheep's body.
fn stand(track: &TestTrack) -> Vec<(DVec3, f64)> {
    let world = track.arena.world();
    let body = |info: &ActorInfo| {
        let serial = info.parts[0].slice;
        let id = world.bodies().iter().find(|&&id| world.serial(id) == Some(serial)).copied().unwrap();
        let frame = world.frame(id, PartPoint { part: 0, point: DVec3::ZERO }).unwrap();
        (DVec3::from(frame.position), DVec3::from(frame.arm(DVec3::Y)).y)
    };
    sheep(track).iter().map(body).collect()
}

fn run(track: &mut TestTrack, seconds: f64) -> usize {
    let mut iterations = 0;
    for tick in 0..(30.0 * seconds) as usize {
        track.tick();
        let report = track.arena.world().report();
        assert_eq!(report.quarantined, 0, "tick {tick}: {report:?}");
        assert!(report.worst_joint_gap < 0.05, "tick {tick}: {report:?}");
        iterations += report.iterations;
    }
    iterations
}

/// They keep on their feet, walk about, and graze: who stands still sleeps and costs nothing.
#[test]
fn a_flock_grazes_and_walks_on_its_feet() {
    for form in FORMS {
        let mut track = TestTrack::new(&format!("{FLAT}{WOOL}{}", flock(3, [30.0, 30.0], form)), SETTINGS);
        let start = stand(&track);
        let (mut iterations, mut asleep, mut farthest) = (0, 0, 0.0f64);
        for _ in 0..30 {
            iterations += run(&mut track, 1.0);
            asleep += track.arena.world().report().asleep;
            for (i, (at, upright)) in stand(&track).into_iter().enumerate() {
                assert!(upright > 0.9 && (at.y - 0.79).abs() < 0.08, "{form}, sheep {i}: {upright}, {at}");
                farthest = farthest.max(at.distance(start[i].0));
            }
        }
        assert!((1.0..25.0).contains(&farthest), "{form}: {farthest} m");
        assert!(asleep > 30, "{form}: {asleep} of 270 sheep seconds asleep");
        // Nine sheep for nine hundred ticks.
        assert!(iterations < 6 * 9 * 900, "{form}: {iterations} iterations");
    }
}

/// A car that drives straight at them meets nobody, unless they fear nothing.
#[test]
fn sheep_flee_a_car() {
    let met = |fear: &str| {
        let mut track = TestTrack::new(&format!("{ROAD}{}", flock(2, [2.0, -1.5], fear)), SETTINGS);
        track.enter(0);
        let mut nearest = f64::MAX;
        for _ in 0..30 * 6 {
            track.drive(0, Controls { throttle: 0.5, ..Controls::default() });
            track.tick();
            let car = track.car(0).position;
            nearest = stand(&track).iter().fold(nearest, |least, (at, _)| least.min(at.distance(car)));
        }
        assert!(track.car(0).position.x > 20.0, "it drove past: {}", track.car(0).position);
        nearest
    };
    let (afraid, fearless) = (met("fear_radius = 16.0"), met("fear_radius = 0.0"));
    assert!(afraid > 3.0 && fearless < 2.7, "{afraid} m and {fearless} m");
}

/// A tornado that comes near is fled like a car: they keep out of its reach, unless they fear nothing.
#[test]
fn sheep_flee_a_tornado() {
    let left = |fear: &str| {
        let tornado = "[[actors]]\nkind = \"tornado\"\nname = \"twister\"\nposition = [-10.0, 0.0, 31.0]\naway_time = 0.0\n\
                       legs = [{ to = [20.0, 0.0, 31.0], frequency = 0.05 }]\n";
        let text = format!("{FLAT}{WOOL}{}{tornado}", flock(2, [20.0, 30.0], fear));
        let mut track = TestTrack::new(&text, SETTINGS);
        let mut highest = 0.0f64;
        for _ in 0..30 * 12 {
            track.tick();
            highest = stand(&track).iter().fold(highest, |most, (at, _)| most.max(at.y));
        }
        highest
    };
    let (afraid, fearless) = (left("fear_radius = 16.0"), left("fear_radius = 0.0"));
    assert!(afraid < 1.5 && fearless > 5.0, "{afraid} m and {fearless} m high");
}

/// Who fears nothing is run over by a car at full speed, flies no faster than twice that, and gets up. What a car does to
/// the legs of a sheep differs from centimetre to centimetre, so it stands at ten places. Joints and rods are stiff or have no way to
/// open but in ticks that end at the cap of iterations: by more than 5 cm they do of a rigid sheep at one place in five, of
/// natural coordinates at one in forty.
#[test]
fn a_sheep_that_is_run_over_gets_up() {
    for (form, torn_at_most) in FORMS.into_iter().zip([2, 0, 5]) {
        let places = (0..10).map(|i| 10.0 + 0.5 * f64::from(i));
        let outcomes: Vec<_> = places.map(|place| run_over(form, place)).collect();
        let torn = outcomes.iter().filter(|(gap, _)| *gap >= 0.05).count();
        let knocked_over = outcomes.iter().filter(|(_, upright)| *upright < 0.7).count();
        assert!(knocked_over >= 6, "{form}: knocked over at {knocked_over} of 10 places");
        assert!(torn <= torn_at_most, "{form}: joints opened at {torn} of 10 places");
    }
}

/// Widest gap of a joint, m, of a sheep that a car runs over at `place`, m, and its least uprightness.
fn run_over(form: &str, place: f64) -> (f64, f64) {
    let keys = format!("{form}\nfear_radius = 0.0");
    let mut track = TestTrack::new(&format!("{ROAD}{}", flock(1, [place, 0.0], &keys)), SETTINGS);
    track.enter(0);
    let (mut fastest, mut least, mut car, mut gap) = (0.0f64, 1.0f64, 0.0f64, 0.0f64);
    for tick in 0..30 * 14 {
        // Full speed until it has hit; then it goes, and does not stand on top of it.
        match tick {
            0..150 => track.drive(0, Controls { throttle: 1.0, ..Controls::default() }),
            150 => track.leave(0),
            _ => {}
        }
        track.tick();
        if tick < 150 {
            car = car.max(track.car(0).velocity.length());
        }
        let world = track.arena.world();
        assert_eq!(world.report().quarantined, 0, "{form} at {place}, tick {tick}");
        gap = gap.max(world.report().worst_joint_gap);
        let sheep = sheep(&track).remove(0).parts[0].slice;
        let id = world.bodies().iter().find(|&&id| world.serial(id) == Some(sheep)).copied().unwrap();
        fastest = fastest.max(world.velocity(id).unwrap().length());
        least = least.min(stand(&track)[0].1);
    }
    assert!(car > 12.0 && fastest > 4.0 && fastest < 2.0 * car, "{form} at {place}: {fastest} m/s by a car at {car}");
    let (at, upright) = stand(&track)[0];
    assert!(upright > 0.9 && (at.y - 0.79).abs() < 0.1, "{form} at {place}: {upright} at {at}");
    (gap, least)
}

/// The tornado throws them about and they get up again, in every form.
#[test]
fn sheep_are_thrown_about_and_get_up() {
    for form in FORMS {
        let tornado = "[[actors]]\nkind = \"tornado\"\nposition = [0.0, 0.0, 31.0]\naway_time = 600.0\nstay_time = 8.0\n\
                       legs = [{ to = [70.0, 0.0, 31.0], frequency = 0.1 }]\n";
        let keys = format!("{form}\nfear_radius = 0.0");
        let text = format!("{FLAT}{WOOL}{}{tornado}", flock(2, [30.0, 30.0], &keys));
        let mut track = TestTrack::new(&text, SETTINGS);
        let mut highest = [0.0f64; 4];
        let mut fell = [false; 4];
        for _ in 0..25 * 30 {
            run(&mut track, 1.0 / 30.0);
            for (i, (at, upright)) in stand(&track).into_iter().enumerate() {
                highest[i] = highest[i].max(at.y);
                fell[i] |= highest[i] > 2.0 && at.y < 1.0 && upright < 0.7;
                assert!(at.y > 0.1 && at.is_finite(), "{form}, sheep {i}: {at}");
            }
        }
        let end = stand(&track);
        assert!(highest.iter().any(|&height| height > 5.0), "{form}: {highest:?}");
        assert!(fell.contains(&true), "{form}: {fell:?}");
        for (i, (at, upright)) in end.into_iter().enumerate() {
            assert!(upright > 0.9 && (at.y - 0.79).abs() < 0.1, "{form}, sheep {i}: {upright} at {at}");
        }
    }
}

/// The same sheep do the same, whatever the number of threads.
#[test]
fn sheep_repeat_themselves() {
    let hashes = |threads: usize| {
        let tornado = "[[actors]]\nkind = \"tornado\"\nposition = [15.0, 0.0, 31.0]\n\
                       legs = [{ to = [50.0, 0.0, 31.0], frequency = 0.2 }]\n";
        let text = format!("{FLAT}{WOOL}{}{tornado}", flock(2, [30.0, 30.0], "seed = 7"));
        let mut track = TestTrack::new(&text, ArenaSettings { threads, ..SETTINGS });
        let mut hashes = Vec::new();
        for _ in 0..10 {
            run(&mut track, 1.0);
            hashes.push(track.arena.world().state_hash());
        }
        hashes
    };
    let first = hashes(1);
    assert_eq!(first, hashes(2));
    assert!(first.windows(2).all(|pair| pair[0] != pair[1]), "nothing moves");
}
