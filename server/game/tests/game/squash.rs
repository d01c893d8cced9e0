//! Cartoon squash: a car's body gives way to what it feels, swings back, and changes nothing of how the car moves.

use pita_game::free_form::Appearance;
use pita_sim::{DQuat, DVec3};

use crate::test_track::{COAST, FLAT, FULL_BRAKE, FULL_THROTTLE, SETTINGS, TestTrack};

/// Flat ground with one car, whose squash is of this strength.
fn track(strength: f64) -> TestTrack {
    let ground = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let mut track = TestTrack::new(&format!("{ground}\n[vehicle]\nsquash.strength = {strength:?}\n"), SETTINGS);
    track.enter(0);
    track.run(2.0, COAST);
    track
}

/// How the car's body is drawn.
fn appearance(track: &TestTrack) -> Appearance {
    let id = track.arena.actor_of(0).expect("it is there").id;
    let bodies = track.arena.actor(id).expect("it is there").bodies();
    let q = track.arena.world().slice(bodies[5]).expect("it lives").q;
    Appearance::of_numbers(q.try_into().expect("as many numbers as an appearance has"))
}

fn drop_from(track: &mut TestTrack, height: f64) {
    let at = track.car(0).position;
    track.place(0, at + DVec3::Y * height, DQuat::IDENTITY, DVec3::ZERO);
}

/// Over a landing from ten metres.
#[test]
fn a_body_is_stretched_in_the_fall_squashed_by_the_landing_and_swings_back() {
    let mut track = track(1.0);
    let close = |x: f64, to: f64, by: f64| (x - to).abs() < by;
    assert!(close(appearance(&track).warp.scale.y, 1.0, 0.01), "at rest: {:?}", appearance(&track));
    drop_from(&mut track, 10.0);
    track.run(1.2, COAST);
    let falling = appearance(&track).warp.scale;
    assert!((1.02..1.1).contains(&falling.y), "in the fall: {falling}");
    assert!(close(falling.x * falling.y * falling.z, 1.0, 0.01), "its volume stays: {falling}");
    let (mut least, mut squashed_for) = (f64::INFINITY, 0);
    for tick in 0..60 {
        track.run(1.0 / 30.0, COAST);
        let height = appearance(&track).warp.scale.y;
        least = least.min(height);
        squashed_for = if close(height, 1.0, 0.05) { squashed_for } else { tick };
    }
    eprintln!("squashed to {least}, within 5 % again after {squashed_for} ticks");
    assert!((0.5..0.85).contains(&least), "squashed to {least}");
    assert!(squashed_for < 50, "off by more than 5 % for {squashed_for} ticks");
    track.run(2.0, COAST);
    assert!(close(appearance(&track).warp.scale.y, 1.0, 1e-3), "and comes to rest: {:?}", appearance(&track));
    let info = track.arena.actor_of(0).unwrap();
    let world = track.arena.world();
    let asleep = track.arena.actor(info.id).unwrap().bodies().iter().filter(|&&body| world.is_asleep(body)).count();
    assert_eq!(asleep, 6, "then it sleeps like the car");
}

#[test]
fn it_leans_back_under_throttle_and_forwards_under_the_brakes() {
    let mut track = track(2.0);
    track.run(1.5, FULL_THROTTLE);
    assert!(appearance(&track).warp.bend.x < -0.02, "{:?}", appearance(&track));
    track.run(0.8, FULL_BRAKE);
    assert!(appearance(&track).warp.bend.x > 0.05, "{:?}", appearance(&track));
}

/// Bit by bit: momentum, and all else of it.
#[test]
fn the_car_moves_as_without() {
    let mut tracks = [track(0.0), track(3.0)];
    for track in &mut tracks {
        drop_from(track, 10.0);
    }
    for _ in 0..60 {
        let [stiff, soft] = tracks.each_mut().map(|track| {
            track.run(0.1, FULL_THROTTLE);
            [0, 1, 4].map(|part| (track.part(0, part).position, track.part(0, part).velocity))
        });
        assert_eq!(stiff, soft);
    }
    assert_eq!(tracks[0].arena.actor_of(0).unwrap().parts.len(), 5, "without strength it is no part");
    assert_eq!(tracks[1].arena.actor_of(0).unwrap().parts.len(), 6);
}

/// Leaving takes its DOF along; a reset makes it whole.
#[test]
fn it_comes_and_goes_with_the_car() {
    let mut track = track(1.0);
    drop_from(&mut track, 10.0);
    track.run(1.6, COAST);
    assert!(appearance(&track).warp.scale.y < 0.95);
    track.leave(0);
    track.tick();
    assert_eq!(track.arena.world().body_count(), 0);
}

/// A car is where its chassis and wheels are, wherever its squash was made.
#[test]
fn a_car_that_starts_outside_the_world_is_put_back_once() {
    let bounds = "[bounds]\nmin = [-50.0, -20.0, -50.0]\nmax = [50.0, 80.0, 50.0]\n";
    let route = "[routes.out]\ncorners = [[60.0, 0.0], [0.0, 0.0]]\n";
    let driver = "[[drivers]]\nname = \"out\"\nroute = \"out\"\nspeed = 1.0\n";
    let flat = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let text = format!("{flat}{bounds}{route}{driver}[vehicle]\nsquash.strength = 1.0\n");
    let mut track = TestTrack::new(&text, SETTINGS);
    let mut lost = 0;
    for _ in 0..30 {
        track.tick();
        lost += track.arena.logic().lost;
    }
    assert_eq!(lost, 1);
}
