//! An actor of a game's own, with nothing but the public interface: a wrecking-ball crane, in an arena of its own.
//! `docs/ACTORS.md` goes through it.
//!
//! `cargo run -p pita-game --example crane`

mod crane;

use crane::Crane;
use pita_game::{ActorKinds, Arena, ArenaError, ArenaEvent, ArenaSettings, Command, Ports, Stage, Supplies, pipeline};

/// What a tick needs from outside: nothing comes in, and effects go to the terminal.
struct Terminal;

impl Ports for Terminal {
    fn begin(&mut self, _stage: Stage) {}

    fn collect(&mut self, _tick: u64, _into: &mut Vec<Command>) {}

    fn output(&mut self, arena: &Arena) {
        for event in arena.events() {
            if let ArenaEvent::Effect(effect) = event {
                println!("{:>5.2} s: {} at {:.1}", arena.tick() as f64 / 30.0, effect.kind, effect.position);
            }
        }
    }

    fn end(&mut self) {}
}

fn main() -> Result<(), ArenaError> {
    let kinds = ActorKinds::built_in().with::<Crane>();
    let supplies = Supplies { kinds: &kinds, read: &|_| Err("this arena needs no files".to_owned()) };
    let settings = ArenaSettings { tick_hz: 30, threads: 1 };
    let mut arena = Arena::from_toml_with(include_str!("arena.toml"), &settings, &supplies)?;
    for _ in 0..20 * u32::from(settings.tick_hz) {
        pipeline::tick(&mut arena, &mut Terminal);
    }
    Ok(())
}
