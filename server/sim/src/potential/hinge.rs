//! Hinge: two points and an axis of each held together; the turn about the axis is free.

use glam::DVec3;

use super::Anchor;
use super::alignment::{Aligned, Alignment, TILT, require_tilt};
use super::ball_joint::BallJointTerm;
use super::hold::{TOLERANCE, require_tolerance};
use crate::error::{SimError, require_direction, require_vector};

slotmap::new_key_type! {
    /// Handle of a hinge.
    pub struct HingeId;
}

/// A hinge to be added. Its two bodies do not collide with each other.
///
/// Its angle, which limits and motors are about, is 0 as the bodies stand when it is added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeDesc {
    /// Point of the first body.
    pub a: Anchor,
    /// Point of the second body.
    pub b: Anchor,
    /// Axis in the first part's frame (the world's where there is no body), of any length.
    pub axis_a: DVec3,
    /// Axis in the second part's frame. The second turns positively about it, the right hand says.
    pub axis_b: DVec3,
    /// How far the points may be apart at the end of a tick, m.
    pub tolerance: f64,
    /// How far the axes may be apart at the end of a tick, rad.
    pub tilt: f64,
}

impl HingeDesc {
    /// A hinge that is held closed to a millimetre and a milliradian.
    pub fn new(a: Anchor, b: Anchor, axis_a: DVec3, axis_b: DVec3) -> Self {
        Self { a, b, axis_a, axis_b, tolerance: TOLERANCE, tilt: TILT }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require_direction(self.axis_a, "axis_a")?;
        require_direction(self.axis_b, "axis_b")?;
        require_tolerance(self.tolerance)?;
        require_tilt(self.tilt)
    }
}

/// A hinge in an island.
pub(crate) type HingeTerm = Aligned<BallJointTerm, Alignment<1>>;
