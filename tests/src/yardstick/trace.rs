//! What a run leaves behind: the state at every tick, and what every tick took.

use pita_server::trace::{TickTime, time};
use pita_sim::{DQuat, DVec3};

/// An engine with a scene in it.
pub trait Engine {
    /// Advances by one tick of 1/30 s.
    fn tick(&mut self);
    /// Appends the state of every body, in the scene's order; of every node where the scene is an elastic body.
    fn record(&self, into: &mut Vec<BodyState>);
    /// What it says went wrong so far; `None` where an engine does not tell.
    fn trouble(&self) -> Option<Trouble> {
        None
    }
}

/// What went wrong in a run, by the engine's own word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trouble {
    /// Ticks at whose end some island's equations were not solved to the tolerance.
    pub unconverged_ticks: usize,
    /// Bodies that were taken out of the scene because their state was no number.
    pub quarantined: usize,
}

/// State of a body, or of a node, which neither turns nor spins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// Of the centre of mass, m.
    pub position: DVec3,
    /// Principal axes to world.
    pub rotation: DQuat,
    /// Of the centre of mass, m/s.
    pub velocity: DVec3,
    /// In world axes, rad/s.
    pub angular_velocity: DVec3,
}

/// States of all bodies at the start and after every tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    bodies: usize,
    states: Vec<BodyState>,
}

impl Trace {
    /// From states in the order of ticks and, within a tick, of bodies.
    pub fn new(bodies: usize, states: Vec<BodyState>) -> Self {
        assert!(bodies > 0 && !states.is_empty() && states.len().is_multiple_of(bodies), "whole ticks");
        Self { bodies, states }
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.bodies
    }

    /// Number of records: one more than ticks.
    pub fn records(&self) -> usize {
        self.states.len() / self.bodies
    }

    /// All bodies before the tick of that number, counted from 0.
    pub fn record(&self, number: usize) -> &[BodyState] {
        &self.states[number * self.bodies..][..self.bodies]
    }

    /// All records in the order of time.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[BodyState]> {
        self.states.chunks_exact(self.bodies)
    }

    /// The last `count` records.
    pub fn last(&self, count: usize) -> impl ExactSizeIterator<Item = &[BodyState]> {
        self.iter().skip(self.records().saturating_sub(count))
    }
}

/// States, times and troubles of a run.
pub struct Run {
    /// What happened.
    pub trace: Trace,
    /// What every tick took.
    pub times: Vec<TickTime>,
    /// What the engine says went wrong; `None` where it does not tell.
    pub trouble: Option<Trouble>,
}

/// Runs `ticks` ticks, of which only the engine's own time counts, and calls `after_tick` after each.
pub fn run(engine: &mut impl Engine, ticks: usize, mut after_tick: impl FnMut()) -> Run {
    let mut states = Vec::new();
    engine.record(&mut states);
    let bodies = states.len();
    states.reserve_exact(bodies * ticks);
    let mut times = Vec::with_capacity(ticks);
    for _ in 0..ticks {
        times.push(time(|| engine.tick()));
        engine.record(&mut states);
        after_tick();
    }
    Run { trace: Trace::new(bodies, states), times, trouble: engine.trouble() }
}

/// The quantile `q`, 0 to 1, of `values`, linear between two of them (Hyndman and Fan's type 7, NumPy's default).
pub fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let place = q * values.len().saturating_sub(1) as f64;
    let at = |place: f64| values.get(place as usize).copied().unwrap_or(f64::NAN);
    let (below, above) = (at(place.floor()), at(place.ceil()));
    below + place.fract() * (above - below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_values() {
        let mut values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(quantile(&mut values, 0.0), 1.0);
        assert_eq!(quantile(&mut values, 0.5), 2.5);
        assert!((quantile(&mut values, 0.99) - 3.97).abs() < 1e-12);
        assert_eq!(quantile(&mut values, 1.0), 4.0);
        assert!(quantile(&mut [], 0.5).is_nan());
    }
}
