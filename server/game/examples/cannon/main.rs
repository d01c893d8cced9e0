//! A weapon of a game's own, with nothing but the public interface: a cannon that fires at cars. `docs/ACTORS.md` goes
//! through it.
//!
//! `cargo run -p pita-game --example cannon`

mod cannon;

use cannon::Cannon;
use pita_game::{ActorKinds, Arena, ArenaError, ArenaSettings, Command, Ports, Stage, Supplies, pipeline};

/// A player without a network: enters, and says what the cannon does to him.
#[derive(Default)]
struct Player {
    heard: usize,
}

impl Ports for Player {
    fn begin(&mut self, _stage: Stage) {}

    fn collect(&mut self, tick: u64, into: &mut Vec<Command>) {
        if tick == 1 {
            into.push(Command::Enter { slot: 0, name: "target".to_owned() });
        }
    }

    fn output(&mut self, arena: &Arena) {
        self.heard += arena.logic().messages;
    }

    fn end(&mut self) {}
}

fn main() -> Result<(), ArenaError> {
    let kinds = ActorKinds::built_in().with::<Cannon>();
    let supplies = Supplies { kinds: &kinds, read: &|_| Err("this arena needs no files".to_owned()) };
    let settings = ArenaSettings { tick_hz: 30, threads: 1 };
    let mut arena = Arena::from_toml_with(include_str!("arena.toml"), &settings, &supplies)?;
    let mut player = Player::default();
    for _ in 0..20 * u32::from(settings.tick_hz) {
        pipeline::tick(&mut arena, &mut player);
    }
    println!("the car was told of {} blows in 20 s", player.heard);
    Ok(())
}
