//! One tick: five stages, the same numbers and names here, in the documentation and in the metrics.
//!
//! 1 collect input → 2 detect collisions → 3 logic and AI → 4 integrate → 5 render and network output.
//! Owns the order of the stages and nothing else. What a tick needs from outside, commands, timers and somewhere to put
//! the result, is behind [`Ports`].

use crate::arena::{Arena, Command};

/// The stages of a tick, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// 1: commands come in and are applied.
    Input,
    /// 2: contacts are found at the state of the last tick.
    Collision,
    /// 3: actors set forces and actuators.
    Logic,
    /// 4: one implicit step of the whole world.
    Integration,
    /// 5: the new state is handed out.
    Output,
}

/// What a tick needs from outside the world.
pub trait Ports {
    /// A stage begins; for timers.
    fn begin(&mut self, stage: Stage);

    /// Stage 1: appends what came in since the last tick, in the order in which it is to be applied. `tick` is the
    /// number that the tick will have when it is done.
    fn collect(&mut self, tick: u64, into: &mut Vec<Command>);

    /// Stage 5: `arena` as this tick leaves it.
    fn output(&mut self, arena: &Arena);

    /// The last stage ended; for timers.
    fn end(&mut self);
}

/// Runs one tick.
pub fn tick(arena: &mut Arena, ports: &mut impl Ports) {
    ports.begin(Stage::Input);
    arena.collect_input(ports);

    ports.begin(Stage::Collision);
    arena.detect_collisions();

    ports.begin(Stage::Logic);
    arena.run_logic();

    ports.begin(Stage::Integration);
    arena.integrate();

    ports.begin(Stage::Output);
    ports.output(arena);

    ports.end();
}
