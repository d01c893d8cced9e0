//! Rays, volumes and what is nearest, through all three trees, against closed forms and the slow way.

use pita_sim::{
    BodyId, Collider, CollisionObject, Compound, DQuat, DVec3, Groups, Piece, QueryFilter, RigidBodyDesc, Shape,
    StaticDesc, StaticId, World,
};

use super::{body, cube, weightless, world};

const ALL: QueryFilter = QueryFilter::ALL;

fn wall(world: &mut World, position: DVec3) -> StaticId {
    let collider = Collider::new(Shape::Box { half: DVec3::splat(0.5) }, 0.5);
    world.add_static(StaticDesc { position, ..StaticDesc::new(collider) }).unwrap()
}

/// A sleeper at x = 10, something awake at 20, a wall at 30, and the ground half a metre below them.
fn street() -> (World, [CollisionObject; 4]) {
    let mut world = world();
    let plane = Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5);
    let plane = world.add_static(StaticDesc { position: DVec3::Y * -0.5, ..StaticDesc::new(plane) }).unwrap();
    let [asleep, awake] = [10.0, 20.0].map(|x| cube(&mut world, DVec3::X * x));
    let wall = wall(&mut world, DVec3::X * 30.0);
    world.step();
    world.sleep(asleep).unwrap();
    world.detect_collisions();
    assert!(world.is_asleep(asleep) && !world.is_asleep(awake));
    let bodies = [asleep, awake].map(CollisionObject::Body);
    (world, [bodies[0], bodies[1], CollisionObject::Static(wall), CollisionObject::Static(plane)])
}

fn except(object: CollisionObject) -> QueryFilter {
    let CollisionObject::Body(body) = object else { unreachable!("a body was asked for") };
    QueryFilter { except: Some(body), ..ALL }
}

#[test]
fn rays_hit_what_comes_first() {
    let (world, [asleep, awake, wall, plane]) = street();
    let cast = |from: DVec3, to: DVec3, length, filter: &QueryFilter| world.ray_cast(from, to, length, filter).unwrap();
    for (x, object, normal) in [(9.5, asleep, DVec3::NEG_X), (19.5, awake, DVec3::NEG_X), (29.5, wall, DVec3::NEG_X)] {
        let hit = cast(DVec3::X * (x - 3.0), DVec3::X * 7.0, 50.0, &ALL).unwrap();
        assert_eq!(hit.object, object);
        assert!((hit.distance - 3.0).abs() < 1e-3 && hit.normal.distance(normal) < 1e-3, "{hit:?}");
        assert!(hit.point.distance(DVec3::X * x) < 1e-3);
        assert_eq!(cast(DVec3::X * (x - 3.0), DVec3::X, 2.9, &ALL), None, "too short for {object:?}");
        assert_eq!(cast(DVec3::X * (x - 3.0), DVec3::Y, 50.0, &ALL), None, "the wrong way");
    }
    assert_eq!(cast(DVec3::ZERO, DVec3::X, 50.0, &except(asleep)).unwrap().object, awake);
    let down = cast(DVec3::new(5.0, 2.0, 0.0), DVec3::NEG_Y, 50.0, &ALL).unwrap();
    assert_eq!(down.object, plane);
    assert!((down.distance - 2.5).abs() < 1e-9 && down.normal == DVec3::Y);
    let inside = cast(DVec3::X * 10.0, DVec3::X, 50.0, &ALL).unwrap();
    assert_eq!((inside.object, inside.distance), (asleep, 0.0));
    assert!(world.ray_cast(DVec3::ZERO, DVec3::ZERO, 1.0, &ALL).is_err());
    assert!(world.ray_cast(DVec3::NAN, DVec3::X, 1.0, &ALL).is_err());
    assert!(world.ray_cast(DVec3::ZERO, DVec3::X, f64::INFINITY, &ALL).is_err());
}

#[test]
fn volumes_hold_everything_once_and_in_order() {
    let (world, [asleep, awake, wall, plane]) = street();
    let overlap = |half: DVec3, at: DVec3| world.overlap(&Shape::Box { half }, at, DQuat::IDENTITY, &ALL).unwrap();
    assert_eq!(overlap(DVec3::new(20.0, 0.4, 1.0), DVec3::X * 20.0), [asleep, awake, wall]);
    assert_eq!(overlap(DVec3::new(20.0, 1.0, 1.0), DVec3::X * 20.0), [asleep, awake, plane, wall]);
    assert_eq!(overlap(DVec3::splat(0.4), DVec3::X * 15.0), []);
    let ball = Shape::Ball { radius: 1.0 };
    let near = |y: f64| world.overlap(&ball, DVec3::new(20.0, y, 0.0), DQuat::IDENTITY, &ALL).unwrap();
    assert_eq!((near(1.49), near(1.51)), (vec![awake], vec![]));
    let plane = Shape::HalfSpace { normal: DVec3::Y };
    assert!(world.overlap(&plane, DVec3::ZERO, DQuat::IDENTITY, &ALL).is_err());
}

