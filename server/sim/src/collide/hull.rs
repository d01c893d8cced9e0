//! Hulls: colliders of bodies as detection keeps them from tick to tick.

use glam::DMat3;
use slotmap::SlotMap;

use super::kdop::Kdop;
use super::shape::{Collider, Shape};
use super::{Bound, Moving};
use crate::dof::{Body, BodyId, Placed, Pose, Twist};
use crate::settings::Settings;
use crate::state::State;

/// Where detection looks bodies up.
#[derive(Clone, Copy)]
pub(crate) struct Bodies<'a> {
    pub bodies: &'a SlotMap<BodyId, Body>,
    pub state: &'a State,
}

impl<'a> Bodies<'a> {
    /// What a body collides with there.
    pub fn collider(self, placed: &Placed) -> Option<&'a Collider> {
        let body = self.bodies.get(placed.body)?;
        match &body.figure {
            Some(figure) => Some(&figure.colliders[placed.index as usize].collider),
            None => body.collider.as_ref(),
        }
    }

    /// Where a collider is and how it moves; `None` where its body takes no part.
    pub fn motion(self, placed: &Placed) -> Option<(Pose, Twist)> {
        let body = self.bodies.get(placed.body).filter(|body| !body.quarantined)?;
        let Some(figure) = &body.figure else { return Some((body.pose(self.state), body.twist(self.state))) };
        let frame = figure.dof.frame(placed.at, self.state.q(body.slice), self.state.v(body.slice));
        Some((frame.pose(), frame.twist()))
    }
}

/// A collider of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hull {
    pub placed: Placed,
    /// Serial of the body.
    pub owner: u32,
    pose: Pose,
    twist: Twist,
    /// Of the hull and of all that a tick may do to it; empty where the body takes no part.
    pub bounds: Bound,
    /// How the tick moves it, as far as the second look asks.
    pub stride: Stride,
}

/// Whether a tick moves a hull far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stride {
    /// By shifting or turning.
    pub is_far: bool,
    /// By turning alone.
    pub turns_far: bool,
}

impl Hull {
    pub fn new(placed: Placed, owner: u32) -> Self {
        Self {
            placed,
            owner,
            pose: Pose::IDENTITY,
            twist: Twist::REST,
            bounds: Bound::EMPTY,
            stride: Stride::default(),
        }
    }

    /// Takes over where its body is now.
    pub fn follow(&mut self, bodies: Bodies, settings: &Settings) {
        let motion = bodies.motion(&self.placed);
        self.bounds = Bound::EMPTY;
        if let (Some((pose, twist)), Some(collider)) = (motion, bodies.collider(&self.placed)) {
            (self.pose, self.twist) = (pose, twist);
            self.bounds = swept_bounds(collider, pose, twist, settings);
        }
    }

    /// Where it is; `None` where its body takes no part.
    pub fn pose(&self) -> Option<Pose> {
        (self.bounds != Bound::EMPTY).then_some(self.pose)
    }

    /// What the fine phase sees of it.
    pub fn moving<'a>(&self, bodies: Bodies<'a>) -> Option<Moving<'a>> {
        let collider = bodies.collider(&self.placed)?;
        let Self { placed: Placed { serial, .. }, owner, pose, twist, .. } = *self;
        Some(Moving { serial, owner, collider, pose, twist })
    }
}

/// Bounds of a shape.
pub(super) fn bounds(shape: &Shape, pose: Pose) -> Bound {
    let to_shape = DMat3::from_quat(pose.rotation).transpose();
    Kdop::of_intervals(|axis| {
        let (centre, (low, high)) = (axis.dot(pose.position), shape.interval(to_shape * axis));
        (centre + low, centre + high)
    })
}

/// Bounds of a collider and of all that a tick may do to it.
fn swept_bounds(collider: &Collider, pose: Pose, twist: Twist, settings: &Settings) -> Bound {
    let (to_shape, radius) = (DMat3::from_quat(pose.rotation).transpose(), collider.bounding_radius());
    // Turning moves no point farther than this, nor out of the ball around the shape.
    let turn = settings.dt * twist.angular.length() * radius;
    let slack = settings.contact.margin + settings.dt * settings.dt * settings.gravity.length();
    let turned = Kdop::of_intervals(|axis| {
        let (centre, (low, high)) = (axis.dot(pose.position), collider.shape().interval(to_shape * axis));
        (centre + (low - turn).max(-radius).min(low) - slack, centre + (high + turn).min(radius).max(high) + slack)
    });
    turned.swept(settings.dt * twist.linear)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

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
