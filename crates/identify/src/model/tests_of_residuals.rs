//! Fits and tests of the residuals of a model on one recording.

use super::result::ModelFit;
use crate::analysis::{FitMetrics, Regressors, ResidualInputTest, ResidualTest, Residuals, residual_input_test};
use motorfit_estimate::{EFFECTIVE_RATIO_MIN, Fitted as _, Whiteness};
use motorfit_evaluate::model::{ModelProblem, ModelRecording};
use std::cell::OnceCell;

/// Simulates a candidate on a recording and tests its residuals; returns the metrics of the fit beside it.
pub(super) fn fitted(
    problem: &ModelProblem,
    values: &[f64],
    recording: usize,
    initial: &[f64],
) -> (ModelFit, FitMetrics) {
    let own = problem.recording(recording);
    let simulated = problem.simulate(values, recording, initial).outputs;
    let inputs = Inputs::new(problem, recording);
    let (mut kept, mut residuals) = (Vec::new(), Vec::new());
    for (output, (measured, simulated)) in own.measured.iter().zip(&simulated).enumerate() {
        let Some(measured) = measured else {
            kept.push(Vec::new());
            residuals.push(None);
            continue;
        };
        let all: Vec<f64> = measured.iter().zip(simulated).map(|(y, x)| y - x).collect();
        let counting: Vec<f64> = (0..own.len()).filter(|n| own.counts(output, *n)).map(|n| all[n]).collect();
        let size = problem.rms((recording, output));
        let test = || match own.is_scattered(output) {
            // At the samples of a sensor that is slower than the clock.
            true => {
                let regressors = inputs.at_samples(output, |n| own.counts(output, n));
                tested_residuals(&counting, &counting, (&regressors.iter().collect::<Vec<_>>(), &[]), size)
            }
            false => {
                let counts = own.counting.get(output).map_or(&[][..], Vec::as_slice);
                tested_residuals(&all, &counting, (&inputs.regressors(output), counts), size)
            }
        };
        residuals.push((own.effective_sample_ratio >= EFFECTIVE_RATIO_MIN).then(test).flatten());
        kept.push(counting);
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
