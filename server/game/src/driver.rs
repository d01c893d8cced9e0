//! Who drives a vehicle: a player through the network, or the arena itself along a route.
//!
//! A driver sees the motion of its car and answers controls, the same that a player sends.

use glam::{DQuat, DVec3};
use pita_sim::{BodyId, World};

use crate::Controls;

/// Motion of a vehicle's chassis.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Centre, m.
    pub position: DVec3,
    /// Chassis frame to world.
    pub rotation: DQuat,
    /// Velocity of the centre, m/s.
    pub velocity: DVec3,
}

impl Motion {
    /// Motion of `body`; `None` where there is no such body any more.
    pub fn of(world: &World, body: BodyId) -> Option<Self> {
        let (position, rotation) = (world.position(body)?, world.rotation(body)?);
        Some(Self { position, rotation, velocity: world.velocity(body)? })
    }

    /// Speed along the car's own x, m/s.
    pub fn forward_speed(&self) -> f64 {
        self.velocity.dot(self.rotation * DVec3::X)
    }

    /// Heading about y; 0 faces +x, positive is to the left, rad.
    pub fn yaw(&self) -> f64 {
        let forward = self.rotation * DVec3::X;
        f64::atan2(-forward.z, forward.x)
    }

    /// Height of the car's own up: 1 upright, −1 on its roof.
    pub fn upright(&self) -> f64 {
        (self.rotation * DVec3::Y).y
    }
}

/// Who drives.
#[derive(Clone, Debug)]
pub enum Driver {
    /// Somebody outside: controls come as commands.
    Player,
    /// The arena.
    Route(RouteDriver),
}

impl Driver {
    /// This tick's controls; `None` where they come from outside.
    pub fn decide(&mut self, motion: &Motion, dt: f64) -> Option<Controls> {
        match self {
            Self::Player => None,
            Self::Route(driver) => Some(driver.decide(motion, dt)),
        }
    }
}

/// Distance at which a waypoint counts as reached, m: about the turning radius, so that none is circled for ever.
const REACHED: f64 = 8.0;
/// Slower than this while it should drive is stuck, m/s.
const STUCK_SPEED: f64 = 0.5;
/// So long it may be stuck before it backs out, s.
const STUCK_TIME: f64 = 2.0;
/// So long it backs out, s.
const BACK_TIME: f64 = 1.5;
/// So long it may lie on its side or roof before it asks for a reset, s.
const OVERTURNED_TIME: f64 = 2.0;
/// Heading error at which the steering is at its stop, rad.
const FULL_STEER: f64 = 0.5;
/// Excess of speed at which it brakes fully, m/s.
const FULL_BRAKE: f64 = 4.0;

/// Follows a closed route.
#[derive(Clone, Debug)]
pub struct RouteDriver {
    /// Corners in x and z, m.
    route: Vec<[f64; 2]>,
    next: usize,
    /// Wanted speed, m/s.
    speed: f64,
    stuck_for: f64,
    back_for: f64,
    overturned_for: f64,
}

impl RouteDriver {
    /// A driver who drives at `speed` m/s to corner `next` of `route` first, then round and round.
    ///
    /// # Panics
    /// Where `route` is empty; arena files with such a route are refused.
    pub fn new(route: Vec<[f64; 2]>, next: usize, speed: f64) -> Self {
        assert!(!route.is_empty(), "a route has corners");
        let next = next % route.len();
        Self { route, next, speed, stuck_for: 0.0, back_for: 0.0, overturned_for: 0.0 }
    }

    fn decide(&mut self, motion: &Motion, dt: f64) -> Controls {
        let error = self.heading_error(motion);
        let steer = (-error / FULL_STEER).clamp(-1.0, 1.0);
        self.overturned_for = if motion.upright() < 0.5 { self.overturned_for + dt } else { 0.0 };
        if self.overturned_for > OVERTURNED_TIME {
            self.overturned_for = 0.0;
            return Controls { reset: true, ..Controls::default() };
        }
        let speed = motion.forward_speed();
        if self.backs_out(speed, dt) {
            return Controls { throttle: 0.6, reverse: true, steer: -steer, ..Controls::default() };
        }
        // Slower where the next corner is off to a side.
        let excess = speed - self.speed * (1.0 - 0.6 * (error.abs() / 1.5).min(1.0));
        let throttle = (-excess / FULL_BRAKE).clamp(0.0, 1.0);
        let brake = (excess / FULL_BRAKE).clamp(0.0, 1.0);
        Controls { throttle, brake, steer, ..Controls::default() }
    }

    /// Angle by which the next corner lies to the left of the heading, −π to π.
    fn heading_error(&mut self, motion: &Motion) -> f64 {
        let to = |corner: [f64; 2]| DVec3::new(corner[0], motion.position.y, corner[1]) - motion.position;
        if to(self.route[self.next]).length() < REACHED {
            self.next = (self.next + 1) % self.route.len();
        }
        let way = motion.rotation.inverse() * to(self.route[self.next]);
        f64::atan2(-way.z, way.x)
    }

    fn backs_out(&mut self, speed: f64, dt: f64) -> bool {
        if self.back_for > 0.0 {
            self.back_for -= dt;
            return true;
        }
        self.stuck_for = if speed.abs() < STUCK_SPEED { self.stuck_for + dt } else { 0.0 };
        if self.stuck_for > STUCK_TIME {
            self.stuck_for = 0.0;
            self.back_for = BACK_TIME;
        }
        false
    }
}
