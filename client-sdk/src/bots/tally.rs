//! What bots counted: of one, of all of a script, of the fleet.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use super::ScriptKind;
use crate::{
    SessionEnd,
    statistics::{Durations, Statistics, durations},
};

/// Counts of one bot, or sums over several. Cumulative; [`FleetTally::since`] gives an interval.
#[derive(Clone, Debug)]
pub struct BotTally {
    /// Bots that ever joined.
    pub connected: usize,
    /// Why those sessions ended that ended before they were stopped.
    pub lost: Vec<SessionEnd>,
    /// Path that each car drove, m.
    pub distances_m: Vec<f64>,
    /// From when an input was due to when it was sent, µs.
    pub lateness_us: Durations,
    /// Inputs that were left out because they were late by a whole tick or more.
    pub inputs_skipped: u64,
    /// How far other cars were shown from where their own speed would have taken them since they were shown last, µm.
    pub jumps_um: Durations,
    /// What the sessions counted.
    pub session: Statistics,
}

impl Default for BotTally {
    fn default() -> Self {
        Self {
            connected: 0,
            lost: Vec::new(),
            distances_m: Vec::new(),
            lateness_us: durations(),
            inputs_skipped: 0,
            jumps_um: durations(),
            session: Statistics::default(),
        }
    }
}

impl BotTally {
    /// Shortest path, m; zero without bots.
    pub fn distance_min_m(&self) -> f64 {
        self.distances_m.iter().copied().min_by(f64::total_cmp).unwrap_or(0.0)
    }

    /// Mean path, m; zero without bots.
    pub fn distance_mean_m(&self) -> f64 {
        self.distances_m.iter().sum::<f64>() / self.distances_m.len().max(1) as f64
    }

    fn add(&mut self, other: &Self) {
        self.connected += other.connected;
        self.lost.extend_from_slice(&other.lost);
        self.distances_m.extend_from_slice(&other.distances_m);
        // All histograms here have the same bounds.
        let _ = self.lateness_us.add(&other.lateness_us);
        let _ = self.jumps_um.add(&other.jumps_um);
        self.inputs_skipped += other.inputs_skipped;
        self.session.add(&other.session);
    }

    fn since(&self, earlier: &Self) -> Self {
        let mut interval = self.clone();
        interval.distances_m.iter_mut().zip(&earlier.distances_m).for_each(|(now, before)| *now -= before);
        // Fails only where `earlier` holds more than `self`, which it does not by its meaning.
        let _ = interval.lateness_us.subtract(&earlier.lateness_us);
        let _ = interval.jumps_um.subtract(&earlier.jumps_um);
        interval.inputs_skipped = self.inputs_skipped.saturating_sub(earlier.inputs_skipped);
        interval.session = self.session.since(&earlier.session);
        interval
    }
}

/// Counts of a fleet at one instant, or of an interval.
#[derive(Clone, Debug)]
pub struct FleetTally {
    /// Length of what was counted.
    pub elapsed: Duration,
    /// By script.
    pub scripts: BTreeMap<ScriptKind, BotTally>,
    taken: Instant,
}

impl FleetTally {
    pub(super) fn new(began: Instant) -> Self {
        let taken = Instant::now();
        Self { elapsed: taken.duration_since(began), scripts: BTreeMap::new(), taken }
    }

    pub(super) fn add(&mut self, script: ScriptKind, bot: &BotTally) {
        self.scripts.entry(script).or_default().add(bot);
    }

    /// Sum over the scripts.
    pub fn total(&self) -> BotTally {
        let mut total = BotTally::default();
        self.scripts.values().for_each(|tally| total.add(tally));
        total
    }

    /// What was counted since `earlier`, a tally of the same fleet. Who joined and who was lost is of the whole time.
    pub fn since(&self, earlier: &Self) -> Self {
        let nothing = BotTally::default();
        let interval = |(&script, now): (&ScriptKind, &BotTally)| {
            (script, now.since(earlier.scripts.get(&script).unwrap_or(&nothing)))
        };
        Self {
            elapsed: self.taken.duration_since(earlier.taken),
            scripts: self.scripts.iter().map(interval).collect(),
            taken: self.taken,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bot(distance_m: f64, inputs: u64) -> BotTally {
        let mut bot = BotTally { connected: 1, distances_m: vec![distance_m], ..BotTally::default() };
        bot.session.inputs_sent = inputs;
        (0..inputs).for_each(|_| bot.lateness_us.saturating_record(100));
        bot
    }

    #[test]
    fn an_interval_subtracts_bot_by_bot_and_keeps_newcomers_whole() {
        let mut earlier = FleetTally::new(Instant::now());
        earlier.add(ScriptKind::Circle, &bot(10.0, 3));
        let mut now = FleetTally::new(Instant::now());
        now.add(ScriptKind::Circle, &bot(25.0, 8));
        now.add(ScriptKind::Circle, &bot(4.0, 2));
        now.add(ScriptKind::Chase, &bot(7.0, 1));
        let interval = now.since(&earlier);
        let circle = &interval.scripts[&ScriptKind::Circle];
        assert_eq!((circle.connected, circle.distances_m.as_slice()), (2, &[15.0, 4.0][..]));
        let total = interval.total();
        assert_eq!((total.connected, total.session.inputs_sent, total.lateness_us.len()), (3, 8, 8));
        assert_eq!((total.distance_min_m(), total.distance_mean_m()), (4.0, 26.0 / 3.0));
    }

    #[test]
    fn no_bots_have_driven_nowhere() {
        assert_eq!((BotTally::default().distance_min_m(), BotTally::default().distance_mean_m()), (0.0, 0.0));
    }
}
