//! Parameter estimates of the methods of a comparison, Steiglitz–McBride included.

use super::parameter::ComparedParameter;
use super::result::{Block, Comparison, MethodResult};
use super::steiglitz::Steiglitz;
use motorfit_core::numeric::{mean, sample_deviation};
use motorfit_motor::Parameters;

/// Parameter estimates of one method.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodEstimates {
    /// Name of the method.
    pub method: &'static str,
    /// Values of the parameters of the best run, in the order of [`Comparison::parameters`]; for Steiglitz–McBride, from the
    /// first recording.
    pub best: Option<Vec<f64>>,
    /// Values of the parameters of all runs that did not diverge, in the same order; for Steiglitz–McBride, from records with
    /// new noise.
    pub all: Vec<Vec<f64>>,
    /// Time of a single run \[s\]; `None` if interrupted before it was measured.
    pub seconds: Option<f64>,
}

impl MethodEstimates {
    /// Returns the estimates of the parameter of an index over all runs; NaN where a run has no such value.
    #[must_use]
    pub fn values(&self, parameter: usize) -> Vec<f64> {
        self.all.iter().map(|found| found.get(parameter).copied().unwrap_or(f64::NAN)).collect()
    }

    /// Returns for each parameter the relative error of the best run and the mean relative error over runs \[%\], shape
    /// `[parameters, 2]`; NaN without runs.
    #[must_use]
    pub fn errors(&self, expected: &[f64]) -> Vec<[f64; 2]> {
        let of = |(n, expected): (usize, &f64)| {
            let error = |value: f64| 100.0 * ((value - expected) / expected).abs();
            let all: Vec<f64> = self.values(n).into_iter().map(error).collect();
            let best = self.best.as_ref().and_then(|best| best.get(n));
            [best.map_or(f64::NAN, |best| error(*best)), mean(&all)]
        };
        expected.iter().enumerate().map(of).collect()
    }

    /// Returns the sample standard deviation over runs of each of the parameters of a comparison; NaN without runs.
    #[must_use]
    pub fn deviations(&self, parameters: &[ComparedParameter]) -> Vec<f64> {
        (0..parameters.len()).map(|n| sample_deviation(&self.values(n))).collect()
    }
}

impl MethodResult {
    /// Returns the parameter estimates of the runs.
    #[must_use]
    pub fn estimates(&self) -> MethodEstimates {
        MethodEstimates {
            method: self.method.name(),
            best: self.best().and_then(|run| run.parameters.clone()),
            all: self.runs.iter().filter_map(|run| run.parameters.clone()).collect(),
            seconds: self.seconds,
        }
    }
}

impl Comparison {
    /// Returns the estimates of each method of a block, Steiglitz–McBride last.
    #[must_use]
    pub fn estimates(&self, block: &Block) -> Vec<MethodEstimates> {
        let steiglitz = self.steiglitz.as_ref().map(super::steiglitz::Steiglitz::estimates);
        block.results.iter().map(MethodResult::estimates).chain(steiglitz).collect()
    }
}

impl Steiglitz {
    /// Returns the estimate, with those from records with new noise in place of runs.
    #[must_use]
    pub fn estimates(&self) -> MethodEstimates {
        let values = |motor: &Parameters| motor.to_array().to_vec();
        let (best, all) = (self.estimate.as_ref().ok().map(values), self.spread.iter().map(values).collect());
        MethodEstimates { method: "sm", best, all, seconds: Some(self.seconds) }
    }
}
