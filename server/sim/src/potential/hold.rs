//! What holds a joint closed: a penalty stiffness that the engine chooses so that the gap stays within the author's
//! tolerance, whatever the masses.
//!
//! It starts at the solver's `joint_stiffness`. Where a solved island leaves a gap open wider than its tolerance, the
//! stiffness grows and solving goes on within the tick; from tick to tick it follows what the load asks for. Only
//! joints and rods have a [`Hold`]: an author's stiffness stays the author's.

use glam::DVec3;

use super::Term;
use crate::dof::Frame;
use crate::error::{SimError, require};

/// Least and most that a stiffness grows by at a time.
const GROWTH: (f64, f64) = (2.0, 100.0);

/// Share of the tolerance that a steady load opens: what is left is for changes of the load.
const SHARE: f64 = 0.5;

/// What a stiffness keeps of itself in a tick in which nothing asks for it. A joint that goes slack and taut again within
/// half a second is ready for it.
const KEPT: f64 = 0.9;

/// Most that a stiffness grows by from one tick to the next beyond what the tick itself took.
const LEAD: f64 = 4.0;

/// Least share of its stiffness that is left from one tick to the next to a joint that cannot be closed.
const YIELD: f64 = 0.5;

/// Largest acceleration that joints are made for, in m per dt²: 30 m/s within a tick at 30 Hz.
pub(crate) const STRONGEST: f64 = 1.0;

/// Stiffest, in reduced masses per dt², for positions within a metre of the origin; farther out in proportion less.
/// The rounding of positions times this is a speed of 1e-4 m/s at 30 Hz: stiffer, and no solver could come to rest.
const STIFFEST: f64 = 1e10;

/// Default of tolerances, m.
pub(crate) const TOLERANCE: f64 = 1e-3;

/// `Err` unless a tolerance is one that can be held.
pub(crate) fn require_tolerance(tolerance: f64) -> Result<(), SimError> {
    require((1e-6..=1.0).contains(&tolerance), "tolerance", tolerance, "1e-6 to 1 m")
}

/// What the stiffness of a joint is measured with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// Reduced mass (or inertia) per dt²: N/m, or N m/rad.
    pub unit: f64,
    /// The settings' stiffness, in units.
    pub least: f64,
    /// Largest coordinate of the joint, m.
    pub reach: f64,
    /// Largest force (or torque, over the lever of its gap) that the island can bring to bear: N, or N m/m.
    pub strongest: f64,
}

/// A penalty stiffness and the tolerance that it is to hold.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hold {
    /// m.
    tolerance: f64,
    /// N/m, or N m/rad.
    pub stiffness: f64,
    least: f64,
    most: f64,
    strongest: f64,
}

impl Hold {
    /// `remembered` is what [`Hold::remember`] answered in the last tick, 0 at first.
    pub fn new(scale: Scale, tolerance: f64, remembered: f64) -> Self {
        let least = scale.unit * scale.least;
        let most = least.max(scale.unit * STIFFEST / scale.reach.max(1.0));
        let remembered = if remembered > 0.0 { remembered } else { 1.0 };
        let stiffness = (least * remembered).min(most);
        Self { tolerance, stiffness, least, most, strongest: scale.strongest }
    }

    /// Grows where `gap`, m, is above the tolerance and no more than a load explains. Answers whether it did.
    pub fn stiffen(&mut self, gap: f64) -> bool {
        let most = self.most_at(gap);
        let grows = self.is_open(gap) && self.stiffness < most;
        if grows {
            let (slowest, fastest) = GROWTH;
            let growth = (gap / (SHARE * self.tolerance)).clamp(slowest, fastest);
            self.stiffness = (self.stiffness * growth).min(most);
        }
        grows
    }

    /// Whether `gap`, m, is above the tolerance.
    pub fn is_open(&self, gap: f64) -> bool {
        gap > self.tolerance
    }

    /// What the next tick is to start with, given the gap at the end of this one, m: a stiffness in starting ones.
    pub fn remember(&self, gap: f64) -> f64 {
        let next = self.stiffness * (gap / (SHARE * self.tolerance)).clamp(KEPT, LEAD);
        // A joint that gives way comes back as soon as it is closed.
        let next = if self.is_open(gap) { next } else { next.max(self.least) };
        next.min(self.most_at(gap).max(YIELD * self.stiffness)) / self.least
    }

    /// Stiffest where `gap`, m, is open: no load of this island opens it so wide against that much, so what keeps it
    /// open is another joint that does not agree.
    fn most_at(&self, gap: f64) -> f64 {
        self.most.min(self.strongest / gap.max(f64::MIN_POSITIVE))
    }
}

/// What a joint remembers from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Memory {
    /// Gradient on its second end, N.
    pub force: DVec3,
    /// Of its points, see [`Hold::remember`].
    pub stiffening: f64,
    /// Of its turns.
    pub turn_stiffening: f64,
}

/// A potential that holds a gap closed.
pub(crate) trait Joint: Term {
    /// Widest gap at the candidate, m.
    fn gap(&self, at: [&Frame<f64>; 2]) -> f64;

    /// Turn at the candidate that should not be, rad.
    fn tilt(&self, _at: [&Frame<f64>; 2]) -> f64 {
        0.0
    }

    /// Whether a gap is above the tolerance.
    fn is_open(&self, at: [&Frame<f64>; 2]) -> bool;

    /// For the next tick, given the end of this one.
    fn remember(&self, at: [&Frame<f64>; 2]) -> Memory;
}

/// A joint of the world: what the author asked for, and what it remembers.
pub(crate) struct Held<Desc> {
    pub desc: Desc,
    pub memory: Memory,
}

impl<Desc> Held<Desc> {
    pub fn new(desc: Desc) -> Self {
        Self { desc, memory: Memory::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: Scale = Scale { unit: 2.0, least: 1e4, reach: 0.0, strongest: 1e9 };

    #[test]
    fn grows_to_what_the_gap_asks_for_and_stops_at_the_limit() {
        let mut hold = Hold::new(SCALE, 1e-3, 0.0);
        assert_eq!(hold.stiffness, 2e4);
        assert!(!hold.stiffen(1e-3) && !hold.stiffen(f64::NAN) && hold.stiffness == 2e4);
        assert!(hold.stiffen(4e-3) && hold.stiffness == 1.6e5);
        assert!(hold.stiffen(1.0) && hold.stiffness == 1.6e7);
        assert!(hold.stiffen(1.0) && !hold.stiffen(1.0) && hold.stiffness == 1e9);
    }

    #[test]
    fn remembers_what_a_load_asked_for_and_forgets_it_slowly() {
        let hold = Hold::new(SCALE, 1e-3, 40.0);
        assert_eq!(hold.remember(0.5e-3), 40.0);
        assert_eq!(hold.remember(0.0), 36.0);
        assert_eq!(hold.remember(0.01), 160.0);
        assert_eq!(Hold::new(SCALE, 1e-3, f64::NAN).stiffness, 2e4);
    }

    #[test]
    fn gives_way_where_no_load_explains_the_gap_and_comes_back() {
        let scale = Scale { strongest: 100.0, ..SCALE };
        let mut hold = Hold::new(scale, 1e-3, 0.0);
        assert!(!hold.stiffen(0.05));
        let remembered = (0..10).fold(0.0, |remembered, _| Hold::new(scale, 1e-3, remembered).remember(0.05));
        assert!((remembered - 0.1).abs() < 1e-12, "{remembered}");
        assert_eq!(Hold::new(scale, 1e-3, remembered).remember(1e-3), 1.0);
    }
}
