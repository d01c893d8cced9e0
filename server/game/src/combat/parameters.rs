//! The numbers of combat: `[combat]` of an arena file, without which nobody is harmed and nothing is fired.

use serde::Deserialize;

use super::Weapon;
use crate::arena_file::{ArenaError, Key};

/// Most weapons of a vehicle.
const WEAPONS_MAX: usize = 8;

/// `[combat]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CombatParameters {
    /// Of a vehicle that was not harmed yet, points.
    pub health: f64,
    /// A blow of at most so much does no harm, N s.
    pub harmless_impulse: f64,
    /// What is more costs a point each, N s.
    pub impulse_per_point: f64,
    /// From a knock-out to the next life, s.
    pub respawn_time: f64,
    /// Who harmed last has the credit of a knock-out for so long, s.
    pub credit_time: f64,
    /// Weapons of every vehicle, the first at hand.
    pub weapons: Vec<Weapon>,
    /// Rounds.
    pub round: RoundParameters,
    /// The boxing glove.
    pub glove: GloveParameters,
    /// The saw disc.
    pub saw: SawParameters,
    /// The grenade.
    pub grenade: GrenadeParameters,
}

impl Default for CombatParameters {
    fn default() -> Self {
        Self {
            health: 100.0,
            harmless_impulse: 2_500.0,
            impulse_per_point: 120.0,
            respawn_time: 3.0,
            credit_time: 5.0,
            weapons: vec![Weapon::Glove, Weapon::Saw, Weapon::Grenade],
            round: RoundParameters::default(),
            glove: GloveParameters::default(),
            saw: SawParameters::default(),
            grenade: GrenadeParameters::default(),
        }
    }
}

/// `[combat.round]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RoundParameters {
    /// It ends after so long, s.
    pub time: f64,
    /// It ends when somebody has so many points.
    pub points: u32,
    /// From its end to the next one, s.
    pub pause: f64,
}

impl Default for RoundParameters {
    fn default() -> Self {
        Self { time: 180.0, points: 10, pause: 8.0 }
    }
}

/// `[combat.glove]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GloveParameters {
    /// Between two punches, s.
    pub reload: f64,
    /// Of a punch, points.
    pub damage: f64,
    /// Kg.
    pub mass: f64,
    /// How far the spring drives it, m.
    pub reach: f64,
    /// Of the spring, N/m.
    pub stiffness: f64,
}

impl Default for GloveParameters {
    fn default() -> Self {
        Self { reload: 1.5, damage: 25.0, mass: 60.0, reach: 3.0, stiffness: 25_000.0 }
    }
}

/// `[combat.saw]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SawParameters {
    /// Between two throws, s.
    pub reload: f64,
    /// Of a cut, points.
    pub damage: f64,
    /// Kg.
    pub mass: f64,
    /// Of the throw, beyond the vehicle's own, m/s.
    pub speed: f64,
    /// rad/s.
    pub spin: f64,
    /// It vanishes after, s.
    pub life: f64,
}

impl Default for SawParameters {
    fn default() -> Self {
        Self { reload: 1.0, damage: 15.0, mass: 15.0, speed: 30.0, spin: 60.0, life: 4.0 }
    }
}

/// `[combat.grenade]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GrenadeParameters {
    /// Between two throws, s.
    pub reload: f64,
    /// In the middle of the blast, points.
    pub damage: f64,
    /// Kg.
    pub mass: f64,
    /// Forwards, beyond the vehicle's own, and upwards, m/s.
    pub speed: [f64; 2],
    /// It bursts after, or at the first vehicle that it hits, s.
    pub fuse: f64,
    /// Of the blast, m.
    pub radius: f64,
    /// That the blast gives to what is in its middle, m/s.
    pub blast_speed: f64,
    /// Most that the blast gives to one body, N s.
    pub blast_impulse: f64,
}

impl Default for GrenadeParameters {
    fn default() -> Self {
        Self {
            reload: 3.0,
            damage: 50.0,
            mass: 6.0,
            speed: [15.0, 6.0],
            fuse: 2.0,
            radius: 8.0,
            blast_speed: 14.0,
            blast_impulse: 25_000.0,
        }
    }
}

impl CombatParameters {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first number that is not finite or out of range, below `key`.
    pub fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("health").number(self.health, 1.0, 1e6, "points")?;
        key.at("harmless_impulse").number(self.harmless_impulse, 0.0, 1e7, "N s")?;
        key.at("impulse_per_point").number(self.impulse_per_point, 1.0, 1e7, "N s")?;
        // Longer than any glove hangs on a vehicle that is put elsewhere then.
        key.at("respawn_time").number(self.respawn_time, 1.0, 60.0, "s")?;
        key.at("credit_time").number(self.credit_time, 0.0, 600.0, "s")?;
        key.at("weapons").count(self.weapons.len(), 0, WEAPONS_MAX, "weapons")?;
        self.round.check(&key.at("round"))?;
        self.glove.check(&key.at("glove"))?;
        self.saw.check(&key.at("saw"))?;
        self.grenade.check(&key.at("grenade"))
    }
}

impl RoundParameters {
    fn check(&self, key: &Key) -> Result<(), ArenaError> {
        key.at("time").number(self.time, 1.0, 86_400.0, "s")?;
        key.at("points").count(self.points as usize, 1, 1_000_000, "points")?;
        key.at("pause").number(self.pause, 1.0, 600.0, "s")
    }
}

/// What all weapons have.
fn check_weapon(key: &Key, reload: f64, damage: f64, mass: f64) -> Result<(), ArenaError> {
    key.at("reload").number(reload, 0.2, 600.0, "s")?;
    key.at("damage").number(damage, 0.0, 1e6, "points")?;
    key.at("mass").number(mass, 0.5, 1_000.0, "kg")
}

impl GloveParameters {
    fn check(&self, key: &Key) -> Result<(), ArenaError> {
        check_weapon(key, self.reload, self.damage, self.mass)?;
        key.at("reach").number(self.reach, 0.5, 20.0, "m")?;
        key.at("stiffness").number(self.stiffness, 100.0, 1e6, "N/m")
    }
}

impl SawParameters {
    fn check(&self, key: &Key) -> Result<(), ArenaError> {
        check_weapon(key, self.reload, self.damage, self.mass)?;
        key.at("speed").number(self.speed, 0.0, 100.0, "m/s")?;
        key.at("spin").number(self.spin, 0.0, 500.0, "rad/s")?;
        key.at("life").number(self.life, 0.1, 60.0, "s")
    }
}

impl GrenadeParameters {
    fn check(&self, key: &Key) -> Result<(), ArenaError> {
        check_weapon(key, self.reload, self.damage, self.mass)?;
        for (i, speed) in self.speed.into_iter().enumerate() {
            key.at("speed").index(i).number(speed, 0.0, 100.0, "m/s")?;
        }
        key.at("fuse").number(self.fuse, 0.1, 60.0, "s")?;
        key.at("radius").number(self.radius, 0.5, 100.0, "m")?;
        key.at("blast_speed").number(self.blast_speed, 0.0, 100.0, "m/s")?;
        key.at("blast_impulse").number(self.blast_impulse, 0.0, 1e7, "N s")
    }
}
