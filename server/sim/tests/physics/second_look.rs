//! What a tick itself brings about is seen within the tick.

use pita_sim::{BodyId, DVec3, World};

use super::{cube, ground, world};

/// Deepest overlap that detection finds at the end of any of so many ticks, m.
fn deepest(world: &mut World, ticks: usize) -> f64 {
    let mut deepest: f64 = 0.0;
    for _ in 0..ticks {
        world.step();
        world.detect_collisions();
        deepest = world.contacts().map(|contact| -contact.gap).fold(deepest, f64::max);
    }
    deepest
}

fn spin(world: &mut World, id: BodyId, velocity: DVec3, spin: DVec3) {
    world.set_velocity(id, velocity, spin).unwrap();
}

/// Two crates fall one behind the other, with no speed between them: only the tick that stops the lower one brings them
/// together. Without the second look the upper one ends 228 mm inside the lower.
#[test]
fn what_follows_another_down_does_not_end_inside_it() {
    let mut world = world();
    ground(&mut world);
    for height in [2.0, 3.1] {
        let id = cube(&mut world, DVec3::Y * height);
        spin(&mut world, id, DVec3::Y * -8.0, DVec3::ZERO);
    }
    let deepest = deepest(&mut world, 30);
    assert!(deepest < 0.005, "{deepest} m deep");
}

/// Crates that are thrown at one another and spin by a third of a radian a tick hit with corners that were not near
/// anything when the tick began.
#[test]
fn corners_that_swing_in_are_seen() {
    let mut world = world();
    ground(&mut world);
    for (i, side) in (0..6).zip([-1.0, 1.0].into_iter().cycle()) {
        let id = cube(&mut world, DVec3::new(-1.5 * side, 1.0 + 0.6 * f64::from(i), 0.3 * f64::from(i)));
        spin(&mut world, id, DVec3::new(10.0 * side, -5.0, 0.0), DVec3::new(4.0, 3.0 * side, 9.0));
    }
    let deepest = deepest(&mut world, 45);
    assert!(deepest < 0.005, "{deepest} m deep");
}
