//! Collisions as logic sees them: groups, sensors, phases, what may pass, and materials.

use pita_sim::{
    BodyId, Collider, Collision, CollisionObject, DQuat, DVec3, Groups, Material, MaterialId, ParticleDesc, Phase,
    RigidBodyDesc, Shape, StaticDesc, Surface, World,
};

use super::{DT, body, ground, weightless, world};

const BALL: Shape = Shape::Ball { radius: 0.5 };

fn add(world: &mut World, collider: Collider, position: DVec3, velocity: DVec3) -> BodyId {
    let inertia = collider.shape().inertia(1.0);
    let desc = RigidBodyDesc { velocity, ..RigidBodyDesc::new(position, 1.0, inertia) };
    world.add_rigid_body(RigidBodyDesc { collider: Some(collider), ..desc }).unwrap()
}

fn phases(world: &World) -> Vec<Phase> {
    world.collisions().map(|collision| collision.phase).collect()
}

#[test]
fn a_ball_that_falls_begins_to_touch_and_stays_until_it_is_lifted() {
    let mut world = world();
    ground(&mut world);
    let ball = body(&mut world, BALL, 2.0, DVec3::Y * 1.5, 0.5);
    let mut told: Vec<Collision> = Vec::new();
    for tick in 0..60 {
        if tick == 50 {
            world.set_velocity(ball, DVec3::Y * 5.0, DVec3::ZERO).unwrap();
        }
        world.detect_collisions();
        told.extend(world.collisions());
        world.integrate();
    }
    let (first, last) = (told[0], told[told.len() - 1]);
    assert_eq!((first.phase, last.phase), (Phase::Begin, Phase::End));
    assert!(told[1..told.len() - 1].iter().all(|collision| collision.phase == Phase::Stay));
    assert_eq!(first.sides[0].object, CollisionObject::Body(ball));
    assert!(matches!(first.sides[1].object, CollisionObject::Static(_)));
    // It fell a metre: the first tick of it is told before it happens, the blow in the tick after.
    assert!((first.approach_speed - 4.4).abs() < 0.4 && first.impulse == 0.0, "{first:?}");
    assert!((first.normal + DVec3::Y).length() < 1e-9 && first.point.y.abs() < 0.2, "{first:?}");
    let given: f64 = told.iter().take_while(|collision| collision.approach_speed > -0.1).map(|c| c.impulse).sum();
    let ticks = told.len() as f64;
    assert!(given > 2.0 * 4.2 && given < 2.0 * (4.5 + 9.81 * DT * ticks), "{given} N s");
}

#[test]
fn a_pair_that_logic_lets_pass_falls_through() {
    let mut world = world();
    ground(&mut world);
    let ball = body(&mut world, BALL, 2.0, DVec3::Y * 0.5, 0.5);
    let mut cancelled = 0;
    for _ in 0..30 {
        world.detect_collisions();
        let ids: Vec<_> = world.collisions().map(|collision| collision.id).collect();
        cancelled += ids.iter().filter(|&&id| world.cancel_collision(id)).count();
        assert!(world.collisions().all(|collision| collision.is_cancelled));
        world.integrate();
    }
    // A second of free fall, by the scheme.
    let fallen = 0.5 - world.position(ball).unwrap().y;
    assert!((fallen - 9.81 * DT * DT * 30.0 * 31.0 / 2.0).abs() < 1e-6, "{fallen}");
    assert_eq!(cancelled, 30);
    // Not cancelled any more, it comes back up at a bounded speed.
    world.step();
    let id = world.collisions().next().unwrap().id;
    world.detect_collisions();
    assert!(!world.cancel_collision(id), "a collision of another tick");
}

#[test]
fn groups_that_do_not_meet_pass_through_each_other() {
    let groups = |memberships, mask| Groups { memberships, mask };
    for (a, b, meet) in [
        (Groups::ALL, Groups::ALL, true),
        (groups(1, 2), groups(2, 1), true),
        (groups(1, 2), groups(2, 2), false),
        (groups(1, u32::MAX), groups(2, 4), false),
    ] {
        let mut world = weightless();
        let left = add(&mut world, Collider::new(BALL, 0.0).with_groups(a), DVec3::X * -2.0, DVec3::X * 5.0);
        add(&mut world, Collider::new(BALL, 0.0).with_groups(b), DVec3::X * 2.0, DVec3::X * -5.0);
        (0..30).for_each(|_| {
            world.step();
        });
        assert_eq!(world.velocity(left).unwrap().x < 4.0, meet, "{a:?} {b:?}");
    }
}

