//! The way of a tornado around the level: a PD controller from corner to corner, with a frequency and a damping ratio for
//! each leg (talk, "Code: PD Controller": F = (Ct − C) Ks + (Vt − V) Kd).

use glam::DVec3;
use pita_sim::{Anchor, BodyId, JointDrive, PdControl, PdDesc, PdId, SimError, World};

use super::parameters::LegFile;

/// A closed way of legs. On each the foot swings to the leg's end like a damped spring; it is there after 1 / frequency.
pub struct Path {
    legs: Vec<LegFile>,
    /// The leg that it is on.
    leg: usize,
    controller: PdId,
    /// Since the leg began, s.
    passed: f64,
    /// Largest force of the controller, N.
    max_force: f64,
}

impl Path {
    /// The way of `body` along `legs`, which are at least one, from its first leg on. Every leg's controller is tried.
    ///
    /// # Errors
    /// What the engine says of a leg that this tick rate cannot show.
    pub fn add(world: &mut World, body: BodyId, legs: &[LegFile], max_force: f64) -> Result<Self, SimError> {
        for (i, leg) in legs.iter().enumerate() {
            let tried = add_controller(world, body, leg, max_force).map_err(|e| e.of(format!("leg {i}")))?;
            world.remove_pd(tried);
        }
        let first = legs.first().ok_or(SimError::Unusable { what: "a tornado's path needs a leg" })?;
        let controller = add_controller(world, body, first, max_force)?;
        Ok(Self { legs: legs.to_vec(), leg: 0, controller, passed: 0.0, max_force })
    }

    /// Where the leg ends, m.
    pub fn target(&self) -> DVec3 {
        DVec3::from_array(self.legs[self.leg].to)
    }

    /// Lets `dt` pass, and goes on to the next leg when this one is over.
    ///
    /// # Errors
    /// What the engine says.
    pub fn follow(&mut self, world: &mut World, body: BodyId, dt: f64) -> Result<(), SimError> {
        self.passed += dt;
        let LegFile { frequency, wait, .. } = self.legs[self.leg];
        if self.passed >= frequency.recip() + wait { self.go_on(world, body) } else { Ok(()) }
    }

    /// Begins the next leg.
    ///
    /// # Errors
    /// What the engine says.
    pub fn go_on(&mut self, world: &mut World, body: BodyId) -> Result<(), SimError> {
        world.remove_pd(self.controller);
        self.leg = (self.leg + 1) % self.legs.len();
        self.controller = add_controller(world, body, &self.legs[self.leg], self.max_force)?;
        self.passed = 0.0;
        Ok(())
    }
}

fn add_controller(world: &mut World, body: BodyId, leg: &LegFile, max_force: f64) -> Result<PdId, SimError> {
    world.add_pd(PdDesc {
        at: Anchor::body(body, DVec3::ZERO),
        drive: JointDrive::Position { frequency: leg.frequency, damping_ratio: leg.damping_ratio },
        max_force,
        control: PdControl { target: DVec3::from_array(leg.to), target_velocity: DVec3::ZERO },
    })
}
