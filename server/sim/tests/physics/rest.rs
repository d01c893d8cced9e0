//! What rests is left where it is, and costs next to nothing.

use super::{DT, cube, ground};
use pita_sim::{BodyId, DVec3, Settings, World};

/// A wall of cubes with cracks of half a millimetre, dropped by a centimetre, that does not fall asleep; after two seconds.
fn wall() -> (World, Vec<BodyId>) {
    let mut world = World::new(Settings { sleep: None, ..Settings::at(DT) }).unwrap();
    ground(&mut world);
    let place = |i: usize| DVec3::new((i % 3) as f64 * 1.0005, 0.51 + (i / 3) as f64 * 1.005, 0.02 * (i % 2) as f64);
    let cubes = (0..9).map(|i| cube(&mut world, place(i))).collect();
    (0..60).for_each(|_| _ = world.step());
    (world, cubes)
}

/// A crack that is nearly shut bears nothing; it is no blow that is waited for.
#[test]
fn what_rests_beside_a_crack_is_not_solved() {
    let (mut world, _) = wall();
    for tick in 0..60 {
        let report = world.step();
        assert_eq!((report.iterations, report.evaluations), (0, report.islands), "tick {tick}");
    }
}