#[test]
fn a_sensor_sees_what_passes_and_pushes_nothing() {
    let mut world = weightless();
    let gate = Collider::new(Shape::Box { half: DVec3::new(0.5, 2.0, 2.0) }, 0.5).into_sensor();
    let gate = world.add_static(StaticDesc::new(gate)).unwrap();
    // A second sensor does not see the first.
    add(&mut world, Collider::new(BALL, 0.5).into_sensor(), DVec3::ZERO, DVec3::ZERO);
    let ball = add(&mut world, Collider::new(BALL, 0.5), DVec3::new(-3.0, 0.9, 0.9), DVec3::X * 3.0);
    let mut told = Vec::new();
    for _ in 0..60 {
        world.detect_collisions();
        assert_eq!(world.contacts().count(), 0);
        told.extend(world.collisions().filter(|c| c.sides[1].object == CollisionObject::Static(gate)));
        world.integrate();
    }
    assert_eq!(world.velocity(ball).unwrap(), DVec3::X * 3.0);
    assert!(told.iter().all(|collision| collision.sides[1].is_sensor && !collision.sides[0].is_sensor));
    let count = |phase| told.iter().filter(|collision| collision.phase == phase).count();
    assert_eq!((count(Phase::Begin), count(Phase::End)), (1, 1));
    // Two metres at 3 m/s, in ticks.
    assert!((19..=21).contains(&count(Phase::Stay)), "{}", count(Phase::Stay));
}

/// Nor does it wake what sleeps: whoever has the sensor is told of it and decides.
#[test]
fn a_sensor_sees_what_sleeps() {
    let mut world = world();
    ground(&mut world);
    let shape = Shape::Box { half: DVec3::new(1.0, 0.25, 0.5) };
    let sleeper = body(&mut world, shape, 100.0, DVec3::Y * 0.25, 0.5);
    while !world.is_asleep(sleeper) {
        world.step();
    }
    let sensor = Collider::new(Shape::Ball { radius: 3.0 }, 0.5).into_sensor();
    let position = DVec3::X * -10.0;
    let eye = world
        .add_particle(ParticleDesc { position, velocity: DVec3::X * 6.0, mass: 1.0, collider: Some(sensor) })
        .unwrap();
    let mut seen = 0;
    for _ in 0..100 {
        let at = world.position(eye).unwrap().with_y(0.0);
        world.set_pose(eye, at, DQuat::IDENTITY).unwrap();
        world.set_velocity(eye, DVec3::X * 6.0, DVec3::ZERO).unwrap();
        world.detect_collisions();
        let sees = world.collisions().any(|c| c.sides.iter().any(|side| side.object == CollisionObject::Body(sleeper)));
        assert_eq!(sees, at.x.abs() < 4.0 && at.x.abs() < 3.9 || sees && at.x.abs() < 4.3, "{at}");
        seen += usize::from(sees);
        world.integrate();
    }
    assert!(seen > 30 && world.is_asleep(sleeper), "{seen}");
}

#[test]
fn a_removed_partner_takes_its_collisions_along() {
    let mut world = world();
    let floor = Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5);
    let floor = world.add_static(StaticDesc::new(floor)).unwrap();
    let (lower, upper) = (body(&mut world, BALL, 1.0, DVec3::Y * 0.5, 0.5), DVec3::Y * 1.5);
    body(&mut world, BALL, 1.0, upper, 0.5);
    world.step();
    assert_eq!(phases(&world), [Phase::Begin, Phase::Begin]);
    assert!(world.remove_static(floor));
    assert_eq!(world.collisions().count(), 1);
    world.step();
    assert_eq!(phases(&world), [Phase::Stay]);
    world.remove_body(lower);
    assert_eq!(world.collisions().count(), 0);
    world.step();
    assert_eq!(world.collisions().count(), 0);
}

/// A table entry replaces what the rule makes of both materials, and collisions name them.
#[test]
fn a_pair_of_materials_has_its_own_friction() {
    let material = |id, friction| Material { id: MaterialId(id), ..Material::from(friction) };
    let mut world = world();
    let ice = Collider::new(Shape::HalfSpace { normal: DVec3::Y }, material(1, 0.5));
    world.add_static(StaticDesc::new(ice)).unwrap();
    let half = DVec3::new(0.5, 0.1, 0.5);
    let mut slide = |id, x| {
        let collider = Collider::new(Shape::Box { half }, material(id, 0.5));
        add(&mut world, collider, DVec3::new(x, 0.1, 0.0), DVec3::Z * 5.0)
    };
    let (by_rule, by_table) = (slide(2, -3.0), slide(3, 3.0));
    let surface = Surface { friction: 0.1, ..Surface::default() };
    world.set_material_pair(MaterialId(3), MaterialId(1), surface).unwrap();
    let bad = Surface { friction: f64::INFINITY, ..surface };
    assert!(world.set_material_pair(MaterialId(3), MaterialId(1), bad).is_err());
    (0..15).for_each(|_| {
        world.step();
    });
    for (id, friction) in [(by_rule, 0.5), (by_table, 0.1)] {
        let speed = world.velocity(id).unwrap().z;
        let expected = 5.0 - friction * 9.81 * 0.5;
        assert!((speed - expected).abs() < 0.05, "{speed} m/s instead of {expected}");
    }
    let materials: Vec<_> = world.collisions().map(|c| c.sides.map(|side| side.material.0)).collect();
    assert_eq!(materials, [[2, 1], [3, 1]]);
}
