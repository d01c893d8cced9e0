//! Getting unstuck: backs out of what a car ran into, and resets one that lies on its roof.

use pita_protocol::message::{Controls, buttons};

use super::Body;

/// Ticks without progress after which a car counts as stuck: one second.
const STUCK_TICKS: u32 = 30;
/// Below this speed a car that is meant to move makes no progress, m/s.
const STUCK_SPEED: f32 = 0.5;
/// Ticks of reversing out.
const REVERSE_TICKS: u32 = 36;
/// Reversals without [`FREE_TICKS`] between them after which the reset button is pressed.
const REVERSALS_MAX: u32 = 3;
/// Ticks of progress after which earlier reversals are forgotten.
const FREE_TICKS: u32 = 90;
/// Ticks that a car may lie on its side, in case it rolls on.
const OVERTURNED_TICKS: u32 = 30;
/// The roof's vertical component below which a car lies.
const OVERTURNED_UP: f32 = 0.4;
/// Ticks that the reset button is held: longer than one lost packet.
const RESET_TICKS: u32 = 3;

/// Watches one car and takes over its controls while it is stuck.
#[derive(Debug, Default)]
pub struct Recovery {
    stuck: u32,
    free: u32,
    overturned: u32,
    reversals: u32,
    manoeuvre: Option<(Controls, u32)>,
}

impl Recovery {
    /// The controls to send: those that are wanted, or those of a manoeuvre.
    pub fn drive(&mut self, own: &Body, wanted: Controls) -> Controls {
        if let Some((controls, ticks)) = self.manoeuvre.take() {
            self.manoeuvre = (ticks > 1).then_some((controls, ticks - 1));
            return controls;
        }
        self.observe(own, &wanted);
        if self.overturned >= OVERTURNED_TICKS || self.reversals > REVERSALS_MAX {
            return self.begin(Controls { buttons: buttons::RESET, ..Controls::default() }, RESET_TICKS);
        }
        if self.stuck >= STUCK_TICKS {
            self.reversals += 1;
            let reversals = self.reversals;
            let out = Controls { throttle: 0.7, steer: -wanted.steer, brake: 0.0, buttons: buttons::REVERSE };
            let controls = self.begin(out, REVERSE_TICKS);
            self.reversals = reversals;
            return controls;
        }
        wanted
    }

    fn observe(&mut self, own: &Body, wanted: &Controls) {
        let moves = own.speed().abs() >= STUCK_SPEED;
        self.stuck = if moves || wanted.throttle < 0.1 { 0 } else { self.stuck + 1 };
        self.free = if moves { self.free + 1 } else { 0 };
        if self.free >= FREE_TICKS {
            self.reversals = 0;
        }
        self.overturned = if own.up().y < OVERTURNED_UP { self.overturned + 1 } else { 0 };
    }

    fn begin(&mut self, controls: Controls, ticks: u32) -> Controls {
        *self = Self { manoeuvre: Some((controls, ticks - 1)), ..Self::default() };
        controls
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    const WANTED: Controls = Controls { throttle: 1.0, brake: 0.0, steer: 0.5, buttons: 0 };

    fn car(speed: f32, rotation: Quat) -> Body {
        Body { position: Vec3::ZERO, rotation, velocity: rotation * Vec3::X * speed }
    }

    fn run(recovery: &mut Recovery, own: &Body, ticks: u32) -> Vec<Controls> {
        (0..ticks).map(|_| recovery.drive(own, WANTED)).collect()
    }

    #[test]
    fn leaves_a_car_alone_that_moves() {
        let sent = run(&mut Recovery::default(), &car(5.0, Quat::IDENTITY), 500);
        assert!(sent.iter().all(|controls| *controls == WANTED));
    }

    #[test]
    fn reverses_out_and_resets_when_that_does_not_help() {
        let sent = run(&mut Recovery::default(), &car(0.0, Quat::IDENTITY), 400);
        let first = sent.iter().position(|c| c.buttons == buttons::REVERSE).unwrap();
        let reset = sent.iter().position(|c| c.buttons == buttons::RESET).unwrap();
        assert!((first as u32) < STUCK_TICKS && first < reset);
        assert_eq!(sent[first].steer, -WANTED.steer);
        let reversing = sent[..reset].iter().filter(|c| c.buttons == buttons::REVERSE).count() as u32;
        assert_eq!(reversing, (REVERSALS_MAX + 1) * REVERSE_TICKS);
    }

    #[test]
    fn a_car_on_its_roof_is_reset_and_then_let_go() {
        let mut recovery = Recovery::default();
        let sent = run(&mut recovery, &car(0.0, Quat::from_rotation_x(3.0)), OVERTURNED_TICKS + RESET_TICKS);
        assert_eq!(sent.iter().filter(|c| c.buttons == buttons::RESET).count() as u32, RESET_TICKS);
        assert_eq!(recovery.drive(&car(0.0, Quat::IDENTITY), WANTED), WANTED);
    }
}
