//! Surfaces of triangles: what rests on them rests, and what slides or rolls over inner edges does not feel them.

use std::sync::Arc;

use pita_sim::collide::TriangleMesh;
use pita_sim::{Collider, DVec3, RigidBodyDesc, Settings, Shape, StaticDesc, World};

use super::{DT, body, world};

/// A square field of `cells` by `cells`, `spacing` wide each, with its middle at the origin.
fn field(world: &mut World, cells: usize, spacing: f64, height: impl Fn(f64, f64) -> f64) {
    let half = cells as f64 * spacing / 2.0;
    let place = |i: usize| i as f64 * spacing - half;
    let points = (0..=cells).flat_map(|row| (0..=cells).map(move |column| (column, row)));
    let heights: Vec<_> = points.map(|(column, row)| height(place(column), place(row))).collect();
    let mesh = TriangleMesh::of_height_field(&heights, cells + 1, spacing).unwrap();
    let collider = Collider::new(Shape::Mesh(Arc::new(mesh)), 0.5);
    let position = DVec3::new(-half, 0.0, -half);
    world.add_static(StaticDesc { position, ..StaticDesc::new(collider) }).unwrap();
}

fn shapes() -> [Shape; 5] {
    let hull = [DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::Y].map(|p| (p - 0.25) * 0.8);
    [
        Shape::Ball { radius: 0.3 },
        Shape::Box { half: DVec3::new(0.5, 0.3, 0.4) },
        Shape::Capsule { half_length: 0.4, radius: 0.2 },
        Shape::Cylinder { half_length: 0.2, radius: 0.4, rounding: 0.05 },
        Shape::Hull { points: hull.to_vec(), radius: 0.05 },
    ]
}

#[test]
fn everything_rests_on_a_field_of_triangles() {
    for (shape, spacing) in
        shapes().into_iter().flat_map(|shape| [0.13, 0.9, 30.0].map(|spacing| (shape.clone(), spacing)))
    {
        let mut world = world();
        field(&mut world, 12, spacing, |_, _| 0.0);
        let thing = body(&mut world, shape.clone(), 10.0, DVec3::new(0.05, 0.6, 0.02), 0.5);
        for _ in 0..120 {
            world.step();
        }
        let settled = world.position(thing).unwrap();
        assert!(settled.y > 0.1 && settled.y < 0.6, "{shape:?} on cells of {spacing} m is at {settled}");
        let lowest = world.contacts().map(|contact| contact.gap).fold(f64::INFINITY, f64::min);
        assert!(lowest > -2e-3, "{shape:?} on cells of {spacing} m is {lowest} deep");
        for _ in 0..120 {
            world.step();
        }
        let crept = (world.position(thing).unwrap() - settled).length();
        // A ball may roll on.
        let allowed = if matches!(shape, Shape::Ball { .. }) { 0.05 } else { 2e-3 };
        assert!(crept < allowed, "{shape:?} on cells of {spacing} m crept {crept} m");
    }
}

/// A box and a wheel cross hundreds of inner edges and stay as low, as straight and as fast as on a plane.
#[test]
fn inner_edges_do_not_kick() {
    for spacing in [0.11, 0.7, 3.1] {
        for (shape, friction, spin) in [
            (Shape::Box { half: DVec3::new(0.5, 0.2, 0.4) }, 0.0, DVec3::ZERO),
            (Shape::Cylinder { half_length: 0.15, radius: 0.4, rounding: 0.05 }, 0.8, DVec3::Z * -25.0),
            (Shape::Ball { radius: 0.4 }, 0.8, DVec3::Z * -25.0),
        ] {
            let mut world = world();
            field(&mut world, (64.0 / spacing) as usize, spacing, |_, _| 0.0);
            let height = if matches!(shape, Shape::Box { .. }) { 0.2 } else { 0.4 };
            let thing = body(&mut world, shape.clone(), 20.0, DVec3::new(-25.0, height, 0.033), friction);
            world.set_velocity(thing, DVec3::X * 10.0, spin).unwrap();
            for tick in 0..120 {
                world.step();
                let (position, velocity) = (world.position(thing).unwrap(), world.velocity(thing).unwrap());
                let rose = (position.y - height).abs();
                // A free wheel wanders: 0.3 degrees in 20 m on cells of 11 cm.
                let aside = velocity.y.abs().max(0.2 * velocity.z.abs());
                let slowed = (velocity.x - 10.0).abs();
                assert!(
                    rose < 3e-3 && aside < 0.05 && slowed < 0.1,
                    "{shape:?}, cells of {spacing} m, tick {tick}: {position} {velocity}"
                );
            }
        }
    }
}

