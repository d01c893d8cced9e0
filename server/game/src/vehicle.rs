//! A car: a chassis and four wheels, all of them rigid bodies, held together and driven by potentials.
//!
//! Owns the vehicle's logic in stage 3: from the controls of its driver to steering angles, drive torques, brakes and
//! pushes. The bodies are [`rig`]'s, the smoothing of the controls is [`response`]'s, engine and gears are
//! [`drive_train`]'s, [`brakes`] has the brakes, [`stunts`] what no real car does, [`squash`] what its body looks like
//! meanwhile, [`parameters`] the numbers.
//! The vehicle pushes on the world only through its axles, the clutches between them, and forces for one tick.

pub mod brakes;
pub mod drive_train;
pub mod parameters;
pub mod response;
pub mod rig;
pub mod squash;
pub mod stunts;

use glam::DVec3;
use pita_sim::{AxleControl, BodyId, Motor, Phase, SimError, World};

use crate::actor::{Actor, ActorInfo, Contact, Response, WhenLost};
use crate::combat::{CombatParameters, Fighter, Muzzle};
use crate::driver::{Driver, Motion};
use crate::rehearsal::Memory;
use crate::step::{Message, Step};
use crate::{Controls, Pose};
use brakes::Braking;
use drive_train::DriveTrain;
pub use parameters::VehicleParameters;
use response::Pedals;
use rig::{Rig, WHEELS, Wheel};
use squash::Squash;
use stunts::{Footing, Stage, Stunts};

/// Height of the wheels above the underside of the car that was, after a reset, m: clears the ground where an overturned
/// car is reset on a slope.
const RESET_LIFT: f64 = 0.3;

/// Speed above which a car cannot be reset, m/s.
const RESET_SPEED_MAX: f64 = 3.0;

/// Time between two resets of a car, s.
const RESET_REST: f64 = 2.0;

/// Speed at which a car that is knocked out goes up, m/s.
const KNOCK_OUT_HOP: f64 = 6.0;

/// A car with its driver.
pub struct Vehicle {
    info: ActorInfo,
    parameters: VehicleParameters,
    rig: Rig,
    /// `None` where its body keeps its shape.
    squash: Option<Squash>,
    /// Those of the rig, then that of the squash.
    bodies: Vec<BodyId>,
    driver: Driver,
    controls: Controls,
    response: Pedals,
    drive_train: DriveTrain,
    stunts: Stunts,
    touches: Touches,
    /// `None` where nobody fights.
    fighter: Option<Fighter>,
    reset_was_held: bool,
    /// Time until the reset button works again, s.
    reset_rest: f64,
}

impl Vehicle {
    /// Adds the vehicle to `world` on the ground at `pose`, at rest.
    ///
    /// # Errors
    /// What the engine says where it refuses a body or an axle; nothing stays behind then.
    pub fn add(
        world: &mut World,
        identity: Identity,
        parameters: VehicleParameters,
        driver: Driver,
        pose: Pose,
    ) -> Result<Self, SimError> {
        let rig = Rig::add(world, &parameters, pose)?;
        let squash = Squash::add(world, &parameters, pose.position).inspect_err(|_| rig.remove(world))?;
        let skin = squash.as_ref().map(|squash| squash.part(world, &parameters));
        let Identity { id, name, slot } = identity;
        let parts = rig.parts(world).into_iter().chain(skin).collect();
        let info = ActorInfo { id, kind: "vehicle", name, slot, parts };
        Ok(Self {
            bodies: rig.bodies().iter().copied().chain(squash.as_ref().map(Squash::body)).collect(),
            squash,
            info,
            stunts: Stunts::new(&parameters),
            parameters,
            rig,
            driver,
            controls: Controls::default(),
            response: Pedals::default(),
            drive_train: DriveTrain::default(),
            touches: Touches::default(),
            fighter: None,
            reset_was_held: false,
            reset_rest: 0.0,
        })
    }

    /// The same car, which fights where there are rules for that; it may fire where a round is on.
    pub fn in_combat(self, combat: Option<CombatParameters>, may_fire: bool) -> Self {
        let fighter = combat.map(|combat| Fighter::new(self.info.id, combat, may_fire));
        Self { fighter, ..self }
    }

