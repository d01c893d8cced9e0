//! An arena with scripted ports, and what one wants to know of the cars in it.

use pita_game::driver::Motion;
use pita_game::{ActorInfo, Arena, ArenaEvent, ArenaSettings, Command, Controls, Ports, Stage, pipeline};
use pita_sim::{BodyId, DQuat, DVec3, DofKind, SimError, SliceView, World};

/// Nothing but ground.
pub const FLAT: &str = include_str!("../../../../configs/arenas/flat.toml");

/// What most tests run at.
pub const SETTINGS: ArenaSettings = ArenaSettings { tick_hz: 30, threads: 1 };

/// Commands in, marks of the stages and events out.
#[derive(Default)]
pub struct Recorder {
    pub pending: Vec<Command>,
    pub stages: Vec<Stage>,
    pub outputs: Vec<u64>,
    pub events: Vec<ArenaEvent>,
    pub ends: usize,
}

impl Ports for Recorder {
    fn begin(&mut self, stage: Stage) {
        self.stages.push(stage);
    }

    fn collect(&mut self, _tick: u64, into: &mut Vec<Command>) {
        into.append(&mut self.pending);
    }

    fn output(&mut self, arena: &Arena) {
        self.outputs.push(arena.tick());
        self.events.extend_from_slice(arena.events());
    }

    fn end(&mut self) {
        self.ends += 1;
    }
}

/// An arena under test.
pub struct TestTrack {
    pub arena: Arena,
    pub ports: Recorder,
    /// Length of a tick, s.
    dt: f64,
}

impl TestTrack {
    pub fn new(text: &str, settings: ArenaSettings) -> Self {
        let arena = Arena::from_toml(text, &settings).unwrap_or_else(|e| panic!("{e}"));
        Self { arena, ports: Recorder::default(), dt: 1.0 / f64::from(settings.tick_hz) }
    }

    /// Flat ground with one car in slot 0 that has come to rest.
    pub fn with_parked_car() -> Self {
        Self::with_parked_car_at(SETTINGS.tick_hz)
    }

    /// The same at another tick rate.
    pub fn with_parked_car_at(tick_hz: u16) -> Self {
        let mut track = Self::new(FLAT, ArenaSettings { tick_hz, ..SETTINGS });
        track.enter(0);
        track.run(2.0, Controls::default());
        track
    }

    pub fn enter(&mut self, slot: u16) {
        self.ports.pending.push(Command::Enter { slot, name: format!("driver {slot}") });
    }

    pub fn leave(&mut self, slot: u16) {
        self.ports.pending.push(Command::Leave { slot, reason: "left".to_owned() });
    }

    pub fn drive(&mut self, slot: u16, controls: Controls) {
        self.ports.pending.push(Command::Drive { slot, controls });
    }

    pub fn tick(&mut self) {
        pipeline::tick(&mut self.arena, &mut self.ports);
    }

    /// Holds `controls` in slot 0 for `seconds`.
    pub fn run(&mut self, seconds: f64, controls: Controls) {
        for _ in 0..(seconds / self.dt).round() as usize {
            self.drive(0, controls);
            self.tick();
        }
    }

    /// Ticks with `controls` in slot 0 until `reached`, at most `seconds`; answers how long it took, s.
    pub fn run_until(&mut self, seconds: f64, controls: Controls, reached: impl Fn(&Self) -> bool) -> f64 {
        for tick in 0..(seconds / self.dt).round() as usize {
            if reached(self) {
                return tick as f64 * self.dt;
            }
            self.drive(0, controls);
            self.tick();
        }
        panic!("not reached within {seconds} s: {:?}", self.car(0));
    }

    fn info(&self, id: u32) -> &ActorInfo {
        self.arena.actor(id).expect("it is there").describe()
    }

    /// Motion of part `part` of actor `id`; part 0 of a vehicle is the chassis.
    pub fn part_of(&self, id: u32, part: usize) -> Motion {
        let serial = self.info(id).parts[part].slice;
        let slice = self.arena.world().slices().find(|s| s.serial == serial).expect("a living body");
        motion(&slice)
    }

    /// The same of the vehicle in `slot`.
    pub fn part(&self, slot: u16, part: usize) -> Motion {
        self.part_of(self.id(slot), part)
    }

    /// Motion of the vehicle in `slot`.
    pub fn car(&self, slot: u16) -> Motion {
        self.part(slot, 0)
    }

    /// Holds what `driver` says in slot 0 for `seconds`.
    pub fn run_with(&mut self, seconds: f64, driver: impl Fn(&Self) -> Controls) {
        for _ in 0..(seconds / self.dt).round() as usize {
            let controls = driver(self);
            self.drive(0, controls);
            self.tick();
        }
    }

    /// Radius of the chassis's path, m, and yaw rate, rad/s, over two seconds with `controls` in slot 0.
    pub fn turn(&mut self, controls: Controls) -> (f64, f64) {
        self.turn_with(2.0, |_| controls)
    }

