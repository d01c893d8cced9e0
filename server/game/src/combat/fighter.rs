//! What a vehicle knows of combat: its health, who harmed it, its weapon.

use pita_sim::{Phase, SimError};

use super::{CombatParameters, Muzzle};
use crate::Controls;
use crate::actor::{Contact, Partner};
use crate::step::{Message, Step};

/// A vehicle's share in combat.
#[derive(Clone, Debug)]
pub struct Fighter {
    /// The vehicle's: harm that it does itself is nobody's merit.
    id: u32,
    parameters: CombatParameters,
    health: f64,
    /// Time until the next life, s; `None` while it fights.
    out_for: Option<f64>,
    /// Who harmed it last, and for how long that counts, s.
    attacker: Option<(u32, f64)>,
    /// Index of the weapon that is at hand.
    weapon: usize,
    next_was_held: bool,
    /// Time until the next shot, s.
    reload: f64,
    /// A round is on.
    may_fire: bool,
    /// It is to be put to a spawn point.
    asks_respawn: bool,
}

impl Fighter {
    /// The fighter of actor `id`, in full health; it may fire where a round is on.
    pub fn new(id: u32, parameters: CombatParameters, may_fire: bool) -> Self {
        let health = parameters.health;
        Self {
            id,
            parameters,
            health,
            out_for: None,
            attacker: None,
            weapon: 0,
            next_was_held: false,
            reload: 0.0,
            may_fire,
            asks_respawn: false,
        }
    }

    /// Points; 0 or less of one who is knocked out.
    pub fn health(&self) -> f64 {
        self.health
    }

    /// Whether it is knocked out.
    pub fn is_out(&self) -> bool {
        self.out_for.is_some()
    }

    /// A new life.
    pub fn restore(&mut self) {
        (self.health, self.out_for, self.attacker) = (self.parameters.health, None, None);
        self.asks_respawn = false;
    }

    /// Harm by what it collides with, by the impulse of the last tick. Tyres bear what the ground gives them, and weapons
    /// say themselves what they do.
    pub fn collide(&mut self, contact: &Contact) {
        let rolls = contact.own.material == "tyre" && matches!(contact.partner, Partner::Ground(_));
        if rolls || contact.own.is_sensor || contact.other.is_sensor || contact.phase == Phase::Begin {
            return;
        }
        let by = match contact.partner {
            Partner::Actor { kind, .. } if super::Weapon::is_kind(kind) => return,
            Partner::Actor { id, kind: "vehicle" } => Some(id),
            _ => None,
        };
        let harm = (contact.impulse - self.parameters.harmless_impulse) / self.parameters.impulse_per_point;
        if harm > 0.0 {
            self.suffer(harm, by);
        }
    }

    /// What other actors tell.
    pub fn hear(&mut self, message: &Message) {
        match *message {
            Message::Damage { amount, by } => self.suffer(amount, by),
            Message::RoundEnded => self.may_fire = false,
            Message::RoundBegan => {
                self.restore();
                (self.may_fire, self.asks_respawn) = (true, true);
            }
            Message::Own { .. } => {}
        }
    }

    fn suffer(&mut self, harm: f64, by: Option<u32>) {
        if self.is_out() || !harm.is_finite() || harm <= 0.0 {
            return;
        }
        self.health -= harm;
        if let Some(by) = by.filter(|&by| by != self.id) {
            self.attacker = Some((by, self.parameters.credit_time));
        }
    }

    /// One tick: is knocked out, comes back, takes weapons in hand and fires them.
    ///
    /// # Errors
    /// What the engine says.
    pub fn act(&mut self, step: &mut Step, controls: &Controls, muzzle: Muzzle) -> Result<(), SimError> {
        if self.asks_respawn {
            self.asks_respawn = false;
            step.respawn();
            // What it fired now would come from where it no longer is.
            return Ok(());
        }
        self.attacker = self.attacker.map(|(by, left)| (by, left - step.dt)).filter(|(_, left)| *left > 0.0);
        self.reload = (self.reload - step.dt).max(0.0);
        if let Some(left) = &mut self.out_for {
            *left -= step.dt;
            if *left <= 0.0 {
                self.restore();
                step.respawn();
            }
            return Ok(());
        }
        if self.health <= 0.0 {
            self.out_for = Some(self.parameters.respawn_time);
            step.knocked_out(self.attacker.map(|(by, _)| by));
            step.effect("knock_out", muzzle.position, pita_sim::DVec3::ZERO, 1.0);
            return Ok(());
        }
        self.handle_weapons(step, controls, muzzle);
        Ok(())
    }

    fn handle_weapons(&mut self, step: &mut Step, controls: &Controls, muzzle: Muzzle) {
        let count = self.parameters.weapons.len().max(1);
        if controls.next_weapon && !self.next_was_held {
            self.weapon = (self.weapon + 1) % count;
        }
        self.next_was_held = controls.next_weapon;
        let Some(&weapon) = self.parameters.weapons.get(self.weapon) else { return };
        if controls.fire && self.may_fire && self.reload <= 0.0 {
            self.reload = weapon.reload(&self.parameters);
            weapon.fire(step, &self.parameters, muzzle);
        }
    }
}
