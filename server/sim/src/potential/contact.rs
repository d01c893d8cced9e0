//! Contact point: a normal force by a piecewise cubic spline of the depth, friction by a piecewise cubic of the slip
//! with an anchor that persists, so that what should stick does not creep.
//!
//! Arms and normal are frozen at the start of the tick: the gap is then linear in the unknown and the potential convex.
//! The displacement is linear in the angular velocity too, which is what makes a wheel that turns 80 degrees a tick
//! roll.

use glam::{DMat3, DVec3};

use super::restitution::{Blow, Rebound};
use super::{FIXED, FrameIndex, PairBlocks, Term, Wrench, outer};
use crate::autodiff::{Scalar, Vec3};
use crate::collide::SecondPoint;
use crate::dof::{Frame, Twist};
use crate::settings::ContactSettings;

/// Slip at which friction is saturated, in units of limit / stiffness: where x − 4/27 x³ peaks.
pub(super) const SATURATION: f64 = 1.5;

/// Most that an impact stiffens a contact, in reduced masses per dt²: 1000 m/s at 30 Hz.
const STIFFEST: f64 = 4e4;

/// What the depth at the start of a tick exceeds that under its load by before recovery is taken out of the velocity, m:
/// at 30 Hz 3 mm leave a hop of 0.4 mm.
const RECOVERY_SLOP: f64 = 3e-3;

/// Stiffest that a load makes a contact, in reduced masses per dt²: what bears 200,000 times its own mass.
const STIFFEST_LOADED: f64 = 1e6;

/// Share of the gap tolerance that a steady load takes up: what is left is for changes of the load.
const SHARE: f64 = 0.5;

/// Tolerances by which a contact must be too deep to be stiffened within the tick. What is less follows in the next ones:
/// impacts are over by then.
const FAR_TOO_DEEP: f64 = 4.0;

/// Least and most that a stiffness grows by from tick to tick, and shares of the depth that is wanted within which it
/// stays, so that what rests stays where it is.
const FOLLOW: (f64, f64) = (0.7, 2.0);
const STEADY: (f64, f64) = (0.6, 2.0);

/// A load is steady where the contact closes or opens at less than this at the start of the tick, m/s, and where it
/// changed by less than this share since the last. To follow impacts cost a slammed jelly its solution.
const RESTING_SPEED: f64 = 0.1;

/// What closes at this speed when the tick starts hits, m/s.
const BLOW_SPEED: f64 = 0.5;
const CHANGE: f64 = 0.3;

/// How much stiffer than an impact a contact is that parts its bodies: what it gives way is missing from the bounce, with
/// this 0.1 % of its speed at 4 m/s.
const BOUNCE_STIFFENING: f64 = 30.0;

/// Share of the tangent in friction's stiffness along the slip, the rest is secant. Newton iterations a tick at 0.5, 0.8
/// and 1: slope55 2.8, 1.9, 1.1; 16 cars 56, 54, 51; pile100 10.2, 7.1, 7.4; 100 sheep 261, 257, 268.
pub(super) const TANGENT_SHARE: f64 = 0.8;

/// How fast a contact point closes, m/s.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Approach {
    /// At the start of the tick.
    pub now: f64,
    /// At its end, if nothing but gravity acts.
    pub free: f64,
    /// What resists there along the normal, kg; asked for by restitution alone.
    pub mass: f64,
}

/// A contact point in an island.
#[derive(Clone, Debug)]
pub(crate) struct ContactTerm {
    frames: [FrameIndex; 2],
    /// From the frames' origins to the point, m.
    arms: [DVec3; 2],
    /// From the first body to the second.
    normal: DVec3,
    /// At the start of the tick, m; not deeper than what may be recovered in one.
    start_gap: f64,
    /// What the start was deeper than that, m.
    excess_depth: f64,
    /// Start gap of a tick without recovery: as deep as the load explains, m.
    loaded_gap: f64,
    /// It takes back a depth that its load does not explain.
    recovers: bool,
    /// How much stiffer than the settings' it is for its load.
    stiffening: f64,
    /// Most that this may become.
    most_stiffening: f64,
    /// Depth that it may have under its load, m.
    tolerance: f64,
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
    /// It hits in this tick, or nothing is known of how it bears its load.
    is_impact: bool,
    /// It would if nothing carried its bodies.
    may_hit: bool,
    /// [`Blow::owed`] if its bodies meet in this tick.
    owed: f64,
    /// Its bodies are to part at a speed in this tick.
    rebounds: bool,
    /// Speed at which it closed at the start of the tick, m/s.
    start_speed: f64,
    /// Normal force at the end of the last tick, N.
    last_force: f64,
}

