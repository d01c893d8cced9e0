//! What PITA asks of itself on the yardstick: acceptance at one step a tick, and a cost against the peers.

use crate::yardstick::judge::Verdict;
use crate::yardstick::scene::{Content, Family};

/// Sheep that have come to rest are slower on average in the last second, m/s.
const REST_SPEED: f64 = 0.01;

/// A scene's bar. Acceptance by the judge comes first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Our p50 has to be below this part of the cheapest accepted peer's.
    pub p50_ratio: f64,
    /// Our p99 may be up to this part of a peer's.
    pub p99_ratio: f64,
}

impl Bar {
    /// The bar of a scene.
    pub fn of(content: &Content) -> Self {
        let (p50_ratio, p99_ratio) = match content {
            Content::Rigid(Family::Chain, _) => (0.08, 1.0),
            Content::Rigid(Family::Sheep | Family::Cars | Family::Spin, _) | Content::Beam(_) => (0.5, 1.0),
            Content::Rigid(Family::Pile, _) => (0.6, 1.5),
            Content::Rigid(Family::Stack | Family::Stick | Family::Slide, _) => (1.0, 1.5),
        };
        Self { p50_ratio, p99_ratio }
    }

    /// Whether `verdict`, with these ratios to the peers, clears it. A ratio that is not known holds nothing up.
    pub fn is_met(&self, content: &Content, verdict: &Verdict, p50_ratio: Option<f64>, p99_ratio: Option<f64>) -> bool {
        verdict.accepted
            && p50_ratio.is_none_or(|ratio| ratio < self.p50_ratio)
            && p99_ratio.is_none_or(|ratio| ratio <= self.p99_ratio)
            && (!matches!(content, Content::Rigid(Family::Sheep, _))
                || verdict.value("speed_m_per_s").is_some_and(|speed| speed < REST_SPEED))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::yardstick::catalogue;
    use crate::yardstick::judge::{Figure, Unit};

    fn met(scene: &str, accepted: bool, speed: f64, p50_ratio: f64, p99_ratio: f64) -> bool {
        let content = catalogue::content(scene).unwrap();
        let speed = Figure { label: "v", key: "speed_m_per_s", value: speed, unit: Unit::MetresPerSecond };
        let verdict = Verdict { accepted, figures: vec![speed], ..Verdict::default() };
        Bar::of(&content).is_met(&content, &verdict, Some(p50_ratio), Some(p99_ratio))
    }

    #[test]
    fn acceptance_cost_and_worst_ticks_all_count() {
        assert!(met("chain", true, 1.0, 0.079, 1.0));
        assert!(!met("chain", false, 1.0, 0.079, 1.0));
        assert!(!met("chain", true, 1.0, 0.081, 1.0));
        assert!(!met("chain", true, 1.0, 0.079, 1.01));
        assert!(met("cars64", true, 15.0, 0.49, 1.0) && !met("cars64", true, 15.0, 0.51, 1.0));
        assert!(met("pile500", true, 0.0, 0.59, 1.5) && !met("pile500", true, 0.0, 0.59, 1.6));
        assert!(met("slope45", true, 0.0, 0.99, 1.5) && !met("slope45", true, 0.0, 1.01, 1.5));
    }

    #[test]
    fn sheep_have_to_rest() {
        assert!(met("sheep100", true, 0.009, 0.49, 1.0));
        assert!(!met("sheep100", true, 0.011, 0.49, 1.0));
    }
}
