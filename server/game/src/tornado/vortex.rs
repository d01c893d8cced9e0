//! The flow of a tornado: which velocity it wants to give to what is at a place.

use glam::DVec3;
use pita_sim::{SimError, World};

use super::TornadoParameters;
use super::column::Column;

/// The flow about the column as it stands in this tick.
pub struct Vortex<'a> {
    parameters: &'a TornadoParameters,
    /// Places of the column's spheres, foot first, m, and their velocities, m/s.
    spheres: [(DVec3, DVec3); Column::SPHERES],
    gravity: DVec3,
    /// 0 where it is not there, 1 in full strength.
    strength: f64,
}

/// Slowest that something is drawn to its orbit or pushed out to it, as a share of the speed around it.
const DRAW: f64 = 0.6;

impl<'a> Vortex<'a> {
    /// The flow about a column as it stands.
    ///
    /// # Errors
    /// Where a sphere of the column is gone.
    pub fn about(
        column: &Column,
        world: &World,
        parameters: &'a TornadoParameters,
        strength: f64,
    ) -> Result<Self, SimError> {
        Ok(Self { parameters, spheres: column.spheres(world)?, gravity: world.settings().gravity, strength })
    }

    /// Where it stands on the ground, m.
    pub fn foot(&self) -> DVec3 {
        self.spheres[0].0
    }

    /// How high a place is between foot, 0, and top, 1.
    pub fn share(&self, point: DVec3) -> f64 {
        let [(foot, _), .., (top, _)] = self.spheres;
        (point.y - foot.y) / (top.y - foot.y).max(1.0)
    }

    /// Horizontally from the axis to a place, m.
    pub fn arm(&self, point: DVec3) -> DVec3 {
        (point - self.axis(self.share(point)).0).with_y(0.0)
    }

    /// Radius of the orbit at a height, m.
    pub fn radius(&self, share: f64) -> f64 {
        let p = self.parameters;
        p.foot_radius + (p.top_radius - p.foot_radius) * share.clamp(0.0, 1.0)
    }

    /// Place and velocity of the axis at a height.
    fn axis(&self, share: f64) -> (DVec3, DVec3) {
        let along = share.clamp(0.0, 1.0) * (Column::SPHERES - 1) as f64;
        let lower = (along as usize).min(Column::SPHERES - 2);
        let ((a, va), (b, vb)) = (self.spheres[lower], self.spheres[lower + 1]);
        (a.lerp(b, along - lower as f64), va.lerp(vb, along - lower as f64))
    }

    /// Velocity that the flow wants at a place, m/s: around, towards the orbit, and up.
    fn wanted(&self, point: DVec3) -> DVec3 {
        let (p, share, arm) = (self.parameters, self.share(point), self.arm(point));
        let outwards = arm.try_normalize().unwrap_or(DVec3::X);
        let around = self.strength * p.swirl_speed;
        let missing = (self.radius(share) - arm.length()) / p.grip;
        let towards_orbit = missing.clamp(-DRAW * around, DRAW * around);
        let (_, drift) = self.axis(share);
        drift + around * DVec3::Y.cross(outwards) + towards_orbit * outwards + self.strength * p.lift_speed * DVec3::Y
    }

    /// What a velocity potential has to aim at, m/s, so that it arrives at the flow: it stays behind by its time constant
    /// times the acceleration that it has to give, that of the orbit and gravity's.
    pub fn target(&self, point: DVec3, time_constant: f64) -> DVec3 {
        let (p, arm) = (self.parameters, self.arm(point));
        let around = self.strength * p.swirl_speed;
        let radius = arm.length().max(0.5 * self.radius(self.share(point)));
        let inwards = -arm.normalize_or_zero() * around * around / radius;
        self.wanted(point) + time_constant * (inwards - self.strength * self.gravity)
    }
}
