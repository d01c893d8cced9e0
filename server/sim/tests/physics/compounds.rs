//! Compounds: several shapes on one rigid body.

use std::f64::consts::FRAC_PI_2;

use pita_sim::collide::{Compound, Piece};
use pita_sim::mass::Density;
use pita_sim::{BodyId, Collider, DQuat, DVec3, Phase, QueryFilter, RigidBodyDesc, Shape, World};

use super::{body, ground, weightless, world};

fn slab(half: DVec3, position: DVec3) -> Piece {
    Piece::new(Collider::new(Shape::Box { half }, 0.5), position, 500.0)
}

/// A table: a top on four legs, its frame's origin on the floor amid the legs.
fn table() -> Compound {
    let leg = |x: f64, z: f64| slab(DVec3::new(0.05, 0.4, 0.05), DVec3::new(x, 0.4, z));
    let top = slab(DVec3::new(0.8, 0.04, 0.5), DVec3::Y * 0.84);
    Compound::new(vec![top, leg(0.7, 0.4), leg(-0.7, 0.4), leg(0.7, -0.4), leg(-0.7, -0.4)]).unwrap()
}

/// Where the origin of a compound's frame is.
fn origin(world: &World, id: BodyId, compound: &Compound) -> DVec3 {
    world.position(id).unwrap() + world.rotation(id).unwrap() * compound.to_body(DVec3::ZERO)
}

/// A box cut into eight and put together again weighs, and turns, as the whole does.
#[test]
fn pieces_weigh_what_the_whole_does() {
    let half = DVec3::new(0.3, 0.2, 0.6);
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -0.8, 1.1));
    let piece = |i: u32| {
        let sign = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
        let at = half / 2.0 * DVec3::new(sign(1), sign(2), sign(4));
        Piece { rotation: turn, ..slab(half / 2.0, turn * at + DVec3::X) }
    };
    let compound = Compound::new((0..8).map(piece).collect()).unwrap();
    let whole = Shape::Box { half }.mass_properties(Density::constant(500.0)).unwrap().moved(DVec3::X, turn);
    let mass = compound.mass_properties();
    assert!((mass.mass - whole.mass).abs() < 1e-9 && (mass.centre - whole.centre).length() < 1e-12);
    assert!((mass.moments - whole.moments).to_cols_array().iter().all(|x| x.abs() < 1e-9));
    let desc = compound.desc(DVec3::ZERO, DQuat::IDENTITY);
    let mut moments = desc.inertia.to_array();
    moments.sort_by(f64::total_cmp);
    let mut expected = Shape::Box { half }.inertia(whole.mass).to_array();
    expected.sort_by(f64::total_cmp);
    assert!(moments.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{moments:?} {expected:?}");
    let heavier = compound.weighing(2.0 * whole.mass).unwrap();
    assert!((heavier.desc(DVec3::ZERO, DQuat::IDENTITY).inertia - 2.0 * desc.inertia).length() < 1e-9);
}

/// A table stands on its legs; what falls on its top stays there, what rolls below it rolls through.
#[test]
fn a_table_stands_and_carries() {
    let mut world = world();
    ground(&mut world);
    let compound = table();
    let id = world.add_compound(&compound, DVec3::Y * 0.01, DQuat::from_rotation_y(0.1)).unwrap();
    let load = body(&mut world, Shape::Box { half: DVec3::splat(0.1) }, 5.0, DVec3::new(0.5, 1.2, 0.1), 0.5);
    let below = body(&mut world, Shape::Ball { radius: 0.2 }, 5.0, DVec3::new(-2.0, 0.2, 0.0), 0.5);
    world.set_velocity(below, DVec3::X * 2.0, DVec3::Z * -10.0).unwrap();
    for tick in 0..120 {
        world.step();
        let deepest = world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max);
        assert!(deepest < 5e-3, "{deepest} m deep in tick {tick}");
    }
    let at = origin(&world, id, &compound);
    assert!(at.length() < 3e-3, "{at}");
    assert!((world.position(load).unwrap().y - 0.98).abs() < 3e-3, "{}", world.position(load).unwrap());
    assert!(world.position(below).unwrap().x > 5.5, "{}", world.position(below).unwrap());
}

/// Thrown and spinning, it keeps momentum and never gets through the ground; lying still, it sleeps and wakes as one.
#[test]
fn a_thrown_table_comes_to_rest() {
    let mut world = world();
    ground(&mut world);
    let id = world.add_compound(&table(), DVec3::Y * 2.0, DQuat::from_rotation_x(1.0)).unwrap();
    world.set_velocity(id, DVec3::new(3.0, 0.0, 1.0), DVec3::new(4.0, 3.0, -5.0)).unwrap();
    for tick in 0..300 {
        world.step();
        let deepest = world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max);
        assert!(deepest < 0.015, "{deepest} m deep in tick {tick}");
    }
    assert_eq!(world.report().asleep, 1, "{:?}", world.report());
    let at = world.position(id).unwrap();
    let ball = body(&mut world, Shape::Ball { radius: 0.1 }, 5.0, at + DVec3::Y * 1.5, 0.5);
    (0..60).for_each(|_| drop(world.step().clone()));
    assert!(world.position(ball).unwrap().y > 0.05);
    assert!(world.remove_body(id));
    world.step();
}

