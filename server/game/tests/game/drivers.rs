//! The arena's own drivers: they follow routes, hunt, flee, fill places and give way.

use pita_game::ArenaEvent;
use pita_sim::DVec3;

use crate::test_track::{COAST, FLAT, FULL_BRAKE, SETTINGS, TestTrack};

const ROUTE: &str = "\n[routes.square]\ncorners = [[40.0, 40.0], [-40.0, 40.0], [-40.0, -40.0], [40.0, -40.0]]\n";

fn track(extra: &str) -> TestTrack {
    TestTrack::new(&format!("{FLAT}\n{extra}\n{ROUTE}"), SETTINGS)
}

fn driver(behaviour: &str) -> String {
    format!("[[drivers]]\nname = \"Ada\"\nroute = \"square\"\nspeed = 15.0\nbehaviour = \"{behaviour}\"\n")
}

/// Where the first actor is, m.
fn first(track: &TestTrack) -> DVec3 {
    let slice = track.arena.actors().next().unwrap().parts[0].slice;
    let found = track.arena.world().slices().find(|s| s.serial == slice).unwrap();
    DVec3::new(found.q[0], found.q[1], found.q[2])
}

#[test]
fn a_route_is_followed_round_and_round() {
    let mut track = track(&driver("route"));
    let corners = [[40.0, 40.0], [-40.0, 40.0], [-40.0, -40.0], [40.0, -40.0]];
    let mut visits = [0; 4];
    let mut was_near = [false; 4];
    for _ in 0..60 * 30 {
        track.tick();
        let at = first(&track);
        for (i, [x, z]) in corners.into_iter().enumerate() {
            let is_near = at.with_y(0.0).distance(DVec3::new(x, 0.0, z)) < 10.0;
            visits[i] += u32::from(is_near && !was_near[i]);
            was_near[i] = is_near;
        }
    }
    assert!(visits.iter().all(|&n| n >= 2), "{visits:?}");
}

#[test]
fn a_hunter_comes_to_its_victim_and_who_flees_stays_away() {
    let least_distance = |behaviour: &str| {
        let mut track = track(&driver(behaviour));
        track.enter(0);
        let mut least = f64::INFINITY;
        for _ in 0..15 * 30 {
            track.drive(0, FULL_BRAKE);
            track.tick();
            least = least.min(first(&track).distance(track.car(0).position));
        }
        least
    };
    let (hunter, flees) = (least_distance("hunt"), least_distance("flee"));
    assert!(hunter < 5.0, "the hunter came no nearer than {hunter} m");
    assert!(flees > 12.0, "who flees came as near as {flees} m");
}

#[test]
fn hunters_fire_at_what_is_in_front_of_them() {
    let mut track = track(&format!("[combat]\nweapons = [\"saw\"]\n{}", driver("hunt")));
    track.enter(0);
    for _ in 0..40 * 30 {
        track.drive(0, FULL_BRAKE);
        track.tick();
    }
    let is_saw = |event: &&ArenaEvent| matches!(event, ArenaEvent::ActorAdded(info) if info.kind == "saw");
    let shots = track.ports.events.iter().filter(is_saw).count();
    assert!(shots > 1, "{shots} shots");
}

#[test]
fn places_are_filled_and_given_up_to_players() {
    let ai = "[ai]\ndrivers = 3\nroute = \"square\"\nspeed = 15.0\nbehaviours = [\"route\", \"hunt\", \"flee\"]\n";
    let mut track = track(ai);
    let ids = |track: &TestTrack| -> Vec<u32> { track.arena.actors().map(|info| info.id).collect() };
    assert_eq!(ids(&track).len(), 3);
    let names: Vec<String> = track.arena.actors().map(|info| info.name.clone()).collect();
    assert_eq!(names, ["Ada", "Emmy", "Sofia"]);
    let before = ids(&track);
    track.enter(0);
    track.enter(1);
    track.tick();
    assert_eq!(ids(&track)[0], before[0], "the last who came goes first");
    assert_eq!(ids(&track).len(), 3);
    track.run(1.0, COAST);
    track.leave(0);
    track.tick();
    assert_eq!(ids(&track).len(), 3);
    assert!(track.arena.actor_of(1).is_some());
}

#[test]
fn a_minute_of_hunters_is_the_same_twice() {
    let hash = || {
        let ai = "[combat]\n[ai]\ndrivers = 6\nroute = \"square\"\nspeed = 15.0\nbehaviours = [\"hunt\", \"flee\"]\n";
        let mut track = track(ai);
        let mut quarantined = 0;
        for _ in 0..60 * 30 {
            track.tick();
            quarantined += track.arena.world().report().quarantined;
        }
        assert_eq!(quarantined, 0);
        let harmed = track.ports.events.iter().filter(|e| matches!(e, ArenaEvent::KnockedOut { .. })).count();
        (track.arena.world().state_hash(), harmed)
    };
    let (first, second) = (hash(), hash());
    assert_eq!(first, second);
    eprintln!("{} knock-outs", first.1);
}

/// The desert town as it is shipped: nobody plays, and there is something to see.
#[test]
fn a_minute_in_the_desert_town_is_a_fight() {
    let mut track = TestTrack::new(include_str!("../../../../configs/arenas/desert-town.toml"), SETTINGS);
    for tick in 0..60 * 30 {
        track.tick();
        let world = track.arena.world();
        assert_eq!(world.report().quarantined, 0, "tick {tick}");
        let vehicles = track.arena.actors().filter(|info| info.kind == "vehicle");
        let chassis: Vec<u32> = vehicles.map(|info| info.parts[0].slice).collect();
        for slice in world.slices().filter(|slice| chassis.contains(&slice.serial)) {
            let speed = slice.v[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!(speed < 60.0, "tick {tick}: {speed} m/s");
        }
    }
    let is_weapon = |event: &&ArenaEvent| matches!(event, ArenaEvent::ActorAdded(info) if pita_game::combat::Weapon::is_kind(info.kind));
    let shots = track.ports.events.iter().filter(is_weapon).count();
    let knock_outs = track.ports.events.iter().filter(|e| matches!(e, ArenaEvent::KnockedOut { .. })).count();
    assert!(shots > 5 && knock_outs > 2, "{shots} shots, {knock_outs} knock-outs");
}