/// Normal force over stiffness and its integral at depth s: k (s²/w − s³/3w²) up to w, then a line.
#[inline]
fn normal_spline<S: Scalar>(s: S, w: f64) -> (S, S) {
    if s.below(f64::MIN_POSITIVE) {
        (S::ZERO, S::ZERO)
    } else if s.below(w) {
        let x = s / w;
        (x * x * x * (-x / 12.0 + 1.0 / 3.0) * (w * w), x * x * (-x / 3.0 + 1.0) * w)
    } else {
        let d = s - w;
        (d * d * 0.5 + d * (2.0 / 3.0 * w) + w * w / 4.0, d + 2.0 / 3.0 * w)
    }
}

/// Depth at which the spline's force is `f`, m.
fn depth_under(f: f64, w: f64) -> f64 {
    let f = f / w;
    if f >= 2.0 / 3.0 {
        return (f + 1.0 / 3.0) * w;
    }
    let step = |x: f64| x - (x * x * (1.0 - x / 3.0) - f) / (x * (2.0 - x)).max(f64::MIN_POSITIVE);
    let root = f.sqrt();
    // Within 3 % already; Newton's two steps leave 1e-6.
    step(step(root * (1.0 + root / 6.0))) * w
}

/// Derivative of the spline's force.
fn normal_slope(s: f64, w: f64) -> f64 {
    let x = (s / w).clamp(0.0, 1.0);
    x * (2.0 - x)
}

/// Friction over its limit and its integral at slip x: x − 4/27 x³ up to 1.5, then 1.
#[inline]
pub(super) fn friction_patch<S: Scalar>(x: S) -> (S, S) {
    if x.below(SATURATION) {
        let x2 = x * x;
        (x2 * (-x2 / 27.0 + 0.5), x * (-x2 * (4.0 / 27.0) + 1.0))
    } else {
        (x - 0.5625, S::ONE)
    }
}

/// Derivative of the patch's force.
pub(super) fn friction_slope(x: f64) -> f64 {
    if x < SATURATION { 1.0 - 4.0 / 9.0 * x * x } else { 0.0 }
}

impl ContactTerm {
    /// `mass` is the reduced mass of the pair, kg.
    pub fn new(
        frames: [FrameIndex; 2],
        point: &crate::collide::ContactPoint,
        arms: [DVec3; 2],
        mass: f64,
        approach: Approach,
        settings: &ContactSettings,
        dt: f64,
    ) -> Self {
        let unit = mass / (dt * dt);
        // Stopping what would get so deep takes a depth of overlap / stiffness: that shall not exceed the transition.
        let Rebound { speed: parting_speed, owed } = Rebound::plan(point, approach, settings, dt);
        let overlap = match parting_speed {
            Some(speed) => (approach.free + speed) * dt * BOUNCE_STIFFENING,
            None => approach.now * dt - point.gap.max(0.0),
        };
        let bears_nothing = point.normal_force == 0.0;
        let closes_at = |speed: f64| point.gap - speed * dt < settings.transition;
        let most_stiffening = (STIFFEST_LOADED / settings.normal_stiffness).max(1.0);
        let stiffening = point.stiffening.clamp(1.0, most_stiffening);
        let loaded = settings.normal_stiffness * stiffening;
        let stiffness = loaded.max((overlap / settings.transition).min(STIFFEST));
        let load_depth = depth_under(point.load / (loaded * unit), settings.transition);
        let loaded_gap = point.gap.max(-load_depth);
        let start_gap = point.gap.max(-load_depth - settings.recovery_speed * dt);
        let (start_gap, loaded_gap) = parting_speed.map_or((start_gap, loaded_gap), |speed| (-speed * dt, -speed * dt));
        Self {
            frames,
            arms,
            normal: point.normal,
            start_gap,
            excess_depth: start_gap - point.gap,
            loaded_gap,
            recovers: loaded_gap - start_gap > RECOVERY_SLOP,
            stiffening,
            most_stiffening,
            tolerance: settings.gap_tolerance,
            normal_stiffness: stiffness * unit,
            tangent_stiffness: settings.tangent_stiffness * stiffening * unit,
            transition: settings.transition,
            friction: point.surface.friction,
            anchor: point.anchor,
            limit: point.surface.friction * point.normal_force,
            is_impact: overlap > settings.transition || (bears_nothing && closes_at(approach.now)),
            may_hit: bears_nothing && closes_at(approach.free),
            owed,
            rebounds: parting_speed.is_some(),
            start_speed: approach.now,
            last_force: point.normal_force,
        }
    }

