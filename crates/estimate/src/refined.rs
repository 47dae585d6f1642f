//! The result of a refinement, and the limits that end one.

use super::uncertainty::Uncertainty;
use motorfit_motor::Parameters;

/// A refined estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Values of the free parameters, in the order of the space.
    pub values: Vec<f64>,
    /// Parameters of the first recording, fixed ones included.
    pub parameters: Parameters,
    /// State `[i, ω]` at the start of each recording, estimated where it was free.
    pub initial: Vec<[f64; 2]>,
    /// σ of the residuals of current and speed over all recordings; `None` for a channel that was not measured.
    pub sigma: [Option<f64>; 2],
    /// σ of the residuals of current and speed of each recording; 1 for a channel that was not measured.
    pub sigmas: Vec<[f64; 2]>,
    /// σ that the residuals of each recording and channel were divided by; equal to `sigmas` where the residuals are noise.
    pub weights: Vec<[f64; 2]>,
    /// Sum of squared residuals of current \[A²\] and speed \[rad²/s²\] of each recording.
    pub squares: Vec<[f64; 2]>,
    /// Bound, if any, at which each free parameter ended: `min` or `max`.
    pub at_bound: Vec<Option<&'static str>>,
    /// Standard errors, confidence intervals and correlations.
    pub uncertainty: Uncertainty,
    /// True if the last step was far below a standard error.
    pub converged: bool,
    /// Number of simulations with derivatives.
    pub evaluations: usize,
}

impl Refined {
    /// Returns the sum of squared residuals in units of `sigma`², one pair for each recording.
    #[must_use]
    pub fn weighted(&self, sigma: &[[f64; 2]]) -> f64 {
        let pairs = self.squares.iter().flatten().zip(sigma.iter().flatten());
        pairs.map(|(squares, sigma)| squares / (sigma * sigma)).sum()
    }
}

/// Largest number of simulations of one refinement.
pub(super) const EVALUATIONS_MAX: usize = 200;
/// Length of a step, in standard errors, below which a refinement ends.
pub(super) const STEP_MAX: f64 = 1e-6;
/// Smallest σ whose square does not underflow.
pub(super) const SMALLEST: f64 = 1e-150;
