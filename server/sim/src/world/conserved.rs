//! What a world has of energy and momentum.

use glam::DVec3;

use super::World;
use crate::dof::PartPoint;
use crate::potential::Anchor;

/// Energy of the world, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of motion and spin.
    pub kinetic: f64,
    /// Against gravity, from the origin's height.
    pub gravitational: f64,
    /// In springs.
    pub elastic: f64,
}

impl Energy {
    /// Sum of all.
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravitational + self.elastic
    }
}

/// Momentum of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Momentum {
    /// kg m/s.
    pub linear: DVec3,
    /// About the origin, kg m²/s.
    pub angular: DVec3,
}

impl World {
    /// Energy now.
    pub fn energy(&self) -> Energy {
        let mut energy = Energy::default();
        for body in self.bodies.values() {
            let motion = body.motion(&self.state);
            energy.kinetic += motion.energy;
            energy.gravitational += self.settings.field().energy(motion.moment);
            if let Some(figure) = &body.figure {
                let (q, v) = (self.state.q(body.slice), self.state.v(body.slice));
                energy.elastic += figure.stored_energy(q, v, self.settings.dt);
            }
        }
        for spring in self.potentials.springs.values() {
            let stretch = (self.point(spring.b) - self.point(spring.a)).length() - spring.rest_length;
            energy.elastic += 0.5 * spring.stiffness * stretch * stretch;
        }
        energy
    }

    /// From the next tick on, reports say how much energy came from nowhere: see [`crate::Settings::audit_energy`].
    pub fn audit_energy(&mut self) {
        self.settings.audit_energy = true;
    }

    /// Momentum now.
    pub fn momentum(&self) -> Momentum {
        let mut momentum = Momentum::default();
        for body in self.bodies.values() {
            let motion = body.motion(&self.state);
            momentum.linear += motion.momentum;
            momentum.angular += motion.angular_momentum;
        }
        momentum
    }

    /// Where an anchor is, m.
    pub(super) fn point(&self, anchor: Anchor) -> DVec3 {
        let body = anchor.body.and_then(|id| self.bodies.get(id));
        let at = PartPoint { part: anchor.part, point: anchor.point };
        body.map_or(anchor.point, |body| body.frame(at, &self.state).position.into())
    }
}