    /// A point of the second look. What the tick itself has made of the gap is taken back at any speed; what was there when
    /// it began is left to recovery.
    pub fn second(
        frames: [FrameIndex; 2],
        SecondPoint { contact: point, start_gap, start_depth, .. }: &SecondPoint,
        arms: [DVec3; 2],
        mass: f64,
        settings: &ContactSettings,
        dt: f64,
    ) -> Self {
        let unit = mass / (dt * dt);
        let deepened = -point.gap - start_depth;
        let stiffness = settings.normal_stiffness.max((deepened / settings.transition).min(STIFFEST));
        Self {
            frames,
            arms,
            normal: point.normal,
            start_gap: start_gap + start_depth,
            excess_depth: *start_depth,
            loaded_gap: (start_gap + start_depth).max(0.0),
            recovers: false,
            stiffening: 1.0,
            most_stiffening: 1.0,
            tolerance: settings.gap_tolerance,
            normal_stiffness: stiffness * unit,
            tangent_stiffness: settings.tangent_stiffness * unit,
            transition: settings.transition,
            friction: point.surface.friction,
            anchor: point.anchor,
            limit: 0.0,
            is_impact: true,
            may_hit: true,
            owed: 0.0,
            rebounds: false,
            start_speed: 0.0,
            last_force: 0.0,
        }
    }

    /// Whether it hits in this tick, or nothing is known of how it bears its load.
    pub fn is_impact(&self) -> bool {
        self.is_impact
    }

    /// Whether it would hit, or so, if its bodies fell freely.
    pub fn may_hit(&self) -> bool {
        self.may_hit
    }

    /// Displacement of b against a over the tick, m.
    #[inline]
    fn displacement<S: Scalar>(&self, dt: f64, [a, b]: [&Frame<S>; 2]) -> Vec3<S> {
        let a = a.velocity_at(self.arms[0]);
        if self.on_world() { -a * dt } else { (b.velocity_at(self.arms[1]) - a) * dt }
    }

    /// Whether the second end is the world.
    #[inline]
    fn on_world(&self) -> bool {
        self.frames[1] == FIXED
    }

    #[inline]
    fn depth<S: Scalar>(&self, displacement: Vec3<S>) -> S {
        -displacement.along(self.normal) - self.start_gap
    }

    /// Slip of the anchor, its length, and that length in units of limit / stiffness.
    #[inline]
    fn slip<S: Scalar>(&self, displacement: Vec3<S>) -> (Vec3<S>, S, S) {
        let along = Vec3::constant(self.normal).scale(displacement.along(self.normal));
        let slip = Vec3::constant(self.anchor) + displacement - along;
        let length = slip.length();
        (slip, length, length * (self.tangent_stiffness / self.limit.max(1e-300)))
    }

    /// Energy and its gradient by the displacement where the normal spline has this integral and value.
    // The innermost loop of all: what is not asked for of the answer need not be written to memory.
    #[inline(always)]
    fn force<S: Scalar>(&self, displacement: Vec3<S>, (integral, value): (S, S)) -> (S, Vec3<S>) {
        let mut energy = integral * self.normal_stiffness;
        let mut force = Vec3::constant(self.normal).scale(-value * self.normal_stiffness);
        if self.limit > 0.0 {
            let (slip, length, x) = self.slip(displacement);
            let (integral, value) = friction_patch(x);
            energy += integral * (self.limit * self.limit / self.tangent_stiffness);
            if length.value() > 0.0 {
                force += slip.scale(value * self.limit / length);
            }
        }
        (energy, force)
    }

    /// Energy and gradient on both frames.
    #[inline(always)]
    fn pushes<S: Scalar>(&self, displacement: Vec3<S>, normal: (S, S)) -> (S, [Wrench<S>; 2]) {
        let is_open = normal.1.value() == 0.0 && self.limit <= 0.0;
        if is_open {
            return (S::ZERO, [Wrench::ZERO; 2]);
        }
        let (energy, force) = self.force(displacement, normal);
        // Nobody asks for what acts on the world.
        let on_b = if self.on_world() { Wrench::ZERO } else { Wrench::at_fixed(force, self.arms[1]) };
        (energy, [Wrench::at_fixed(-force, self.arms[0]), on_b])
    }

