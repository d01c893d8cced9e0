//! Rolling and spinning resistance of a contact point: torques against the turn of one body over the other, up to a lever
//! times the normal force, with an anchor that persists, so that a ball on a gentle slope stays where it is.
//!
//! The talk's friction patch, for turns: about the normal spinning resists, across it rolling does.

use glam::{DMat3, DVec3};

use super::contact::{ContactTerm, SATURATION, TANGENT_SHARE, friction_patch, friction_slope};
use super::{FrameIndex, PairBlocks, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::collide::ContactPoint;
use crate::dof::Frame;

/// Resistance to turning at a contact point in an island.
#[derive(Clone, Debug)]
pub(crate) struct RollingTerm {
    /// For its normal force.
    contact: ContactTerm,
    normal: DVec3,
    /// Of the normal force against rolling and spinning, m.
    levers: [f64; 2],
    /// N m/rad.
    stiffness: f64,
    /// Turn at the start of the tick, rad.
    anchor: DVec3,
    /// Torques of this Newton iteration, N m.
    limits: [f64; 2],
}

impl RollingTerm {
    /// Of `point`, whose potential is `contact`; `stiffness` in N m/rad.
    pub fn new(contact: ContactTerm, point: &ContactPoint, stiffness: f64) -> Self {
        let levers = [point.surface.rolling_resistance, point.surface.spinning_resistance];
        let limits = levers.map(|lever| lever * point.normal_force);
        Self { contact, normal: point.normal, levers, stiffness, anchor: point.turn, limits }
    }

    /// Turn of b against a since the anchor, across the normal and along it, rad.
    fn turns<S: Scalar>(&self, dt: f64, [a, b]: [&Frame<S>; 2]) -> [Vec3<S>; 2] {
        let turn = Vec3::constant(self.anchor) + (b.angular - a.angular) * dt;
        let spun = Vec3::constant(self.normal).scale(turn.along(self.normal));
        [turn - spun, spun]
    }

    /// The anchor for the next tick: the turn, pulled along at the limits.
    pub fn final_anchor(&self, dt: f64, at: [&Frame<f64>; 2]) -> DVec3 {
        let force = self.contact.normal_force(dt, at);
        let [rolled, spun] = self.turns(dt, at).map(DVec3::from);
        let held = |turn: DVec3, lever: f64| turn.clamp_length_max(SATURATION * lever * force / self.stiffness);
        held(rolled, self.levers[0]) + held(spun, self.levers[1])
    }
}

impl Term for RollingTerm {
    fn frames(&self) -> [FrameIndex; 2] {
        self.contact.frames()
    }

    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let (mut energy, mut torque) = (S::ZERO, Vec3::ZERO);
        for (turn, limit) in self.turns(dt, at).into_iter().zip(self.limits) {
            let angle = turn.length();
            if limit > 0.0 && angle.value() > 0.0 {
                let (integral, value) = friction_patch(angle * (self.stiffness / limit));
                energy += integral * (limit * limit / self.stiffness);
                torque += turn.scale(value * limit / angle);
            }
        }
        let wrench = |torque| Wrench { force: Vec3::ZERO, torque };
        (energy, [wrench(-torque), wrench(torque)])
    }

    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        let along = outer(self.normal, self.normal);
        let spaces = [DMat3::IDENTITY - along, along];
        let mut k = DMat3::ZERO;
        for ((turn, limit), space) in self.turns(dt, at).into_iter().zip(self.limits).zip(spaces) {
            if limit > 0.0 {
                let (turn, angle) = (DVec3::from(turn), turn.length());
                let x = angle * self.stiffness / limit;
                let secant = if x > 0.0 { friction_patch(x).1 / x } else { 1.0 };
                k += space * (self.stiffness * secant);
                if angle > 0.0 {
                    let direction = turn / angle;
                    let slope = (friction_slope(x) - secant) * TANGENT_SHARE;
                    k += outer(direction, direction) * (self.stiffness * slope);
                }
            }
        }
        let mut blocks = PairBlocks::of_points(DMat3::ZERO, DVec3::ZERO, DVec3::ZERO);
        blocks.add_rotation(k);
        blocks
    }

    fn relinearise(&mut self, dt: f64, at: [&Frame<f64>; 2]) {
        let force = self.contact.normal_force(dt, at);
        self.limits = self.levers.map(|lever| lever * force);
    }
}
