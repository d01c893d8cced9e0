//! How long a step to try first, for methods whose directions do not say.

/// The last step's length and slope.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StepLength {
    length: f64,
    slope: f64,
}

impl StepLength {
    /// The factor for a direction along which the energy's derivative is `slope`: the last one's, corrected so that the
    /// linear model promises the same decrease (Nocedal and Wright, "Numerical Optimization", 3.60). At first 1, which
    /// is right for a direction M⁻¹ R where no potential is stiff.
    pub fn next(&mut self, iteration: usize, slope: f64) -> f64 {
        let corrected = self.length * self.slope / slope;
        self.length = if iteration == 0 || !corrected.is_normal() { 1.0 } else { corrected.abs() };
        self.slope = slope;
        self.length
    }

    /// The line search took `alpha` of it.
    pub fn walked(&mut self, alpha: f64) {
        self.length *= alpha;
    }
}
