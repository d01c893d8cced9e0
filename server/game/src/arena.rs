//! A running world with everything that acts in it.
//!
//! Owns the engine's [`World`], the actors, the slots and the events of a tick; each stage of the pipeline that is not
//! the outside's is a method here. Reading it never changes it.

mod build;
mod cast;
mod collisions;
mod logic;
mod placing;
mod players;
mod rehearsed;
mod reload;
pub mod rounds;

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use pita_sim::{BodyId, Collision, Shape, World};

use crate::Controls;
use crate::actor::{Actor, ActorInfo};
use crate::arena_file::{BoundsFile, Materials, PrecisionFile};
use crate::combat::CombatParameters;
use crate::pipeline::Ports;
use crate::spawn::Pose;
use crate::step::{Arrival, Effect, KindLogic, LogicReport, Other, Request};
use crate::vehicle::VehicleParameters;
use cast::Cast;
pub use rounds::Rounds;

pub use build::Supplies;
use placing::Placed;
pub use reload::{Reload, ReloadError};

/// What the caller decides about an arena, not its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArenaSettings {
    /// Ticks a second; the length of a tick is its inverse. 1 to 1000.
    pub tick_hz: u16,
    /// Threads of the engine. The result does not depend on it.
    pub threads: usize,
}

/// What the outside asks of an arena.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// A player takes a slot and gets a vehicle. Refusals come as [`ArenaEvent::Left`].
    Enter {
        /// Below [`Arena::max_players`]; whoever had it leaves first.
        slot: u16,
        /// Name to show.
        name: String,
    },
    /// A player leaves, the vehicle with him.
    Leave {
        /// His slot; nothing happens where nobody has it.
        slot: u16,
        /// For people.
        reason: String,
    },
    /// New controls for a player's vehicle; they hold until the next.
    Drive {
        /// His slot; nothing happens where nobody has it.
        slot: u16,
        /// The controls.
        controls: Controls,
    },
}

/// Something that happened in a tick.
#[derive(Clone, Debug, PartialEq)]
pub enum ArenaEvent {
    /// An actor is there now.
    ActorAdded(ActorInfo),
    /// The actor with this id and all its bodies are gone.
    ActorRemoved(u32),
    /// Something to see or hear.
    Effect(Effect),
    /// An actor is knocked out.
    KnockedOut {
        /// Who.
        actor: u32,
        /// Whose merit it is.
        by: Option<u32>,
    },
    /// An actor has more points than before.
    Scored {
        /// Who.
        actor: u32,
        /// In this round.
        points: u32,
    },
    /// A round is over.
    RoundEnded {
        /// Counts rounds, from 1.
        number: u32,
        /// Who has most points; nobody where nobody has any.
        winner: Option<u32>,
    },
    /// A round begins; everybody starts anew.
    RoundBegan {
        /// Counts rounds, from 1.
        number: u32,
    },
    /// A player has a slot now.
    Entered {
        /// Slot.
        slot: u16,
        /// Name.
        name: String,
    },
    /// A player has no slot any more, or did not get one.
    Left {
        /// Slot.
        slot: u16,
        /// For people.
        reason: String,
    },
}

/// A piece of geometry that never moves.
#[derive(Clone, Debug, PartialEq)]
pub struct StaticInfo {
    /// Shape in its own frame.
    pub shape: Shape,
    /// Where it stands, m.
    pub position: DVec3,
    /// Its frame to world.
    pub rotation: DQuat,
}

/// A running world.
pub struct Arena {
    name: String,
    title: String,
    max_players: u16,
    /// Length of a tick, s.
    dt: f64,
    ticks: u64,
    world: World,
    statics: Vec<StaticInfo>,
    /// What leaves it is put back.
    bounds: BoundsFile,
    precision: PrecisionFile,
    materials: Materials,
    vehicle: VehicleParameters,
    /// `None` where nobody fights.
    combat: Option<CombatParameters>,
    rounds: Option<Rounds>,
    /// Who fills empty places; `None` where nobody does.
    cast: Option<Cast>,
    /// Never empty.
    spawns: Vec<Pose>,
    /// By id.
    actors: BTreeMap<u32, Box<dyn Actor>>,
    next_actor: u32,
    /// Actor of each body.
    owners: BTreeMap<BodyId, u32>,
    /// Actor of each slot.
    slots: BTreeMap<u16, u32>,
    events: Vec<ArenaEvent>,
    /// Those of them that the last tick handed out; what was added since is the next one's.
    told: usize,
    /// Kept from tick to tick for its memory.
    commands: Vec<Command>,
    /// Likewise: those who are lost, and what actors are told of each other and ask for, in this tick.
    lost: Vec<u32>,
    others: Vec<Other>,
    requests: Vec<Request>,
    /// Who was asked for and comes with the next tick.
    arrivals: Vec<Arrival>,
    logic: LogicReport,
    /// By kind; kinds that were there once stay, with nothing.
    logic_by_kind: BTreeMap<&'static str, KindLogic>,
    /// What the file placed.
    placed: Placed,
    /// What the coming tick changes about that, in order.
    reloads: Vec<Reload>,
    /// Likewise: collisions of this tick.
    collisions: Vec<Collision>,
}

