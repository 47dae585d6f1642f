//! Fits and tests of the residuals of a model on one recording.

use super::result::ModelFit;
use crate::analysis::{Regressors, ResidualInputTest, ResidualTest, Residuals, residual_input_test};
use motorfit_core::numeric::{count, mean, rms, squares_about};
use motorfit_estimate::{EFFECTIVE_RATIO_MIN, Whiteness};
use motorfit_evaluate::model::{ModelProblem, ModelRecording};
use std::cell::OnceCell;

/// Simulates a candidate on a recording and tests its residuals.
pub(super) fn fitted(problem: &ModelProblem, values: &[f64], recording: usize, initial: &[f64]) -> ModelFit {
    let own = problem.recording(recording);
    let simulated = problem.simulate(values, recording, initial).outputs;
    let inputs = Inputs::new(problem, recording);
    let (mut fit_percent, mut residual_sigma, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
    for (output, (measured, simulated)) in own.measured.iter().zip(&simulated).enumerate() {
        let Some(measured) = measured else {
            fit_percent.push(None);
            residual_sigma.push(None);
            residuals.push(None);
            continue;
        };
        let all: Vec<f64> = measured.iter().zip(simulated).map(|(y, x)| y - x).collect();
        let kept: Vec<f64> = (0..own.len()).filter(|n| own.counts(output, *n)).map(|n| all[n]).collect();
        let signal: Vec<f64> = (0..own.len()).filter(|n| own.counts(output, *n)).map(|n| measured[n]).collect();
        fit_percent.push(percent(kept.iter().map(|e| e * e).sum(), squares_about(mean(&signal), &signal)));
        residual_sigma.push(Some(rms(&kept)));
        let tested = own.effective_sample_ratio >= EFFECTIVE_RATIO_MIN;
        let size = rms(&signal);
        let test = || match own.is_scattered(output) {
            // At the samples of a sensor that is slower than the clock.
            true => {
                let regressors = inputs.at_samples(output, |n| own.counts(output, n));
                tested_residuals(&kept, &kept, (&regressors.iter().collect::<Vec<_>>(), &[]), size)
            }
            false => {
                let counting = own.counting.get(output).map_or(&[][..], Vec::as_slice);
                tested_residuals(&all, &kept, (&inputs.regressors(output), counting), size)
            }
        };
        residuals.push(tested.then(test).flatten());
    }
    ModelFit { simulated, fit_percent, residual_sigma, residuals, initial: initial.to_vec(), at_start: None }
}

/// Returns the fit of each output of a candidate over all recordings \[%\], simulated from the initial states as measured; `None` for
/// an output that was not measured or does not vary. The length of the candidate must be that of the space.
#[doc(hidden)]
pub fn fit_percent(problem: &ModelProblem, candidate: &[f64]) -> Vec<Option<f64>> {
    let one = |recording: usize| fitted(problem, candidate, recording, problem.open_initial(recording));
    over_all(problem, &(0..problem.recordings()).map(one).collect::<Vec<_>>()).0
}

/// The inputs of a recording, and the regressors made from them.
struct Inputs<'a> {
    problem: &'a ModelProblem,
    recording: &'a ModelRecording,
    /// For each input those from its own sample on, and from the sample before on.
    known: Vec<[OnceCell<Regressors>; 2]>,
}

impl<'a> Inputs<'a> {
    fn new(problem: &'a ModelProblem, recording: usize) -> Self {
        let recording = problem.recording(recording);
        Self { problem, recording, known: recording.inputs.iter().map(|_| Default::default()).collect() }
    }

    /// Returns the inputs that vary, with the first lag at which each can tell of the model. An input that is held until the next sample
    /// acts on states from there on. In a closed loop it is computed from the measurements of its sample, and contains their noise: only
    /// on an output with direct feedthrough could it act as early.
    fn varying(&self, output: usize) -> impl Iterator<Item = (usize, usize)> {
        let is_held = !self.problem.settings().is_first_order_hold;
        let lag = move |n: usize| usize::from(is_held && !self.problem.model().has_feedthrough(n, output));
        (0..self.recording.inputs.len()).filter(|n| !is_constant(&self.recording.inputs[*n])).map(move |n| (n, lag(n)))
    }

    /// Returns an input that is later by a number of samples; before the first one it has its first value.
    fn later(&self, input: usize, lag: usize) -> Vec<f64> {
        let signal = &self.recording.inputs[input];
        (0..signal.len()).map(|n| signal[n.saturating_sub(lag)]).collect()
    }

    /// Returns the regressors for the residuals of an output at all samples.
    fn regressors(&self, output: usize) -> Vec<&Regressors> {
        let one = |(n, lag): (usize, usize)| self.known[n][lag].get_or_init(|| Regressors::new(&self.later(n, lag)));
        self.varying(output).map(one).collect()
    }

    /// Returns the regressors for the residuals of an output at some samples.
    fn at_samples(&self, output: usize, counts: impl Fn(usize) -> bool) -> Vec<Regressors> {
        let at =
            |signal: Vec<f64>| -> Vec<f64> { (0..).zip(signal).filter(|(n, _)| counts(*n)).map(|(_, v)| v).collect() };
        let signals = self.varying(output).map(|(n, lag)| at(self.later(n, lag)));
        signals.filter(|signal| !is_constant(signal)).map(|signal| Regressors::new(&signal)).collect()
    }
}

fn is_constant(signal: &[f64]) -> bool {
    signal.windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits())
}

fn tested_residuals(
    all: &[f64],
    kept: &[f64],
    (regressors, counting): (&[&Regressors], &[bool]),
    size: f64,
) -> Option<ResidualTest> {
    let whiteness = Whiteness::of(kept, size)?;
    let one = |regressors: &&Regressors| {
        residual_input_test(&Residuals { values: all, regressors, counting, sensitivities: &[] })
    };
    let part = |test: &ResidualInputTest| test.statistic / test.threshold;
    let worst = regressors.iter().filter_map(one).max_by(|a, b| part(a).total_cmp(&part(b)));
    Some(ResidualTest { whiteness, voltage: worst })
}

/// Returns a fit in percent; `None` for a constant signal.
fn percent(squares: f64, about_mean: f64) -> Option<f64> {
    let fit = 100.0 * (1.0 - (squares / about_mean).sqrt());
    (about_mean > 0.0 && fit.is_finite()).then_some(fit)
}

/// Returns the fit and the root mean square of the residuals of each output over recordings.
pub(super) fn over_all(problem: &ModelProblem, fits: &[ModelFit]) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
    let outputs = problem.model().outputs().len();
    let of = |output: usize| {
        let mut signal = Vec::new();
        let mut squares = 0.0;
        for (recording, fit) in fits.iter().enumerate() {
            let Some(counted) = problem.recording(recording).counted(output) else { continue };
            squares += fit.residual_sigma[output].unwrap_or(0.0).powi(2) * count(counted.len());
            signal.extend(counted);
        }
        if signal.is_empty() {
            return (None, None);
        }
        (percent(squares, squares_about(mean(&signal), &signal)), Some((squares / count(signal.len())).sqrt()))
    };
    (0..outputs).map(of).unzip()
}
