//! Joints that break at a force.
//!
//! Owns the rule: a joint that bore more than its strength in the last tick is taken out before the next. The engine
//! only tells what joints bear.

use pita_sim::{DVec3, JointId, World};

/// A joint with a strength.
#[derive(Clone, Copy, Debug)]
struct Weak {
    joint: JointId,
    /// N.
    strength: f64,
}

/// A joint that broke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Broken {
    /// Where it was, m.
    pub at: DVec3,
    /// What it bore on its second end, N.
    pub force: DVec3,
}

/// Joints of an actor that break.
#[derive(Clone, Debug, Default)]
pub struct Breakable {
    whole: Vec<Weak>,
}

impl Breakable {
    /// From now on `joint` breaks where it bears more than `strength` newtons.
    pub fn add(&mut self, joint: JointId, strength: f64) {
        self.whole.push(Weak { joint, strength });
    }

    /// Takes out what bore too much in the last tick; answers it, in the order in which the joints were added.
    pub fn give_way(&mut self, world: &mut World) -> Vec<Broken> {
        let mut broken = Vec::new();
        self.whole.retain(|weak| {
            let Some((at, force)) = world.joint_load(weak.joint) else { return false };
            let holds = force.length() <= weak.strength;
            if !holds {
                world.remove_joint(weak.joint);
                broken.push(Broken { at, force });
            }
            holds
        });
        broken
    }

    /// How many joints are whole.
    pub fn whole(&self) -> usize {
        self.whole.len()
    }

    /// Takes out all that is left, for an actor that is put together anew.
    pub fn clear(&mut self, world: &mut World) {
        for weak in self.whole.drain(..) {
            world.remove_joint(weak.joint);
        }
    }
}
