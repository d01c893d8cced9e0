//! Geometry as designers make it: duplicates, slivers, holes, one thing inside another. It is taken with a repair that is
//! told, or refused by name; nothing crashes.

use std::sync::Arc;

use pita_sim::collide::{Compound, Piece, TriangleMesh};
use pita_sim::{BodyId, Collider, DQuat, DVec3, RigidBodyDesc, Shape, StaticDesc, World};

use super::{body, ground, world};

fn settle(world: &mut World, ticks: u32) {
    (0..ticks).for_each(|_| drop(world.step().clone()));
}

/// A hull with a collider of its own mass properties, principal or not: inertia of a ball will do.
fn hull(world: &mut World, points: Vec<DVec3>, radius: f64, position: DVec3) -> BodyId {
    let collider = Some(Collider::new(Shape::Hull { points, radius }, 0.5));
    let desc = RigidBodyDesc::new(position, 10.0, DVec3::splat(0.2));
    world.add_rigid_body(RigidBodyDesc { collider, ..desc }).unwrap()
}

fn cube_corners(half: f64) -> Vec<DVec3> {
    let sign = |i: u32, bit: u32| if i & bit == 0 { -half } else { half };
    (0..8).map(|i| DVec3::new(sign(i, 1), sign(i, 2), sign(i, 4))).collect()
}

/// A point, an edge, a triangle, a square and a line of points are plates and rods of their radius; corners that come
/// three times, and points inside, change nothing. On the ground and on a box.
#[test]
fn hulls_of_few_and_of_too_many_points_rest() {
    let mut many: Vec<_> = (0..3).flat_map(|_| cube_corners(0.3)).collect();
    many.extend([DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * -0.3]);
    let line = (0..9).map(|i| DVec3::X * (0.1 * f64::from(i % 3))).collect();
    let plate = [DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::X + DVec3::Z];
    let cases = [
        ("point", vec![DVec3::ZERO], 0.1, 0.1),
        ("the same point", vec![DVec3::ZERO; 5], 0.1, 0.1),
        ("edge", vec![DVec3::NEG_X * 0.3, DVec3::X * 0.3], 0.1, 0.1),
        ("line", line, 0.1, 0.1),
        ("triangle", vec![DVec3::NEG_X * 0.3, DVec3::X * 0.3, DVec3::Z * 0.4], 0.05, 0.05),
        ("plate", plate.iter().map(|&p| (p - DVec3::new(0.5, 0.0, 0.5)) * 0.6).collect(), 0.05, 0.05),
        ("many", many, 0.0, 0.3),
    ];
    for (name, points, radius, height) in cases {
        let mut world = world();
        ground(&mut world);
        let block = Collider::new(Shape::Box { half: DVec3::ONE }, 0.5);
        let position = DVec3::new(5.0, 1.0, 0.0);
        world.add_static(StaticDesc { position, ..StaticDesc::new(block) }).unwrap();
        let on_ground = hull(&mut world, points.clone(), radius, DVec3::Y * (height + 0.3));
        let on_block = hull(&mut world, points, radius, DVec3::new(5.0, 2.0 + height + 0.3, 0.0));
        settle(&mut world, 120);
        for (id, floor) in [(on_ground, 0.0), (on_block, 2.0)] {
            let above = world.position(id).unwrap().y - floor;
            assert!((above - height).abs() < 3e-3, "{name} over {floor} m is at {above} m");
        }
    }
}

#[test]
fn hulls_that_are_none_are_refused_by_name() {
    let refused = |points: Vec<DVec3>, radius: f64| Shape::Hull { points, radius }.validate().unwrap_err().to_string();
    assert!(refused(vec![], 0.1).starts_with("points is 0"));
    assert!(refused(vec![DVec3::ZERO; 257], 0.1).starts_with("points is 257"));
    assert!(refused(vec![DVec3::ZERO, DVec3::NAN], 0.1).starts_with("points is NaN"));
    assert!(refused(vec![DVec3::ZERO, DVec3::INFINITY], 0.1).starts_with("points is"));
    for points in [1, 2, 3, 4] {
        let flat: Vec<_> = cube_corners(1.0)[..points].to_vec();
        assert!(refused(flat, 0.0).contains("lie in a plane"), "{points}");
    }
    let mut sliver = cube_corners(1.0)[..4].to_vec();
    sliver.push(DVec3::new(0.0, 0.0, -1.0 + 1e-9));
    assert!(refused(sliver, 0.0).contains("lie in a plane"));
}

