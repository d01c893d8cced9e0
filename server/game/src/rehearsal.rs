//! One car on the ground of an arena, stepped as the arena itself would: what a client predicts its own vehicle with.
//!
//! Owns an arena without props, arena drivers and other players, and the way to set the car's state to what it was
//! somewhere else. Contacts are found anew from a state that was set; friction starts without its anchors then.

use glam::{DQuat, DVec3};

use crate::arena::{Arena, ArenaSettings, Command};
use crate::arena_file::{ArenaError, shipped_file};
use crate::controls::Controls;
use crate::pipeline::{self, Ports, Stage};

/// The one slot of the rehearsal.
const SLOT: u16 = 0;

/// A body's share of Q and Q'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// Centre of mass, m.
    pub position: DVec3,
    /// Body to world.
    pub rotation: DQuat,
    /// m/s.
    pub velocity: DVec3,
    /// In world axes, rad/s.
    pub angular_velocity: DVec3,
}

/// What an actor knows from tick to tick beside its bodies' states; what the numbers mean is the actor's.
pub type Memory = [f64; 16];

/// A car, all of it: bodies in the order of its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct CarState {
    /// Chassis and wheels.
    pub bodies: Vec<BodyState>,
    /// Pedals, steering and buttons.
    pub memory: Memory,
}

/// See the module.
pub struct Rehearsal {
    arena: Arena,
}

impl Rehearsal {
    /// The arena that `text`, TOML, describes, with one car in it and nothing else that moves.
    ///
    /// # Errors
    /// Any [`ArenaError`].
    pub fn from_toml(text: &str, settings: &ArenaSettings) -> Result<Self, ArenaError> {
        Self::from_toml_with(text, settings, shipped_file)
    }

    /// The same, its meshes read by `read`, which answers the bytes of a file or why there are none.
    ///
    /// # Errors
    /// Any [`ArenaError`].
    pub fn from_toml_with(
        text: &str,
        settings: &ArenaSettings,
        read: impl Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Self, ArenaError> {
        let mut arena = Arena::without_actors(text, settings, read)?;
        arena.apply(Command::Enter { slot: SLOT, name: String::new() });
        Ok(Self { arena })
    }

    /// The car as it is now.
    pub fn state(&self) -> CarState {
        let (bodies, memory) = self.arena.rehearsed(SLOT);
        CarState { bodies, memory }
    }

    /// Sets the car's state. What has another number of bodies, or numbers that the engine refuses, changes nothing or
    /// a part; answers whether all of it was taken.
    pub fn set_state(&mut self, state: &CarState) -> bool {
        self.arena.set_rehearsed(SLOT, &state.bodies, &state.memory)
    }

    /// One tick under `controls`.
    pub fn step(&mut self, controls: Controls) {
        let mut alone = Alone(controls);
        pipeline::tick(&mut self.arena, &mut alone);
    }
}

impl std::fmt::Debug for Rehearsal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rehearsal").field("arena", &self.arena.name()).finish_non_exhaustive()
    }
}

/// Nobody but the driver.
struct Alone(Controls);

impl Ports for Alone {
    fn begin(&mut self, _stage: Stage) {}

    fn collect(&mut self, _tick: u64, into: &mut Vec<Command>) {
        into.push(Command::Drive { slot: SLOT, controls: self.0 });
    }

    fn output(&mut self, _arena: &Arena) {}

    fn end(&mut self) {}
}