    /// Positive semidefinite second derivative of the energy by the displacement, N/m.
    #[inline(always)]
    pub fn stiffness(&self, displacement: DVec3) -> DMat3 {
        let displacement = displacement.into();
        let nn = outer(self.normal, self.normal);
        let mut k = nn * (self.normal_stiffness * normal_slope(self.depth(displacement), self.transition));
        if self.limit > 0.0 {
            let (slip, length, x) = self.slip(displacement);
            let secant = if x > 0.0 { friction_patch(x).1 / x } else { 1.0 };
            let tangent = DMat3::IDENTITY - nn;
            k += tangent * (self.tangent_stiffness * secant);
            if length > 0.0 {
                // The tangent alone vanishes where it slides, and Newton then jumps to and fro across the anchor.
                let direction = DVec3::from(slip) / length;
                let slope = (friction_slope(x) - secant) * TANGENT_SHARE;
                k += outer(direction, direction) * (self.tangent_stiffness * slope);
            }
        }
        k
    }

    /// From the frames' origins to the point, m.
    pub fn arms(&self) -> [DVec3; 2] {
        self.arms
    }

    /// As [`ContactTerm::gradient`], with friction limited as it is there.
    #[inline]
    pub fn limited_gradient(&mut self, displacement: DVec3) -> DVec3 {
        let displacement = displacement.into();
        let normal = normal_spline(self.depth(displacement), self.transition);
        self.limit = self.friction * self.normal_stiffness * normal.1;
        self.force(displacement, normal).1.into()
    }

    /// Gradient of the energy by the displacement, N.
    #[inline]
    pub fn gradient(&self, displacement: DVec3) -> DVec3 {
        let displacement = displacement.into();
        self.force(displacement, normal_spline(self.depth(displacement), self.transition)).1.into()
    }

    /// Normal force, N.
    #[inline]
    pub fn normal_force(&self, dt: f64, at: [&Frame<f64>; 2]) -> f64 {
        self.normal_stiffness * normal_spline(self.depth(self.displacement(dt, at)), self.transition).1
    }

    /// What it gives back of the work that it took up when its bodies met, J.
    pub fn rebound_work(&self, dt: f64, at: [&Frame<f64>; 2]) -> f64 {
        if !self.rebounds {
            return 0.0;
        }
        let displacement = self.displacement(dt, at);
        let force = self.normal_stiffness * normal_spline(self.depth(displacement), self.transition).1;
        force * displacement.along(self.normal).max(0.0)
    }

    /// Depth at the candidate state, m; negative where it is open.
    pub fn final_depth(&self, dt: f64, at: [&Frame<f64>; 2]) -> f64 {
        self.depth(self.displacement(dt, at)) + self.excess_depth
    }

    /// Whether it takes back a depth that its load does not explain. What [`ContactTerm::second`] takes back is the tick's.
    pub fn recovers(&self) -> bool {
        self.recovers
    }

    /// From now on it is that of a tick in which its bodies are as deep as the load explains.
    pub fn stop_recovery(&mut self) {
        self.excess_depth += self.loaded_gap - self.start_gap;
        self.start_gap = self.loaded_gap;
        self.recovers = false;
    }

    /// What comes of it at the end of the tick.
    pub fn outcome(&self, dt: f64, at: [&Frame<f64>; 2]) -> Outcome {
        let displacement = self.displacement(dt, at);
        let depth = self.depth(displacement);
        let normal_force = self.normal_stiffness * normal_spline(depth, self.transition).1;
        Outcome {
            normal_force,
            depth: depth + self.excess_depth,
            is_still: DVec3::from(displacement) == DVec3::ZERO,
            anchor: self.final_anchor(displacement, normal_force),
            stiffening: self.final_stiffening(depth, normal_force),
            blow: self.final_blow(-displacement.along(self.normal) / dt, normal_force * dt),
        }
    }

    fn final_stiffening(&self, depth: f64, force: f64) -> f64 {
        let ratio = depth / (SHARE * self.tolerance);
        let is_steady = self.start_speed.abs() < RESTING_SPEED && (force - self.last_force).abs() < CHANGE * force;
        let next = match ratio {
            _ if !is_steady => ratio.clamp(FOLLOW.0, 1.0),
            _ if (STEADY.0..STEADY.1).contains(&ratio) => 1.0,
            _ => ratio.clamp(FOLLOW.0, FOLLOW.1),
        };
        (self.stiffening * next).clamp(1.0, self.most_stiffening)
    }

