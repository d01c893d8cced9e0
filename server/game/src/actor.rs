//! Things with game logic.
//!
//! An actor owns the bodies that it added to the world and is the only one to push on them. It acts in stage 3 and
//! only through forces and actuators; poses are set only to place it anew.

use pita_sim::{BodyId, DVec3, Phase, Shape, SimError, StaticId, World};

use crate::rehearsal::Memory;
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

/// A collision of an actor, as stage 2 found it.
#[derive(Clone, Copy, Debug)]
pub struct Contact<'a> {
    /// Whether it begins, goes on or has ended.
    pub phase: Phase,
    /// The actor's own side.
    pub own: ContactSide<'a>,
    /// The other side.
    pub other: ContactSide<'a>,
    /// What is there: ground, or a victim.
    pub partner: Partner,
    /// Where, m.
    pub point: DVec3,
    /// Unit vector from the actor to the other.
    pub normal: DVec3,
    /// Distance of the surfaces at the start of the tick, m; negative where they overlap.
    pub gap: f64,
    /// How fast they come closer at the start of the tick, m/s; negative where they part.
    pub approach_speed: f64,
    /// That they gave each other along the normal in the last tick, N s: the tick after the blow knows how hard it was.
    pub impulse: f64,
}

/// A side of a [`Contact`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSide<'a> {
    /// The body; `None` for what never moves.
    pub body: Option<BodyId>,
    /// Name of its material in the arena's file, `chassis` or `tyre`; empty where it has none.
    pub material: &'a str,
    /// Whether it sees and does not push.
    pub is_sensor: bool,
}

/// What an actor collides with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// What never moves.
    Ground(StaticId),
    /// Another actor.
    Actor {
        /// Its id.
        id: u32,
        /// Its [`ActorInfo::kind`].
        kind: &'static str,
    },
}

/// What becomes of a contact in this tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Response {
    /// The two push each other apart, unless the other side lets them pass.
    #[default]
    Collide,
    /// They pass through each other in this tick.
    Pass,
}

/// A thing with game logic.
pub trait Actor: Send {
    /// What it is.
    fn describe(&self) -> &ActorInfo;

    /// Its bodies, in the order of [`ActorInfo::parts`]; never empty.
    fn bodies(&self) -> &[BodyId];

    /// What it knows from tick to tick beside its bodies' states, for whoever sets them to what they were.
    fn memory(&self) -> Memory {
        Memory::default()
    }

    /// Remembers what [`Actor::memory`] answered then.
    fn recall(&mut self, _memory: &Memory) {}

    /// Input mapping, stage 1: the newest controls of the player whose slot it has.
    fn control(&mut self, _controls: Controls) {}

    /// Stage 3, before any [`Actor::step`]: the collision procedure. It hears of every collision of the actor, sensors
    /// included, once a tick from the tick in which the two will meet to the one in which they have parted.
    fn collide(&mut self, _contact: &Contact) -> Response {
        Response::Collide
    }

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
