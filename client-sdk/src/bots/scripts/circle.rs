//! Drives in a circle.

use pita_protocol::message::Controls;

use super::{Script, View, holding};

/// Speed that is held, m/s: 100 m in 15 s.
const SPEED: f32 = 7.0;
/// To the left, so wide that the car neither slides nor leaves the neighbourhood.
const STEER: f32 = -0.5;

/// Holds one speed and one steering angle.
#[derive(Debug)]
pub struct Circle;

impl Script for Circle {
    fn drive(&mut self, view: &View, _tick: u64) -> Controls {
        Controls { steer: STEER, ..holding(&view.own, SPEED) }
    }
}
