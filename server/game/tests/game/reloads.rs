//! A running arena takes another text: what changes, what stays, and what is refused.

use pita_game::{ActorKinds, Controls, Reload, ReloadError, Supplies};

use crate::test_track::{FLAT, SETTINGS, TestTrack};

/// Flat ground with crates at both `places`, m along x.
fn text(places: [f64; 2]) -> String {
    let place =
        |x: f64| format!("[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nposition = [{x:?}, 0.0, 60.0]\n");
    format!("{FLAT}\n{}", places.map(place).concat())
}

fn between(old: &str, new: &str) -> Result<Reload, ReloadError> {
    Reload::between(old, new, &SETTINGS, &Supplies { kinds: &ActorKinds::built_in(), read: &|_| Err(String::new()) })
}

#[test]
fn actors_change_under_players_who_stay() {
    let (old, new) = (text([10.0, 20.0]), text([20.0, 30.0]));
    let mut track = TestTrack::new(&old, SETTINGS);
    track.enter(0);
    track.run(3.0, Controls { throttle: 0.5, ..Controls::default() });
    let ids = |track: &TestTrack, kind| -> Vec<u32> {
        track.arena.actors().filter(|actor| actor.kind == kind).map(|actor| actor.id).collect()
    };
    let (cars, car) = (ids(&track, "vehicle"), track.car(0));
    assert_eq!(ids(&track, "crate"), [0, 1]);
    let reload = between(&old, &new).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(reload.changes(), ["actors: 1 tables as they were, 1 built anew"]);
    track.arena.schedule(reload);
    track.tick();
    assert_eq!(ids(&track, "vehicle"), cars);
    assert!(track.car(0).position.distance(car.position) < 1.0, "the player drives on");
    let crates = ids(&track, "crate");
    assert_eq!(crates.len(), 2);
    assert!(crates[0] == 1 && crates[1] > cars[0], "one stayed, one is new: {crates:?}");
    let at = track.arena.world().position(track.arena.actor(crates[1]).unwrap().bodies()[0]).unwrap();
    assert!((at.x - 30.0).abs() < 0.01, "{at}");
    // And back again, from where it is now.
    track.arena.schedule(between(&new, &old).unwrap_or_else(|error| panic!("{error}")));
    track.tick();
    assert_eq!((ids(&track, "crate").len(), track.arena.world().body_count()), (2, 7));
}

#[test]
fn what_is_not_safe_or_not_valid_changes_nothing_and_says_so() {
    let old = text([10.0, 20.0]);
    let refusal = |new: &str| between(&old, new).err().map(|error| error.to_string()).unwrap_or_default();
    let slippery = old.replace("friction = 1.0", "friction = 0.5").replace("max_players = 64", "max_players = 9");
    let said = refusal(&slippery);
    assert!(said.starts_with("materials, max_players cannot change while the arena runs"), "{said}");
    let said = refusal(&old.replace("kind = \"crate\"", "kind = \"crane\""));
    assert!(said.contains("actors[0].kind is crane"), "{said}");
    assert_eq!(between(&old, &old).ok().map(|reload| reload.changes()), Some(Vec::new()));
}

#[test]
fn new_cars_have_the_new_parameters() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.enter(0);
    track.tick();
    let new = format!("{FLAT}\n[vehicle]\nchassis_mass = 2000.0\n");
    track.arena.schedule(between(FLAT, &new).unwrap_or_else(|error| panic!("{error}")));
    track.enter(1);
    track.tick();
    let mass = |slot| {
        let id = track.arena.actor_of(slot).expect("entered").id;
        track.arena.world().mass(track.arena.actor(id).expect("listed").bodies()[0])
    };
    assert_eq!((mass(0), mass(1)), (Some(1100.0), Some(2000.0)));
}
