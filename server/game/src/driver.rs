//! Who drives a vehicle: a player through the network, or the arena itself.
//!
//! A driver sees the motion of its car and the other actors, and answers controls, the same that a player sends. It thinks
//! about whom to hunt or flee sporadically, steers each tick, and gets itself out of where it is stuck.

pub mod recovery;

use std::f64::consts::FRAC_PI_2;

use glam::{DQuat, DVec3};
use pita_sim::{BodyId, World};
use serde::Deserialize;

use crate::Controls;
use crate::step::{Other, Step};
use recovery::Recovery;

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

    /// Angle by which `point` lies to the left of the heading, −π to π.
    pub fn bearing(&self, point: DVec3) -> f64 {
        let way = self.rotation.inverse() * (point.with_y(self.position.y) - self.position);
        f64::atan2(-way.z, way.x)
    }
}

/// Who drives.
#[derive(Clone, Debug)]
pub enum Driver {
    /// Somebody outside: controls come as commands.
    Player,
    /// The arena.
    Own(AiDriver),
}

impl Driver {
    /// This tick's controls; `None` where they come from outside.
    pub fn decide(&mut self, motion: &Motion, step: &mut Step) -> Option<Controls> {
        match self {
            Self::Player => None,
            Self::Own(driver) => Some(driver.decide(motion, step)),
        }
    }
}

/// What a driver is after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Behaviour {
    /// Follows its route.
    #[default]
    Route,
    /// Drives at the nearest vehicle, and fires at it; follows its route where there is none.
    Hunt,
    /// Drives away from a vehicle that comes near; follows its route else.
    Flee,
}

/// Distance at which a corner counts as reached, m: about the turning radius, so that none is circled for ever.
const REACHED: f64 = 8.0;
/// Heading error at which the steering is at its stop, rad.
const FULL_STEER: f64 = 0.25;
/// Sideways acceleration that it allows itself, m/s².
const CORNERING: f64 = 5.0;
/// No turn is driven slower, m/s.
const TURNING_SPEED: f64 = 4.0;
/// Excess of speed at which it brakes fully, m/s.
const FULL_BRAKE: f64 = 4.0;
/// Ticks between two looks around: half a second at 30 Hz is how fast people notice.
const LOOK_PERIOD: u32 = 15;
/// Ticks between two changes of the weapon.
const WEAPON_PERIOD: u32 = 150;
/// A hunter sees so far, m.
const SIGHT: f64 = 80.0;
/// One who flees minds what is nearer, m.
const FEAR: f64 = 25.0;
/// A hunter aims at where its victim will be after so long at most, s.
const LEAD: f64 = 1.0;
/// It fires at what is nearer, m, where a straight shot misses by less than half a car's length, m.
const RANGE: f64 = 40.0;
const MISS: f64 = 1.9;
/// So near it has struck, m, and takes a new run for so long, s.
const STRUCK: f64 = 5.0;
const RETREAT_TIME: f64 = 2.5;
/// It boosts towards what is ahead, rad, and farther, m.
const AIM: f64 = 0.12;
const BOOST_FROM: f64 = 30.0;

/// The arena's own driver.
#[derive(Clone, Debug)]
pub struct AiDriver {
    behaviour: Behaviour,
    /// Corners in x and z, m.
    route: Vec<[f64; 2]>,
    next: usize,
    /// Wanted speed, m/s.
    speed: f64,
    /// Whom it hunts or flees.
    other: Option<u32>,
    /// A hunter who has struck takes a new run, s.
    retreat_for: f64,
    recovery: Recovery,
}

impl AiDriver {
    /// A driver who drives at `speed` m/s to corner `next` of the closed `route` first, then round and round, where
    /// nothing else is to be done.
    ///
    /// # Panics
    /// Where `route` is empty; arena files with such a route are refused.
    pub fn new(behaviour: Behaviour, route: Vec<[f64; 2]>, next: usize, speed: f64) -> Self {
        assert!(!route.is_empty(), "a route has corners");
        let next = next % route.len();
        Self { behaviour, route, next, speed, other: None, retreat_for: 0.0, recovery: Recovery::default() }
    }

