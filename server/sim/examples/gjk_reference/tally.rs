//! What came out, kind by kind.

use pita_sim::collide::proximity;
use serde::Serialize;

use super::pairs::{Item, Kind};
use super::reference::{Core, separation, signed_distance};

/// How far the engine's distance may be from the reference's, m.
pub const TOLERANCE: f64 = 1e-6;

/// Of one kind of pairs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Tally {
    /// What people call the kind.
    pub kind: &'static str,
    /// Pairs asked for.
    pub pairs: u64,
    /// Of which overlap.
    pub overlapping: u64,
    /// The engine found nothing.
    pub missed: u64,
    /// A number was not finite.
    pub not_finite: u64,
    /// Distances off by more than the tolerance.
    pub wrong_distances: u64,
    /// Depths off by more than the tolerance.
    pub wrong_depths: u64,
    /// Normals along which the shapes are not as far apart as the engine says.
    pub wrong_normals: u64,
    /// Pairs of which the reference is not sure to within a tenth of the tolerance; they are not judged.
    pub unsure: u64,
    /// Largest error of a distance, m.
    pub worst_distance: f64,
    /// Largest error of a depth, m.
    pub worst_depth: f64,
}

impl Tally {
    /// Of nothing yet.
    pub fn of(kind: Kind) -> Self {
        Self { kind: kind.name(), ..Self::default() }
    }

    /// How many pairs failed.
    pub fn failures(&self) -> u64 {
        self.missed + self.not_finite + self.wrong_distances + self.wrong_depths + self.wrong_normals
    }

    /// Asks the engine about a pair and judges the answer. Answers whether it passes.
    pub fn check(&mut self, [a, b]: &[Item; 2]) -> bool {
        self.pairs += 1;
        let failures = self.failures();
        let solids = [a.solid(), b.solid()];
        let truth = signed_distance(&solids[0], &solids[1]);
        if truth.uncertainty > 0.1 * TOLERANCE {
            self.unsure += 1;
            return true;
        }
        let Some(found) = proximity(a.at(), b.at(), f64::MAX) else {
            self.missed += 1;
            return false;
        };
        if !(found.gap.is_finite() && found.normal.is_finite() && found.point.is_finite()) {
            self.not_finite += 1;
            return false;
        }
        let error = found.gap - truth.gap;
        let cores_overlap = truth.gap < -(solids[0].radius + solids[1].radius);
        self.overlapping += u64::from(truth.gap < 0.0);
        if cores_overlap {
            // Of a round core the reference's depth is an upper bound.
            let round = solids.iter().any(|solid| matches!(solid.core, Core::Cylinder { .. }));
            let error = if round { (-error).max(0.0) } else { error.abs() };
            self.worst_depth = self.worst_depth.max(error);
            self.wrong_depths += u64::from(error > TOLERANCE);
        } else {
            self.worst_distance = self.worst_distance.max(error.abs());
            self.wrong_distances += u64::from(error.abs() > TOLERANCE);
        }
        let along = separation(&solids[0].core, &solids[1].core, found.normal) - solids[0].radius - solids[1].radius;
        self.wrong_normals += u64::from((along - found.gap).abs() > 10.0 * TOLERANCE);
        self.failures() == failures
    }
}
