//! Entering, leaving, and being put back.

use pita_game::{Arena, ArenaEvent, Controls};
use pita_sim::DVec3;

use crate::test_track::{FLAT, FULL_THROTTLE, SETTINGS, TestTrack};

#[test]
fn leaving_takes_the_car_and_all_its_bodies_out() {
    let mut track = TestTrack::new(Arena::DEFAULT, SETTINGS);
    let bodies = track.arena.world().body_count();
    track.enter(7);
    track.run(0.5, Controls::default());
    let id = track.arena.actor_of(7).expect("entered").id;
    assert_eq!(track.arena.world().body_count(), bodies + 5);
    track.leave(7);
    track.tick();
    assert_eq!(track.arena.world().body_count(), bodies);
    assert!(track.arena.actor_of(7).is_none());
    let left = ArenaEvent::Left { slot: 7, reason: "left".to_owned() };
    assert_eq!(track.arena.events(), [ArenaEvent::ActorRemoved(id), left]);
    track.leave(7);
    track.tick();
    assert!(track.arena.events().is_empty(), "leaving twice is nothing");
}

#[test]
fn actor_ids_and_slices_are_never_used_again() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    let (mut ids, mut slices) = (Vec::new(), Vec::new());
    for _ in 0..10 {
        track.enter(0);
        track.tick();
        let info = track.arena.actor_of(0).expect("entered");
        ids.push(info.id);
        slices.extend(info.parts.iter().map(|part| part.slice));
        track.leave(0);
    }
    assert!(ids.is_sorted_by(|a, b| a < b), "{ids:?}");
    assert!(slices.is_sorted_by(|a, b| a < b), "{slices:?}");
}

#[test]
fn who_enters_a_taken_slot_replaces_and_a_slot_that_is_not_there_is_refused() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.enter(0);
    track.tick();
    let bodies = track.arena.world().body_count();
    track.enter(0);
    track.tick();
    assert_eq!(track.arena.world().body_count(), bodies);
    track.enter(64);
    track.tick();
    let reason = "slot 64 does not exist, there are 64".to_owned();
    assert_eq!(track.arena.events(), [ArenaEvent::Left { slot: 64, reason }]);
    assert_eq!(track.arena.world().body_count(), bodies);
}

#[test]
fn as_many_players_as_there_are_slots_spawn_apart() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    for slot in 0..64 {
        track.enter(slot);
    }
    track.tick();
    let at: Vec<DVec3> = (0..64).map(|slot| track.car(slot).position).collect();
    for (i, a) in at.iter().enumerate() {
        assert!(at[..i].iter().all(|b| a.distance(*b) > 5.0), "{a}");
    }
}

#[test]
fn more_players_than_spawn_points_find_room_above() {
    let text = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let mut track = TestTrack::new(&text, SETTINGS);
    for slot in 0..5 {
        track.enter(slot);
    }
    track.run(10.0, Controls::default());
    for slot in 0..5 {
        let car = track.car(slot);
        assert!(car.position.is_finite() && car.position.y > 0.2 && car.position.length() < 50.0, "{car:?}");
    }
}

#[test]
fn a_crowd_on_taken_spawn_points_stays_within_the_bounds() {
    let crates = "[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nposition = [-9.0, 0.0, -9.0]\ncopies = [4, 1, 4]\n\
                  spacing = [6.0, 0.0, 6.0]\n";
    let bounds = "[bounds]\nmin = [-100.0, -20.0, -100.0]\nmax = [100.0, 80.0, 100.0]\n";
    let text = format!("{}\n{crates}{bounds}", FLAT.replace("count = [8, 8]", "count = [3, 3]"));
    let mut track = TestTrack::new(&text, SETTINGS);
    for slot in 0..64 {
        track.enter(slot);
    }
    let mut lost = 0;
    for _ in 0..2 * 30 {
        track.tick();
        lost += track.arena.logic().lost;
    }
    assert_eq!(lost, 0, "of 64 cars on nine points among crates");
}

#[test]
fn what_falls_out_of_the_world_is_put_back() {
    let ground = "shape.half_space = {}\nmaterial = \"asphalt\"";
    let island = "shape.box.half = [30.0, 1.0, 30.0]\nmaterial = \"asphalt\"\nposition = [0.0, -1.0, 0.0]";
    assert!(FLAT.contains(ground));
    let mut track = TestTrack::new(&FLAT.replace(ground, island), SETTINGS);
    track.enter(0);
    let mut lowest = 0.0f64;
    for _ in 0..20 * 30 {
        track.drive(0, FULL_THROTTLE);
        track.tick();
        lowest = lowest.min(track.car(0).position.y);
        if lowest < -15.0 && track.car(0).position.y > 0.0 {
            return;
        }
    }
    panic!("lowest {lowest}, now {:?}", track.car(0));
}