    /// `speed` is that at which it closed at the end, m/s, `impulse` in N s.
    fn final_blow(&self, speed: f64, impulse: f64) -> Blow {
        let work = impulse * (self.start_speed + speed) / 2.0;
        if self.owed != 0.0 && work > 0.0 { Blow { owed: self.owed, work } } else { Blow::default() }
    }

    fn final_anchor(&self, displacement: Vec3<f64>, normal_force: f64) -> DVec3 {
        let (slip, length, _) = self.slip(displacement);
        let reach = SATURATION * self.friction * normal_force / self.tangent_stiffness;
        DVec3::from(slip) * if length > reach { reach / length } else { 1.0 }
    }
}

/// What comes of a contact point, most of it for the next tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    /// N.
    pub normal_force: f64,
    /// Depth, m; negative where it is open.
    pub depth: f64,
    /// Its bodies did not move against each other there.
    pub is_still: bool,
    /// The slip, pulled along at the cone, m.
    pub anchor: DVec3,
    /// How much stiffer than the settings' it is to be, so that the load takes up its share of the tolerance.
    pub stiffening: f64,
    /// That the bodies gave each other.
    pub blow: Blow,
}

/// How friction at a contact changes beyond what [`Term::hessian`] says: with the normal force, and along the slip by the
/// share of the tangent that is left out there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slide {
    pub frames: [FrameIndex; 2],
    arms: [DVec3; 2],
    normal: DVec3,
    /// Unit vector along the slip.
    direction: DVec3,
    /// Of friction, with the depth, N/m.
    by_depth: f64,
    /// Of friction, with the slip, N/m.
    by_slip: f64,
}

impl Slide {
    /// Change of the gradient on both ends, given the displacements of their frames.
    pub fn change(&self, [a, b]: [Twist; 2]) -> [Wrench; 2] {
        let displacement = b.at(self.arms[1]) - a.at(self.arms[0]);
        let along = self.by_slip * self.direction.dot(displacement) - self.by_depth * self.normal.dot(displacement);
        let force = Vec3::constant(self.direction * along);
        [Wrench::at_fixed(-force, self.arms[0]), Wrench::at_fixed(force, self.arms[1])]
    }
}

impl ContactTerm {
    /// How friction changes beyond the Hessian; `None` where it sticks or there is none.
    pub fn slide(&self, dt: f64, at: [&Frame<f64>; 2]) -> Option<Slide> {
        let displacement = self.displacement(dt, at);
        let (slip, length, x) = self.slip(displacement);
        if self.limit <= 0.0 || length <= 0.0 {
            return None;
        }
        let (value, slope) = (friction_patch(x).1, friction_slope(x));
        let normal_slope = self.normal_stiffness * normal_slope(self.depth(displacement), self.transition);
        // µ N p(x / N): what is left of the product rule once x = slip × stiffness / limit has changed too.
        let by_depth = self.friction * normal_slope * (value - x * slope);
        let by_slip = (1.0 - TANGENT_SHARE) * self.tangent_stiffness * (slope - value / x);
        let Self { frames, arms, normal, .. } = *self;
        Some(Slide { frames, arms, normal, direction: DVec3::from(slip) / length, by_depth, by_slip })
    }
}

impl Term for ContactTerm {
    const IS_OF_POINTS: bool = true;

    fn frames(&self) -> [FrameIndex; 2] {
        self.frames
    }

    #[inline(always)]
    fn evaluate<S: Scalar>(&self, dt: f64, at: [&Frame<S>; 2]) -> (S, [Wrench<S>; 2]) {
        let displacement = self.displacement(dt, at);
        self.pushes(displacement, normal_spline(self.depth(displacement), self.transition))
    }

    #[inline]
    fn relinearise(&mut self, dt: f64, at: [&Frame<f64>; 2]) {
        self.limit = self.friction * self.normal_force(dt, at);
    }

    #[inline(always)]
    fn relinearise_and_evaluate(&mut self, dt: f64, at: [&Frame<f64>; 2]) -> (f64, [Wrench; 2]) {
        let displacement = self.displacement(dt, at);
        let normal = normal_spline(self.depth(displacement), self.transition);
        self.limit = self.friction * self.normal_stiffness * normal.1;
        self.pushes(displacement, normal)
    }

