//! The same commands give the same bits; the default arena lives and stays sane on its own.

use pita_game::{Arena, ArenaSettings, Controls};

use crate::test_track::{SETTINGS, TestTrack};

/// State hashes, one a second, of `cars` scripted cars in the default arena.
fn hashes(cars: u16, seconds: usize, threads: usize) -> Vec<u64> {
    let mut track = TestTrack::new(Arena::DEFAULT, ArenaSettings { threads, ..SETTINGS });
    for slot in 0..cars {
        track.enter(slot);
    }
    let mut hashes = Vec::new();
    for second in 0..seconds {
        for tick in 0..30 {
            for slot in 0..cars {
                track.drive(slot, script(slot, second as f64 + tick as f64 / 30.0));
            }
            track.tick();
            let report = track.arena.world().report();
            // A reset sets a car that leans on a ramp upright into it, which is 0.6 m deep for a tick.
            let whole = report.quarantined == 0 && report.worst_joint_gap < 0.03 && report.worst_penetration < 0.8;
            assert!(whole, "tick {}: {report:?}", track.arena.tick());
        }
        hashes.push(track.arena.world().state_hash());
    }
    for slot in 0..cars {
        let car = track.car(slot);
        assert!(car.position.is_finite() && car.velocity.is_finite(), "slot {slot}: {car:?}");
        assert!(car.position.abs().max_element() < 125.0, "slot {slot} left the arena: {car:?}");
    }
    hashes
}

/// Wanders, by a different pattern in every slot.
fn script(slot: u16, time: f64) -> Controls {
    let phase = f64::from(slot);
    let steer = (0.7 * time + phase).sin() * (0.13 * time + 2.0 * phase).cos();
    let throttle = 0.6 + 0.4 * (0.3 * time + phase).sin();
    let brake = if (0.21 * time + 3.0 * phase).sin() > 0.95 { 1.0 } else { 0.0 };
    Controls { throttle, brake, steer, reset: (time as u64 + u64::from(slot)) % 15 == 14, ..Controls::default() }
}

#[test]
fn sixteen_cars_for_a_minute_twice_and_with_two_threads() {
    let first = hashes(16, 60, 1);
    assert_eq!(first, hashes(16, 60, 1), "the same run twice");
    assert_eq!(first, hashes(16, 60, 2), "one thread and two");
    assert!(first.windows(2).all(|w| w[0] != w[1]), "nothing moves");
}

#[test]
fn the_default_arena_is_alive_without_players() {
    let mut track = TestTrack::new(Arena::DEFAULT, SETTINGS);
    let drivers: Vec<u32> = track.arena.actors().filter(|a| a.kind == "vehicle").map(|a| a.parts[0].slice).collect();
    assert!(drivers.len() >= 2);
    let at = |track: &TestTrack, serial: u32| {
        let slice = track.arena.world().slices().find(|s| s.serial == serial).expect("a living body");
        [slice.q[0], slice.q[2]]
    };
    let mut way = vec![0.0; drivers.len()];
    for _ in 0..60 * 30 {
        let before: Vec<_> = drivers.iter().map(|&serial| at(&track, serial)).collect();
        track.tick();
        for (i, &serial) in drivers.iter().enumerate() {
            let now = at(&track, serial);
            way[i] += f64::hypot(now[0] - before[i][0], now[1] - before[i][1]);
        }
    }
    assert!(way.iter().all(|&metres| metres > 500.0), "metres driven in a minute: {way:?}");
    assert_eq!(track.arena.world().report().quarantined, 0);
}
