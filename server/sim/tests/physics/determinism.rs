//! Same calls, same bits: from run to run, and whatever the number of threads.

use pita_sim::{Anchor, BallJointDesc, DQuat, DVec3, Settings, Shape, World};

use super::sheep::{PARTS, add_articulated, coordinates};
use super::{DT, body, ground};

/// Some heaps of boxes with balls on strings, thrown about, and a sheep on each. Boxes of every other one start within each
/// other, so that recovery has to do with them.
fn heaps(threads: usize) -> World {
    let mut world = World::new(Settings { threads, ..Settings::at(DT) }).unwrap();
    ground(&mut world);
    for heap in 0..8 {
        let at = DVec3::new(f64::from(heap) * 6.0, 0.0, 0.0);
        let height = if heap % 2 == 0 { 1.1 } else { 0.95 };
        for i in 0..10 {
            let position =
                at + DVec3::new(0.1 * f64::from(i % 3), 0.6 + height * f64::from(i), 0.07 * f64::from(i % 4));
            let cube = body(&mut world, Shape::Box { half: DVec3::splat(0.5) }, 20.0, position, 0.5);
            if i == 9 {
                let ball = body(&mut world, Shape::Ball { radius: 0.2 }, 5.0, position + DVec3::Z * 1.5, 0.5);
                let (a, b) = (Anchor::body(cube, DVec3::Z * 0.75), Anchor::body(ball, DVec3::Z * -0.75));
                world.add_ball_joint(BallJointDesc::new(a, b)).unwrap();
                let poses = PARTS.each_ref().map(|part| (position + DVec3::Y * 2.0 + part.centre, DQuat::IDENTITY));
                add_articulated(&mut world, coordinates(&poses), true);
            }
        }
    }
    world
}

#[test]
fn threads_do_not_change_a_bit() {
    let (mut one, mut again, mut two) = (heaps(1), heaps(1), heaps(2));
    for tick in 0..120 {
        for world in [&mut one, &mut again, &mut two] {
            world.step();
        }
        assert_eq!(one.state_hash(), again.state_hash(), "tick {tick}: two runs differ");
        assert_eq!(one.state_hash(), two.state_hash(), "tick {tick}: one and two threads differ");
        assert_eq!(one.report(), two.report(), "tick {tick}");
    }
    // Enough for threads to share: fewer pairs are looked at by one.
    assert!(one.report().contacts > 100 && one.report().pairs > 64, "{:?}", one.report());
}