    /// Lets it be knocked out, come back and fire.
    fn fight(&mut self, step: &mut Step, motion: &Motion) -> Result<(), SimError> {
        let Some(fighter) = &mut self.fighter else { return Ok(()) };
        let front = DVec3::X * self.parameters.chassis_half[0];
        let (chassis, rotation, velocity) = (self.rig.chassis(), motion.rotation, motion.velocity);
        let position = motion.position + rotation * front;
        let muzzle = Muzzle { owner: self.info.id, chassis, front, position, rotation, velocity };
        let was_out = fighter.is_out();
        fighter.act(step, &self.controls, muzzle)?;
        match fighter.is_out() && !was_out {
            true => self.rig.kick(step.world, DVec3::Y * KNOCK_OUT_HOP, step.dt),
            false => Ok(()),
        }
    }

    /// Puts the car back on its wheels where it is, when the button goes down. Not while it still moves fast, nor again
    /// at once: it would be a brake, and a ladder.
    fn reset_if_asked(&mut self, step: &mut Step, motion: &Motion) -> Result<(), SimError> {
        let asked = self.controls.reset && !self.reset_was_held;
        self.reset_was_held = self.controls.reset;
        self.reset_rest = (self.reset_rest - step.dt).max(0.0);
        let speed = motion.velocity.length();
        if !asked || self.reset_rest > 0.0 || speed > RESET_SPEED_MAX {
            return Ok(());
        }
        self.reset_rest = RESET_REST;
        let lift = RESET_LIFT - self.parameters.chassis_half[1];
        let pose = Pose { position: motion.position + DVec3::Y * lift, yaw: motion.yaw() };
        self.place(step.world, pose)
    }

    /// Steers, drives and brakes the wheels.
    fn move_wheels(&mut self, step: &mut Step, speed: f64) -> Result<(), SimError> {
        let (p, world) = (&self.parameters, &mut *step.world);
        let steer = |wheel: Wheel| match wheel.is_front() {
            true => p.wheel_angle(self.response.steer(), wheel.z(p)),
            false => 0.0,
        };
        let rolling = WHEELS.map(|wheel| self.rig.rolling(world, wheel, steer(wheel)));
        let driven = WHEELS.iter().zip(&rolling).filter(|(wheel, _)| p.drive.drives(**wheel));
        let (count, sum) = driven.fold((0.0, 0.0), |(count, sum), (_, rolling)| (count + 1.0, sum + rolling.spin));
        let Controls { reverse, handbrake, .. } = self.controls;
        let output = self.drive_train.drive(p, self.response.throttle(), reverse, [speed, sum / count], step.dt);
        self.rig.set_clutches(world, [true, false].map(|front| output.clutch(p, front, step.dt)))?;
        for (wheel, rolling) in WHEELS.into_iter().zip(&rolling) {
            let (drive, brake) = match Braking::of(p, wheel, self.response.brake(), handbrake, rolling, step.dt) {
                Braking::Released if p.drive.drives(wheel) => (output.motor(p, wheel, rolling), 0.0),
                Braking::Released => (Motor::default(), 0.0),
                Braking::Blocking(torque) => (Motor::default(), torque),
                Braking::AntiLock(motor) => (motor, 0.0),
            };
            self.rig.set_axle(world, wheel, AxleControl { steer: steer(wheel), drive, brake })?;
        }
        Ok(())
    }

    /// The air's share, implicit in the speed.
    fn drag(&self, step: &mut Step, motion: &Motion) -> Result<(), SimError> {
        let slowing = self.parameters.drag * motion.velocity.length();
        let force = -motion.velocity * (slowing / (1.0 + slowing * step.dt / self.parameters.mass()));
        step.world.apply_force(self.rig.chassis(), force, motion.position)
    }

    /// What the car touches in this tick. Of what sleeps nothing is told: it stands.
    fn footing(&mut self, world: &World) -> Footing {
        let Touches { wheels, chassis } = std::mem::take(&mut self.touches);
        match world.is_asleep(self.rig.chassis()) {
            true => Footing { wheels: WHEELS.len(), chassis: false },
            false => Footing { wheels: wheels.into_iter().filter(|touches| *touches).count(), chassis },
        }
    }
}