/// A dumbbell of two balls, hit on one end, turns as the closed form says: a blow J off the centre by r gives J/m and
/// J r/I.
#[test]
fn a_blow_beside_the_centre_turns_it() {
    let mut world = weightless();
    let ball = |x: f64| Piece::new(Collider::new(Shape::Ball { radius: 0.2 }, 0.0), DVec3::X * x, 1000.0);
    let compound = Compound::new(vec![ball(-0.5), ball(0.5)]).unwrap().weighing(4.0).unwrap();
    let id = world.add_compound(&compound, DVec3::ZERO, DQuat::IDENTITY).unwrap();
    let shot = RigidBodyDesc::new(DVec3::new(0.5, 0.0, -1.0), 1.0, DVec3::splat(0.016));
    let collider = Some(Collider::new(Shape::Ball { radius: 0.2 }, 0.0));
    let shot = world.add_rigid_body(RigidBodyDesc { velocity: DVec3::Z * 5.0, collider, ..shot }).unwrap();
    let mut begun = 0;
    for _ in 0..30 {
        world.detect_collisions();
        begun += world.collisions().filter(|collision| collision.phase == Phase::Begin).count();
        world.integrate();
    }
    let (speed, spin) = (world.velocity(id).unwrap(), world.angular_velocity(id).unwrap());
    let blow = 5.0 - world.velocity(shot).unwrap().z;
    let about = compound.mass_properties().inertia_about(DVec3::ZERO);
    assert!(begun >= 1 && blow > 1.0, "{begun} {blow}");
    assert!((speed.z - blow / 4.0).abs() < 1e-3, "{speed} {blow}");
    assert!((spin.y + 0.5 * blow / about.y_axis.y).abs() < 1e-2, "{spin} {blow}");
}

/// Rays and overlaps see every piece at its place.
#[test]
fn questions_see_pieces() {
    let mut world = weightless();
    let upright = DQuat::from_rotation_z(FRAC_PI_2);
    let id = world.add_compound(&table(), DVec3::ZERO, upright).unwrap();
    world.step();
    let all = QueryFilter::ALL;
    // Turned by a right angle its top stands upright at x = −0.84, its legs reach from there to 0.
    let hit = world.ray_cast(DVec3::X * -5.0, DVec3::X, 10.0, &all).unwrap().unwrap();
    assert!((hit.distance - 4.12).abs() < 1e-6, "{hit:?}");
    let hit = world.ray_cast(DVec3::new(5.0, 0.7, 0.4), DVec3::NEG_X, 10.0, &all).unwrap().unwrap();
    assert!((hit.distance - 5.0).abs() < 1e-6, "{hit:?}");
    let between = DVec3::new(-0.3, 0.0, 0.0);
    assert!(world.overlap(&Shape::Ball { radius: 0.2 }, between, DQuat::IDENTITY, &all).unwrap().is_empty());
    assert_eq!(world.overlap(&Shape::Ball { radius: 0.9 }, between, DQuat::IDENTITY, &all).unwrap().len(), 1);
    assert!(world.position(id).is_some());
}

#[test]
fn bad_compounds_are_refused_by_name() {
    let refused = |pieces: Vec<Piece>| Compound::new(pieces).unwrap_err().to_string();
    let good = || slab(DVec3::ONE, DVec3::ZERO);
    assert!(refused(vec![]).starts_with("pieces is 0"));
    assert!(refused(vec![good(); 257]).starts_with("pieces is 257"));
    assert!(refused(vec![good(), Piece { position: DVec3::NAN, ..good() }]).starts_with("piece 1: position is NaN"));
    let unturned = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    assert!(refused(vec![Piece { rotation: unturned, ..good() }]).starts_with("piece 0: rotation is 0"));
    assert!(refused(vec![Piece { density: -1.0, ..good() }]).starts_with("piece 0: density is -1"));
    assert!(refused(vec![Piece { density: 0.0, ..good() }]).contains("has no mass"));
    let plane = Piece { collider: Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5), ..good() };
    assert!(refused(vec![plane]).contains("piece 0: a half-space cannot move"));
    let compound = Compound::new(vec![good()]).unwrap();
    assert!(compound.clone().weighing(f64::NAN).is_err());
    let mut world = world();
    assert!(world.add_compound(&compound, DVec3::INFINITY, DQuat::IDENTITY).is_err());
    assert!(world.add_compound(&compound.weighing(1e-9).unwrap(), DVec3::ZERO, DQuat::IDENTITY).is_err());
    assert_eq!(world.step().pairs, 0);
}
