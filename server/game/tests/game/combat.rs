//! Harm, weapons, knock-outs, rounds: asked for by controls, decided here.

use std::f64::consts::PI;

use pita_game::{ArenaEvent, Controls};
use pita_sim::{DQuat, DVec3};

use crate::test_track::{COAST, FLAT, FULL_BRAKE, SETTINGS, TestTrack};

const FIRE: Controls = Controls { fire: true, ..FULL_BRAKE };

/// Two cars, `distance` m from nose to nose: slot 0 faces +x, slot 1 faces it. `combat` are keys of `[combat]`.
fn duel(combat: &str, distance: f64) -> TestTrack {
    let mut track = TestTrack::new(&format!("{FLAT}\n[combat]\n{combat}\n"), SETTINGS);
    track.enter(0);
    track.enter(1);
    both(&mut track, 1.0, COAST);
    let half = 0.5 * distance + 1.9;
    let height = track.car(0).position.y;
    track.place(0, DVec3::new(-half, height, 0.0), DQuat::IDENTITY, DVec3::ZERO);
    track.place(1, DVec3::new(half, height, 0.0), DQuat::from_rotation_y(PI), DVec3::ZERO);
    both(&mut track, 1.2, FULL_BRAKE);
    track.ports.events.clear();
    track
}

/// Slot 0 does what is said, slot 1 brakes.
fn both(track: &mut TestTrack, seconds: f64, controls: Controls) {
    for _ in 0..(seconds * 30.0).round() as usize {
        track.drive(1, FULL_BRAKE);
        track.drive(0, controls);
        track.tick();
    }
}

fn id(track: &TestTrack, slot: u16) -> u32 {
    track.arena.actor_of(slot).unwrap().id
}

fn count(track: &TestTrack, is_wanted: impl Fn(&ArenaEvent) -> bool) -> usize {
    track.ports.events.iter().filter(|event| is_wanted(event)).count()
}

fn kinds(track: &TestTrack) -> Vec<&'static str> {
    track.arena.actors().map(|info| info.kind).collect()
}

#[test]
fn a_glove_throws_the_victim_back_and_the_owner_too_and_is_drawn_in() {
    let mut track = duel("weapons = [\"glove\"]", 2.0);
    both(&mut track, 0.1, FIRE);
    assert_eq!(kinds(&track), ["vehicle", "vehicle", "glove"]);
    let (mut victim, mut owner) = (0.0f64, 0.0f64);
    for _ in 0..30 {
        both(&mut track, 1.0 / 30.0, FULL_BRAKE);
        (victim, owner) = (victim.max(track.car(1).velocity.x), owner.min(track.car(0).velocity.x));
    }
    assert!(victim > 3.0, "the victim gets {victim} m/s");
    assert!(owner < -1.0, "the owner {owner} m/s");
    assert_eq!(kinds(&track), ["vehicle", "vehicle"], "it is drawn in");
    both(&mut track, 10.0, FULL_BRAKE);
    for slot in [0, 1] {
        assert!(track.car(slot).upright() > 0.99 && track.car(slot).velocity.length() < 0.1);
    }
}

/// A sheet before the nose, at whatever distance: what is fired stays on this side of it, and neither comes to nor harms who
/// is right behind it.
#[test]
fn nothing_is_fired_through_a_thin_wall() {
    let gaps = (0..30).map(|gap| 0.1 * f64::from(gap));
    for weapon in ["glove", "saw", "grenade"] {
        let keys = format!("weapons = [\"{weapon}\"]\ngrenade.radius = 0.5\ngrenade.damage = 0.0");
        gaps.clone().for_each(|gap| fire_at_a_wall(&keys, weapon, gap));
    }
    // A spring that drives it 5 m in its first tick and 7.5 m in the next one.
    let long = "weapons = [\"glove\"]\nglove = { reach = 20.0, stiffness = 18000.0 }";
    (0..60).map(|gap| 0.25 * f64::from(gap)).for_each(|gap| fire_at_a_wall(long, "glove", gap));
}