/// A ball dropped into a bowl comes to rest at its bottom, and nothing falls through a hill.
#[test]
fn hills_and_bowls_hold() {
    let mut world = world();
    field(&mut world, 40, 0.25, |x, z| 0.1 * (x * x + z * z));
    let ball = body(&mut world, Shape::Ball { radius: 0.3 }, 5.0, DVec3::new(1.5, 1.0, 0.4), 0.5);
    let cube = body(&mut world, Shape::Box { half: DVec3::splat(0.2) }, 5.0, DVec3::new(-1.5, 1.2, 0.4), 0.5);
    for _ in 0..300 {
        world.step();
        for (id, low) in [(ball, 0.29), (cube, 0.19)] {
            let position = world.position(id).unwrap();
            let ground = 0.1 * (position.x * position.x + position.z * position.z);
            assert!(position.y > ground + low - 0.02, "{position} is in the ground");
        }
    }
    assert!(world.velocity(cube).unwrap().length() < 1e-3, "{}", world.velocity(cube).unwrap());
}

/// A pyramid stands on its tip in a crack and falls over along it. Beside the tip, where one wall ends at the other, the way
/// out of a wall is along the other one: both have to hold it all the same.
#[test]
fn what_falls_over_in_a_crack_does_not_get_through_its_walls() {
    let across = [(-1.0, 0.5), (-0.5, 0.5), (0.0, 0.0), (0.5, 0.5), (1.0, 0.5)];
    let row = |z: f64| across.map(|(x, y)| DVec3::new(x, y, z));
    let vertices = [row(-2.0), row(2.0)].concat();
    let cells = (0..4u32).flat_map(|i| [[i, i + 5, i + 6], [i, i + 6, i + 1]]);
    let crack = TriangleMesh::new(&vertices, &cells.collect::<Vec<_>>()).unwrap();
    let corners = [(-0.5, 3.0, -0.5), (-0.5, 3.0, 0.5), (0.5, 3.0, -0.5), (0.5, 3.0, 0.5), (0.0, 0.0001, 0.0)];
    let corners = corners.map(|(x, y, z)| DVec3::new(x, y, z));
    let spike = Shape::Hull { points: corners.to_vec(), radius: 0.0 };
    let mass = spike.mass_properties(pita_sim::mass::Density::constant(1000.0)).unwrap();
    let (inertia, rotation) = mass.principal();
    let points = corners.iter().map(|&corner| rotation.inverse() * (corner - mass.centre)).collect();
    for dt in [0.01, 1.0 / 60.0, DT] {
        let mut world = World::new(Settings { sleep: None, ..Settings::at(dt) }).unwrap();
        world.add_static(StaticDesc::new(Collider::new(Shape::Mesh(Arc::new(crack.clone())), 0.0))).unwrap();
        let shape = Shape::Hull { points: Vec::clone(&points), radius: 0.0 };
        let desc = RigidBodyDesc::new(mass.centre, mass.mass, inertia);
        let (collider, velocity) = (Some(Collider::new(shape, 0.0)), DVec3::X);
        world.add_rigid_body(RigidBodyDesc { rotation, collider, velocity, ..desc }).unwrap();
        let mut least = world.energy().total();
        for tick in 0..(1.2 / dt) as u32 {
            world.step();
            let deepest = world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max);
            assert!(deepest < 0.015, "{deepest} m deep in tick {tick} of {dt} s");
            let energy = world.energy().total();
            let risen = (energy - least) / (mass.mass * 9.81);
            assert!(risen < 0.01, "gains {risen} m in tick {tick} of {dt} s");
            least = least.min(energy);
        }
    }
}
