//! What a sheep wants: to graze, to walk a little, to be with its flock, and away from what it fears.

use glam::{DQuat, DVec3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::SheepParameters;

/// It grazes in one place for this long at least, and at most, s,
const GRAZES: [f64; 2] = [4.0, 14.0];
/// and walks about for so long.
const WALKS: [f64; 2] = [1.5, 4.0];

/// A wish of the flock shorter than this is not worth a walk.
const WORTH_A_WALK: f64 = 0.45;

/// Numbers that look random, from a generator that answers the same on every machine, so that the same sheep in the same
/// run throws the same.
#[derive(Clone, Debug)]
struct Dice(Pcg32);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(Pcg32::seed_from_u64(seed))
    }

    /// 0 to below 1.
    fn throw(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / (f64::from(u32::MAX) + 1.0)
    }
}

/// What it is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mood {
    /// It stands and eats.
    #[default]
    Grazing,
    /// It walks.
    Walking,
    /// It runs.
    Fleeing,
}

/// What it sees when it thinks.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// From where it is to where it lives, over the ground, m.
    pub homeward: DVec3,
    /// [`flock::with_flock`](super::flock::with_flock).
    pub flock: DVec3,
    /// [`flock::away_from`](super::flock::away_from).
    pub away: DVec3,
}

/// The mind of a sheep.
#[derive(Clone, Debug)]
pub struct Mind {
    dice: Dice,
    mood: Mood,
    /// Velocity over the ground that it wants, m/s.
    wish: DVec3,
    /// Until it changes its mind by itself, s.
    patience: f64,
}

impl Mind {
    /// A mind that grazes; another seed makes another sheep of it.
    pub fn new(seed: u64) -> Self {
        let mut dice = Dice::new(seed);
        let patience = GRAZES[1] * dice.throw();
        Self { dice, mood: Mood::Grazing, wish: DVec3::ZERO, patience }
    }

    /// What it is about.
    pub fn mood(&self) -> Mood {
        self.mood
    }

    /// Velocity over the ground that it wants, m/s.
    pub fn wish(&self) -> DVec3 {
        self.wish
    }

    /// Thinks, `passed` s after the last time.
    pub fn think(&mut self, p: &SheepParameters, view: &View, passed: f64) {
        self.patience -= passed;
        let strayed = view.homeward.length() > p.pasture_radius;
        if view.away != DVec3::ZERO {
            let way = view.away + 0.3 * view.flock;
            self.go(Mood::Fleeing, way.normalize_or(view.away.normalize()) * p.flee_speed);
        } else if strayed {
            self.go(Mood::Walking, view.homeward.normalize() * p.walk_speed);
        } else if view.flock.length() > WORTH_A_WALK {
            self.go(Mood::Walking, view.flock.clamp_length_max(1.0) * p.walk_speed);
        } else if self.mood == Mood::Fleeing || self.patience <= 0.0 {
            self.change();
            self.wish *= p.walk_speed;
        }
    }

    fn go(&mut self, mood: Mood, wish: DVec3) {
        (self.mood, self.wish) = (mood, wish);
    }

    /// Who walked or ran grazes, who grazed walks somewhere as often as not.
    fn change(&mut self) {
        let wanders = self.mood == Mood::Grazing && self.dice.throw() < 0.5;
        let [least, most] = if wanders { WALKS } else { GRAZES };
        self.patience = least + (most - least) * self.dice.throw();
        if wanders {
            let yaw = std::f64::consts::TAU * self.dice.throw();
            self.go(Mood::Walking, DQuat::from_rotation_y(yaw) * DVec3::X);
        } else {
            self.go(Mood::Grazing, DVec3::ZERO);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dice_are_even_and_repeat() {
        let thrown = |seed| {
            let mut dice = Dice::new(seed);
            (0..10_000).map(|_| dice.throw()).collect::<Vec<_>>()
        };
        let first = thrown(7);
        assert_eq!(first, thrown(7));
        assert_ne!(first, thrown(8));
        let mean = first.iter().sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01 && first.iter().all(|x| (0.0..1.0).contains(x)), "{mean}");
    }

    #[test]
    fn fear_comes_first_and_then_home() {
        let (p, none) = (SheepParameters::default(), DVec3::ZERO);
        let mut mind = Mind::new(1);
        mind.think(&p, &View { homeward: DVec3::X * 500.0, flock: none, away: DVec3::NEG_X }, 0.5);
        assert_eq!((mind.mood(), mind.wish()), (Mood::Fleeing, DVec3::NEG_X * p.flee_speed));
        mind.think(&p, &View { homeward: DVec3::X * 500.0, flock: none, away: none }, 0.5);
        assert_eq!((mind.mood(), mind.wish()), (Mood::Walking, DVec3::X * p.walk_speed));
        let calm = View { homeward: none, flock: none, away: none };
        let mut moods = [0, 0];
        for _ in 0..2000 {
            mind.think(&p, &calm, 0.5);
            moods[usize::from(mind.mood() == Mood::Walking)] += 1;
        }
        assert!(moods[0] > moods[1] && moods[1] > 100, "{moods:?}");
    }
}
