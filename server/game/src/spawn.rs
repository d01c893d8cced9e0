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

/// The point of `points` that has to be raised least until it has room among `others`, m; of those the one that is
/// farthest from all of them, the first of equals. It is not raised above `ceiling`, m: where everything below is taken,
/// the farthest point is the answer all the same, so that an arena never refuses for lack of room.
///
/// # Panics
/// Where `points` is empty; arena files without a spawn point are refused.
pub fn choose(points: &[Pose], others: &[DVec3], ceiling: f64) -> Pose {
    let room = |at: DVec3| others.iter().map(|o| o.distance_squared(at)).fold(f64::INFINITY, f64::min);
    let rank = |point: &Pose| (raise(point.position, others, ceiling), room(point.position));
    let mut best = (points[0], rank(&points[0]));
    for &point in &points[1..] {
        let (found, least) = (rank(&point), best.1);
        if found.0 < least.0 || (found.0 == least.0 && found.1 > least.1) {
            best = (point, found);
        }
    }
    let (Pose { position, yaw }, (raised, _)) = best;
    Pose { position: position + DVec3::Y * if raised.is_finite() { raised } else { 0.0 }, yaw }
}

/// By how much a spawn point has to be raised until it has room, m; infinite where that is above the ceiling.
fn raise(point: DVec3, others: &[DVec3], ceiling: f64) -> f64 {
    let near: Vec<DVec3> =
        others.iter().copied().filter(|o| o.with_y(point.y).distance_squared(point) < CLEARANCE * CLEARANCE).collect();
    let is_free = |at: DVec3| near.iter().all(|o| o.distance_squared(at) >= CLEARANCE * CLEARANCE);
    // Each of the others blocks a stretch of at most twice the clearance.
    let most = near.len() * (2.0 * CLEARANCE / RAISE).ceil() as usize;
    let mut raises = (0..=most).map(|step| step as f64 * RAISE);
    let fits = |raise: &f64| *raise == 0.0 || point.y + raise + CLEARANCE <= ceiling;
    raises.find(|&raise| is_free(point + DVec3::Y * raise)).filter(fits).unwrap_or(f64::INFINITY)
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
        assert_eq!(choose(&points, &[], 50.0), at(0.0));
        assert_eq!(choose(&points, &[at(0.0).position], 50.0), at(20.0));
        assert_eq!(choose(&points, &[at(0.0).position, at(20.0).position], 50.0), at(10.0));
    }

    #[test]
    fn a_taken_point_is_raised_until_there_is_room() {
        let others: Vec<_> = (0..20).map(|i| DVec3::new(0.0, f64::from(i), 0.0)).collect();
        let pose = choose(&[at(0.0)], &others, 50.0);
        assert!(others.iter().all(|o| o.distance(pose.position) >= CLEARANCE), "{pose:?}");
        assert!(pose.position.y < 30.0);
    }

    #[test]
    fn a_crowd_is_spread_over_all_points_before_it_is_piled_up() {
        let points = [at(0.0), at(10.0), at(20.0)];
        let mut crowd: Vec<DVec3> = points.iter().map(|point| point.position).collect();
        for _ in 0..9 {
            crowd.push(choose(&points, &crowd, 50.0).position);
        }
        let highest = crowd.iter().map(|at| at.y).fold(0.0, f64::max);
        // Four above each other, as near as clearance and step allow.
        assert_eq!(highest, 18.0, "{crowd:?}");
    }

    #[test]
    fn nothing_is_raised_through_the_ceiling() {
        let points = [at(0.0), at(10.0)];
        let crowd = [at(0.0).position, at(11.0).position, DVec3::new(0.0, 5.0, 0.0)];
        assert_eq!(choose(&points, &crowd, 12.0).position, DVec3::new(10.0, 6.0, 0.0));
        assert_eq!(choose(&points, &crowd, 8.0), at(10.0), "the farthest point");
    }
}
