//! A sheep, the talk's worked example, alive: it grazes with its flock, flees cars and tornadoes, is thrown about, and gets
//! up again.
//!
//! Owns what a sheep does in a tick. What it wants is `mind`'s, which way its flock and its fears want it is `flock`'s,
//! its DOF are `rig`'s. It only ever pushes on its DOF through `muscles`, which are PD controllers on points.

pub mod anatomy;
pub mod flock;
mod mind;
mod muscles;
pub mod parameters;
pub mod rig;

use glam::DVec3;
use pita_sim::{BodyId, Phase, SimError, World};

use crate::Pose;
use crate::actor::{Actor, ActorInfo, Contact, Response, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key};
use crate::kinds::{ActorKind, Site};
use crate::step::{Other, Step};
use crate::tornado::Tornado;
use anatomy::{BODY, STANDING};
use flock::{Mate, Threat};
use mind::{Mind, Mood, View};
use muscles::{Muscles, Posture};
pub use parameters::SheepParameters;
use rig::Rig;

/// It thinks every so many ticks.
const THINK_PERIOD: u32 = 10;
/// What kind of actor a car is.
const CAR: &str = "vehicle";
/// Slower than this a car frightens nobody, m/s.
const HARMLESS_SPEED: f64 = 1.5;
/// So long without ground under it, and it goes limp, s.
const AIRBORNE_TIME: f64 = 0.2;
/// A blow that knocks it over, N s; its own landing from a metre is 225.
const KNOCK: f64 = 300.0;
/// It lies still for so long before it gets up, s.
const STUNNED_TIME: f64 = 0.8;
/// Faster than this it is still being thrown about, m/s.
const THROWN_SPEED: f64 = 2.0;
/// Cosine of the tilt above which it is up.
const UPRIGHT: f64 = 0.9;
/// Its body rises to its height within this time, s,
const RISE_TIME: f64 = 0.2;
/// and no faster than this, m/s.
const RISE_SPEED: f64 = 0.8;
/// It rolls over in pieces of this, rad: who lies on the back is not pulled straight up, which turns nothing.
const ROLL_OVER: f64 = 1.0;
/// Acceleration of its walk, m/s².
const ACCELERATION: f64 = 6.0;
/// Rate at which it turns, rad/s.
const TURN_RATE: f64 = 3.0;
/// Most that its legs swing, rad, at [`FULL_STRIDE_SPEED`], m/s, and above.
const STRIDE: f64 = 0.4;
const FULL_STRIDE_SPEED: f64 = 2.0;
/// Way of a full swing of its legs, m.
const STRIDE_LENGTH: f64 = 1.2;
/// How far the head is raised, rad.
const HEAD_GRAZING: f64 = -0.9;
const HEAD_UP: f64 = 0.3;
/// After so long of standing still it holds where it is, s, and falls asleep like any other thing.
const SETTLED_TIME: f64 = 1.0;

/// A sheep.
pub struct Sheep {
    info: ActorInfo,
    parameters: SheepParameters,
    home: Pose,
    rig: Rig,
    muscles: Muscles,
    mind: Mind,
    yaw: f64,
    /// Where it is in the swing of its legs, rad.
    gait: f64,
    /// Since it had ground under it, s.
    airborne: f64,
    /// For how long it has been lying still, s.
    stunned: f64,
    /// For how long it has been standing still, s.
    settled: f64,
    /// Height of what it stands on, m.
    ground: f64,
    /// What the collision procedure saw since the last step.
    has_ground: bool,
    blow: f64,
}

/// How its body moves.
struct Motion {
    position: DVec3,
    velocity: DVec3,
    forward: DVec3,
    /// 1 upright, −1 on its back.
    upright: f64,
    /// How far it is turned over about its own length, rad.
    roll: f64,
}

impl ActorKind for Sheep {
    const KIND: &'static str = "sheep";
    type Parameters = SheepParameters;

    fn check(parameters: &SheepParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        parameters.check(key, file)
    }

    fn add(site: &mut Site, parameters: &SheepParameters) -> Result<Self, SimError> {
        let material = site.material(&parameters.material);
        let rig = Rig::add(site.world, parameters.form, material, site.pose)?;
        // Seeds one apart make sheep that have nothing in common.
        let mind = Mind::new(parameters.seed.wrapping_mul(1 << 32).wrapping_add(site.id.into()));
        Ok(Self {
            info: site.info(Self::KIND, rig.parts(site.world)),
            parameters: parameters.clone(),
            home: site.pose,
            muscles: Muscles::default(),
            yaw: site.pose.yaw,
            gait: 0.0,
            airborne: 0.0,
            stunned: STUNNED_TIME,
            settled: 0.0,
            ground: site.pose.position.y,
            has_ground: false,
            blow: 0.0,
            rig,
            mind,
        })
    }
}

impl Sheep {
    fn motion(&self, world: &World) -> Result<Motion, SimError> {
        let frame = self.rig.frame(world, BODY)?;
        let axis = |local| DVec3::from(frame.arm(local));
        let (forward, upright) = (axis(DVec3::X), axis(DVec3::Y).y);
        let roll = f64::atan2(-axis(DVec3::Z).y, upright);
        Ok(Motion { position: frame.position.into(), velocity: frame.linear.into(), forward, upright, roll })
    }

