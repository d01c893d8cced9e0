//! The sheep pasture as it ships: its tornado lifts what it meets and drops it, and the sheep stay.

use std::collections::BTreeSet;

use pita_sim::DVec3;

use crate::test_track::{SETTINGS, TestTrack};

const PASTURE: &str = include_str!("../../../../configs/arenas/sheep-pasture.toml");

/// Slices of what is called `kind`, one for each actor.
fn slices(track: &TestTrack, kind: &str) -> BTreeSet<u32> {
    track.arena.actors().filter(|actor| actor.kind == kind).map(|actor| actor.parts[0].slice).collect()
}

/// With a single sheep, which is not what this is about.
#[test]
fn cars_and_crates_fly_and_come_down() {
    let mut track = TestTrack::new(&PASTURE.replace("copies = [8, 1, 5]", "copies = [1, 1, 1]"), SETTINGS);
    for kind in ["vehicle", "crate"] {
        let all = slices(&track, kind);
        assert!(all.len() >= 2, "{} of {kind}", all.len());
        let (mut flown, mut landed) = (BTreeSet::new(), BTreeSet::new());
        for _ in 0..300 * 30 {
            track.tick();
            for slice in track.arena.world().slices().filter(|slice| all.contains(&slice.serial)) {
                let height = slice.q[1];
                assert!(height > 0.0 && height < 30.0, "a {kind} at {height} m");
                if height > 5.0 {
                    flown.insert(slice.serial);
                } else if height < 1.5 && flown.contains(&slice.serial) {
                    landed.insert(slice.serial);
                }
            }
            if !landed.is_empty() && flown == landed {
                break;
            }
        }
        assert!(!landed.is_empty() && flown == landed, "{kind}: {flown:?} flew, {landed:?} came down");
    }
}

#[test]
fn sheep_fly_and_come_down() {
    let mut track = TestTrack::new(PASTURE, SETTINGS);
    let sheep = slices(&track, "sheep");
    assert_eq!((sheep.len(), slices(&track, "tornado").len()), (40, 1));
    let (mut flown, mut landed) = (BTreeSet::new(), BTreeSet::new());
    for tick in 0..100 * 30 {
        track.tick();
        let world = track.arena.world();
        assert_eq!(world.report().quarantined, 0, "tick {tick}: {:?}", world.report());
        for slice in world.slices().filter(|slice| sheep.contains(&slice.serial)) {
            let (at, speed) = (DVec3::from_slice(slice.q), DVec3::from_slice(slice.v).length());
            assert!(at.x.abs() < 100.0 && at.z.abs() < 100.0, "tick {tick}: a sheep at {at}");
            assert!(at.y > 0.0 && at.y < 30.0 && speed < 40.0, "tick {tick}: a sheep at {at} with {speed} m/s");
            if at.y > 5.0 {
                flown.insert(slice.serial);
            } else if at.y < 1.5 && flown.contains(&slice.serial) {
                landed.insert(slice.serial);
            }
        }
        if tick > 40 * 30 && flown == landed {
            break;
        }
    }
    assert!(flown.len() >= 3 && flown == landed, "{flown:?} flew, {landed:?} came down");
}