/// Slot 0 fires at a wall `gap` m before its nose for three seconds, slot 1 stands behind it.
fn fire_at_a_wall(keys: &str, weapon: &str, gap: f64) {
    let wall = "[[statics]]\nshape.box.half = [0.05, 2.0, 5.0]\nmaterial = \"asphalt\"\nposition = [0.0, 2.0, 60.0]\n";
    let mut track = TestTrack::new(&format!("{FLAT}\n{wall}[combat]\nhealth = 10.0\n{keys}\n"), SETTINGS);
    track.enter(0);
    track.enter(1);
    both(&mut track, 1.0, COAST);
    let height = track.car(0).position.y;
    track.place(0, DVec3::new(-1.955 - gap, height, 60.0), DQuat::IDENTITY, DVec3::ZERO);
    let behind = DVec3::new(1.98, height, 60.0);
    track.place(1, behind, DQuat::from_rotation_y(PI), DVec3::ZERO);
    both(&mut track, 0.1, FULL_BRAKE);
    let mut seen = 0;
    for _ in 0..90 {
        both(&mut track, 1.0 / 30.0, FIRE);
        let shots: Vec<u32> = track.arena.actors().filter(|info| info.kind == weapon).map(|info| info.id).collect();
        for shot in shots {
            let at = track.part_of(shot, 0).position;
            let is_past = at.x > 0.0 && at.y < 4.0 && (at.z - 60.0).abs() < 5.0;
            assert!(!is_past, "{weapon}, {gap} m off: at {at}, shot {seen}");
            seen += 1;
        }
    }
    assert!(seen > 10, "{weapon}: {seen}");
    let victim = (id(&track, 1), track.car(1).position);
    assert!((victim.1 - behind).length() < 0.1, "{weapon}, {gap} m off: {victim:?}");
    let harmed = |event: &ArenaEvent| matches!(event, ArenaEvent::KnockedOut { actor, .. } if *actor == victim.0);
    assert_eq!(count(&track, harmed), 0, "{weapon}, {gap} m off");
    assert_eq!(track.quarantined(), 0, "{weapon}, {gap} m off");
}

#[test]
fn a_saw_flies_cuts_and_vanishes() {
    let mut track = duel("health = 10.0\nrespawn_time = 60.0\nweapons = [\"saw\"]", 15.0);
    both(&mut track, 0.1, FIRE);
    let saw = track.arena.actors().find(|info| info.kind == "saw").expect("it flies").parts[0].slice;
    let slice = track.arena.world().slices().find(|slice| slice.serial == saw).unwrap();
    assert!(slice.v[0] > 20.0 && slice.v[4] > 40.0, "{:?}", slice.v);
    both(&mut track, 5.0, FULL_BRAKE);
    let (shooter, victim) = (id(&track, 0), id(&track, 1));
    let knocked_out = ArenaEvent::KnockedOut { actor: victim, by: Some(shooter) };
    assert_eq!(count(&track, |event| *event == knocked_out), 1, "{:?}", track.ports.events);
    assert_eq!(kinds(&track), ["vehicle", "vehicle"]);
}

#[test]
fn a_grenade_bursts_and_throws_what_is_around() {
    let mut track = duel("weapons = [\"grenade\"]\ngrenade.fuse = 1.0\ngrenade.speed = [9.0, 4.0]", 12.0);
    let before = track.car(1).position;
    both(&mut track, 0.1, FIRE);
    let mut highest = 0.0f64;
    for _ in 0..60 {
        both(&mut track, 1.0 / 30.0, FULL_BRAKE);
        highest = highest.max(track.car(1).position.y);
    }
    let bursts = |event: &ArenaEvent| matches!(event, ArenaEvent::Effect(effect) if effect.kind == "blast");
    assert_eq!(count(&track, bursts), 1);
    assert_eq!(kinds(&track), ["vehicle", "vehicle"]);
    let moved = track.car(1).position.x - before.x;
    assert!(highest > before.y + 0.05 && moved > 0.2, "{highest} m high, {moved} m off");
}

