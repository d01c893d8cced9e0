//! An arena with scripted ports, and what one wants to know of the cars in it.

use pita_game::driver::Motion;
use pita_game::{Arena, ArenaEvent, ArenaSettings, Command, Controls, Ports, Stage, pipeline};
use pita_sim::{DQuat, DVec3, SliceView};

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

    /// Motion of part `part` of the vehicle in `slot`; part 0 is the chassis.
    pub fn part(&self, slot: u16, part: usize) -> Motion {
        let info = self.arena.actor_of(slot).expect("somebody has the slot");
        let serial = info.parts[part].slice;
        let slice = self.arena.world().slices().find(|s| s.serial == serial).expect("a living body");
        motion(&slice)
    }

    /// Motion of the vehicle in `slot`.
    pub fn car(&self, slot: u16) -> Motion {
        self.part(slot, 0)
    }

    /// Radius of the chassis's path, m, and yaw rate, rad/s, over two seconds with `controls` in slot 0.
    pub fn turn(&mut self, controls: Controls) -> (f64, f64) {
        let ticks = (2.0 / self.dt).round();
        let (mut turned, mut way) = (0.0, 0.0);
        for _ in 0..ticks as usize {
            let before = self.car(0);
            self.drive(0, controls);
            self.tick();
            let after = self.car(0);
            let change = after.yaw() - before.yaw();
            turned += f64::atan2(change.sin(), change.cos());
            way += after.position.with_y(0.0).distance(before.position.with_y(0.0));
        }
        (way / turned.abs(), turned / (ticks * self.dt))
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

/// Full throttle.
pub const FULL_THROTTLE: Controls =
    Controls { throttle: 1.0, brake: 0.0, steer: 0.0, reverse: false, handbrake: false, reset: false };

/// Full brake.
pub const FULL_BRAKE: Controls =
    Controls { throttle: 0.0, brake: 1.0, steer: 0.0, reverse: false, handbrake: false, reset: false };
