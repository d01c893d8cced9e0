//! Whom a tornado has, and how it holds them: a velocity potential each (talk: "used to pull objects and swirl them").

use glam::DVec3;
use pita_sim::{Anchor, BodyId, JointDrive, PdControl, PdDesc, PdId, SimError, World};

use super::TornadoParameters;
use super::vortex::Vortex;

/// How far out of the orbit at the top a victim is lost, in radii of it.
const TORN_OFF: f64 = 2.5;

/// Most that are left in peace at a time after they were dropped.
const DROPPED_MAX: usize = 512;

/// Those that a tornado holds, in the order in which it took them.
#[derive(Default)]
pub struct Victims {
    held: Vec<Victim>,
    /// Whom it dropped, and how long it leaves each in peace, s.
    dropped: Vec<(BodyId, f64)>,
}

struct Victim {
    body: BodyId,
    flow: PdId,
    /// For how long it is held, s.
    held: f64,
}

impl Victims {
    /// Takes hold of a body, unless it has it, has just dropped it, has its hands full, or it is too heavy. Answers
    /// whether it did.
    ///
    /// # Errors
    /// What the engine says.
    pub fn add(&mut self, world: &mut World, p: &TornadoParameters, body: BodyId) -> Result<bool, SimError> {
        let known = self.held.iter().any(|victim| victim.body == body);
        let in_peace = self.dropped.iter().any(|&(dropped, _)| dropped == body);
        let Some(mass) = world.mass(body).filter(|&mass| mass <= p.max_mass) else { return Ok(false) };
        if known || in_peace || self.held.len() >= p.victims {
            return Ok(false);
        }
        let flow = world.add_pd(PdDesc {
            at: Anchor::body(body, DVec3::ZERO),
            drive: JointDrive::Velocity { time_constant: p.grip },
            max_force: mass * p.max_acceleration,
            control: PdControl { target: DVec3::ZERO, target_velocity: DVec3::ZERO },
        })?;
        self.held.push(Victim { body, flow, held: 0.0 });
        Ok(true)
    }

    /// Lets `dt` pass: swirls those that it holds, and drops those that are at the top, or torn off, or had enough.
    ///
    /// # Errors
    /// What the engine says.
    pub fn swirl(
        &mut self,
        world: &mut World,
        p: &TornadoParameters,
        vortex: &Vortex,
        dt: f64,
    ) -> Result<(), SimError> {
        self.dropped.iter_mut().for_each(|(_, left)| *left -= dt);
        self.dropped.retain(|&(body, left)| left > 0.0 && world.serial(body).is_some());
        // A body that is gone took its controller with it.
        self.held.retain(|victim| world.serial(victim.body).is_some());
        let torn_off = TORN_OFF * p.top_radius;
        for i in (0..self.held.len()).rev() {
            let victim = &mut self.held[i];
            victim.held += dt;
            let Some(at) = world.position(victim.body) else { continue };
            let had_enough = victim.held > p.hold_time || vortex.share(at) > 1.0;
            if had_enough || vortex.arm(at).length() > torn_off || world.is_quarantined(victim.body) {
                self.drop_one(world, i, p.peace_time);
                continue;
            }
            let control = PdControl { target: at, target_velocity: vortex.target(at, p.grip) };
            world.set_pd(victim.flow, control)?;
        }
        Ok(())
    }

    /// Drops everybody.
    pub fn drop_all(&mut self, world: &mut World, peace_time: f64) {
        for i in (0..self.held.len()).rev() {
            self.drop_one(world, i, peace_time);
        }
    }

    fn drop_one(&mut self, world: &mut World, index: usize, peace_time: f64) {
        let Victim { body, flow, .. } = self.held.remove(index);
        world.remove_pd(flow);
        if self.dropped.len() < DROPPED_MAX {
            self.dropped.push((body, peace_time));
        }
    }
}
