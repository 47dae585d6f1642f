//! Fits and tests of the residuals of a model on one recording.

use super::result::ModelFit;
use crate::analysis::{FitMetrics, OutputResiduals, ResidualInputs};
use motorfit_estimate::{EFFECTIVE_RATIO_MIN, Fitted as _};
use motorfit_evaluate::model::ModelProblem;

/// Simulates a candidate on a recording and tests its residuals; returns the metrics of the fit beside it.
pub(super) fn fitted(
    problem: &ModelProblem,
    values: &[f64],
    recording: usize,
    initial: &[f64],
) -> (ModelFit, FitMetrics) {
    let own = problem.recording(recording);
    let simulated = problem.simulate(values, recording, initial).outputs;
    let inputs = ResidualInputs::new(own.inputs.iter().map(Vec::as_slice).collect());
    let is_held = !problem.settings().is_first_order_hold;
    let (mut kept, mut residuals) = (Vec::new(), Vec::new());
    for (output, (measured, simulated)) in own.measured.iter().zip(&simulated).enumerate() {
        let Some(measured) = measured else {
            kept.push(Vec::new());
            residuals.push(None);
            continue;
        };
        let all: Vec<f64> = measured.iter().zip(simulated).map(|(y, x)| y - x).collect();
        let counting: Vec<usize> = (0..own.len()).filter(|n| own.counts(output, *n)).collect();
        kept.push(counting.iter().map(|n| all[*n]).collect());
        let is_scattered = own.is_scattered(output);
        let of = OutputResiduals {
            values: &all,
            counting: own.counting.get(output).filter(|_| !is_scattered).map_or(&[], Vec::as_slice),
            own: is_scattered.then_some(counting),
            sensitivities: Vec::new(),
            rms: problem.rms((recording, output)),
        };
        let test = || inputs.test(&of, |input| is_held && !problem.model().has_feedthrough(input, output));
        residuals.push((own.effective_sample_ratio >= EFFECTIVE_RATIO_MIN).then(test).flatten());
    }
    let metrics = FitMetrics::of_residuals(problem, recording, &kept);
    let (fit_percent, residual_sigma) = (metrics.fit_percent(), metrics.residual_sigma());
    let initial = initial.to_vec();
    (ModelFit { simulated, fit_percent, residual_sigma, residuals, initial, at_start: None }, metrics)
}

/// Returns the fit of each output of a candidate over all recordings \[%\], simulated from the initial states as measured; `None` for
/// an output that was not measured or does not vary. The length of the candidate must be that of the space.
#[doc(hidden)]
pub fn fit_percent(problem: &ModelProblem, candidate: &[f64]) -> Vec<Option<f64>> {
    FitMetrics::of(problem, candidate).fit_percent()
}
