//! Recovery: what starts out overlapping parts at a bounded speed and keeps none of it.

use pita_sim::{DVec3, Settings, Shape, World};

use super::{DT, body, ground, weightless, world};

const HALF: f64 = 0.5;
const BOX: Shape = Shape::Box { half: DVec3::splat(HALF) };

/// A box that a designer put 80 mm (and 400 mm) into the ground comes up at no more than the recovery speed, no higher
/// than where it rests, and never has a speed to show for it.
#[test]
fn a_box_in_the_ground_rises_without_a_hop() {
    for depth in [0.005, 0.03, 0.08, 0.4] {
        let mut world = world();
        ground(&mut world);
        let id = body(&mut world, BOX, 100.0, DVec3::Y * (HALF - depth), 0.5);
        let mut height = HALF - depth;
        for tick in 0..90 {
            world.step();
            let now = world.position(id).unwrap().y;
            let (risen, speed) = ((now - height) / DT, world.velocity(id).unwrap().length());
            assert!(risen < 3.01, "{depth} m deep: rises at {risen} m/s in tick {tick}");
            assert!(now < HALF + 1e-3, "{depth} m deep: hops to {now} in tick {tick}");
            assert!(speed < 0.1, "{depth} m deep: {speed} m/s in tick {tick}");
            height = now;
        }
        assert!((height - HALF).abs() < 1e-3, "{depth} m deep: ends at {height}");
        assert!(world.velocity(id).unwrap().length() < 1e-4);
    }
}

/// One crate half inside another in space: they part, momentum stays as it is, and so do their centre and their motion.
#[test]
fn crates_one_inside_another_part_and_keep_their_momentum() {
    let mut world = weightless();
    let a = body(&mut world, BOX, 10.0, DVec3::ZERO, 0.5);
    let b = body(&mut world, BOX, 40.0, DVec3::new(0.6, 0.1, -0.05), 0.5);
    let drift = DVec3::new(0.5, -0.2, 0.3);
    world.set_velocity(a, drift, DVec3::ZERO).unwrap();
    world.set_velocity(b, drift, DVec3::ZERO).unwrap();
    let before = world.momentum();
    for _ in 0..30 {
        world.step();
        for id in [a, b] {
            let speed = (world.velocity(id).unwrap() - drift).length();
            assert!(speed < 0.1, "{speed} m/s");
        }
    }
    let (change, turned) = (world.momentum().linear - before.linear, world.momentum().angular - before.angular);
    assert!(change.length() < 0.05 && turned.length() < 0.05, "{change} {turned}");
    let apart = world.position(b).unwrap() - world.position(a).unwrap();
    assert!(apart.abs().max_element() > 0.995, "still inside: {apart}");
}

/// A dozen crates in one place, none quite like another: where one pushes the next, and what the tick itself brings about is
/// looked at again, none keeps a speed, and they do not take longer than the deepest alone would.
#[test]
fn a_heap_in_one_place_parts_without_speed() {
    let mut world = weightless();
    let ids: Vec<_> = (0..12)
        .map(|i| {
            let i = f64::from(i);
            let half = DVec3::new(0.3 + 0.02 * i, 0.5 - 0.02 * i, 0.4);
            body(&mut world, Shape::Box { half }, 10.0 + i, DVec3::new(0.01 * i, -0.02 * i, 0.013 * i), 0.5)
        })
        .collect();
    let mut fastest = 0.0f64;
    for _ in 0..60 {
        world.step();
        fastest = ids.iter().map(|&id| world.velocity(id).unwrap().length()).fold(fastest, f64::max);
    }
    assert!(fastest < 1.0, "{fastest} m/s");
    world.detect_collisions();
    let deepest = world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max);
    assert!(deepest < 5e-3, "{deepest} m deep");
}

/// Two crates one inside another on the ground end at rest.
#[test]
fn crates_one_inside_another_end_at_rest_on_the_ground() {
    let mut world = world();
    ground(&mut world);
    let ids = [DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.7, 0.45, 0.2)].map(|at| body(&mut world, BOX, 30.0, at, 0.5));
    for _ in 0..90 {
        world.step();
        for id in ids {
            // They are tilted and lifted on their way out, and fall from there.
            assert!(world.velocity(id).unwrap().length() < 1.0, "{}", world.velocity(id).unwrap());
        }
    }
    for id in ids {
        assert!((world.position(id).unwrap().y - HALF).abs() < 2e-3 && world.velocity(id).unwrap().length() < 1e-3);
    }
}

/// With a recovery speed of 0 what is deep stays where it is.
#[test]
fn without_recovery_depths_stay() {
    let mut settings = Settings::at(DT);
    settings.contact.recovery_speed = 0.0;
    let mut world = World::new(settings).unwrap();
    ground(&mut world);
    let id = body(&mut world, BOX, 100.0, DVec3::Y * (HALF - 0.08), 0.5);
    for _ in 0..60 {
        world.step();
    }
    let height = world.position(id).unwrap().y;
    assert!((height - (HALF - 0.08)).abs() < 2e-3 && world.velocity(id).unwrap().length() < 1e-3, "{height}");
}
