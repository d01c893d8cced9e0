//! A rehearsal drives as the arena does.

use glam::DVec3;
use pita_game::pipeline::tick;
use pita_game::{Arena, ArenaSettings, BodyState, CarState, Command, Controls, Ports, Rehearsal, Stage};

const SETTINGS: ArenaSettings = ArenaSettings { tick_hz: 30, threads: 1 };

/// One player who drives.
struct Driven(Controls, bool);

impl Ports for Driven {
    fn begin(&mut self, _stage: Stage) {}
    fn collect(&mut self, _tick: u64, into: &mut Vec<Command>) {
        if !std::mem::replace(&mut self.1, true) {
            into.push(Command::Enter { slot: 0, name: "Wu".into() });
        }
        into.push(Command::Drive { slot: 0, controls: self.0 });
    }
    fn output(&mut self, _arena: &Arena) {}
    fn end(&mut self) {}
}

fn controls(tick: u64) -> Controls {
    let steer = if tick % 60 < 30 { 0.4 } else { -0.2 };
    let (boost, jump) = ((40..55).contains(&tick), (100..103).contains(&tick));
    Controls { throttle: 0.5, steer, boost, jump, ..Controls::default() }
}

fn car(arena: &Arena) -> Vec<BodyState> {
    let world = arena.world();
    // Those that move; the body that squashes comes last.
    let slices: Vec<u32> = arena.actor_of(0).unwrap().parts.iter().take(5).map(|part| part.slice).collect();
    let bodies = slices.iter().map(|slice| *world.bodies().iter().find(|&&b| world.serial(b) == Some(*slice)).unwrap());
    let state = |body| BodyState {
        position: world.position(body).unwrap(),
        rotation: world.rotation(body).unwrap(),
        velocity: world.velocity(body).unwrap(),
        angular_velocity: world.angular_velocity(body).unwrap(),
    };
    bodies.map(state).collect()
}

/// From the arena's state in single precision, as it comes over the wire, five ticks ahead: within millimetres.
#[test]
fn five_ticks_from_any_state_on_it_is_where_the_arena_is() {
    drives_as(Arena::DEFAULT);
}

/// The same where cars fight, have bodies that squash, and drive among meshes.
#[test]
fn combat_squash_and_meshes_do_not_mislead_it() {
    let flat = include_str!("../../../../configs/arenas/flat.toml");
    let rock = "[[statics]]\nmesh = \"rock.obj\"\nmaterial = \"asphalt\"\nposition = [-5.0, 0.0, -30.0]\n";
    drives_as(&format!("{flat}\n{rock}[combat]\n[vehicle]\nsquash.strength = 1.5\n"));
}

fn drives_as(text: &str) {
    let mut arena = Arena::from_toml(text, &SETTINGS).unwrap();
    let mut rehearsal = Rehearsal::from_toml(text, &SETTINGS).unwrap();
    let mut player = Driven(Controls::default(), false);
    let mut past: Vec<Vec<BodyState>> = Vec::new();
    let mut memory = rehearsal.state().memory;
    let mut worst = 0.0f64;
    for now in 0..240 {
        player.0 = controls(now);
        tick(&mut arena, &mut player);
        past.push(car(&arena));
    }
    let single = |v: DVec3| v.as_vec3().as_dvec3();
    for (start, bodies) in past.iter().enumerate().take(past.len() - 5) {
        let bodies = bodies
            .iter()
            .map(|b| BodyState { position: single(b.position), velocity: single(b.velocity), ..*b })
            .collect();
        assert!(rehearsal.set_state(&CarState { bodies, memory }));
        for ahead in 1..=5 {
            rehearsal.step(controls((start + ahead) as u64));
            if ahead == 1 {
                memory = rehearsal.state().memory;
            }
        }
        let off = rehearsal.state().bodies[0].position.distance(past[start + 5][0].position);
        worst = worst.max(off);
    }
    assert!(past[239][0].position.distance(past[0][0].position) > 5.0, "it drives");
    eprintln!("worst {worst} m off after five ticks");
    assert!(worst < 0.03, "{worst} m off after five ticks");
}

#[test]
fn a_state_that_is_none_is_refused() {
    let mut rehearsal = Rehearsal::from_toml(Arena::DEFAULT, &SETTINGS).unwrap();
    let good = rehearsal.state();
    assert_eq!(good.bodies.len(), 5);
    let mut bad = good.clone();
    bad.bodies[2].position = DVec3::NAN;
    assert!(!rehearsal.set_state(&bad));
    assert!(!rehearsal.set_state(&CarState { bodies: Vec::new(), ..good.clone() }));
    assert!(rehearsal.set_state(&good));
    assert!(Rehearsal::from_toml("nonsense", &SETTINGS).is_err());
}