/// A body asks where it would meet what never moves: walls and the ground, each of its colliders, and nothing else.
#[test]
fn a_body_knows_where_it_would_meet_a_wall() {
    let (mut world, [asleep, awake, ..]) = street();
    let [asleep, awake] = [asleep, awake].map(|object| match object {
        CollisionObject::Body(id) => id,
        CollisionObject::Static(_) => unreachable!("boxes are bodies"),
    });
    let mut meets = |id, x: f64, y: f64| world.meets_static(id, DVec3::new(x, y, 0.0)).unwrap();
    // The wall's face is at 29.5 m, the ground as far below the origin as a box reaches; other boxes do not matter.
    for id in [asleep, awake] {
        assert!(!meets(id, 28.99, 0.1) && meets(id, 29.01, 0.1));
        assert!(!meets(id, 15.0, 0.01) && meets(id, 15.0, -0.01));
        assert!(!meets(id, 10.5, 0.01) && !meets(id, 20.5, 0.01));
    }
    assert!(world.meets_static(awake, DVec3::NAN).is_err());
    let ball = |x: f64| Piece::new(Collider::new(Shape::Ball { radius: 0.2 }, 0.5), DVec3::X * x, 100.0);
    let compound = Compound::new(vec![ball(-1.0), ball(1.0)]).unwrap();
    let two = world.add_compound(&compound, DVec3::new(0.0, 9.0, 0.0), DQuat::IDENTITY).unwrap();
    let meets = |world: &mut World, x: f64| world.meets_static(two, DVec3::new(x, 0.1, 0.0)).unwrap();
    assert!(!meets(&mut world, 28.29) && meets(&mut world, 28.31));
    world.remove_body(two);
    assert!(world.meets_static(two, DVec3::ZERO).is_err());
}

#[test]
fn the_nearest_is_found_in_every_tree() {
    let (world, [asleep, awake, wall, plane]) = street();
    let nearest = |at: DVec3, within| world.nearest(at, within, &ALL).unwrap();
    for (x, object) in [(9.2, asleep), (20.8, awake), (30.8, wall)] {
        let near = nearest(DVec3::X * x, 100.0).unwrap();
        assert_eq!(near.object, object);
        assert!((near.distance - 0.3).abs() < 1e-3, "{near:?}");
    }
    assert_eq!(nearest(DVec3::X * 15.0, 100.0).unwrap().object, plane);
    assert_eq!(nearest(DVec3::X * 15.0, 0.4), None);
    let inside = nearest(DVec3::new(10.4, 0.0, 0.0), 1.0).unwrap();
    assert_eq!(inside.object, asleep);
    assert!((inside.distance + 0.1).abs() < 1e-3 && (inside.point.x - 10.5).abs() < 1e-3, "{inside:?}");
}

#[test]
fn filters_hold_groups_and_sensors_back() {
    let mut world = weightless();
    let add = |world: &mut World, x: f64, collider: Collider| {
        let desc = RigidBodyDesc::new(DVec3::X * x, 1.0, DVec3::ONE);
        world.add_rigid_body(RigidBodyDesc { collider: Some(collider), ..desc }).unwrap()
    };
    let ball = || Collider::new(Shape::Ball { radius: 0.5 }, 0.5);
    let sensor = add(&mut world, 2.0, ball().into_sensor());
    let ghost = add(&mut world, 4.0, ball().with_groups(Groups { memberships: 2, mask: 2 }));
    let solid = add(&mut world, 6.0, ball());
    world.step();
    let first = |filter: &QueryFilter| world.ray_cast(DVec3::ZERO, DVec3::X, 9.0, filter).unwrap().unwrap().object;
    let only_one = Groups { memberships: 1, mask: u32::MAX };
    assert_eq!(first(&QueryFilter { sensors: true, ..ALL }), CollisionObject::Body(sensor));
    assert_eq!(first(&ALL), CollisionObject::Body(ghost));
    assert_eq!(first(&QueryFilter { groups: only_one, ..ALL }), CollisionObject::Body(solid));
}

/// Shapes of all kinds, turned, in a heap: every ray goes as far as the slow way says, which walks it in small steps.
#[test]
fn rays_agree_with_the_slow_way() {
    let mut world = weightless();
    let shapes = [
        Shape::Box { half: DVec3::new(0.4, 0.2, 0.3) },
        Shape::Ball { radius: 0.3 },
        Shape::Capsule { half_length: 0.4, radius: 0.2 },
        Shape::Cylinder { half_length: 0.2, radius: 0.4, rounding: 0.05 },
        Shape::Hull { points: vec![DVec3::ZERO, DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5], radius: 0.1 },
    ];
    let bodies: Vec<BodyId> = (0..60)
        .map(|i| {
            let at = DVec3::new(f64::from(i % 5), f64::from(i / 5 % 4), f64::from(i / 20)) * 1.3;
            let id = body(&mut world, shapes[i as usize % 5].clone(), 1.0, at, 0.5);
            world.set_pose(id, at, DQuat::from_scaled_axis(DVec3::new(0.3, 0.7, 0.2) * f64::from(i))).unwrap();
            id
        })
        .collect();
    world.step();
    assert_eq!(bodies.len(), 60);
    let mut hits = 0;
    for i in 0..40 {
        let t = f64::from(i);
        let from = DVec3::new(-2.0, 0.1 * t, 0.06 * t);
        let direction = DVec3::new(1.0, 0.3 * (t * 1.7).sin(), 0.3 * (t * 2.3).cos()).normalize();
        let hit = world.ray_cast(from, direction, 12.0, &ALL).unwrap();
        let is_free = |way: f64| {
            let near = world.nearest(from + direction * way, 5.0, &ALL).unwrap();
            near.is_none_or(|near| near.distance > 0.0)
        };
        let slow = (0..3_000).map(|step| f64::from(step) * 4e-3).find(|&way| !is_free(way));
        match (hit, slow) {
            (Some(hit), Some(slow)) => {
                assert!((hit.distance - slow).abs() < 5e-3, "ray {i}: {hit:?}, slowly {slow}");
                hits += 1;
            }
            // What grazes may fall between two steps.
            (Some(hit), None) => {
                let inner = world.nearest(hit.point + direction * 5e-4, 1.0, &ALL).unwrap().unwrap();
                assert!(inner.distance > -1e-3, "ray {i}: {hit:?} was walked past");
            }
            (None, slow) => assert_eq!(slow, None, "ray {i} missed"),
        }
    }
    assert!(hits > 15, "{hits} rays hit anything");
}