/// What the collision procedure told since the last step.
#[derive(Clone, Copy, Debug, Default)]
struct Touches {
    wheels: [bool; 4],
    chassis: bool,
}

/// Who a vehicle is.
#[derive(Clone, Debug)]
pub struct Identity {
    /// [`ActorInfo::id`].
    pub id: u32,
    /// [`ActorInfo::name`].
    pub name: String,
    /// [`ActorInfo::slot`].
    pub slot: Option<u16>,
}

impl Actor for Vehicle {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// Not its squash, which stays in the place where it was made.
    fn whereabouts(&self) -> &[BodyId] {
        self.rig.bodies()
    }

    /// Pedals and steering, whether reset was held, time until it works again, gear and shift, stunts.
    fn memory(&self) -> Memory {
        let [throttle, brake, steer] = self.response.to_array();
        let held = f64::from(u8::from(self.reset_was_held));
        let [gear, shift] = self.drive_train.to_array();
        let [boost, jump_held, jump_rest, lies, rights] = self.stunts.to_array();
        let mut memory = Memory::default();
        let known =
            [throttle, brake, steer, held, self.reset_rest, gear, shift, boost, jump_held, jump_rest, lies, rights];
        memory[..known.len()].copy_from_slice(&known);
        memory
    }

    fn recall(&mut self, memory: &Memory) {
        let [throttle, brake, steer, held, rest, gear, shift, stunts @ ..] = *memory;
        self.response = Pedals::from_array([throttle, brake, steer]);
        (self.reset_was_held, self.reset_rest) = (held != 0.0, rest);
        self.drive_train = DriveTrain::from_array([gear, shift]);
        let [boost, jump_held, jump_rest, lies, rights, ..] = stunts;
        self.stunts = Stunts::from_array([boost, jump_held, jump_rest, lies, rights]);
    }

    fn control(&mut self, controls: Controls) {
        self.controls = controls.in_range();
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        if let Some(fighter) = &mut self.fighter {
            fighter.collide(contact);
        }
        let part = self.rig.bodies().iter().position(|&body| contact.own.body == Some(body));
        if contact.phase != Phase::End && !contact.other.is_sensor {
            match part.and_then(|part| part.checked_sub(1)) {
                Some(wheel) => {
                    self.touches.wheels[wheel] = true;
                    return Response::RollOver;
                }
                None => self.touches.chassis = true,
            }
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        let chassis = self.rig.chassis();
        let motion = Motion::of(step.world, chassis).ok_or(SimError::Gone { what: "the chassis" })?;
        if self.fighter.as_ref().is_some_and(Fighter::is_out) {
            self.controls = Controls { handbrake: true, ..Controls::default() };
        } else if let Some(controls) = self.driver.decide(&motion, step) {
            self.controls = controls;
        }
        if let Some(squash) = &mut self.squash {
            squash.follow(step.world, &motion)?;
        }
        self.reset_if_asked(step, &motion)?;
        // As it stands now: nothing else is done by how it lay.
        let motion = Motion::of(step.world, chassis).ok_or(SimError::Gone { what: "the chassis" })?;
        let speed = motion.forward_speed();
        self.response.follow(&self.controls, &self.parameters, speed, step.dt);
        self.move_wheels(step, speed)?;
        self.drag(step, &motion)?;
        let footing = self.footing(step.world);
        let (rig, parameters, controls) = (&self.rig, &self.parameters, &self.controls);
        let (world, dt, motion) = (&mut *step.world, step.dt, &motion);
        self.stunts.act(Stage { world, rig, parameters, controls, motion, footing, dt })?;
        self.fight(step, motion)
    }

    fn hear(&mut self, _from: u32, message: &Message) {
        if let Some(fighter) = &mut self.fighter {
            fighter.hear(message);
        }
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Spawn
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        (self.response, self.drive_train) = (Pedals::default(), DriveTrain::default());
        if let Some(squash) = &mut self.squash {
            squash.reset(world)?;
        }
        self.rig.place(world, pose)
    }
}
