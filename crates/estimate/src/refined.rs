//! The result of a refinement, and the limits that end one.

use super::fitted::{Fitted, Sigma, state};
use super::uncertainty::Uncertainty;

/// A refined estimate: the maximum-likelihood estimate where the residuals are noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Values of the free parameters, in the order of the space.
    pub values: Vec<f64>,
    /// Initial states of each recording, estimated where they are unknown.
    pub initial: Vec<Vec<f64>>,
    /// σ of the residuals of each output over all recordings; `None` for one that was not measured.
    pub sigma: Vec<Option<f64>>,
    /// σ of the residuals of each recording and output; 1 for one that was not measured.
    pub sigmas: Sigma,
    /// σ that the residuals were divided by.
    pub weights: Sigma,
    /// Sum of squared residuals of each recording and output.
    pub squares: Sigma,
    /// Bound that each free parameter ended at.
    pub at_bound: Vec<Option<&'static str>>,
    /// Standard errors, confidence intervals and correlations.
    pub uncertainty: Uncertainty,
    /// True if the last step was far below a standard error.
    pub converged: bool,
    /// Number of simulations with derivatives.
    pub evaluations: usize,
}

impl Refined {
    /// Returns true if all lists have the lengths of a problem.
    pub(super) fn suits(&self, problem: &dyn Fitted) -> bool {
        let (axes, recordings, outputs) = (problem.axes().len(), problem.recordings(), problem.outputs());
        let of = &self.uncertainty;
        let lists = [self.values.len(), self.at_bound.len(), of.std_error.len(), of.ci95.len(), of.correlation.len()];
        let is_table = |table: &Sigma| table.len() == recordings && table.iter().all(|row| row.len() == outputs);
        let starts = self.initial.iter().enumerate().all(|(n, own)| own.len() == problem.initial(n).len());
        lists.into_iter().chain(of.correlation.iter().map(Vec::len)).all(|length| length == axes)
            && [&self.sigmas, &self.weights, &self.squares].into_iter().all(is_table)
            && self.initial.len() == recordings
            && starts
    }

    /// Returns the state `[i, ω]` of the DC motor at the start of a recording \[A, rad/s\]; zero for one that is not in the fit.
    #[must_use]
    pub fn state(&self, recording: usize) -> [f64; 2] {
        self.initial.get(recording).map_or([0.0; 2], |initial| state(initial))
    }

    /// Returns the sum of squared residuals in units of `sigma`², a value for each recording and output.
    #[must_use]
    pub fn weighted(&self, sigma: &[Vec<f64>]) -> f64 {
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
