//! Hulls: colliders of bodies as detection keeps them from tick to tick.

use glam::{DMat3, DVec3};
use slotmap::SlotMap;

use super::embedded_hull::{Deformed, Motion};
use super::kdop::{greater, lesser};
use super::shape::{Collider, Shape};
use super::{Bound, Moving, SLABS};
use crate::dof::{Body, BodyId, FigureBody, Placed, Pose, Twist};
use crate::settings::Settings;
use crate::state::State;

/// Share of its bounding radius that a part of a figure moves by in a tick from where on it is asked what it passes: what is
/// slower is stopped by what it passes at no more than that.
const FAST: f64 = 0.1;

/// Where detection looks bodies up.
#[derive(Clone, Copy)]
pub(crate) struct Bodies<'a> {
    pub bodies: &'a SlotMap<BodyId, Body>,
    pub state: &'a State,
}

impl<'a> Bodies<'a> {
    /// What a body collides with there; of an embedded hull, without its shape.
    pub fn collider(self, placed: &Placed) -> Option<&'a Collider> {
        let (body, index) = (self.bodies.get(placed.body)?, placed.index as usize);
        match &body.figure {
            None => body.colliders.get(index),
            Some(figure) => match figure.hull(placed.index) {
                Some(hull) => Some(hull.collider()),
                None => Some(&figure.colliders.get(index)?.collider),
            },
        }
    }

    /// Where a collider is and how it moves.
    fn motion(self, placed: &Placed, body: &Body) -> (Pose, Twist) {
        match &body.figure {
            None => placed.carried(body.pose(self.state), body.twist(self.state)),
            Some(figure) => {
                let frame = figure.dof.frame(placed.at, self.state.q(body.slice), self.state.v(body.slice));
                (frame.pose(), frame.twist())
            }
        }
    }
}

/// A collider of a body.
#[derive(Clone, Debug)]
pub(super) struct Hull {
    pub placed: Placed,
    /// Serial of the body.
    pub owner: u32,
    pose: Pose,
    twist: Twist,
    /// How much faster than its twist says its surface may be, m/s.
    spread: f64,
    /// See [`Moving`].
    flies: bool,
    pivot: DVec3,
    bend: f64,
    /// Of the hull and of all that a tick may do to it; empty where the body takes no part.
    pub bounds: Bound,
    /// The last detection saw it at rest; and this one does, at the same place.
    pub was_at_rest: bool,
    pub keeps_still: bool,
    /// How the tick moves it, as far as the second look asks.
    pub stride: Stride,
    /// What it is in this tick where its vertices are embedded, and where the solver wants to put it.
    deformed: Option<Box<Deformed>>,
    ahead: Option<Box<(Deformed, Pose)>>,
}

/// Whether a tick moves a hull far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stride {
    /// By shifting or turning.
    pub is_far: bool,
    /// By turning alone.
    pub turns_far: bool,
    /// Velocity of its origin at the end of the tick, m/s.
    pub velocity: DVec3,
}

impl Hull {
    pub fn new(placed: Placed, owner: u32) -> Self {
        let (pose, twist, spread, bounds) = (Pose::IDENTITY, Twist::REST, 0.0, Bound::EMPTY);
        let (flies, pivot, bend, stride) = (false, DVec3::ZERO, 0.0, Stride::default());
        let (was_at_rest, keeps_still, deformed, ahead) = (false, false, None, None);
        Self {
            placed,
            owner,
            pose,
            twist,
            spread,
            flies,
            pivot,
            bend,
            bounds,
            was_at_rest,
            keeps_still,
            stride,
            deformed,
            ahead,
        }
    }

    /// Takes over where its body is now.
    pub fn follow(&mut self, bodies: Bodies, settings: &Settings) {
        let (pose, bounds) = (self.pose, std::mem::replace(&mut self.bounds, Bound::EMPTY));
        let was_at_rest = std::mem::take(&mut self.was_at_rest);
        self.keeps_still = false;
        let Some(body) = bodies.bodies.get(self.placed.body).filter(|body| !body.quarantined) else { return };
        match body.figure.as_ref().and_then(|figure| Some((figure, figure.hull(self.placed.index)?))) {
            None => {
                (self.pose, self.twist) = bodies.motion(&self.placed, body);
                self.twist.linear += body.surge;
            }
            Some((figure, hull)) => {
                let deformed = self.deformed.get_or_insert_with(|| Box::new(Deformed::new(hull)));
                let state = [bodies.state.q(body.slice), bodies.state.v(body.slice)];
                Motion { pose: self.pose, twist: self.twist, spread: self.spread } =
                    deformed.follow(hull, figure, state);
            }
        }
        self.was_at_rest = body.figure.is_none() && self.twist == Twist::REST;
        if was_at_rest && self.was_at_rest && self.pose == pose {
            (self.bounds, self.keeps_still) = (bounds, true);
            return;
        }
        self.foresee(bodies, body, settings);
        if let Some(collider) = self.collider(bodies) {
            self.bounds = swept_bounds(&self.seen(collider), settings);
        }
    }

