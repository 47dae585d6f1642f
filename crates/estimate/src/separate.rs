//! Fits of single recordings of a joint fit, each from the joint optimum, and what they gain.

use super::descent::Descent;
use super::fit::Fit;
use super::fitted::Fitted;
use super::part::Part;
use super::refined::Refined;
use super::weights::first_sigma;
use motorfit_core::numeric::count;
use rayon::prelude::*;

/// The fit of one recording alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Separate {
    /// The free parameters of the joint fit that act on the recording.
    pub axes: Vec<usize>,
    /// Estimate of these; its only recording is this one.
    pub refined: Refined,
    /// Twice the log-likelihood ratio of the separate fit to the joint one.
    pub gain: f64,
    /// Variance inflation by the correlation of the residuals.
    pub inflation: f64,
}

/// Returns the fit of each recording of a joint fit alone, from the joint optimum; `None` if one fails.
#[must_use]
pub fn separate_fits(problem: &dyn Fitted, shared: &Refined) -> Option<Vec<Separate>> {
    let all = || (0..problem.recordings()).into_par_iter().map(|n| alone(problem, shared, n)).collect();
    if shared.suits(problem) { all() } else { None }
}

fn alone(problem: &dyn Fitted, shared: &Refined, recording: usize) -> Option<Separate> {
    let axes: Vec<usize> = (0..shared.values.len()).filter(|axis| problem.acts(*axis, recording)).collect();
    let only = Part { problem, recording: Some(recording), axes: &axes, values: &shared.values };
    let fit = Fit::new(&only);
    let start: Vec<f64> = axes.iter().map(|axis| shared.values[*axis]).collect();
    let (search, converged) = Descent::new(&fit, &fit.start(&start), &first_sigma(&fit))?.weighed();
    let refined = search.finish(converged, true);
    let inflation = refined.uncertainty.variance_inflation();
    let sums = |squares: &[f64]| {
        squares.iter().zip(&refined.sigmas[0]).map(|(squares, sigma)| squares / (sigma * sigma)).sum::<f64>()
    };
    let gain = (sums(&shared.squares[recording]) - sums(&refined.squares[0])).max(0.0) / inflation;
    // With an estimated σ twice the log-likelihood ratio is `N ln(1 + g/N)`, which is less than the decrease g.
    let effective = (count(fit.count()) / inflation).max(1.0);
    Some(Separate { axes, gain: effective * (gain / effective).ln_1p(), refined, inflation })
}
