//! Things with game logic.
//!
//! An actor owns the bodies that it added to the world: they come and go with it, and it alone places them anew. What it
//! does to the world, itself and others, it does through forces, actuators and potentials, in stage 3.

use pita_sim::{BodyId, DVec3, Phase, SimError, StaticId, World};

use crate::part::PartInfo;
use crate::rehearsal::Memory;
use crate::step::{Message, Step};
use crate::{Controls, Pose};

/// Description of an actor, for the wire and for people.
#[derive(Clone, Debug, PartialEq)]
pub struct ActorInfo {
    /// Identifies the actor for as long as it lives; never used twice in a run.
    pub id: u32,
    /// `vehicle`, `crate`, `tornado`.
    pub kind: &'static str,
    /// What a person calls it; the player's name for a player's vehicle.
    pub name: String,
    /// Slot of the player who drives it.
    pub slot: Option<u16>,
    /// Its parts; the first is the one that says where the actor is.
    pub parts: Vec<PartInfo>,
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
    /// They push each other apart, but for a kerb that the body rolls over within this tick: that it passes.
    RollOver,
}

/// What becomes of an actor that left the arena's bounds or that the engine took out of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum WhenLost {
    /// It is gone.
    #[default]
    Remove,
    /// It is gone, and that is how it ends where it leaves the bounds: a shot over the wall. Counted as
    /// [`LogicReport::expired`](crate::LogicReport::expired) then, not as lost.
    Expire,
    /// [`Actor::place`] puts it there.
    Home(Pose),
    /// [`Actor::place`] puts it to a free spawn point.
    Spawn,
}

/// A thing with game logic. [`Actor::describe`] and [`Actor::bodies`] are all that one must have.
pub trait Actor: Send {
    /// What it is.
    fn describe(&self) -> &ActorInfo;

    /// Its bodies, in the order of [`ActorInfo::parts`]; never empty.
    fn bodies(&self) -> &[BodyId];

    /// Those of its bodies that say where it is: an actor is lost when one of them leaves the arena's bounds.
    fn whereabouts(&self) -> &[BodyId] {
        self.bodies()
    }

    /// What it knows from tick to tick beside its bodies' states, for whoever sets them to what they were.
    fn memory(&self) -> Memory {
        Memory::default()
    }

    /// Remembers what [`Actor::memory`] answered then.
    fn recall(&mut self, _memory: &Memory) {}

    /// How much it matters to those who watch, where not everybody can be sent in every tick: 1 is the rule, 2 counts as
    /// half as far away, 0 is never sent. Distance, speed and ownership come on top.
    fn relevance(&self) -> f32 {
        1.0
    }

    /// Input mapping, stage 1: the newest controls of the player whose slot it has.
    fn control(&mut self, _controls: Controls) {}

    /// Stage 3, before any [`Actor::step`]: the collision procedure. It hears of every collision of the actor, sensors
    /// included, once a tick from the tick in which the two will meet to the one in which they have parted.
    fn collide(&mut self, _contact: &Contact) -> Response {
        Response::Collide
    }

    /// Stage 3: sets forces and actuators for this tick's integration, and asks for what it wants of the arena.
    ///
    /// # Errors
    /// What the engine refused; the actor then counts as lost.
    fn step(&mut self, _step: &mut Step) -> Result<(), SimError> {
        Ok(())
    }

    /// Stage 3, after every [`Actor::step`]: what actor `from` told this one in this tick. Acting on it has to wait for
    /// the next step.
    fn hear(&mut self, _from: u32, _message: &Message) {}

    /// What becomes of it when it is lost.
    fn when_lost(&self) -> WhenLost {
        WhenLost::default()
    }

    /// Puts it at `pose`, upright and at rest.
    ///
    /// # Errors
    /// What the engine says where it refuses the pose.
    fn place(&mut self, _world: &mut World, _pose: Pose) -> Result<(), SimError> {
        Ok(())
    }

    /// It goes: takes out of the world what it added to bodies of others and to static geometry. Its own bodies, and
    /// all that is between them, go by themselves.
    fn leave(&mut self, _world: &mut World) {}
}
