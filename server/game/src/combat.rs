//! Combat: health, weapons that are physics, knock-outs.
//!
//! Owns what a vehicle knows as a [`Fighter`], and the weapons: actors of their own that push on others through springs,
//! contacts and blasts. Who wins is the arena's to say, [`arena::rounds`](crate::arena::rounds). A client asks to fire; what comes of it is decided here.

pub mod fighter;
pub mod glove;
pub mod grenade;
pub mod parameters;
pub mod saw;

use pita_sim::{BodyId, DQuat, DVec3, SimError};
use serde::Deserialize;

use crate::step::Step;
pub use fighter::Fighter;
pub use parameters::CombatParameters;

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

/// What a weapon asks for at its end.
pub(crate) fn end(step: &mut Step) -> Result<(), SimError> {
    step.remove_self();
    Ok(())
}
