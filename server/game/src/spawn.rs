//! Where actors are put.

use glam::{DQuat, DVec3};

/// An upright place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Point of the ground below the actor, m.
    pub position: DVec3,
    /// Heading: angle about y, 0 faces +x, positive turns left, rad.
    pub yaw: f64,
}

impl Pose {
    /// Rotation from the actor's frame to the world's.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw)
    }
}

/// Room that a vehicle needs around its spawn point, m: a little more than its length, so that two that face each
/// other do not touch. Smaller lets cars spawn inside each other.
const CLEARANCE: f64 = 4.5;

/// Step by which a taken spawn point is raised until there is room, m.
const RAISE: f64 = 2.0;

/// The point of `points` that is farthest from everything in `others`, the first of equals; raised where even that one
/// is taken, so that an arena never refuses for lack of room.
///
/// # Panics
/// Where `points` is empty; arena files without a spawn point are refused.
pub fn choose(points: &[Pose], others: &[DVec3]) -> Pose {
    let room = |at: DVec3| others.iter().map(|o| o.distance_squared(at)).fold(f64::INFINITY, f64::min);
    let mut best = (points[0], room(points[0].position));
    for &point in &points[1..] {
        let found = room(point.position);
        if found > best.1 {
            best = (point, found);
        }
    }
    // Each of the others blocks a stretch of at most twice the clearance.
    let raises = others.len() * (2.0 * CLEARANCE / RAISE).ceil() as usize;
    let mut pose = best.0;
    for _ in 0..raises {
        if room(pose.position) >= CLEARANCE * CLEARANCE {
            break;
        }
        pose.position.y += RAISE;
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Pose {
        Pose { position: DVec3::new(x, 0.0, 0.0), yaw: 0.0 }
    }

    #[test]
    fn the_farthest_point_is_chosen_and_the_first_of_equals() {
        let points = [at(0.0), at(10.0), at(20.0)];
        assert_eq!(choose(&points, &[]), at(0.0));
        assert_eq!(choose(&points, &[at(0.0).position]), at(20.0));
        assert_eq!(choose(&points, &[at(0.0).position, at(20.0).position]), at(10.0));
    }

    #[test]
    fn a_taken_point_is_raised_until_there_is_room() {
        let others: Vec<_> = (0..20).map(|i| DVec3::new(0.0, f64::from(i), 0.0)).collect();
        let pose = choose(&[at(0.0)], &others);
        assert!(others.iter().all(|o| o.distance(pose.position) >= CLEARANCE), "{pose:?}");
        assert!(pose.position.y < 30.0);
    }
}
