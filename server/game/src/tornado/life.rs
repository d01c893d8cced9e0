//! How a tornado appears and disappears.

/// Where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// It grows out of the ground.
    Appearing,
    /// It is there.
    Roaming,
    /// It shrinks.
    Disappearing,
    /// It is not there.
    Away,
}

/// How long each phase lasts, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lifespan {
    /// Of appearing, and of disappearing.
    pub fade_time: f64,
    /// Of roaming.
    pub stay_time: f64,
    /// Of being away; 0 for a tornado that never disappears.
    pub away_time: f64,
}

/// A tornado's life goes round and round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Life {
    lifespan: Lifespan,
    phase: Phase,
    /// Since the phase began, s.
    passed: f64,
}

impl Life {
    /// It begins to appear.
    pub fn new(lifespan: Lifespan) -> Self {
        Self { lifespan, phase: Phase::Appearing, passed: 0.0 }
    }

    /// Where it stands.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// How much of it is there: 0 while it is away, 1 while it roams; its rate is continuous.
    pub fn strength(&self) -> f64 {
        let share = (self.passed / self.lifespan.fade_time).clamp(0.0, 1.0);
        let grown = share * share * (3.0 - 2.0 * share);
        match self.phase {
            Phase::Appearing => grown,
            Phase::Roaming => 1.0,
            Phase::Disappearing => 1.0 - grown,
            Phase::Away => 0.0,
        }
    }

    /// Lets `dt` s pass. Answers the phase that begins, where one does.
    pub fn pass(&mut self, dt: f64) -> Option<Phase> {
        self.passed += dt;
        let Lifespan { fade_time, stay_time, away_time } = self.lifespan;
        let (lasts, next) = match self.phase {
            Phase::Appearing => (fade_time, Phase::Roaming),
            Phase::Roaming if away_time <= 0.0 => return None,
            Phase::Roaming => (stay_time, Phase::Disappearing),
            Phase::Disappearing => (fade_time, Phase::Away),
            Phase::Away => (away_time, Phase::Appearing),
        };
        if self.passed < lasts {
            return None;
        }
        (self.phase, self.passed) = (next, 0.0);
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_stays_goes_and_comes_again() {
        let mut life = Life::new(Lifespan { fade_time: 1.0, stay_time: 2.0, away_time: 3.0 });
        let (dt, mut begun, mut before) = (0.01, vec![], life.strength());
        for _ in 0..820 {
            begun.extend(life.pass(dt));
            // Smoothstep is never steeper than 1.5 a second here.
            assert!((life.strength() - before).abs() <= 1.51 * dt, "{life:?}");
            before = life.strength();
        }
        use Phase::{Appearing, Away, Disappearing, Roaming};
        assert_eq!(begun, [Roaming, Disappearing, Away, Appearing, Roaming]);
        let mut stays = Life::new(Lifespan { fade_time: 0.5, stay_time: 1.0, away_time: 0.0 });
        let begun: Vec<_> = (0..1000).filter_map(|_| stays.pass(dt)).collect();
        assert_eq!(begun, [Roaming]);
        assert_eq!((stays.phase(), stays.strength()), (Roaming, 1.0));
    }
}
