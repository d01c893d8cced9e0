//! The examples, in their own arenas: what a game adds with nothing but the public interface works.

use pita_game::{ActorKinds, Arena, ArenaEvent, Command, Supplies, pipeline};
use pita_sim::DVec3;

use crate::test_track::{Recorder, SETTINGS};
use cannon::Cannon;
use crane::Crane;

#[path = "../../examples/cannon/cannon.rs"]
mod cannon;
#[path = "../../examples/crane/crane.rs"]
mod crane;

fn load(text: &str) -> Arena {
    let kinds = ActorKinds::built_in().with::<Crane>().with::<Cannon>();
    Arena::from_toml_with(text, &SETTINGS, &Supplies { kinds: &kinds, read: &|_| Err(String::new()) })
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Its ball swings at the end of its rope, and goes through the wall of crates.
#[test]
fn a_crane_of_a_games_own_knocks_over_a_wall() {
    let mut arena = load(include_str!("../../examples/crane/arena.toml"));
    let mut ports = Recorder::default();
    let ball = arena.actor(0).expect("the crane").bodies()[1];
    let crates: Vec<_> = (1..17).map(|id| arena.actor(id).expect("a crate").bodies()[0]).collect();
    let before: Vec<DVec3> = crates.iter().map(|&id| arena.world().position(id).unwrap()).collect();
    let mut fastest: f64 = 0.0;
    for _ in 0..20 * 30 {
        pipeline::tick(&mut arena, &mut ports);
        fastest = fastest.max(arena.world().velocity(ball).unwrap().length());
    }
    let world = arena.world();
    assert!(fastest > 3.0 && fastest < 15.0, "the ball swings at up to {fastest} m/s");
    assert!(world.position(ball).unwrap().length() < 15.0, "on its rope: {}", world.position(ball).unwrap());
    let moved = crates.iter().zip(&before).filter(|&(&id, &at)| world.position(id).unwrap().distance(at) > 1.0);
    assert!(moved.count() >= 4, "crates lie about");
    let clangs = ports.events.iter().filter(|event| matches!(event, ArenaEvent::Effect(e) if e.kind == "clang"));
    assert!(clangs.count() >= 1);
    assert_eq!(world.report().quarantined, 0);
}

/// It hits the car, which is told of it, and its balls do not pile up.
#[test]
fn a_cannon_of_a_games_own_hits_a_car() {
    let mut arena = load(include_str!("../../examples/cannon/arena.toml"));
    let mut ports = Recorder::default();
    ports.pending.push(Command::Enter { slot: 0, name: "target".to_owned() });
    let (mut blows, mut most) = (0, 0);
    for _ in 0..20 * 30 {
        pipeline::tick(&mut arena, &mut ports);
        blows += arena.logic().messages;
        most = most.max(arena.actors().filter(|actor| actor.kind == "cannonball").count());
    }
    let shots =
        ports.events.iter().filter(|event| matches!(event, ArenaEvent::ActorAdded(a) if a.kind == "cannonball"));
    assert_eq!(shots.count(), 13, "one each 45 ticks");
    assert!(blows >= 10, "{blows} blows");
    assert!((1..=4).contains(&most), "{most} balls at once");
}
