//! Parameter estimates of the methods of a comparison, Steiglitz–McBride included.

use super::{Block, Comparison, MethodResult};
use crate::motor::{Parameter, Parameters};
use crate::numeric::{mean, sample_deviation};

/// Parameter estimates of one method.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodEstimates {
    /// Name of the method.
    pub method: &'static str,
    /// Estimate of the best run; for Steiglitz–McBride, from the first recording.
    pub best: Option<Parameters>,
    /// Estimates of all runs that did not diverge; for Steiglitz–McBride, from records with new noise.
    pub all: Vec<Parameters>,
    /// Time of a single run \[s\]; `None` if interrupted before it was measured.
    pub seconds: Option<f64>,
}

impl MethodEstimates {
    /// Returns the estimates of one parameter over all runs.
    #[must_use]
    pub fn values(&self, parameter: Parameter) -> Vec<f64> {
        self.all.iter().map(|found| found.get(parameter)).collect()
    }

    /// Returns for each parameter the relative error of the best run and the mean relative error over runs \[%\], shape
    /// `[5, 2]`; NaN without runs.
    #[must_use]
    pub fn errors(&self, expected: &Parameters) -> [[f64; 2]; 5] {
        Parameter::ALL.map(|p| {
            let error = |value: f64| 100.0 * ((value - expected.get(p)) / expected.get(p)).abs();
            let all: Vec<f64> = self.values(p).into_iter().map(error).collect();
            [self.best.map_or(f64::NAN, |best| error(best.get(p))), mean(&all)]
        })
    }

    /// Returns the sample standard deviation of each parameter over runs.
    #[must_use]
    pub fn deviations(&self) -> [f64; 5] {
        Parameter::ALL.map(|p| sample_deviation(&self.values(p)))
    }
}

impl MethodResult {
    /// Returns the parameter estimates of the runs.
    #[must_use]
    pub fn estimates(&self) -> MethodEstimates {
        MethodEstimates {
            method: self.method.name(),
            best: self.best().and_then(|run| run.parameters),
            all: self.runs.iter().filter_map(|run| run.parameters).collect(),
            seconds: self.seconds,
        }
    }
}

impl Comparison {
    /// Returns the estimates of each method of a block, Steiglitz–McBride last.
    #[must_use]
    pub fn estimates(&self, block: &Block) -> Vec<MethodEstimates> {
        let steiglitz = self.steiglitz.as_ref().map(super::Steiglitz::estimates);
        block.results.iter().map(MethodResult::estimates).chain(steiglitz).collect()
    }
}