    fn decide(&mut self, motion: &Motion, step: &mut Step) -> Controls {
        if step.is_due(LOOK_PERIOD) {
            self.look_around(motion, step);
        }
        let other = self.other.and_then(|id| step.other(id));
        let wanted = match (self.behaviour, other) {
            (Behaviour::Hunt, Some(victim)) => self.hunt(motion, victim, step),
            (Behaviour::Flee, Some(hunter)) => self.flee(motion, hunter),
            _ => self.follow_route(motion),
        };
        self.recovery.watch(motion, wanted, step.dt).unwrap_or_else(|| {
            step.respawn();
            Controls::default()
        })
    }

    /// The talk's sporadic processing: whom to mind.
    fn look_around(&mut self, motion: &Motion, step: &Step) {
        let within = match self.behaviour {
            Behaviour::Route => return,
            Behaviour::Hunt => SIGHT,
            Behaviour::Flee => FEAR,
        };
        let is_vehicle = |other: &Other| other.kind == "vehicle";
        self.other = step.nearest(motion.position, within, is_vehicle).map(|other| other.id);
    }

    fn hunt(&mut self, motion: &Motion, victim: &Other, step: &mut Step) -> Controls {
        let way = victim.position - motion.position;
        self.retreat_for = if way.length() < STRUCK { RETREAT_TIME } else { self.retreat_for - step.dt };
        if self.retreat_for > 0.0 {
            return self.follow_route(motion);
        }
        let time = (way.length() / motion.velocity.length().max(1.0)).min(LEAD);
        let wanted = self.drive_to(motion, victim.position + victim.velocity * time, 2.0 * self.speed);
        let error = motion.bearing(victim.position).abs();
        Controls {
            fire: error < FRAC_PI_2 && way.length() * error.sin() < MISS && way.length() < RANGE,
            boost: error < AIM && way.length() > BOOST_FROM,
            next_weapon: step.is_due(WEAPON_PERIOD),
            ..wanted
        }
    }

    fn flee(&mut self, motion: &Motion, hunter: &Other) -> Controls {
        let away = (motion.position - hunter.position).with_y(0.0).normalize_or(motion.rotation * DVec3::X);
        // Away, and rather to where the route goes than into a wall.
        let home = (self.corner() - motion.position).with_y(0.0).normalize_or_zero();
        let aim = motion.position + (away + 0.7 * home) * SIGHT;
        Controls { boost: motion.bearing(aim).abs() < AIM, ..self.drive_to(motion, aim, 1.5 * self.speed) }
    }

    fn follow_route(&mut self, motion: &Motion) -> Controls {
        let corner = self.corner();
        if corner.distance(motion.position.with_y(0.0)) < REACHED {
            self.next = (self.next + 1) % self.route.len();
        }
        self.drive_to(motion, self.corner(), self.speed)
    }

    fn corner(&self) -> DVec3 {
        let [x, z] = self.route[self.next];
        DVec3::new(x, 0.0, z)
    }

    /// Towards `aim`, at `speed` m/s; slower where the way there is a narrow arc.
    fn drive_to(&self, motion: &Motion, aim: DVec3, speed: f64) -> Controls {
        let error = motion.bearing(aim);
        // An arc to the aim has the radius distance / 2 sin(error); where that is behind, it turns on the spot.
        let sine = if error.abs() < FRAC_PI_2 { error.sin().abs().max(0.01) } else { 1.0 };
        let radius = aim.with_y(motion.position.y).distance(motion.position) / (2.0 * sine);
        let excess = motion.forward_speed() - speed.min((CORNERING * radius).sqrt().max(TURNING_SPEED));
        Controls {
            throttle: (-excess / FULL_BRAKE).clamp(0.0, 1.0),
            brake: (excess / FULL_BRAKE).clamp(0.0, 1.0),
            steer: (-error / FULL_STEER).clamp(-1.0, 1.0),
            ..Controls::default()
        }
    }
}
