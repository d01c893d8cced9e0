//! Contact point: a normal force by a piecewise cubic spline of the depth, friction by a piecewise cubic of the slip
//! with an anchor that persists, so that what should stick does not creep.
//!
//! Arms and normal are frozen at the start of the tick: the gap is then linear in the unknown and the potential convex.
//! The displacement is linear in the angular velocity too, which is what makes a wheel that turns 80 degrees a tick
//! roll.

use glam::{DMat3, DVec3};

use super::{Candidate, NodeIndex, PairBlocks, Term, Wrench, outer};
use crate::settings::ContactSettings;

/// Slip at which friction is saturated, in units of limit / stiffness: where x − 4/27 x³ peaks.
const SATURATION: f64 = 1.5;

/// Most that an impact stiffens a contact, in reduced masses per dt²: 1000 m/s at 30 Hz.
const STIFFEST: f64 = 4e4;

/// Share of the tangent in friction's stiffness along the slip, the rest is secant. Newton iterations a tick at 0.5, 0.8
/// and 1: slope55 2.8, 1.9, 1.1; 16 cars 56, 54, 51; pile100 10.2, 7.1, 7.4; 100 sheep 261, 257, 268.
const TANGENT_SHARE: f64 = 0.8;

/// A contact point in an island.
#[derive(Clone, Debug)]
pub(crate) struct ContactTerm {
    pub nodes: [NodeIndex; 2],
    /// From the centres of mass to the point, m.
    arms: [DVec3; 2],
    /// From the first body to the second.
    normal: DVec3,
    /// At the start of the tick, m; not deeper than what may be recovered in one.
    start_gap: f64,
    /// What the start was deeper than that, m.
    excess_depth: f64,
    /// N/m.
    normal_stiffness: f64,
    /// N/m.
    tangent_stiffness: f64,
    /// Depth over which the normal force's cubic grows into a line, m.
    transition: f64,
    friction: f64,
    /// Slip at the start of the tick, m.
    anchor: DVec3,
    /// Friction limit of this Newton iteration, N.
    limit: f64,
}

/// Normal force over stiffness, its integral and its derivative, at depth s: k (s²/w − s³/3w²) up to w, then a line.
fn normal_spline(s: f64, w: f64) -> (f64, f64, f64) {
    if s <= 0.0 {
        (0.0, 0.0, 0.0)
    } else if s < w {
        let x = s / w;
        (w * w * x * x * x * (1.0 / 3.0 - x / 12.0), w * x * x * (1.0 - x / 3.0), x * (2.0 - x))
    } else {
        let d = s - w;
        (w * w / 4.0 + 2.0 / 3.0 * w * d + 0.5 * d * d, 2.0 / 3.0 * w + d, 1.0)
    }
}

/// Friction over its limit, its integral and its derivative, at slip x: x − 4/27 x³ up to 1.5, then 1.
fn friction_patch(x: f64) -> (f64, f64, f64) {
    if x < SATURATION {
        let x2 = x * x;
        (x2 * (0.5 - x2 / 27.0), x * (1.0 - 4.0 / 27.0 * x2), 1.0 - 4.0 / 9.0 * x2)
    } else {
        (x - 0.5625, 1.0, 0.0)
    }
}

impl ContactTerm {
    /// `mass` is the reduced mass of the pair, kg; `closing_speed` how fast the point closes at the start, m/s.
    pub fn new(
        nodes: [NodeIndex; 2],
        point: &crate::collide::ContactPoint,
        arms: [DVec3; 2],
        mass: f64,
        closing_speed: f64,
        settings: &ContactSettings,
        dt: f64,
    ) -> Self {
        let unit = mass / (dt * dt);
        // Stopping what would get so deep takes a depth of overlap / stiffness: that shall not exceed the transition.
        let overlap = closing_speed * dt - point.gap.max(0.0);
        let stiffness = settings.normal_stiffness.max((overlap / settings.transition).min(STIFFEST));
        let start_gap = point.gap.max(-settings.recovery_speed * dt);
        Self {
            nodes,
            arms,
            normal: point.normal,
            start_gap,
            excess_depth: start_gap - point.gap,
            normal_stiffness: stiffness * unit,
            tangent_stiffness: settings.tangent_stiffness * unit,
            transition: settings.transition,
            friction: point.friction,
            anchor: point.anchor,
            limit: point.friction * point.normal_force,
        }
    }