    /// Finds out how it goes on.
    fn foresee(&mut self, bodies: Bodies, body: &Body, settings: &Settings) {
        let Some(figure) = &body.figure else {
            self.flies = true;
            self.pivot = body.pose(bodies.state).position - self.pose.position;
            return;
        };
        let radius = self.collider(bodies).map_or(0.0, Collider::bounding_radius);
        self.flies = settings.dt * self.twist.linear.length() > FAST * radius;
        if self.flies {
            self.bend = self.spread + figure.bend(&self.placed, bodies.state.q(body.slice), radius, settings);
        }
    }

    /// Whether the tick brings it nearer to a plane with that normal than it looked when it began, by more than all margins.
    pub fn dips(&self, normal: DVec3, settings: &Settings) -> bool {
        let towards = |velocity: DVec3| (-velocity.dot(normal)).max(0.0);
        settings.dt * (towards(self.stride.velocity) - towards(self.twist.linear)) > settings.contact.margin
    }

    /// Where it is; `None` where its body takes no part.
    pub fn pose(&self) -> Option<Pose> {
        (self.bounds != Bound::EMPTY).then_some(self.pose)
    }

    /// What it collides with, where it is.
    pub fn collider<'a>(&'a self, bodies: Bodies<'a>) -> Option<&'a Collider> {
        match &self.deformed {
            Some(deformed) => Some(&deformed.collider),
            None => bodies.collider(&self.placed),
        }
    }

    /// Takes over where the solver wants to put its vertices, if they are embedded: positions and rates of the figure.
    /// Answers how they move.
    pub fn deform_ahead(&mut self, figure: &FigureBody, state: [&[f64]; 2]) -> Option<(Twist, f64)> {
        let hull = figure.hull(self.placed.index)?;
        let (deformed, pose) = &mut **self.ahead.get_or_insert_with(|| Box::new((Deformed::new(hull), Pose::IDENTITY)));
        let motion = deformed.follow(hull, figure, state);
        *pose = motion.pose;
        Some((motion.twist, motion.spread))
    }

    /// What it collides with where the solver wants to put it, if its vertices are embedded, and where that is.
    pub fn ahead(&self) -> Option<(&Collider, Pose)> {
        self.ahead.as_ref().map(|ahead| (&ahead.0.collider, ahead.1))
    }

    /// What the fine phase sees of it.
    pub fn moving<'a>(&'a self, bodies: Bodies<'a>) -> Option<Moving<'a>> {
        Some(self.seen(self.collider(bodies)?))
    }

    fn seen<'a>(&self, collider: &'a Collider) -> Moving<'a> {
        let Self { placed: Placed { serial, .. }, pose, twist, spread, flies, pivot, bend, .. } = *self;
        Moving { serial, collider, pose, twist, spread, flies, pivot, bend }
    }
}

/// Bounds of a shape.
pub(super) fn bounds(shape: &Shape, pose: Pose) -> Bound {
    let (low, high) = shape.intervals(|v| Bound::along(pose.rotation * v));
    let centre = Bound::along(pose.position);
    Bound { min: std::array::from_fn(|i| centre[i] + low[i]), max: std::array::from_fn(|i| centre[i] + high[i]) }
}

/// Bounds of a collider and of all that a tick may do to it.
fn swept_bounds(hull: &Moving, settings: &Settings) -> Bound {
    let Moving { collider, pose, twist, spread, .. } = *hull;
    let (axes, radius) = (DMat3::from_quat(pose.rotation), collider.bounding_radius());
    // Turning moves no point farther than this, nor out of the ball around the shape.
    let turn = settings.dt * twist.angular.length() * radius;
    let slack = settings.contact.margin + settings.dt * (spread + settings.dt * settings.gravity.length());
    let (low, high) = collider.shape().intervals(|v| Bound::along(axes * v));
    let centre = Bound::along(pose.position);
    let turned = |high: f64| greater(lesser(high + turn, radius), high) + slack;
    let mut swept = Bound::EMPTY;
    for i in 0..SLABS {
        (swept.min[i], swept.max[i]) = (centre[i] - turned(-low[i]), centre[i] + turned(high[i]));
    }
    swept.swept(settings.dt * twist.linear)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// Along every direction a bound reaches as far as the shape: against the box that every shape has had all along.
    #[test]
    fn bounds_are_tight() {
        let pose = Pose { position: DVec3::new(3.0, -1.0, 2.0), rotation: DQuat::from_rotation_z(0.7) };
        let cylinder = Shape::Cylinder { half_length: 0.3, radius: 0.5, rounding: 0.1 };
        // Its axis stays along z; across it the rim is 0.5 away whatever the turn.
        let bound = bounds(&cylinder, pose);
        for (slab, half) in [(0, 0.5), (1, 0.5), (2, 0.3)] {
            assert!((bound.max[slab] - pose.position[slab] - half).abs() < 1e-12, "{slab}");
            assert!((pose.position[slab] - bound.min[slab] - half).abs() < 1e-12, "{slab}");
        }
        let hull = Shape::Hull { points: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], radius: 0.2 };
        let bound = bounds(&hull, Pose { rotation: DQuat::IDENTITY, ..pose });
        assert!((bound.min[0] - 2.8).abs() < 1e-12 && (bound.max[0] - 4.2).abs() < 1e-12);
        // A tetrahedron is half as high along the diagonal as the cube around it.
        assert!((bound.max[3] - bound.min[3] - 1.0 / 3f64.sqrt() - 0.4).abs() < 1e-12);
    }
}
