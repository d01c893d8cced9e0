//! Things with game logic.
//!
//! An actor owns the bodies that it added to the world and is the only one to push on them. It acts in stage 3 and
//! only through forces and actuators; poses are set only to place it anew.

use pita_sim::{BodyId, Shape, SimError, World};

use crate::{Controls, Pose};

/// Description of an actor, for the wire and for people.
#[derive(Clone, Debug, PartialEq)]
pub struct ActorInfo {
    /// Identifies the actor for as long as it lives; never used twice in a run.
    pub id: u32,
    /// `vehicle`, `prop`.
    pub kind: &'static str,
    /// What a person calls it; the player's name for a player's vehicle.
    pub name: String,
    /// Slot of the player who drives it.
    pub slot: Option<u16>,
    /// Its parts; the first is the one that says where the actor is.
    pub parts: Vec<PartInfo>,
}

/// A slice of the global state with the shape that it carries.
#[derive(Clone, Debug, PartialEq)]
pub struct PartInfo {
    /// Serial number of the slice, [`World::serial`].
    pub slice: u32,
    /// Shape in the slice's frame.
    pub shape: Shape,
}

/// What an actor may touch in stage 3.
pub struct Step<'a> {
    /// The world, contacts of this tick included.
    pub world: &'a mut World,
    /// Length of the tick, s.
    pub dt: f64,
}

/// A thing with game logic.
pub trait Actor: Send {
    /// What it is.
    fn describe(&self) -> &ActorInfo;

    /// Its bodies, in the order of [`ActorInfo::parts`]; never empty.
    fn bodies(&self) -> &[BodyId];

    /// Input mapping, stage 1: the newest controls of the player whose slot it has.
    fn control(&mut self, _controls: Controls) {}

    /// Stage 3: sets forces and actuators for this tick's integration.
    ///
    /// # Errors
    /// What the engine refused; the arena then puts the actor back.
    fn step(&mut self, _step: &mut Step) -> Result<(), SimError> {
        Ok(())
    }

    /// Where it is put when it got lost; `None` for a free spawn point.
    fn home(&self) -> Option<Pose>;

    /// Puts it at `pose`, upright and at rest.
    ///
    /// # Errors
    /// What the engine says where it refuses the pose.
    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError>;
}
