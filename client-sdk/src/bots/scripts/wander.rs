//! Drives to and fro with random headings.

use glam::Vec3;
use pita_protocol::message::Controls;
use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::{Script, View, towards};

/// Speed that is held, m/s.
const SPEED: f32 = 9.0;
/// Farther than this from where it started it turns back, m.
const RANGE: f32 = 35.0;
/// A heading is kept for so many ticks.
const KEPT_TICKS: std::ops::Range<u64> = 60..150;

/// Keeps a random heading for a few seconds, then takes another one.
#[derive(Debug)]
pub struct Wander {
    random: StdRng,
    home: Option<Vec3>,
    heading: f32,
    until: u64,
}

impl Wander {
    /// Headings follow from `seed`.
    pub fn new(seed: u64) -> Self {
        Self { random: StdRng::seed_from_u64(seed), home: None, heading: 0.0, until: 0 }
    }
}

impl Script for Wander {
    fn drive(&mut self, view: &View, tick: u64) -> Controls {
        let own = &view.own;
        let home = *self.home.get_or_insert(own.position);
        if tick >= self.until {
            self.until = tick.saturating_add(self.random.random_range(KEPT_TICKS));
            let away = own.position.distance(home) > RANGE;
            let (middle, spread) = if away { (own.heading_to(home), 0.4) } else { (own.heading(), 1.8) };
            self.heading = middle + self.random.random_range(-spread..spread);
        }
        towards(own, self.heading, SPEED)
    }
}
