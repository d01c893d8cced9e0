//! Combat: health, weapons that are physics, knock-outs.
//!
//! Owns what a vehicle knows as a [`Fighter`], and the weapons: actors of their own that push on others through springs,
//! contacts and blasts. Who wins is the arena's to say, [`arena::rounds`](crate::arena::rounds). A client asks to fire; what comes of it is decided here.

pub mod fighter;
pub mod glove;
pub mod grenade;
pub mod parameters;
pub mod saw;

use pita_sim::{BodyId, DQuat, DVec3, QueryFilter, Shape, SimError, World};
use serde::Deserialize;

use crate::actor::Response;
use crate::step::Step;
pub use fighter::Fighter;
pub use parameters::CombatParameters;

/// So often the way to what stops a shot is halved: to a millimetre, which is nearer than where contacts are found.
const HALVINGS: u32 = 9;

/// A weapon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weapon {
    /// A boxing glove on a spring.
    Glove,
    /// A disc that spins.
    Saw,
    /// A ball that bursts.
    Grenade,
}

impl Weapon {
    /// Whether an actor of this kind is a weapon: those say themselves what harm they do.
    pub fn is_kind(kind: &str) -> bool {
        [glove::KIND, saw::KIND, grenade::KIND].contains(&kind)
    }

    /// Time until the next shot, s.
    pub fn reload(self, p: &CombatParameters) -> f64 {
        match self {
            Self::Glove => p.glove.reload,
            Self::Saw => p.saw.reload,
            Self::Grenade => p.grenade.reload,
        }
    }

    /// Asks the arena for what it fires.
    pub fn fire(self, step: &mut Step, p: &CombatParameters, muzzle: Muzzle) {
        match self {
            Self::Glove => glove::Glove::fire(step, &p.glove, muzzle),
            Self::Saw => saw::Saw::fire(step, &p.saw, muzzle),
            Self::Grenade => grenade::Grenade::fire(step, &p.grenade, muzzle),
        }
    }
}

/// Where a weapon is fired: the front of a vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Muzzle {
    /// Who fires.
    pub owner: u32,
    /// What carries the weapon.
    pub chassis: BodyId,
    /// The front in the chassis' frame, m.
    pub front: DVec3,
    /// The front in the world, m.
    pub position: DVec3,
    /// Chassis to world.
    pub rotation: DQuat,
    /// Of the chassis, m/s.
    pub velocity: DVec3,
}

impl Muzzle {
    /// The muzzle now: the vehicle moved since the shot was asked for.
    fn now(self, world: &World) -> Result<Self, SimError> {
        let gone = || SimError::Gone { what: "the vehicle that fired" };
        let rotation = world.rotation(self.chassis).ok_or_else(gone)?;
        let position = world.position(self.chassis).ok_or_else(gone)? + rotation * self.front;
        let velocity = world.velocity(self.chassis).ok_or_else(gone)?;
        Ok(Self { position, rotation, velocity, ..self })
    }

    /// Where `shape`, turned by `rotation`, comes to on its way from `path[0]` to `path[1]`, m before the front: to the end, or
    /// to what it touches first. That is looked for every `step` m, no farther apart than the shape is long. Who touches a
    /// wall so fires into it, not through it.
    fn way_out(
        &self,
        world: &World,
        (shape, rotation): (&Shape, DQuat),
        path: [f64; 2],
        step: f64,
    ) -> Result<DVec3, SimError> {
        let filter = QueryFilter { except: Some(self.chassis), ..QueryFilter::ALL };
        let along = self.rotation * DVec3::X;
        let is_free = |ahead: f64| {
            let found = world.overlap(shape, self.position + along * ahead, rotation, &filter)?;
            Ok::<bool, SimError>(found.is_empty())
        };
        let [mut free, end] = path;
        while free < end {
            let mut blocked = (free + step).min(end);
            if is_free(blocked)? {
                free = blocked;
                continue;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (free + blocked);
                (free, blocked) = if is_free(middle)? { (middle, blocked) } else { (free, middle) };
            }
            return Ok(self.position + along * free);
        }
        Ok(self.position + along * end)
    }

    /// Where what is thrown starts: two of its radii before the front, or as far as it comes on its way from the middle of the
    /// vehicle, which it passes then.
    fn throw(&self, world: &World, shape: (&Shape, DQuat), radius: f64) -> Result<DVec3, SimError> {
        self.way_out(world, shape, [-self.front.length(), 2.0 * radius], radius)
    }
}

/// Lets a weapon out of the vehicle that fired it: until it has left, they do not meet.
#[derive(Clone, Copy, Debug, Default)]
struct Release {
    has_left: bool,
    touches: bool,
}

impl Release {
    /// Judges a contact with the vehicle that fired.
    fn meet(&mut self) -> Response {
        self.touches = true;
        if self.has_left { Response::Collide } else { Response::Pass }
    }

    /// A tick is over.
    fn step(&mut self) {
        self.has_left |= !std::mem::take(&mut self.touches);
    }
}

/// What a weapon asks for at its end.
pub(crate) fn end(step: &mut Step) -> Result<(), SimError> {
    step.remove_self();
    Ok(())
}
