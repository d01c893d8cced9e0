//! Fixed joint: two points and all turns held together, as if welded.

use super::Anchor;
use super::alignment::{Aligned, Alignment, TILT, require_tilt};
use super::ball_joint::BallJointTerm;
use super::hold::{TOLERANCE, require_tolerance};
use crate::error::{SimError, require_vector};

slotmap::new_key_type! {
    /// Handle of a fixed joint.
    pub struct FixedJointId;
}

/// A fixed joint to be added: the turn of its bodies against each other stays what it is then. They do not collide with
/// each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedJointDesc {
    /// Point of the first body.
    pub a: Anchor,
    /// Point of the second body.
    pub b: Anchor,
    /// How far the points may be apart at the end of a tick, m.
    pub tolerance: f64,
    /// How far the bodies may be turned against each other at the end of a tick, rad.
    pub tilt: f64,
}

impl FixedJointDesc {
    /// A joint that holds to a millimetre and a milliradian.
    pub fn new(a: Anchor, b: Anchor) -> Self {
        Self { a, b, tolerance: TOLERANCE, tilt: TILT }
    }

    pub(crate) fn validate(&self) -> Result<(), SimError> {
        require_vector(self.a.point, "a.point")?;
        require_vector(self.b.point, "b.point")?;
        require_tolerance(self.tolerance)?;
        require_tilt(self.tilt)
    }
}

/// A fixed joint in an island.
pub(crate) type FixedJointTerm = Aligned<BallJointTerm, Alignment<3>>;
