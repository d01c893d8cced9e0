//! Non-linear line search: how far to walk along a Newton direction.
//!
//! It looks for the zero of the directional derivative R(u + α s)·s, not for a smaller energy: energies of converged
//! states differ by less than their rounding errors.

/// The walk ends where the directional derivative has shrunk to this fraction.
const SHRINK: f64 = 0.5;

/// Most evaluations beyond the full step. Illinois' method needs 3 or 4 at an impact.
const EVALUATIONS_MAX: usize = 10;

/// Finds α in (0, 1]. `slope_at` moves to u + α s and answers the directional derivative there; the last call it gets is
/// for the α that is answered, along with the number of calls. `start` is the slope at 0, negative.
pub(super) fn search(start: f64, mut slope_at: impl FnMut(f64) -> f64) -> (f64, usize) {
    let limit = SHRINK * start.abs();
    let mut high = (1.0, slope_at(1.0));
    // Falling still, or nearly flat: the model was not too bold.
    if high.1 <= limit {
        return (1.0, 1);
    }
    let mut low = (0.0, start);
    let mut evaluations = 1;
    loop {
        // Illinois: false position, with the slope of an end that stays halved. Non-finite slopes bisect.
        let weight = low.1 / (low.1 - high.1);
        let weight = if weight.is_finite() { weight.clamp(0.05, 0.95) } else { 0.5 };
        let alpha = low.0 + weight * (high.0 - low.0);
        let slope = slope_at(alpha);
        evaluations += 1;
        if slope.abs() <= limit || evaluations > EVALUATIONS_MAX {
            return (alpha, evaluations);
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

    #[test]
    fn a_quadratic_takes_the_full_step_at_once() {
        assert_eq!(search(-2.0, |a| 2.0 * (a - 1.0)), (1.0, 1));
    }

    #[test]
    fn a_wall_stops_the_walk() {
        let slope = |a: f64| a - 1.0 + if a > 0.3 { 1e6 * (a - 0.3) } else { 0.0 };
        let (alpha, evaluations) = search(slope(0.0), slope);
        assert!((alpha - 0.3).abs() < 0.2 && slope(alpha).abs() <= 0.5 || alpha < 0.3, "{alpha}");
        assert!(evaluations <= EVALUATIONS_MAX + 1);
    }

    #[test]
    fn non_finite_slopes_end_the_walk() {
        assert!(search(-1.0, |_| f64::NAN).1 <= EVALUATIONS_MAX + 1);
    }
}