/// Over the wall is no loss: a shot ends at the bounds. What leaves them otherwise is lost.
#[test]
fn a_shot_ends_at_the_bounds() {
    let bounds = "[bounds]\nmin = [-40.0, -20.0, -40.0]\nmax = [40.0, 30.0, 40.0]\n";
    for weapon in ["saw", "grenade"] {
        let keys = format!(
            "[combat]\nweapons = [\"{weapon}\"]\nsaw.life = 60.0\ngrenade = {{ fuse = 60.0, reload = 60.0 }}\n"
        );
        let flat = FLAT.replace("count = [8, 8]", "count = [1, 1]");
        let mut track = TestTrack::new(&format!("{flat}{bounds}{keys}"), SETTINGS);
        track.enter(0);
        track.run(1.0, COAST);
        let at = track.car(0).position;
        track.place(0, DVec3::new(30.0, at.y, 0.0), DQuat::IDENTITY, DVec3::ZERO);
        let (mut lost, mut expired) = (0, 0);
        for tick in 0..60 {
            track.drive(0, if tick < 2 { FIRE } else { FULL_BRAKE });
            track.tick();
            let logic = track.arena.logic();
            (lost, expired) = (lost + logic.lost, expired + logic.expired);
        }
        assert_eq!((lost, expired, kinds(&track)), (0, 1, vec!["vehicle"]), "{weapon}");
        track.place(0, DVec3::new(50.0, at.y, 0.0), DQuat::IDENTITY, DVec3::ZERO);
        track.tick();
        let logic = track.arena.logic();
        assert_eq!((logic.lost, logic.expired), (1, 0), "the car is put back");
    }
}

#[test]
fn nothing_is_fired_faster_than_it_reloads_and_nothing_where_nobody_fights() {
    let mut track = duel("weapons = [\"saw\"]\nsaw.reload = 1.0\nsaw.life = 60.0", 60.0);
    both(&mut track, 2.5, FIRE);
    assert_eq!(kinds(&track).iter().filter(|kind| **kind == "saw").count(), 3);
    let mut peace = TestTrack::new(FLAT, SETTINGS);
    peace.enter(0);
    peace.run(2.0, FIRE);
    assert_eq!(kinds(&peace), ["vehicle"]);
    assert!(peace.arena.rounds().is_none());
}

#[test]
fn the_next_weapon_is_taken_once_for_each_press() {
    let mut track = duel("weapons = [\"glove\", \"saw\"]", 30.0);
    both(&mut track, 0.5, Controls { next_weapon: true, ..COAST });
    both(&mut track, 0.1, FIRE);
    assert_eq!(kinds(&track), ["vehicle", "vehicle", "saw"]);
}

/// Head-on at 20 m/s both are harmed; parking is not.
#[test]
fn blows_harm_and_standing_does_not() {
    let mut track = duel("health = 30.0\nrespawn_time = 60.0", 20.0);
    both(&mut track, 5.0, COAST);
    assert_eq!(count(&track, |event| matches!(event, ArenaEvent::KnockedOut { .. })), 0);
    track.push(0, DVec3::X * 20.0);
    track.push(1, DVec3::X * -20.0);
    both(&mut track, 2.0, COAST);
    let [a, b] = [id(&track, 0), id(&track, 1)];
    for (actor, by) in [(a, b), (b, a)] {
        let knocked_out = ArenaEvent::KnockedOut { actor, by: Some(by) };
        assert_eq!(count(&track, |event| *event == knocked_out), 1, "{:?}", track.ports.events);
    }
}

