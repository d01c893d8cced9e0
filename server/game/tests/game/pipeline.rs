//! The order of a tick.

use pita_game::{ArenaEvent, Stage};

use crate::test_track::{FLAT, SETTINGS, TestTrack};

#[test]
fn a_tick_is_five_stages_in_order() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.tick();
    use Stage::{Collision, Input, Integration, Logic, Output};
    assert_eq!(track.ports.stages, [Input, Collision, Logic, Integration, Output]);
    assert_eq!((track.ports.ends, track.ports.outputs.as_slice()), (1, [1].as_slice()));
}

#[test]
fn a_command_acts_in_the_tick_that_collects_it() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.enter(3);
    track.tick();
    assert_eq!(track.ports.events.last(), Some(&ArenaEvent::Entered { slot: 3, name: "driver 3".to_owned() }));
    assert_eq!(track.arena.actor_of(3).map(|a| a.name.as_str()), Some("driver 3"));
    track.tick();
    assert!(track.arena.events().is_empty(), "events are those of one tick");
}
