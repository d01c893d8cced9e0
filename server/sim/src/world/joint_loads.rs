//! What joints bear.

use glam::DVec3;

use super::World;
use crate::potential::{BallJointId, FixedJointId, HingeId, SliderId, UniversalJointId};

/// A joint of any type, to be asked what it bears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointId {
    /// Ball joint.
    Ball(BallJointId),
    /// Fixed joint.
    Fixed(FixedJointId),
    /// Hinge.
    Hinge(HingeId),
    /// Slider.
    Slider(SliderId),
    /// Universal joint.
    Universal(UniversalJointId),
}

impl World {
    /// Where a joint's first end is, m, and the force on its second end by which it held both together in the last tick
    /// in which it was awake, N; zero before the first. What it bears against turns is not part of it. Breakable things
    /// remove a joint that bears too much.
    pub fn joint_load(&self, id: JointId) -> Option<(DVec3, DVec3)> {
        let potentials = &self.potentials;
        let (end, memory) = match id {
            JointId::Ball(id) => potentials.ball_joints.get(id).map(|joint| (joint.desc.a, joint.memory))?,
            JointId::Fixed(id) => potentials.fixed_joints.get(id).map(|joint| (joint.desc.desc.a, joint.memory))?,
            JointId::Hinge(id) => potentials.hinges.get(id).map(|joint| (joint.desc.desc.a, joint.memory))?,
            JointId::Slider(id) => potentials.sliders.get(id).map(|joint| (joint.desc.desc.a, joint.memory))?,
            JointId::Universal(id) => potentials.universal_joints.get(id).map(|joint| (joint.desc.a, joint.memory))?,
        };
        // It remembers its gradient.
        Some((self.point(end), -memory.force))
    }

    /// Removes a joint of any type. Answers whether there was one.
    pub fn remove_joint(&mut self, id: JointId) -> bool {
        match id {
            JointId::Ball(id) => self.remove_ball_joint(id),
            JointId::Fixed(id) => self.remove_fixed_joint(id),
            JointId::Hinge(id) => self.remove_hinge(id),
            JointId::Slider(id) => self.remove_slider(id),
            JointId::Universal(id) => self.remove_universal_joint(id),
        }
    }
}