/// Out: no controls, then a new life elsewhere; in between nobody harms it again.
#[test]
fn who_is_knocked_out_comes_back_whole() {
    let mut track = duel("health = 10.0\nrespawn_time = 2.0\nweapons = [\"saw\"]", 10.0);
    let (before, victim) = (track.car(1).position, id(&track, 1));
    let knock_outs = |track: &TestTrack| {
        count(track, |event| matches!(event, ArenaEvent::KnockedOut { actor, .. } if *actor == victim))
    };
    for _ in 0..15 {
        if knock_outs(&track) == 0 {
            both(&mut track, 0.1, FIRE);
        }
    }
    // Who is out stays where it is, whatever still flies about.
    both(&mut track, 1.8, FULL_BRAKE);
    assert!(track.car(1).position.distance(before) < 10.0);
    assert_eq!(knock_outs(&track), 1);
    both(&mut track, 1.2, FULL_BRAKE);
    assert!(track.car(1).position.distance(before) > 10.0, "at a spawn point: {:?}", track.car(1));
    assert!(track.car(1).upright() > 0.99 && track.car(1).velocity.length() < 0.1);
}

#[test]
fn a_round_has_a_winner_and_the_next_one_begins_anew() {
    let keys = "health = 10.0\nrespawn_time = 1.0\nweapons = [\"saw\"]\nround = { points = 1, pause = 2.0 }";
    let mut track = duel(keys, 10.0);
    both(&mut track, 1.5, FIRE);
    let shooter = id(&track, 0);
    let ended = ArenaEvent::RoundEnded { number: 1, winner: Some(shooter) };
    let scored = ArenaEvent::Scored { actor: shooter, points: 1 };
    assert_eq!([&ended, &scored].map(|wanted| count(&track, |event| event == wanted)), [1, 1]);
    let rounds = track.arena.rounds().unwrap();
    assert!(!rounds.is_on() && rounds.leader() == Some(shooter));
    let saws = kinds(&track).len();
    both(&mut track, 0.4, FIRE);
    assert!(kinds(&track).len() <= saws, "nothing is fired between rounds");
    both(&mut track, 3.0, COAST);
    assert_eq!(count(&track, |event| *event == ArenaEvent::RoundBegan { number: 2 }), 1);
    let rounds = track.arena.rounds().unwrap();
    assert!(rounds.is_on() && rounds.number() == 2 && rounds.points().count() == 0);
}

/// A round without any points has no winner.
#[test]
fn a_round_ends_in_time() {
    let mut track = duel("round = { time = 2.0, pause = 60.0 }", 20.0);
    both(&mut track, 2.0, COAST);
    let ended = ArenaEvent::RoundEnded { number: 1, winner: None };
    assert!(track.ports.events.contains(&ended) || !track.arena.rounds().unwrap().is_on());
    assert_eq!(track.arena.rounds().unwrap().leader(), None);
}

/// Who leaves while his glove is out takes it along.
#[test]
fn a_glove_without_its_car_is_gone() {
    let mut track = duel("weapons = [\"glove\"]", 5.0);
    both(&mut track, 0.1, FIRE);
    track.leave(0);
    for _ in 0..30 {
        track.tick();
    }
    assert_eq!(kinds(&track), ["vehicle"]);
}

/// Points are of those who are there: who leaves takes them along, and scores no more.
#[test]
fn who_has_left_neither_leads_nor_scores() {
    let keys = "health = 10.0\nrespawn_time = 1.0\nweapons = [\"saw\"]\nround = { points = 9 }";
    let mut track = duel(keys, 10.0);
    both(&mut track, 1.5, FIRE);
    let shooter = id(&track, 0);
    assert_eq!(track.arena.rounds().unwrap().leader(), Some(shooter));
    track.leave(0);
    track.tick();
    assert_eq!(track.arena.rounds().unwrap().leader(), None);
    let mut track = duel(keys, 15.0);
    both(&mut track, 0.1, FIRE);
    let [shooter, victim] = [id(&track, 0), id(&track, 1)];
    track.leave(0);
    (0..30).for_each(|_| track.tick());
    assert_eq!(count(&track, |event| *event == ArenaEvent::KnockedOut { actor: victim, by: None }), 1);
    assert_eq!(count(&track, |event| matches!(event, ArenaEvent::Scored { actor, .. } if *actor == shooter)), 0);
}

