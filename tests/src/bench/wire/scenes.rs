//! The three scenes of the wire's bar, simulated by the engine itself.

use pita_game::{Arena, ArenaSettings, Command, Controls, Ports, Stage, pipeline};
use pita_protocol::dof::Precision;
use pita_sim::{BodyId, Collider, DVec3, Material, RigidBodyDesc, Settings, Shape, StaticDesc, Surface, World};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::super::EntryError;
use super::trace::{Placed, Trace};

/// Glenn Fiedler's "Snapshot Compression": 512 steps a metre, quaternions in smallest-three with 9 bits a component
/// between ±1/√2, which is 362 steps; 60 snapshots a second.
const FIEDLER: Precision = Precision { point: 512, rotation: 362, scalar: 1000, rate: 100 };
/// KinematicSoup's open benchmark: 0.01 m and 0.001 of a quaternion's component.
const ASTEROIDS: Precision = Precision { point: 100, rotation: 1000, scalar: 1000, rate: 100 };
/// What the arena takes: 2 mm, and 0.11 degrees.
const ARENA: Precision = Precision { point: 500, rotation: 1500, scalar: 1000, rate: 100 };

/// A large cube that rolls through 900 small ones and drags along those that it comes close to.
pub fn cubes(ticks: usize) -> Result<Trace, EntryError> {
    const WARM_UP_TICKS: usize = 900;
    let mut world = World::new(Settings::at(1.0 / 60.0))?;
    world.add_static(StaticDesc::new(Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.6)))?;
    let mut bodies = vec![add_box(&mut world, DVec3::splat(0.75), DVec3::new(-18.0, 0.75, 0.0), 10.0, 0.6)?];
    for i in 0..900 {
        let at = DVec3::new(f64::from(i % 30) - 14.5, 0.2, f64::from(i / 30) - 14.5);
        bodies.push(add_box(&mut world, DVec3::splat(0.2), at, 1.0, 0.6)?);
    }
    let mut random = StdRng::seed_from_u64(901);
    let mut target = DVec3::ZERO;
    let mut trace = Trace { tick_hz: 60, precision: FIEDLER, ticks: Vec::new() };
    for tick in 0..WARM_UP_TICKS + ticks {
        let arrived = world.position(bodies[0]).is_none_or(|at| at.distance(target) < 4.0);
        if arrived || tick % 90 == 0 {
            target = DVec3::new(random.random_range(-13.0..13.0), 0.0, random.random_range(-13.0..13.0));
        }
        roll(&mut world, &bodies, target)?;
        world.step();
        if tick >= WARM_UP_TICKS {
            trace.ticks.push(placed(&world, &bodies));
        }
    }
    Ok(trace)
}

/// Pushes the first body towards `target` at 6 m/s, and pulls what is near to it.
fn roll(world: &mut World, bodies: &[BodyId], target: DVec3) -> Result<(), EntryError> {
    let player = bodies[0];
    let (Some(at), Some(velocity)) = (world.position(player), world.velocity(player)) else { return Ok(()) };
    let flat = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
    let missing = flat(target - at).normalize_or_zero() * 6.0 - flat(velocity);
    world.apply_force(player, (missing * 40.0).clamp_length_max(400.0), at + DVec3::Y * 0.6)?;
    for &body in &bodies[1..] {
        let Some(from) = world.position(body) else { continue };
        let pull = (at - from).normalize_or_zero() * 24.0;
        if at.distance(from) < 2.8 {
            world.apply_force(body, pull, from)?;
            world.apply_force(player, -pull, at)?;
        }
    }
    Ok(())
}

/// 250 cubes of 1 to 1.4 m that drift about a planetoid, bounce off it and off each other, and change their speed towards random
/// targets every few seconds; weightless, within a sphere of 25 m.
pub fn asteroids(ticks: usize) -> Result<Trace, EntryError> {
    const WARM_UP_TICKS: usize = 90;
    let mut world = World::new(Settings { gravity: DVec3::ZERO, ..Settings::at(1.0 / 30.0) })?;
    let surface = Surface { friction: 0.5, restitution: 0.6, ..Surface::default() };
    let rock = Material { surface, ..Material::from(0.5) };
    world.add_static(StaticDesc::new(Collider::new(Shape::Ball { radius: 6.0 }, rock)))?;
    let mut random = StdRng::seed_from_u64(250);
    let direction = |random: &mut StdRng| {
        let mut one = || random.random_range(-1.0..1.0);
        DVec3::new(one(), one(), one())
    };
    let mut bodies: Vec<BodyId> = Vec::new();
    while bodies.len() < 250 {
        let at = direction(&mut random) * 25.0;
        let is_free = bodies.iter().all(|&other| world.position(other).is_some_and(|p| p.distance(at) > 2.0));
        if is_free && (8.0..24.0).contains(&at.length()) {
            let half = DVec3::splat(random.random_range(0.5..0.7));
            let body = add_box(&mut world, half, at, 8.0 * half.element_product(), rock)?;
            world.set_velocity(body, direction(&mut random) * 3.0, direction(&mut random))?;
            bodies.push(body);
        }
    }
    let mut targets = vec![(0.0, 0); bodies.len()];
    let mut trace = Trace { tick_hz: 30, precision: ASTEROIDS, ticks: Vec::new() };
    for tick in 0..WARM_UP_TICKS + ticks {
        for (&body, (speed, until)) in bodies.iter().zip(&mut targets) {
            if tick >= *until {
                (*speed, *until) = (random.random_range(1.0..4.0), tick + random.random_range(60..180));
            }
            drift(&mut world, body, *speed)?;
        }
        world.step();
        if tick >= WARM_UP_TICKS {
            trace.ticks.push(placed(&world, &bodies));
        }
    }
    Ok(trace)
}