impl Arena {
    /// The arena that runs unless another is asked for.
    pub const DEFAULT: &str = include_str!("../../../configs/arenas/proving-ground.toml");

    /// Name in key expressions.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What a person calls it.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Number of slots.
    pub fn max_players(&self) -> u16 {
        self.max_players
    }

    /// Ticks done.
    pub fn tick(&self) -> u64 {
        self.ticks
    }

    /// The engine's world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Everything that never moves, in the order of the file.
    pub fn statics(&self) -> &[StaticInfo] {
        &self.statics
    }

    /// Every actor, in order of id.
    pub fn actors(&self) -> impl Iterator<Item = &ActorInfo> {
        self.actors.values().map(|actor| actor.describe())
    }

    /// The same, each with how much it [matters](Actor::relevance).
    pub fn relevant_actors(&self) -> impl Iterator<Item = (&ActorInfo, f32)> {
        self.actors.values().map(|actor| (actor.describe(), actor.relevance()))
    }

    /// The actor of a slot.
    pub fn actor_of(&self, slot: u16) -> Option<&ActorInfo> {
        self.slots.get(&slot).and_then(|id| self.actors.get(id)).map(|actor| actor.describe())
    }

    /// An actor by its id.
    pub fn actor(&self, id: u32) -> Option<&dyn Actor> {
        self.actors.get(&id).map(|actor| &**actor)
    }

    /// The round of combat that is on; `None` where nobody fights.
    pub fn rounds(&self) -> Option<&Rounds> {
        self.rounds.as_ref()
    }

    /// The surfaces of the arena.
    pub fn materials(&self) -> &Materials {
        &self.materials
    }

    /// The largest coordinate, in size, that bodies have before they are put back, m.
    pub fn reach_m(&self) -> f64 {
        self.bounds.reach_m()
    }

    /// How fine the arena's file wants its state to be sent.
    pub fn precision(&self) -> PrecisionFile {
        self.precision
    }

    /// What happened in the last tick, in order, and what was added since.
    pub fn events(&self) -> &[ArenaEvent] {
        &self.events
    }

    /// What logic did in the last tick.
    pub fn logic(&self) -> &LogicReport {
        &self.logic
    }

    /// The same by kind of actor, in order of their names.
    pub fn logic_by_kind(&self) -> impl Iterator<Item = (&'static str, KindLogic)> {
        self.logic_by_kind.iter().map(|(&kind, &logic)| (kind, logic))
    }

    /// From the next tick on, the engine says how much energy came from nowhere: see
    /// [`StepReport::energy_gain`](pita_sim::StepReport::energy_gain).
    pub fn audit_energy(&mut self) {
        self.world.audit_energy();
    }

    /// Stage 1: takes the commands that came in since the last tick and applies them, and lets in who was asked for.
    pub(crate) fn collect_input(&mut self, ports: &mut impl Ports) {
        self.events.drain(..self.told);
        self.logic = LogicReport::default();
        self.do_reloads();
        let mut commands = std::mem::take(&mut self.commands);
        ports.collect(self.ticks + 1, &mut commands);
        for command in commands.drain(..) {
            self.apply(command);
        }
        self.commands = commands;
        // What the engine refuses now it may take in the next tick.
        let _refused = self.fill_places();
        self.let_in_arrivals();
    }

    /// Stage 2: finds the contacts of this tick.
    pub(crate) fn detect_collisions(&mut self) {
        self.world.detect_collisions();
    }

    /// Stage 4: one implicit step of the whole world.
    pub(crate) fn integrate(&mut self) {
        self.world.integrate();
        self.ticks += 1;
        self.told = self.events.len();
    }
}
