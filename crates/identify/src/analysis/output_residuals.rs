//! Residual tests of an output of any machine: whiteness, and independence of the inputs.

use super::residual_input_test::{Regressors, ResidualInputTest, Residuals, residual_input_test};
use motorfit_estimate::Whiteness;
use std::cell::OnceCell;

/// Smallest percentage of the variance of residuals explained by the input that matters \[%\].
pub(crate) const EXPLAINED_MIN: f64 = 1.0;

/// The tests of the residuals of one channel of a recording.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ResidualTest {
    /// Autocorrelation test.
    #[serde(flatten)]
    pub whiteness: Whiteness,
    /// Cross-correlation test with the input; `None` if the test is not possible or inconclusive.
    pub voltage: Option<ResidualInputTest>,
}

/// The residual tests of each output of one recording.
pub type ResidualTests = Vec<Option<ResidualTest>>;

/// The residuals of an output of a recording, at all its samples.
pub(crate) struct OutputResiduals<'a> {
    /// Measured minus simulated values; arbitrary at samples that do not count.
    pub values: &'a [f64],
    /// Mask of the samples; empty if all count.
    pub counting: &'a [bool],
    /// The samples of a sensor that is slower than the clock.
    pub own: Option<Vec<usize>>,
    /// Sensitivities of the output to the errors of the parameters, one signal for each independent error.
    pub sensitivities: Vec<Vec<f64>>,
    /// Root mean square of the measured signal.
    pub rms: f64,
}

/// The inputs of a recording, and the regressors made from them.
pub(crate) struct ResidualInputs<'a> {
    /// Inputs that vary, with their numbers.
    signals: Vec<(usize, &'a [f64])>,
    /// For each of them the regressors from its own sample on, and from the sample before on.
    known: Vec<[OnceCell<Regressors>; 2]>,
}

impl<'a> ResidualInputs<'a> {
    pub fn new(inputs: Vec<&'a [f64]>) -> Self {
        let is_constant = |signal: &[f64]| signal.windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits());
        let signals: Vec<_> = inputs.into_iter().enumerate().filter(|(_, signal)| !is_constant(signal)).collect();
        Self { known: signals.iter().map(|_| Default::default()).collect(), signals }
    }

    /// Tests the residuals of an output; `None` for too few samples. Of several inputs the one with the largest ratio of statistic to
    /// threshold counts.
    ///
    /// `is_later` is true for an input that can act on the output from the next sample on only, such as one that is held until there and
    /// acts on states. In a closed loop it is computed from the measurements of its own sample, and contains their noise, which would be
    /// taken for a missing effect.
    pub fn test(&self, of: &OutputResiduals<'_>, is_later: impl Fn(usize) -> bool) -> Option<ResidualTest> {
        let counts = |n: usize| of.counting.get(n).copied().unwrap_or(true);
        let own = |values: &[f64]| -> Vec<f64> {
            of.own.as_ref().map_or_else(|| values.to_vec(), |own| own.iter().map(|n| values[*n]).collect())
        };
        let counting: Vec<bool> = match (of.counting, &of.own) {
            ([], _) => Vec::new(),
            (all, None) => all.to_vec(),
            (_, Some(own)) => own.iter().map(|n| counts(*n)).collect(),
        };
        let values = own(of.values);
        let kept =
            (0..).zip(&values).filter(|(n, _)| counting.get(*n).copied().unwrap_or(true)).map(|(_, value)| *value);
        // If there are too few samples for the whiteness test, the input test is not possible either.
        let whiteness = Whiteness::of(&kept.collect::<Vec<f64>>(), of.rms)?;
        let sensitivities: Vec<Vec<f64>> = of.sensitivities.iter().map(|signal| own(signal)).collect();
        let one = |(place, (number, signal)): (usize, &(usize, &[f64]))| {
            let lag = usize::from(is_later(*number));
            // Before the first sample the signal has its first value.
            let later = || (0..signal.len()).map(|n| signal[n.saturating_sub(lag)]).collect::<Vec<f64>>();
            let at_own = of.own.as_ref().map(|_| Regressors::new(&own(&later())));
            let regressors = match &at_own {
                Some(regressors) => regressors,
                None => self.known[place][lag].get_or_init(|| Regressors::new(&later())),
            };
            let residuals =
                Residuals { values: &values, regressors, counting: &counting, sensitivities: &sensitivities };
            residual_input_test(&residuals)
        };
        let tests = self.signals.iter().enumerate().filter_map(one);
        Some(ResidualTest { whiteness, voltage: tests.max_by(|a, b| part(a).total_cmp(&part(b))) })
    }
}

/// Returns the ratio of the statistic of a test to its threshold.
pub(super) fn part(test: &ResidualInputTest) -> f64 {
    test.statistic / test.threshold
}