    /// Displacement of b against a over the tick, m.
    fn displacement(&self, at: &Candidate) -> DVec3 {
        (at.twist(self.nodes[1]).at(self.arms[1]) - at.twist(self.nodes[0]).at(self.arms[0])) * at.dt
    }

    fn depth(&self, displacement: DVec3) -> f64 {
        -(self.start_gap + self.normal.dot(displacement))
    }

    /// Slip of the anchor, its length, and that length in units of limit / stiffness.
    fn slip(&self, displacement: DVec3) -> (DVec3, f64, f64) {
        let slip = self.anchor + displacement - self.normal * self.normal.dot(displacement);
        let length = slip.length();
        (slip, length, self.tangent_stiffness * length / self.limit.max(1e-300))
    }

    /// Normal force, N.
    pub fn normal_force(&self, at: &Candidate) -> f64 {
        self.normal_stiffness * normal_spline(self.depth(self.displacement(at)), self.transition).1
    }

    /// Depth at the candidate state, m; negative where it is open.
    pub fn final_depth(&self, at: &Candidate) -> f64 {
        self.depth(self.displacement(at)) + self.excess_depth
    }

    /// The anchor for the next tick: the slip, pulled along at the cone.
    pub fn final_anchor(&self, at: &Candidate) -> DVec3 {
        let (slip, length, _) = self.slip(self.displacement(at));
        let reach = SATURATION * self.friction * self.normal_force(at) / self.tangent_stiffness;
        if length > reach { slip * (reach / length) } else { slip }
    }
}

impl Term for ContactTerm {
    fn nodes(&self) -> [NodeIndex; 2] {
        self.nodes
    }

    fn evaluate(&self, at: &Candidate) -> (f64, [Wrench; 2]) {
        let displacement = self.displacement(at);
        let (integral, value, _) = normal_spline(self.depth(displacement), self.transition);
        let mut energy = self.normal_stiffness * integral;
        let mut force = self.normal * (-self.normal_stiffness * value);
        if self.limit > 0.0 {
            let (slip, length, x) = self.slip(displacement);
            let (integral, value, _) = friction_patch(x);
            energy += self.limit * self.limit / self.tangent_stiffness * integral;
            force += slip * (self.limit * value / length.max(1e-300));
        }
        (energy, [Wrench::at(-force, self.arms[0]), Wrench::at(force, self.arms[1])])
    }

    fn hessian(&self, at: &Candidate) -> PairBlocks {
        let displacement = self.displacement(at);
        let nn = outer(self.normal, self.normal);
        let mut k = nn * (self.normal_stiffness * normal_spline(self.depth(displacement), self.transition).2);
        if self.limit > 0.0 {
            let (slip, length, x) = self.slip(displacement);
            let (_, value, slope) = friction_patch(x);
            let secant = if x > 0.0 { value / x } else { 1.0 };
            let tangent = DMat3::IDENTITY - nn;
            k += tangent * (self.tangent_stiffness * secant);
            if length > 0.0 {
                // The tangent alone vanishes where it slides, and Newton then jumps to and fro across the anchor.
                let direction = slip / length;
                k += outer(direction, direction) * (self.tangent_stiffness * (slope - secant) * TANGENT_SHARE);
            }
        }
        PairBlocks::of_points(k, self.arms[0], self.arms[1])
    }

    fn relinearise(&mut self, at: &Candidate) {
        self.limit = self.friction * self.normal_force(at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value and derivative are continuous and are the derivatives of one another.
    #[test]
    fn splines_are_smooth() {
        let h = 1e-6;
        for i in 1..400 {
            let x = f64::from(i) * 0.01;
            for spline in [|x| normal_spline(x, 1.0), friction_patch as fn(f64) -> _] {
                let (below, here, above) = (spline(x - h), spline(x), spline(x + h));
                assert!(((above.0 - below.0) / (2.0 * h) - here.1).abs() < 1e-5, "value at {x}");
                assert!(((above.1 - below.1) / (2.0 * h) - here.2).abs() < 1e-5, "slope at {x}");
            }
        }
    }
}
