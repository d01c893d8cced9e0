//! What rests is left as it is, and costs next to nothing.

use super::{DT, cube, ground};
use pita_sim::{Anchor, BodyId, DVec3, RodDesc, Settings, StepReport, World};

/// A wall of cubes with cracks of half a millimetre, dropped by a centimetre, that does not fall asleep; after three
/// seconds.
fn wall() -> (World, Vec<BodyId>) {
    let mut world = World::new(Settings { sleep: None, ..Settings::at(DT) }).unwrap();
    ground(&mut world);
    let place = |i: usize| DVec3::new((i % 3) as f64 * 1.0005, 0.51 + (i / 3) as f64 * 1.005, 0.02 * (i % 2) as f64);
    let cubes = (0..9).map(|i| cube(&mut world, place(i))).collect();
    (0..90).for_each(|_| _ = world.step());
    (world, cubes)
}

/// A force that is too small to change a bit, and still has to be looked at.
fn nudge(world: &mut World, id: BodyId) {
    world.apply_force(id, DVec3::X * 1e-300, world.position(id).unwrap()).unwrap();
}

/// A crack that is nearly shut bears nothing; it is no blow that is waited for.
#[test]
fn what_rests_beside_a_crack_goes_on_resting() {
    let (mut world, cubes) = wall();
    for tick in 0..60 {
        nudge(&mut world, cubes[tick % 9]);
        let report = world.step();
        assert_eq!((report.iterations, report.evaluations), (0, 1), "tick {tick}");
    }
}

#[test]
fn what_rests_is_not_solved_and_still_told_of() {
    let (mut world, cubes) = wall();
    nudge(&mut world, cubes[0]);
    let solved = world.step().clone();
    (0..3).for_each(|_| _ = world.step());
    for tick in 0..60 {
        let report = world.step().clone();
        assert_eq!((report.evaluations, report.work), (0, 0), "tick {tick}");
        let told = |r: &StepReport| (r.bodies, r.islands, r.dof, r.contacts, r.pairs);
        assert_eq!(told(&report), told(&solved));
        assert!((report.worst_penetration - solved.worst_penetration).abs() < 1e-12);
    }
}

/// Two worlds, one of which has to solve every tick: the same in every bit, at rest and after everything that disturbs it.
#[test]
fn leaving_it_is_solving_it() {
    type Disturb = fn(&mut World, &[BodyId]);
    let disturbances: [(&str, Disturb); 8] = [
        ("nothing", |_, _| {}),
        ("a support that is taken away", |world, cubes| assert!(world.remove_body(cubes[1]))),
        ("a weight", |world, _| _ = cube(world, DVec3::new(0.0, 4.5, 0.0))),
        ("a push", |world, cubes| {
            world.apply_force(cubes[8], DVec3::new(2e5, 0.0, 0.0), world.position(cubes[8]).unwrap()).unwrap();
        }),
        ("a speed", |world, cubes| world.set_velocity(cubes[4], DVec3::Z, DVec3::ZERO).unwrap()),
        ("another place", |world, cubes| {
            let (position, rotation) = (world.position(cubes[8]).unwrap(), world.rotation(cubes[8]).unwrap());
            world.set_pose(cubes[8], position + DVec3::Y, rotation).unwrap();
        }),
        ("a pair that may pass", |world, _| {
            world.detect_collisions();
            let first = world.collisions().next().unwrap().id;
            assert!(world.cancel_collision(first));
            world.integrate();
        }),
        ("a rod", |world, cubes| {
            let [a, b] = [cubes[6], cubes[8]].map(|id| Anchor::body(id, DVec3::ZERO));
            let length = world.position(cubes[6]).unwrap().distance(world.position(cubes[8]).unwrap());
            world.add_rod(RodDesc::new(a, b, length - 0.1)).unwrap();
        }),
    ];
    for (what, disturb) in disturbances {
        let [(mut resting, cubes), (mut solved, _)] = [wall(), wall()];
        for tick in 0..60 {
            nudge(&mut solved, cubes[0]);
            if tick == 30 {
                disturb(&mut resting, &cubes);
                disturb(&mut solved, &cubes);
            }
            resting.step();
            solved.step();
            assert_eq!(resting.state_hash(), solved.state_hash(), "{what}, tick {tick}");
        }
    }
}

/// What a rod held beside a wall falls when the rod is taken away, though all its contacts are what they were.
#[test]
fn what_was_held_falls() {
    let (mut world, _) = wall();
    let hung = cube(&mut world, DVec3::new(3.002, 1.5, 0.0));
    let above = DVec3::new(3.002, 4.0, 0.0);
    let ends = [Anchor::body(hung, DVec3::ZERO), Anchor::world(above)];
    let rod = world.add_rod(RodDesc::new(ends[0], ends[1], 2.5)).unwrap();
    (0..120).for_each(|_| _ = world.step());
    let height = world.position(hung).unwrap().y;
    assert!(world.contacts().any(|contact| [Some(contact.a), contact.b].contains(&Some(hung))));
    assert_eq!(world.velocity(hung).unwrap(), DVec3::ZERO);
    assert!(world.remove_rod(rod));
    (0..10).for_each(|_| _ = world.step());
    assert!(world.position(hung).unwrap().y < height - 0.1);
}
