//! What an actor may do in stage 3.
//!
//! Owns the actor's view of the world and of its fellow actors, and the list of what actors ask for. What they ask for
//! is done by the arena when all of them have acted, in the order in which it was asked: who acts first sees nothing
//! that the last one does not see. Actors that were asked for come at the end of the next tick's stage 1.

use std::collections::BTreeMap;

use glam::DVec3;
use pita_sim::{BodyId, SimError, World};

use crate::Actor;
use crate::scheduler;

/// Most effects of a tick; what is more is dropped and counted, [`LogicReport::refused`].
pub const EFFECTS_MAX: usize = 256;

/// What the other actors are told of an actor: where it was when stage 3 began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Other {
    /// [`ActorInfo::id`](crate::ActorInfo::id).
    pub id: u32,
    /// [`ActorInfo::kind`](crate::ActorInfo::kind).
    pub kind: &'static str,
    /// Slot of the player whose it is.
    pub slot: Option<u16>,
    /// Its first body.
    pub body: BodyId,
    /// Of that body, m.
    pub position: DVec3,
    /// Of that body, m/s.
    pub velocity: DVec3,
}

/// What one actor tells another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// Harm.
    Damage {
        /// How much, in points of health.
        amount: f64,
        /// Whose merit it is: who fired, as a rule.
        by: Option<u32>,
    },
    /// A round of combat is over; the arena tells everybody.
    RoundEnded,
    /// A round of combat begins; the arena tells everybody.
    RoundBegan,
    /// What a game's own actors have to say; they agree on what it means.
    Own {
        /// Names the meaning.
        topic: &'static str,
        /// Whatever it needs.
        values: [f64; 4],
    },
}

/// Something for players to see or hear; it changes nothing in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// What it is: `dust`, `splinters`, `blast`.
    pub kind: &'static str,
    /// The actor that made it.
    pub actor: u32,
    /// Where, m.
    pub position: DVec3,
    /// Which way and how far, m; zero where that means nothing.
    pub direction: DVec3,
    /// How strong, 0 to 1.
    pub strength: f64,
}

/// Adds the bodies of a new actor, which has the given id, to the world.
pub type Build = dyn FnOnce(&mut World, u32) -> Result<Box<dyn Actor>, SimError> + Send;

/// An actor that was asked for: the id that it will have, and what builds it.
pub(crate) type Arrival = (u32, Box<Build>);

/// What an actor asked for.
pub(crate) enum Request {
    Remove(u32),
    Tell { from: u32, to: u32, message: Message },
    Respawn(u32),
    KnockedOut { actor: u32, by: Option<u32> },
    Effect(Effect),
}

/// What logic did in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogicReport {
    /// Actors that acted.
    pub actors: usize,
    /// Sporadic jobs that were due, [`Step::is_due`].
    pub sporadic: usize,
    /// Messages that were heard.
    pub messages: usize,
    /// Actors that came in stage 1 because another asked for them in the tick before.
    pub added: usize,
    /// Actors that went for the same reason.
    pub removed: usize,
    /// Actors that left the bounds, were quarantined, or could not go on: put back, or gone.
    pub lost: usize,
    /// Actors that ended at the bounds, as such as they do: [`WhenLost::Expire`](crate::WhenLost::Expire).
    pub expired: usize,
    /// Effects.
    pub effects: usize,
    /// What was asked for and could not be had: an actor that the engine refused or that is one too many, a message to
    /// nobody, an effect beyond [`EFFECTS_MAX`].
    pub refused: usize,
}

/// What the actors of a kind did in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KindLogic {
    /// How many acted.
    pub actors: usize,
    /// Their sporadic jobs that were due.
    pub sporadic: usize,
}

/// What an actor may touch in stage 3.
pub struct Step<'a> {
    /// The world, contacts of this tick included: to look at, and to push on.
    pub world: &'a mut World,
    /// Length of the tick, s.
    pub dt: f64,
    /// Number that the tick will have when it is done.
    pub tick: u64,
    /// Who acts.
    pub(crate) id: u32,
    pub(crate) others: &'a [Other],
    pub(crate) owners: &'a BTreeMap<BodyId, u32>,
    pub(crate) next_actor: &'a mut u32,
    pub(crate) requests: &'a mut Vec<Request>,
    pub(crate) arrivals: &'a mut Vec<Arrival>,
    pub(crate) report: &'a mut LogicReport,
}