/// A floor with a hole, doubled and flat triangles and loose corners holds what stands beside the hole and lets through
/// what is over it.
#[test]
fn a_broken_floor_holds_beside_its_hole() {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for cell in (0..25).filter(|&cell| cell != 12) {
        let at = DVec3::new(f64::from(cell % 5) - 2.5, 0.0, f64::from(cell / 5) - 2.5) * 2.0;
        let first = vertices.len() as u32;
        vertices.extend([DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::X + DVec3::Z].map(|corner| at + 2.0 * corner));
        let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
        triangles.extend([[a, c, b], [b, c, d], [b, c, d], [a, a, b]]);
    }
    let mesh = TriangleMesh::new(&vertices, &triangles).unwrap();
    let repairs = mesh.repairs();
    assert_eq!((repairs.flat_triangles, repairs.repeated_triangles), (24, 24));
    assert!(repairs.merged_vertices > 50 && repairs.open_edges == 20 + 4, "{repairs}");
    let mut world = world();
    world.add_static(StaticDesc::new(Collider::new(Shape::Mesh(Arc::new(mesh)), 0.5))).unwrap();
    let beside = body(&mut world, Shape::Box { half: DVec3::splat(0.4) }, 10.0, DVec3::new(2.0, 0.5, 0.1), 0.5);
    let over = body(&mut world, Shape::Ball { radius: 0.4 }, 10.0, DVec3::new(0.05, 0.5, 0.0), 0.5);
    settle(&mut world, 90);
    assert!((world.position(beside).unwrap().y - 0.4).abs() < 3e-3, "{}", world.position(beside).unwrap());
    assert!(world.position(over).unwrap().y < -5.0, "{}", world.position(over).unwrap());
}

/// Rigid bodies of every shape in one place: they come apart and are found again. They part without
/// throwing each other.
#[test]
fn rigid_bodies_in_one_place_come_apart() {
    let mut world = world();
    ground(&mut world);
    let at = DVec3::Y * 0.4;
    let shapes = [
        Shape::Box { half: DVec3::new(0.4, 0.3, 0.5) },
        Shape::Ball { radius: 0.3 },
        Shape::Capsule { half_length: 0.3, radius: 0.2 },
        Shape::Cylinder { half_length: 0.2, radius: 0.3, rounding: 0.05 },
        Shape::Hull { points: cube_corners(0.3), radius: 0.02 },
    ];
    let mut ids: Vec<_> = shapes.iter().cycle().take(10).map(|s| body(&mut world, s.clone(), 10.0, at, 0.5)).collect();
    let twice = || Piece::new(Collider::new(shapes[0].clone(), 0.5), DVec3::ZERO, 100.0);
    let compound = Compound::new(vec![twice(), twice()]).unwrap();
    ids.push(world.add_compound(&compound, at, DQuat::IDENTITY).unwrap());
    let depth = |world: &World| world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max);
    for tick in 0..300 {
        let quarantined = world.step().quarantined;
        assert_eq!(quarantined, 0, "tick {tick}");
        let speeds = ids.iter().map(|&id| world.velocity(id).unwrap().length());
        let fastest = speeds.fold(0.0, f64::max);
        // Later they fall from where they were lifted to.
        assert!(tick > 5 || fastest < 1.0, "{fastest} m/s in tick {tick}");
    }
    for &id in &ids {
        let at = world.position(id).unwrap();
        assert!(at.is_finite() && at.y > 0.0 && at.length() < 300.0, "{at}");
    }
    assert!(depth(&world) < 0.05, "{} m", depth(&world));
}