#[test]
fn who_comes_between_two_rounds_waits_like_the_others() {
    let keys = "weapons = [\"saw\"]\nsaw.life = 0.5\nround = { time = 1.0, pause = 60.0 }";
    let mut track = duel(keys, 30.0);
    both(&mut track, 1.0, COAST);
    assert!(!track.arena.rounds().unwrap().is_on());
    track.leave(0);
    track.enter(0);
    both(&mut track, 0.5, FIRE);
    assert_eq!(kinds(&track), ["vehicle", "vehicle"]);
}

/// Whoever holds the trigger while a round begins fires from where he is put to.
#[test]
fn nothing_is_fired_from_where_a_car_was_before_the_round() {
    let keys = "weapons = [\"saw\"]\nsaw.life = 0.5\nround = { time = 1.0, pause = 2.0 }";
    let mut track = duel(keys, 150.0);
    both(&mut track, 1.0, COAST);
    let began = |track: &TestTrack| count(track, |event| *event == ArenaEvent::RoundBegan { number: 2 }) > 0;
    for _ in 0..90 {
        if !began(&track) {
            both(&mut track, 1.0 / 30.0, FIRE);
        }
    }
    let saw = |track: &TestTrack| track.arena.actors().find(|info| info.kind == "saw").map(|info| info.parts[0].slice);
    let fired = (0..10).find_map(|_| {
        both(&mut track, 1.0 / 30.0, FIRE);
        saw(&track)
    });
    let fired = fired.expect("the round is on");
    let slice = track.arena.world().slices().find(|slice| slice.serial == fired).unwrap();
    let off = DVec3::from_slice(slice.q).distance(track.car(0).position);
    assert!(off < 10.0, "{off} m from the car");
}

/// A car that is put on its wheels does nothing more by how it lay before.
#[test]
fn a_car_fires_as_it_stands_after_a_reset() {
    let mut track = duel("weapons = [\"saw\"]", 60.0);
    let at = track.car(0).position;
    track.place(0, at + 2.0 * DVec3::Y, DQuat::from_rotation_z(0.45 * PI), DVec3::ZERO);
    both(&mut track, 1.0 / 30.0, Controls { reset: true, ..FIRE });
    // It comes with the next tick.
    both(&mut track, 1.0 / 30.0, FULL_BRAKE);
    let saw = track.arena.actors().find(|info| info.kind == "saw").expect("it flies").parts[0].slice;
    let slice = track.arena.world().slices().find(|slice| slice.serial == saw).unwrap();
    assert!(slice.v[0] > 20.0 && slice.v[1].abs() < 5.0, "{:?}", slice.v);
}

/// Who leaves the world while he is out is put back, and is out for as long as everybody.
#[test]
fn no_way_out_of_the_world_is_a_short_cut_to_the_next_life() {
    let mut track = duel("health = 10.0\nrespawn_time = 60.0\nweapons = [\"saw\"]", 10.0);
    both(&mut track, 1.5, FIRE);
    assert_eq!(count(&track, |event| matches!(event, ArenaEvent::KnockedOut { .. })), 1);
    track.place(1, DVec3::Y * -100.0, DQuat::IDENTITY, DVec3::ZERO);
    both(&mut track, 1.0, COAST);
    assert!(track.car(1).position.y > 0.0, "put back: {:?}", track.car(1));
    for _ in 0..30 {
        track.drive(1, Controls { throttle: 1.0, ..COAST });
        track.tick();
    }
    assert!(track.car(1).velocity.length() < 0.5, "{:?}", track.car(1));
}