impl<'a> Step<'a> {
    /// Whether this tick is one in which the actor does what it need not do each tick: every `period`-th, the talk's
    /// `IsStep1`. Actors have phases of their own, which spread their work evenly over the ticks. A period of 0 counts
    /// as 1.
    pub fn is_due(&mut self, period: u32) -> bool {
        let is_due = scheduler::is_due(self.id, self.tick, period);
        self.report.sporadic += usize::from(is_due);
        is_due
    }

    /// All other actors, in order of id.
    pub fn others(&self) -> impl Iterator<Item = &'a Other> + use<'a> {
        let (others, id) = (self.others, self.id);
        others.iter().filter(move |other| other.id != id)
    }

    /// An actor by its id; `None` where there was none when stage 3 began.
    pub fn other(&self, id: u32) -> Option<&'a Other> {
        let at = self.others.binary_search_by_key(&id, |other| other.id).ok()?;
        Some(&self.others[at])
    }

    /// The actor that a body belongs to.
    pub fn owner(&self, body: BodyId) -> Option<&'a Other> {
        self.other(*self.owners.get(&body)?)
    }

    /// The other actor nearest to `point` that `is_wanted`, not farther than `within` metres; of several at the same
    /// distance the one with the least id.
    pub fn nearest(&self, point: DVec3, within: f64, is_wanted: impl Fn(&Other) -> bool) -> Option<&'a Other> {
        let distance = |other: &Other| other.position.distance_squared(point);
        let near = self.others().filter(|other| distance(other) <= within * within && is_wanted(other));
        near.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Asks for a new actor; answers the id that it will have. It is built at the end of the next tick's stage 1, so that
    /// its contacts are found before it moves; until then it hears nothing. Where the engine refuses it, nothing of it
    /// stays behind, and nobody has that id.
    pub fn add(
        &mut self,
        build: impl FnOnce(&mut World, u32) -> Result<Box<dyn Actor>, SimError> + Send + 'static,
    ) -> u32 {
        let others = self.others;
        let id = next_free(self.next_actor, |id| others.binary_search_by_key(&id, |other| other.id).is_ok());
        self.arrivals.push((id, Box::new(build)));
        id
    }

    /// Asks that an actor be taken away, with everything that is its own; players' vehicles stay.
    pub fn remove(&mut self, id: u32) {
        self.requests.push(Request::Remove(id));
    }

    /// Asks that this actor be taken away.
    pub fn remove_self(&mut self) {
        self.remove(self.id);
    }

    /// Tells actor `to` something; it hears it at the end of this stage, [`Actor::hear`].
    pub fn tell(&mut self, to: u32, message: Message) {
        self.requests.push(Request::Tell { from: self.id, to, message });
    }

    /// Asks that this actor be put to where it goes when it is lost, [`Actor::when_lost`].
    pub fn respawn(&mut self) {
        self.requests.push(Request::Respawn(self.id));
    }

    /// Tells the arena that this actor is knocked out, and whose merit that is.
    pub fn knocked_out(&mut self, by: Option<u32>) {
        self.requests.push(Request::KnockedOut { actor: self.id, by });
    }

    /// Lets players see or hear something.
    pub fn effect(&mut self, kind: &'static str, position: DVec3, direction: DVec3, strength: f64) {
        let strength = strength.clamp(0.0, 1.0);
        self.requests.push(Request::Effect(Effect { kind, actor: self.id, position, direction, strength }));
    }
}

/// The first id from `next` on that is not taken, after the last one again from 0; `next` is what follows it. There are far
/// more ids than actors.
pub(crate) fn next_free(next: &mut u32, is_taken: impl Fn(u32) -> bool) -> u32 {
    while is_taken(*next) {
        *next = next.wrapping_add(1);
    }
    let id = *next;
    *next = next.wrapping_add(1);
    id
}
