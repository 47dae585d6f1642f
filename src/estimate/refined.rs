//! A refined estimate, and the limits that end a refinement.

use super::uncertainty::Uncertainty;
use crate::motor::Parameters;

/// A refined estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Values of the free parameters, in the order of the space.
    pub values: Vec<f64>,
    /// The parameters of the first recording, those held included.
    pub parameters: Parameters,
    /// State `[i, ω]` at the start of each recording, estimated where it was free.
    pub initial: Vec<[f64; 2]>,
    /// σ of the residuals of current and speed over all recordings; `None` for a channel not measured.
    pub sigma: [Option<f64>; 2],
    /// The same of each recording; 1 for a channel not measured.
    pub sigmas: Vec<[f64; 2]>,
    /// σ that the residuals of each recording and channel were divided by: as `sigmas` where they are noise.
    pub weights: Vec<[f64; 2]>,
    /// Sum of squared residuals of current \[A²\] and speed \[rad²/s²\] of each recording.
    pub squares: Vec<[f64; 2]>,
    /// The bound, if any, that each free parameter stands at: `min` or `max`.
    pub at_bound: Vec<Option<&'static str>>,
    /// Standard errors, intervals and correlations.
    pub uncertainty: Uncertainty,
    /// True if the last step was far below a standard error.
    pub converged: bool,
    /// Simulations with derivatives.
    pub evaluations: usize,
}

impl Refined {
    /// The sum of squared residuals in units of `sigma`, one pair for each recording.
    #[must_use]
    pub fn weighted(&self, sigma: &[[f64; 2]]) -> f64 {
        let pairs = self.squares.iter().flatten().zip(sigma.iter().flatten());
        pairs.map(|(squares, sigma)| squares / (sigma * sigma)).sum()
    }
}

/// Simulations of one refinement at most.
pub(super) const EVALUATIONS_MAX: usize = 200;
/// A refinement ends when its step is shorter than this many standard errors.
pub(super) const STEP_MAX: f64 = 1e-6;
/// The smallest σ whose square is a number like any other.
pub(super) const SMALLEST: f64 = 1e-150;
