//! The arenas that ship live by themselves: nothing leaves them, nothing bursts, and the same run gives the same bits.

use pita_game::combat::CombatParameters;
use pita_game::{Arena, ArenaSettings, arena_file, pipeline};
use pita_sim::DVec3;

use crate::test_track::{FULL_BRAKE, Recorder, SETTINGS, TestTrack};

/// Every arena that the server has built in, and the flat one of the tests.
const ARENAS: [(&str, &str); 5] = [
    ("proving-ground", Arena::DEFAULT),
    ("desert-town", include_str!("../../../../configs/arenas/desert-town.toml")),
    ("sheep-pasture", include_str!("../../../../configs/arenas/sheep-pasture.toml")),
    ("stress", include_str!("../../../../configs/arenas/stress.toml")),
    ("flat", include_str!("../../../../configs/arenas/flat.toml")),
];

/// No car, and nothing that cars and the tornado throw about, moves faster, m/s: within ten minutes of an arena up to 32.
const FASTEST: f64 = 45.0;

/// Most that an actor's bodies move at, m/s. A shot leaves a car at its own speed besides; a glove is as fast as its spring
/// makes it where nothing holds it.
fn speed_limit(kind: &str) -> f64 {
    let CombatParameters { glove, saw, grenade, .. } = CombatParameters::default();
    FASTEST
        + match kind {
            "glove" => glove.reach * (glove.stiffness / glove.mass).sqrt(),
            "saw" => saw.speed,
            "grenade" => grenade.speed[0].hypot(grenade.speed[1]),
            _ => 0.0,
        }
}

/// Runs an arena for `seconds` and answers its state hash.
fn run(name: &str, text: &str, seconds: usize, settings: &ArenaSettings) -> u64 {
    let mut arena = Arena::from_toml(text, settings).unwrap_or_else(|error| panic!("{name}: {error}"));
    arena.audit_energy();
    let mut gained = 0.0f64;
    let mut ports = Recorder::default();
    for tick in 0..seconds * usize::from(settings.tick_hz) {
        pipeline::tick(&mut arena, &mut ports);
        ports = Recorder::default();
        let world = arena.world();
        assert_eq!(world.report().quarantined, 0, "{name}, tick {tick}");
        gained = gained.max(world.report().energy_gain);
        assert!(!world.report().is_energy_burst(), "{name}, tick {tick}: {:?}", world.report());
        for actor in arena.actors() {
            let bodies = arena.actor(actor.id).expect("listed above").bodies();
            let fastest =
                bodies.iter().filter_map(|&body| world.velocity(body)).map(|v| v.length()).fold(0.0, f64::max);
            assert!(
                fastest < speed_limit(actor.kind),
                "{name}, tick {tick}: {} {} at {fastest} m/s",
                actor.kind,
                actor.id
            );
        }
        assert_eq!(arena.logic().lost, 0, "{name}, tick {tick}: something left the arena");
    }
    println!("{name}: {gained:.1} J from nowhere in a tick at most");
    arena.world().state_hash()
}

#[test]
fn shipped_arenas_live_by_themselves() {
    for (name, text) in ARENAS {
        let first = run(name, text, 20, &SETTINGS);
        assert_eq!(first, run(name, text, 20, &ArenaSettings { threads: 2, ..SETTINGS }), "{name}, with two threads");
    }
}

/// Ten minutes of an arena, twice: `cargo test -p pita-game --test game --release -- --ignored --nocapture ten_minutes`.
fn ten_minutes_of(arena: usize) {
    let (name, text) = ARENAS[arena];
    let first = run(name, text, 600, &SETTINGS);
    println!("{name}: {first:016x} after ten minutes");
    assert_eq!(first, run(name, text, 600, &SETTINGS), "{name}, twice");
}

#[test]
#[ignore = "takes minutes"]
fn ten_minutes_of_the_proving_ground() {
    ten_minutes_of(0);
}

#[test]
#[ignore = "takes minutes"]
fn ten_minutes_of_the_desert_town() {
    ten_minutes_of(1);
}

#[test]
#[ignore = "takes many minutes"]
fn ten_minutes_of_the_sheep_pasture() {
    ten_minutes_of(2);
}

#[test]
#[ignore = "takes minutes"]
fn ten_minutes_of_the_stress_arena() {
    ten_minutes_of(3);
}

/// The town's rock is a mesh: cars stand on it.
#[test]
fn the_towns_rock_bears_a_car() {
    let (_, town) = ARENAS[1];
    let town =
        town.replace("[[spawn_grids]]\ncount = [10, 13]\nspacing = [8.0, 6.0]", "[[spawns]]\nposition = [72, 3, -38]");
    let mut track = TestTrack::new(&town.replace("\"$drivers\"", "0"), SETTINGS);
    track.enter(0);
    track.run(3.0, FULL_BRAKE);
    let at = track.car(0).position;
    assert!((1.5..2.4).contains(&at.y) && at.with_y(0.0).distance(DVec3::new(72.0, 0.0, -38.0)) < 2.0, "{at}");
}

/// A tornado, sheep and a market come where they are asked for, and drivers as many as there are places.
#[test]
fn the_desert_town_has_a_storm_where_one_is_asked_for() {
    let (_, town) = ARENAS[1];
    let actors = |given: &[(&str, i64)]| {
        let given = given.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        let text = arena_file::with_parameters(town, &given).unwrap();
        let mut arena = Arena::from_toml(&text, &SETTINGS).unwrap_or_else(|error| panic!("{error}"));
        pipeline::tick(&mut arena, &mut Recorder::default());
        arena.logic().actors
    };
    let calm = actors(&[]);
    assert_eq!(actors(&[("storm", 1)]), calm + 1 + 40 + 96);
    assert_eq!(actors(&[("drivers", 128)]), calm + 128 - 6);
    let many = [("drivers".to_owned(), 129)].into();
    let error = arena_file::with_parameters(town, &many).unwrap_err().to_string();
    assert!(error.contains("drivers is 129") && error.contains("0 to 128"), "{error}");
}

#[test]
fn the_stress_arena_is_as_large_as_it_is_asked_to_be() {
    let (_, text) = ARENAS[3];
    for (size, bodies) in [(1, 9), (10, 540), (48, 11_712)] {
        let text = arena_file::with_parameters(text, &[("size".to_owned(), size)].into()).unwrap();
        let arena = Arena::from_toml(&text, &SETTINGS).unwrap_or_else(|error| panic!("{error}"));
        let cars = 2 * 5;
        assert_eq!(arena.world().body_count(), bodies + cars, "of size {size}");
    }
}
