//! Non-linear line search: how far to walk along a Newton direction.
//!
//! It looks for the zero of the directional derivative R(u + α s)·s, not for a smaller energy: energies of converged
//! states differ by less than their rounding errors.

/// Most evaluations beyond the full step. Illinois' method needs 3 or 4 at an impact.
const EVALUATIONS_MAX: usize = 10;

/// How to walk along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Walk {
    /// The walk ends where the directional derivative has shrunk to this fraction.
    shrink: f64,
    /// Farthest that it may go, in steps.
    reach: f64,
    /// Least share of what is left that a try may take.
    least: f64,
}

impl Walk {
    /// For steps whose length the model of the method knows: never beyond.
    pub const NEWTON: Self = Self { shrink: 0.5, reach: 1.0, least: 0.05 };

    /// For steps that know only their direction: their length may be wrong by orders of magnitude.
    pub const GRADIENT: Self = Self { shrink: 0.5, reach: 1e6, least: 1e-6 };

    /// For conjugate directions, which live on the last search having come close to the minimum.
    pub const CONJUGATE: Self = Self { shrink: 0.1, ..Self::GRADIENT };

    /// Whether a walk from the directional derivative `start` would end at `end`.
    pub fn ends_at(&self, start: f64, end: f64) -> bool {
        end <= self.shrink * start.abs()
    }
}

/// Finds α above 0. `slope_at` moves to u + α s and answers the directional derivative there; the last call it gets is
/// for the α that is answered. `start` is the slope at 0, negative.
pub(super) fn search(start: f64, walk: Walk, mut slope_at: impl FnMut(f64) -> f64) -> f64 {
    let limit = walk.shrink * start.abs();
    let mut low = (0.0, start);
    let mut high = (1.0, slope_at(1.0));
    let mut evaluations = 1;
    // Falling steeply still: farther, by the secant.
    while high.1 < -limit && high.0 < walk.reach && evaluations <= EVALUATIONS_MAX {
        let secant = high.0 + high.1 * (high.0 - low.0) / (low.1 - high.1);
        let farther = secant.clamp(2.0 * high.0, 10.0 * high.0).min(walk.reach);
        low = high;
        high = (farther, slope_at(farther));
        evaluations += 1;
    }
    // Falling still, or nearly flat: the model was not too bold.
    if walk.ends_at(start, high.1) {
        return high.0;
    }
    between(low, high, limit, EVALUATIONS_MAX - evaluations + 1, walk.least, slope_at)
}

/// As [`search`], where the full step is known to be too long: `full` is the slope at its end.
pub(super) fn shorten(start: f64, full: f64, walk: Walk, slope_at: impl FnMut(f64) -> f64) -> f64 {
    between((0.0, start), (1.0, full), walk.shrink * start.abs(), EVALUATIONS_MAX, walk.least, slope_at)
}

/// Illinois: false position between two α with their slopes, where the slope of an end that stays is halved. Non-finite
/// slopes bisect.
fn between(
    mut low: (f64, f64),
    mut high: (f64, f64),
    limit: f64,
    evaluations: usize,
    least: f64,
    mut slope_at: impl FnMut(f64) -> f64,
) -> f64 {
    let mut left = evaluations;
    loop {
        let weight = low.1 / (low.1 - high.1);
        let weight = if weight.is_finite() { weight.clamp(least, 0.95) } else { 0.5 };
        let alpha = low.0 + weight * (high.0 - low.0);
        let slope = slope_at(alpha);
        left = left.saturating_sub(1);
        if slope.abs() <= limit || left == 0 {
            return alpha;
        }
        if slope < 0.0 {
            low = (alpha, slope);
            high.1 /= 2.0;
        } else {
            high = (alpha, slope);
            low.1 /= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The α that a search answers, and the evaluations it took.
    fn searched(walk: Walk, slope: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut evaluations = 0;
        let alpha = search(slope(0.0), walk, |alpha| {
            evaluations += 1;
            slope(alpha)
        });
        (alpha, evaluations)
    }

    #[test]
    fn a_quadratic_takes_the_full_step_at_once() {
        assert_eq!(searched(Walk::NEWTON, |a| 2.0 * (a - 1.0)), (1.0, 1));
    }

    #[test]
    fn a_wall_stops_the_walk() {
        let slope = |a: f64| a - 1.0 + if a > 0.3 { 1e6 * (a - 0.3) } else { 0.0 };
        let (alpha, evaluations) = searched(Walk::NEWTON, slope);
        assert!((alpha - 0.3).abs() < 0.2 && slope(alpha).abs() <= 0.5 || alpha < 0.3, "{alpha}");
        assert!(evaluations <= EVALUATIONS_MAX + 1);
    }

    #[test]
    fn lengths_that_are_far_off_are_found() {
        for minimum in [1e-5, 0.01, 3.0, 2e3] {
            for walk in [Walk::GRADIENT, Walk::CONJUGATE] {
                let (alpha, evaluations) = searched(walk, |a| a - minimum);
                assert!((alpha / minimum - 1.0).abs() <= walk.shrink, "{minimum}: {alpha}");
                assert!(evaluations <= 6, "{minimum}: {evaluations}");
            }
        }
    }

    #[test]
    fn non_finite_slopes_end_the_walk() {
        for walk in [Walk::NEWTON, Walk::GRADIENT] {
            assert!(searched(walk, |a| if a == 0.0 { -1.0 } else { f64::NAN }).1 <= EVALUATIONS_MAX + 1);
            assert!(searched(walk, |a| if a == 0.0 { -1.0 } else { f64::NEG_INFINITY }).1 <= EVALUATIONS_MAX + 2);
        }
    }
}