    /// Looks around and makes up its mind.
    fn think(&mut self, step: &Step, motion: &Motion) {
        let (me, radius) = (motion.position, self.parameters.fear_radius);
        let mates = step.others().filter(|other| other.kind == Self::KIND);
        let mates = mates.map(|&Other { position, velocity, .. }| Mate { position, velocity });
        let view = View {
            homeward: (self.home.position - me).with_y(0.0),
            flock: flock::with_flock(me, mates),
            away: flock::away_from(me, step.others().filter_map(|other| threat(other, radius))),
        };
        self.mind.think(&self.parameters, &view, step.dt * f64::from(THINK_PERIOD));
    }

    /// Whether it is limp: in the air, or knocked over and not over it yet.
    fn is_limp(&mut self, motion: &Motion, dt: f64) -> bool {
        self.airborne = if self.has_ground { 0.0 } else { self.airborne + dt };
        let is_thrown = motion.velocity.length() > THROWN_SPEED + self.mind.wish().length();
        if self.airborne > AIRBORNE_TIME || self.blow > KNOCK {
            self.stunned = 0.0;
        } else if self.stunned < STUNNED_TIME && !is_thrown {
            self.stunned += dt;
        }
        (self.has_ground, self.blow) = (false, 0.0);
        self.stunned < STUNNED_TIME
    }

    /// Stands, walks or gets up.
    fn carry_itself(&mut self, step: &mut Step, motion: &Motion) -> Result<(), SimError> {
        let is_up = motion.upright > UPRIGHT;
        let wish = if is_up { self.mind.wish() } else { DVec3::ZERO };
        self.turn(motion, wish, is_up, step.dt);
        let flat = motion.velocity.with_y(0.0);
        let flat = flat + (wish - flat).clamp_length_max(ACCELERATION * step.dt);
        let missing = self.ground + STANDING - motion.position.y;
        let velocity = flat.with_y((missing / RISE_TIME).clamp(-RISE_SPEED, RISE_SPEED));
        self.gait += step.dt * flat.length() * std::f64::consts::TAU / STRIDE_LENGTH;
        self.gait = self.gait.rem_euclid(std::f64::consts::TAU);
        let swing = STRIDE * (flat.length() / FULL_STRIDE_SPEED).min(1.0);
        let is_grazing = is_up && self.mind.mood() == Mood::Grazing;
        let posture = Posture {
            centre: motion.position + velocity * step.dt,
            velocity,
            yaw: self.yaw,
            roll: motion.roll - motion.roll.clamp(-ROLL_OVER, ROLL_OVER),
            stride: swing * self.gait.sin(),
            head: if is_grazing { HEAD_GRAZING } else { HEAD_UP },
        };
        self.muscles.hold(step.world, &self.rig, &posture)
    }

    /// Turns its heading to where it goes; while it gets up, to where it lies.
    fn turn(&mut self, motion: &Motion, wish: DVec3, is_up: bool, dt: f64) {
        let yaw_of = |way: DVec3| f64::atan2(-way.z, way.x);
        if !is_up && motion.forward.with_y(0.0).length() > 0.3 {
            self.yaw = yaw_of(motion.forward);
        } else if wish != DVec3::ZERO {
            let error = yaw_of(wish) - self.yaw;
            let error = f64::atan2(error.sin(), error.cos());
            self.yaw += error.clamp(-TURN_RATE * dt, TURN_RATE * dt);
        }
    }

    /// Whether it has stood still for so long that its muscles need not be told anything new.
    fn is_settled(&mut self, motion: &Motion, dt: f64) -> bool {
        let is_still = self.muscles.are_tense() && motion.upright > UPRIGHT && motion.velocity.length() < 0.1;
        let wants_to_stay = self.mind.wish() == DVec3::ZERO;
        self.settled = if is_still && wants_to_stay { self.settled + dt } else { 0.0 };
        self.settled > SETTLED_TIME
    }
}

/// What a sheep fears.
fn threat(other: &Other, radius: f64) -> Option<Threat> {
    let &Other { position, velocity, kind, .. } = other;
    let is_car = kind == CAR && velocity.length() > HARMLESS_SPEED;
    (is_car || kind == Tornado::KIND).then_some(Threat { position, velocity, radius })
}

impl Actor for Sheep {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.rig.bodies()
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        if contact.phase != Phase::End && !contact.other.is_sensor {
            // The normal points to the other: what bears it is below.
            if contact.normal.y < -0.5 {
                self.ground = if self.has_ground { self.ground.min(contact.point.y) } else { contact.point.y };
                self.has_ground = true;
            }
            self.blow = self.blow.max(contact.impulse);
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        let motion = self.motion(step.world)?;
        if step.is_due(THINK_PERIOD) {
            self.think(step, &motion);
        }
        let sleeps = self.rig.bodies().iter().all(|&body| step.world.is_asleep(body));
        if sleeps && motion.upright > UPRIGHT && self.mind.wish() == DVec3::ZERO {
            return Ok(());
        }
        self.has_ground |= sleeps;
        if self.is_limp(&motion, step.dt) {
            self.muscles.relax(step.world);
            return Ok(());
        }
        if self.is_settled(&motion, step.dt) { Ok(()) } else { self.carry_itself(step, &motion) }
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.muscles.relax(world);
        (self.yaw, self.airborne, self.stunned, self.settled) = (pose.yaw, 0.0, STUNNED_TIME, 0.0);
        self.rig.place(world, pose)
    }
}
