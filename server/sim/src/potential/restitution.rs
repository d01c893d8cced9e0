//! Restitution: how fast a contact that is a collision parts.
//!
//! A collision takes two ticks. In the first the bodies meet: the contact stops them at the surface, and what they owe
//! each other is remembered. In the second the contact is a potential toward the target velocity: it pushes until they
//! have parted by what that speed covers in a tick. Where they touch already, the first tick is left out.
//!
//! Speeds are taken at the surface, not where the tick happens to begin. In free flight the scheme keeps
//! w² + a w + 2 a h / dt: w the speed of approach, a what gravity adds to it in a tick, h the gap. So a bounce is as high
//! as the restitution says wherever the ticks fall. What turns has turned on when it is to part, and may weigh more there:
//! it never gets more than e² of the work that the contact took up (Stronge's restitution).

use super::contact::Approach;
use crate::collide::ContactPoint;
use crate::settings::ContactSettings;

/// What a contact point remembers of a collision between its two ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Blow {
    /// Square of the speed at which the bodies are to part, m²/s²; 0 where there was no collision.
    pub owed: f64,
    /// That the contact took up, J.
    pub work: f64,
}

/// What a contact point does about restitution in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rebound {
    /// Speed at which the bodies are to part in this tick, m/s.
    pub speed: Option<f64>,
    /// [`Blow::owed`] if they meet in this tick.
    pub owed: f64,
}

impl Rebound {
    /// For ticks of `dt` seconds.
    pub fn plan(point: &ContactPoint, approach: Approach, settings: &ContactSettings, dt: f64) -> Self {
        let restitution = point.surface.restitution;
        if restitution == 0.0 {
            return Self::default();
        }
        let fall = approach.free - approach.now;
        // What is deeper was not brought there by falling.
        let drop = 2.0 * fall / dt * point.gap.max(-settings.transition);
        let parting = |owed: f64| {
            let square = (fall * fall / 4.0 + owed - drop).max(0.0);
            Self { speed: Some(square.sqrt() - fall / 2.0), owed: 0.0 }
        };
        let e2 = restitution * restitution;
        if point.blow.owed > 0.0 {
            let now = approach.now.max(0.0);
            let left = e2 * (2.0 * point.blow.work / approach.mass + now * (now + fall)).max(0.0);
            return parting(left.min(point.blow.owed));
        }
        if approach.now <= settings.collision_speed {
            return Self::default();
        }
        let owed = e2 * (approach.now * (approach.now + fall) + drop).max(0.0);
        let touches = point.gap <= settings.transition;
        if touches { parting(owed) } else { Self { speed: None, owed } }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const DT: f64 = 1.0 / 30.0;
    const NONE: Blow = Blow { owed: 0.0, work: 0.0 };

    fn plan(gap: f64, blow: Blow, now: f64, free: f64, restitution: f64) -> Rebound {
        let mut point = ContactPoint::at(DVec3::ZERO, DVec3::NEG_Y, gap, 0.0);
        (point.blow, point.surface.restitution) = (blow, restitution);
        Rebound::plan(&point, Approach { now, free, mass: 2.0 }, &ContactSettings::default(), DT)
    }

    #[test]
    fn what_touches_parts_at_once_and_what_will_meet_in_the_next_tick() {
        assert_eq!(plan(0.0, NONE, 4.0, 4.0, 0.5), Rebound { speed: Some(2.0), owed: 0.0 });
        assert_eq!(plan(0.1, NONE, 4.0, 4.0, 0.5), Rebound { speed: None, owed: 4.0 });
        // What 2 kg lose between 4 and 3 m/s.
        let blow = Blow { owed: 4.0, work: 7.0 };
        assert_eq!(plan(0.0, blow, 3.0, 3.0, 0.5), Rebound { speed: Some(2.0), owed: 0.0 });
        let turned_away = Blow { work: 0.0, ..blow };
        assert_eq!(plan(0.0, turned_away, 3.0, 3.0, 0.5), Rebound { speed: Some(1.5), owed: 0.0 });
    }

    #[test]
    fn what_is_slow_rests() {
        assert_eq!(plan(0.0, NONE, 0.1, 0.43, 1.0), Rebound::default());
        assert_eq!(plan(0.0, NONE, 4.0, 4.3, 0.0), Rebound::default());
    }

    /// A body that falls for n ticks from rest by the scheme and bounces elastically rises to where it came from.
    #[test]
    fn speeds_are_those_at_the_surface() {
        let fall = 9.81 * DT;
        for (gap, ticks) in [(0.0, 10.0), (0.08, 9.0)] {
            let speed = fall * ticks;
            let height = gap + 9.81 * DT * DT * ticks * (ticks + 1.0) / 2.0;
            let start = plan(gap, NONE, speed, speed + fall, 1.0);
            // Of the 2 kg, that are stopped to what they need to reach the surface.
            let rest = gap / DT;
            let blow = Blow { owed: start.owed, work: (speed + fall - rest) * (speed + rest) };
            let met = if gap > 0.0 { plan(0.0, blow, rest, rest + fall, 1.0) } else { start };
            let up = met.speed.unwrap();
            // Of a flight that starts with this speed in its first tick.
            let rises = up * (up + fall) / (2.0 * 9.81);
            assert!((rises - height).abs() < 1e-9, "{rises} instead of {height}");
        }
    }
}