    fn is_idle(&self, dt: f64, at: [&Frame<f64>; 2]) -> bool {
        self.limit <= 0.0 && self.depth(self.displacement(dt, at)) <= 0.0
    }

    #[inline(always)]
    fn hessian(&self, dt: f64, at: [&Frame<f64>; 2]) -> PairBlocks {
        PairBlocks::of_points(self.stiffness(self.displacement(dt, at).into()), self.arms[0], self.arms[1])
    }

    fn stiffen(&mut self, dt: f64, at: [&Frame<f64>; 2]) -> bool {
        let depth = self.depth(self.displacement(dt, at));
        // A blow is no load: what it presses in for a tick is the impact's own stiffness to bear.
        let bears = self.start_speed < BLOW_SPEED;
        let grows = bears && depth > FAR_TOO_DEEP * self.tolerance && self.stiffening < self.most_stiffening;
        if grows {
            let wanted = self.stiffening * depth / (SHARE * self.tolerance);
            let growth = wanted.min(self.most_stiffening) / self.stiffening;
            self.stiffening *= growth;
            self.normal_stiffness *= growth;
            self.tangent_stiffness *= growth;
        }
        grows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::potential::BetweenFrames;

    /// Value and derivative are continuous and are the derivatives of one another.
    #[test]
    fn splines_are_smooth() {
        type Spline = (fn(f64) -> (f64, f64), fn(f64) -> f64);
        let splines: [Spline; 2] =
            [(|s| normal_spline(s, 1.0), |s| normal_slope(s, 1.0)), (friction_patch, friction_slope)];
        let h = 1e-6;
        for x in (1..400).map(|i| f64::from(i) * 0.01) {
            for (spline, slope) in splines {
                let (below, here, above) = (spline(x - h), spline(x), spline(x + h));
                assert!(((above.0 - below.0) / (2.0 * h) - here.1).abs() < 1e-5, "value at {x}");
                assert!(((above.1 - below.1) / (2.0 * h) - slope(x)).abs() < 1e-5, "slope at {x}");
            }
        }
    }

    /// The force of a depth that a solver left is no load, and explains no depth.
    #[test]
    fn only_a_load_explains_a_depth() {
        let settings = ContactSettings::default();
        let mut point = crate::collide::ContactPoint::at(DVec3::ZERO, DVec3::NEG_Y, -0.1, 0.5);
        for (load, recovers) in [(0.0, true), (1e9, false)] {
            (point.normal_force, point.load) = (1e9, load);
            let arms = [DVec3::ZERO; 2];
            let term = ContactTerm::new([0, FIXED], &point, arms, 1.0, Approach::default(), &settings, 1.0 / 30.0);
            assert_eq!(term.recovers(), recovers, "of a load of {load} N");
        }
    }

    /// What is idle has no Hessian, and what bears a load is not idle, whichever way it moves.
    #[test]
    fn only_what_is_open_is_idle() {
        let (dt, frame) = (1.0 / 30.0, |speed: f64| Frame { linear: (DVec3::Y * speed).into(), ..Frame::WORLD });
        let (mut idle, mut loaded) = (0, 0);
        for speed in (-20..20).map(|i| f64::from(i) * 0.01) {
            let mut term = ContactTerm {
                frames: [0, FIXED],
                arms: [DVec3::ZERO; 2],
                normal: DVec3::NEG_Y,
                start_gap: 1e-3,
                excess_depth: 0.0,
                loaded_gap: 0.0,
                recovers: false,
                stiffening: 1.0,
                most_stiffening: 1.0,
                tolerance: 1e-3,
                normal_stiffness: 1e5,
                tangent_stiffness: 1e5,
                transition: 1e-3,
                friction: 0.5,
                anchor: DVec3::ZERO,
                limit: 0.0,
                is_impact: false,
                may_hit: false,
                owed: 0.0,
                rebounds: false,
                start_speed: 0.0,
                last_force: 0.0,
            };
            let at = [&frame(speed), &Frame::WORLD];
            term.relinearise(dt, at);
            let largest = term.hessian(dt, at).own::<6>(0).as_flattened().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            assert_eq!(term.is_idle(dt, at), largest == 0.0, "{speed}");
            *if largest == 0.0 { &mut idle } else { &mut loaded } += 1;
        }
        assert!(idle > 10 && loaded > 10, "{idle} {loaded}");
    }
}