/// Accelerates a body to `speed` along its way, at most 0.5 m/s², and back into the sphere.
fn drift(world: &mut World, body: BodyId, speed: f64) -> Result<(), EntryError> {
    let (Some(at), Some(velocity), Some(mass)) = (world.position(body), world.velocity(body), world.mass(body)) else {
        return Ok(());
    };
    let missing = (speed - velocity.length()).clamp(-0.5, 0.5);
    let outside = (at.length() - 25.0).max(0.0);
    let ahead = velocity.try_normalize().unwrap_or(DVec3::X) * missing;
    world.apply_force(body, (ahead - at.normalize_or_zero() * outside * 6.0) * mass, at)?;
    Ok(())
}

/// The daemon's arena with 64 players, who drive and steer at random.
pub fn arena(ticks: usize) -> Result<Trace, EntryError> {
    const WARM_UP_TICKS: usize = 150;
    const CARS: u16 = 64;
    let mut arena = Arena::from_toml(Arena::DEFAULT, &ArenaSettings { tick_hz: 30, threads: 1 })?;
    let enter = |slot| Command::Enter { slot, name: format!("car {slot}") };
    let mut players = Players {
        commands: (0..CARS).map(enter).collect(),
        random: StdRng::seed_from_u64(64),
        until: vec![0; CARS.into()],
    };
    let mut trace = Trace { tick_hz: 30, precision: ARENA, ticks: Vec::new() };
    for tick in 0..WARM_UP_TICKS + ticks {
        pipeline::tick(&mut arena, &mut players);
        if tick >= WARM_UP_TICKS {
            let mut bodies: Vec<_> = arena.world().slices().filter_map(|slice| Placed::of(&slice)).collect();
            bodies.sort_by_key(|body| body.id);
            for actor in arena.actors() {
                let place = |slice| bodies.binary_search_by_key(&slice, |body| body.id).ok();
                let root = actor.parts.first().and_then(|part| place(part.slice));
                let others = actor.parts.iter().skip(1);
                let others: Vec<_> = others.filter_map(|part| Some((place(part.slice)?, part.is_hinged))).collect();
                for (at, is_hinged) in others {
                    (bodies[at].parent, bodies[at].is_hinged) = (root, is_hinged);
                }
            }
            trace.ticks.push(bodies);
        }
    }
    Ok(trace)
}

/// Drives every car with controls that last one to three seconds.
struct Players {
    commands: Vec<Command>,
    random: StdRng,
    until: Vec<u64>,
}

impl Ports for Players {
    fn begin(&mut self, _: Stage) {}

    fn collect(&mut self, tick: u64, into: &mut Vec<Command>) {
        into.append(&mut self.commands);
        for (slot, until) in (0..).zip(&mut self.until) {
            if tick >= *until {
                *until = tick + self.random.random_range(30..90);
                let (throttle, steer) = (self.random.random_range(0.3..0.9), self.random.random_range(-0.6..0.6));
                into.push(Command::Drive { slot, controls: Controls { throttle, steer, ..Controls::default() } });
            }
        }
    }

    fn output(&mut self, _: &Arena) {}

    fn end(&mut self) {}
}

fn add_box(
    world: &mut World,
    half: DVec3,
    at: DVec3,
    mass: f64,
    material: impl Into<Material>,
) -> Result<BodyId, EntryError> {
    let shape = Shape::Box { half };
    let inertia = shape.inertia(mass);
    let collider = Some(Collider::new(shape, material));
    Ok(world.add_rigid_body(RigidBodyDesc { collider, ..RigidBodyDesc::new(at, mass, inertia) })?)
}

fn placed(world: &World, bodies: &[BodyId]) -> Vec<Placed> {
    bodies.iter().filter_map(|&body| Placed::of(&world.slice(body)?)).collect()
}
