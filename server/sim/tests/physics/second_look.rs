//! What a tick itself brings about is seen within the tick.

use std::sync::Arc;

use pita_sim::collide::TriangleMesh;
use pita_sim::{BodyId, Collider, DQuat, DVec3, Shape, StaticDesc, World};

use super::sheep::{PARTS, Poses, add_articulated, coordinates};
use super::sheep_forms::add_natural;
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

/// Sheep do not either, nor jellies: points of theirs that the tick brings together are found where it brings them.
#[test]
fn sheep_and_jellies_that_follow_another_down_do_not_end_inside_it() {
    type Add = fn(&mut World, DVec3) -> BodyId;
    let kinds: [(&str, Add, f64, f64); 3] = [
        ("natural", |world, at| add_natural(world, &poses_at(at), true), 1.35, 0.015),
        ("articulated", |world, at| add_articulated(world, coordinates(&poses_at(at)), true), 1.35, 0.015),
        ("jelly", |world, at| add_stiff_jelly(world, at - DVec3::Y * 0.3), 0.74, 0.02),
    ];
    for (name, add, spacing, limit) in kinds {
        let mut world = world();
        ground(&mut world);
        for height in [2.0, 2.0 + spacing] {
            let id = add(&mut world, DVec3::Y * height);
            let slice = world.slice(id).unwrap();
            let (q, mut v) = (slice.q.to_vec(), slice.v.to_vec());
            let moving = if name == "articulated" { 3 } else { v.len() };
            v[..moving].chunks_exact_mut(3).for_each(|v| v[1] = -8.0);
            world.set_slice(id, &q, &v).unwrap();
        }
        let deepest = deepest(&mut world, 30);
        assert!(deepest < limit, "{name}: {deepest} m deep");
    }
}

fn poses_at(at: DVec3) -> Poses {
    std::array::from_fn(|i| (at + PARTS[i].centre, DQuat::IDENTITY))
}

fn add_stiff_jelly(world: &mut World, at: DVec3) -> BodyId {
    super::embedded_hulls::add_jelly(world, super::embedded_hulls::jelly(1e6, [2, 1, 1]), at, DQuat::IDENTITY)
}

/// A floor of triangles.
fn surface(world: &mut World) {
    let flat = TriangleMesh::of_height_field(&[0.0; 25], 5, 4.0).unwrap();
    let collider = Collider::new(Shape::Mesh(Arc::new(flat)), 0.5);
    world.add_static(StaticDesc { position: DVec3::new(-8.0, 0.0, -8.0), ..StaticDesc::new(collider) }).unwrap();
}

/// Crates that are thrown at one another and spin by a third of a radian a tick hit with corners that were not near
/// anything when the tick began. How deep depends on a micrometre: it is asked of twenty throws.
#[test]
fn corners_that_swing_in_are_seen() {
    for floor in [ground, surface] {
        let throw = |k: u32| {
            let mut world = world();
            floor(&mut world);
            throw_crates(&mut world, 1e-6 * f64::from(k));
            deepest(&mut world, 45)
        };
        let mut depths: Vec<_> = (0..20).map(throw).collect();
        depths.sort_by(f64::total_cmp);
        assert!(depths[10] < 0.005 && depths[15] < 0.01, "{depths:?} m deep");
    }
}

/// Six crates, `shift` m off.
fn throw_crates(world: &mut World, shift: f64) {
    for (i, side) in (0..6).zip([-1.0, 1.0].into_iter().cycle()) {
        let id = cube(world, DVec3::new(shift - 1.5 * side, 1.0 + 0.6 * f64::from(i), 0.3 * f64::from(i)));
        spin(world, id, DVec3::new(10.0 * side, -5.0, 0.0), DVec3::new(4.0, 3.0 * side, 9.0));
    }
}

/// What lies above the ground, or flies along it, and is struck down within a tick, is not struck through it: nothing at
/// the start of the tick said that it would come near. Without the look at half-spaces the slab ends 26 cm deep in it.
#[test]
fn what_is_struck_down_does_not_end_beneath_the_ground() {
    for speed in [0.0, 20.0] {
        let mut world = world();
        ground(&mut world);
        let along = DVec3::X * speed;
        let slab = cube(&mut world, DVec3::Y * 1.0);
        spin(&mut world, slab, along, DVec3::ZERO);
        let hammer = cube(&mut world, DVec3::Y * 2.5);
        spin(&mut world, hammer, along - DVec3::Y * 60.0, DVec3::ZERO);
        let mut lowest = f64::INFINITY;
        for _ in 0..10 {
            world.step();
            lowest = lowest.min(world.position(slab).unwrap().y);
        }
        assert!(lowest > 0.4, "at {speed} m/s its centre was at {lowest} m");
    }
}