    /// The same over `seconds` with what `driver` says.
    pub fn turn_with(&mut self, seconds: f64, driver: impl Fn(&Self) -> Controls) -> (f64, f64) {
        let ticks = (seconds / self.dt).round();
        let (mut turned, mut way) = (0.0, 0.0);
        for _ in 0..ticks as usize {
            let before = self.car(0);
            let controls = driver(self);
            self.drive(0, controls);
            self.tick();
            let after = self.car(0);
            let change = after.yaw() - before.yaw();
            turned += f64::atan2(change.sin(), change.cos());
            way += after.position.with_y(0.0).distance(before.position.with_y(0.0));
        }
        (way / turned.abs(), turned / (ticks * self.dt))
    }

    /// Changes bodies of actor `id`, chassis first, from outside the game; a squash it leaves alone.
    fn meddle(&mut self, id: u32, meddle: impl Fn(&mut World, &[BodyId])) {
        let slices: Vec<u32> = self.info(id).parts.iter().map(|p| p.slice).collect();
        let world = self.arena.world();
        let body = |slice: &u32| world.bodies().iter().copied().find(|&body| world.serial(body) == Some(*slice));
        let is_rigid = |body: &BodyId| world.slice(*body).is_some_and(|slice| slice.kind == DofKind::RigidBody);
        let bodies: Vec<BodyId> = slices.iter().filter_map(body).filter(is_rigid).collect();
        // Nothing is added: only this way leads to the world from here.
        let nothing = self.arena.add_actor(|world, _| {
            meddle(world, &bodies);
            Err(SimError::Unusable { what: "nothing to add" })
        });
        assert!(nothing.is_err());
    }

    fn id(&self, slot: u16) -> u32 {
        self.arena.actor_of(slot).expect("somebody has the slot").id
    }

    /// Puts the whole car to where its chassis is at `position`, turned by `turn`, with the velocity `velocity`.
    pub fn place(&mut self, slot: u16, position: DVec3, turn: DQuat, velocity: DVec3) {
        self.place_actor(self.id(slot), position, turn, velocity);
    }

    /// The same for actor `id`.
    pub fn place_actor(&mut self, id: u32, position: DVec3, turn: DQuat, velocity: DVec3) {
        self.meddle(id, |world, bodies| {
            let (from, back) = (world.position(bodies[0]).unwrap(), world.rotation(bodies[0]).unwrap().inverse());
            for &body in bodies {
                let arm = turn * back * (world.position(body).unwrap() - from);
                let rotation = turn * back * world.rotation(body).unwrap();
                world.set_pose(body, position + arm, rotation).unwrap();
                world.set_velocity(body, velocity, DVec3::ZERO).unwrap();
            }
        });
    }

    /// Gives the car a velocity, wheels that roll included, where it is.
    pub fn push(&mut self, slot: u16, velocity: DVec3) {
        self.meddle(self.id(slot), |world, bodies| {
            for (part, &body) in bodies.iter().enumerate() {
                let spin = if part == 0 { 0.0 } else { velocity.length() / 0.35 };
                let axis = world.rotation(bodies[0]).unwrap() * DVec3::NEG_Z;
                world.set_velocity(body, velocity, axis * spin).unwrap();
            }
        });
    }

    /// Turns the whole car about its chassis, rad/s.
    pub fn spin(&mut self, slot: u16, spin: DVec3) {
        self.meddle(self.id(slot), |world, bodies| {
            let centre = world.position(bodies[0]).unwrap();
            for &body in bodies {
                let velocity = world.velocity(body).unwrap() + spin.cross(world.position(body).unwrap() - centre);
                world.set_velocity(body, velocity, spin).unwrap();
            }
        });
    }

    /// Bodies that the engine took out of the world in the last tick.
    pub fn quarantined(&self) -> usize {
        let world = self.arena.world();
        world.bodies().iter().filter(|&&body| world.is_quarantined(body)).count()
    }

    /// Speed over ground of the car in slot 0, m/s.
    pub fn speed(&self) -> f64 {
        self.car(0).velocity.with_y(0.0).length()
    }
}

fn motion(slice: &SliceView) -> Motion {
    let vector = |x: &[f64]| DVec3::new(x[0], x[1], x[2]);
    let rotation = DQuat::from_xyzw(slice.q[3], slice.q[4], slice.q[5], slice.q[6]);
    Motion { position: vector(slice.q), rotation, velocity: vector(slice.v) }
}

/// Nothing.
pub const COAST: Controls = Controls {
    throttle: 0.0,
    brake: 0.0,
    steer: 0.0,
    reverse: false,
    handbrake: false,
    reset: false,
    boost: false,
    jump: false,
    fire: false,
    next_weapon: false,
};

/// Full throttle.
pub const FULL_THROTTLE: Controls = Controls { throttle: 1.0, ..COAST };

/// Full brake.
pub const FULL_BRAKE: Controls = Controls { brake: 1.0, ..COAST };
