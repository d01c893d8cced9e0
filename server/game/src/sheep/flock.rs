//! How a sheep goes with its flock (Reynolds, "Flocks, Herds, and Schools", 1987) and away from what it fears. Directions
//! over the ground from places and velocities; no state, no world.

use glam::DVec3;

/// Closer than this a sheep makes room, m.
const ELBOW_ROOM: f64 = 2.2;
/// It stays with those that it sees within this, m.
const SIGHT: f64 = 15.0;
/// Farther than this from the middle of `n` of them it goes there, m: they cover as much ground as they need.
fn lonely(n: f64) -> f64 {
    3.0 + 1.5 * n.sqrt()
}
/// Most that it goes along with the others for no reason of its own; less than what is worth a walk, or a flock that walks
/// would walk for ever.
const DRIFT: f64 = 0.15;
/// It sees where what it fears will be in this time, s.
const FORESIGHT: f64 = 0.6;

/// Another sheep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mate {
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
}

/// Something to be feared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threat {
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// Within which it is feared, m.
    pub radius: f64,
}

/// Which way its mates want it: away from who is too close, towards the others, and with them. Longer than 1 where it is
/// urgent, zero where it is well placed.
pub fn with_flock(me: DVec3, mates: impl Iterator<Item = Mate>) -> DVec3 {
    let (mut apart, mut middle, mut drift, mut seen) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
    for mate in mates {
        let away = (me - mate.position).with_y(0.0);
        let distance = away.length();
        if distance > SIGHT {
            continue;
        }
        if distance < ELBOW_ROOM {
            // Whoever stands in the same place goes another way.
            apart += away.try_normalize().unwrap_or(DVec3::X) * (1.0 - distance / ELBOW_ROOM);
        }
        middle += mate.position;
        drift += mate.velocity.with_y(0.0);
        seen += 1.0;
    }
    if seen == 0.0 {
        return DVec3::ZERO;
    }
    let home = (middle / seen - me).with_y(0.0);
    let together = if home.length() > lonely(seen) { home.normalize() * 0.5 } else { DVec3::ZERO };
    2.0 * apart + together + (drift / seen).clamp_length_max(DRIFT)
}

/// Which way threats drive it: zero where nothing frightens it, longer the closer they are.
pub fn away_from(me: DVec3, threats: impl Iterator<Item = Threat>) -> DVec3 {
    let mut away = DVec3::ZERO;
    for threat in threats.filter(|threat| threat.radius > 0.0) {
        let (now, then) = (threat.position, threat.position + threat.velocity * FORESIGHT);
        let nearest = if then.distance_squared(me) < now.distance_squared(me) { then } else { now };
        let apart = (me - nearest).with_y(0.0);
        let share = 1.0 - apart.length() / threat.radius;
        if share > 0.0 {
            // What comes straight on is left to its side.
            let course = threat.velocity.with_y(0.0).try_normalize().unwrap_or_default();
            let aside = (me - now).with_y(0.0).reject_from(course).try_normalize().unwrap_or_default();
            let straight = apart.try_normalize().unwrap_or(DVec3::X);
            away += (straight + aside).normalize_or(straight) * (0.2 + share);
        }
    }
    away
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mate(x: f64, z: f64) -> Mate {
        Mate { position: DVec3::new(x, 0.8, z), velocity: DVec3::ZERO }
    }

    #[test]
    fn it_makes_room_and_joins_the_others() {
        let me = DVec3::Y * 0.8;
        assert_eq!(with_flock(me, [].into_iter()), DVec3::ZERO);
        assert!(with_flock(me, [mate(1.0, 0.0)].into_iter()).x < -0.5);
        assert_eq!(with_flock(me, [mate(4.0, 0.0), mate(-4.0, 0.0)].into_iter()), DVec3::ZERO);
        assert!(with_flock(me, [mate(12.0, 0.0), mate(13.0, 1.0)].into_iter()).x > 0.3);
        assert_eq!(with_flock(me, [mate(40.0, 0.0)].into_iter()), DVec3::ZERO);
    }

    #[test]
    fn it_runs_from_what_comes_and_to_its_side() {
        let me = DVec3::new(0.0, 0.8, 0.5);
        let car = |x: f64, speed: f64| Threat { position: DVec3::X * x, velocity: DVec3::X * speed, radius: 15.0 };
        assert_eq!(away_from(me, [car(-40.0, 10.0)].into_iter()), DVec3::ZERO);
        let away = away_from(me, [car(-10.0, 10.0)].into_iter());
        assert!(away.x > 0.1 && away.z > 0.1, "{away}");
        // Fast enough that it will be past.
        assert!(away_from(me, [car(-20.0, 20.0)].into_iter()).length() > 0.2);
        assert!(away_from(me, [Threat { position: me, velocity: DVec3::ZERO, radius: 5.0 }].into_iter()).is_finite());
    }
}
