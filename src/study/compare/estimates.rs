//! The motors that the methods of a comparison found, Steiglitz–McBride among them.

use super::{Block, Comparison, MethodResult};
use crate::motor::{Parameter, Parameters};
use crate::numeric::{mean, sample_deviation};

/// The motors that a method found.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodEstimates {
    /// The name of the method.
    pub method: &'static str,
    /// The motor of its best run; of Steiglitz–McBride that of the first recording.
    pub best: Option<Parameters>,
    /// Those of all runs that found one; of Steiglitz–McBride those of records with new noise.
    pub all: Vec<Parameters>,
    /// Seconds of one run alone; `None` when interrupted before.
    pub seconds: Option<f64>,
}

impl MethodEstimates {
    /// Returns the values of a parameter by all runs.
    #[must_use]
    pub fn values(&self, parameter: Parameter) -> Vec<f64> {
        self.all.iter().map(|found| found.get(parameter)).collect()
    }

    /// Returns relative errors of the best run's parameters and their means over runs, in percent; NaN without runs.
    #[must_use]
    pub fn errors(&self, expected: &Parameters) -> [[f64; 2]; 5] {
        Parameter::ALL.map(|p| {
            let error = |value: f64| 100.0 * ((value - expected.get(p)) / expected.get(p)).abs();
            let all: Vec<f64> = self.values(p).into_iter().map(error).collect();
            [self.best.map_or(f64::NAN, |best| error(best.get(p))), mean(&all)]
        })
    }

    /// Returns standard deviations of the parameters over runs.
    #[must_use]
    pub fn deviations(&self) -> [f64; 5] {
        Parameter::ALL.map(|p| sample_deviation(&self.values(p)))
    }
}

impl MethodResult {
    /// Returns the motors that its runs found.
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
    /// Returns what each method of a block found, Steiglitz–McBride last.
    #[must_use]
    pub fn estimates(&self, block: &Block) -> Vec<MethodEstimates> {
        let steiglitz = self.steiglitz.as_ref().map(super::Steiglitz::estimates);
        block.results.iter().map(MethodResult::estimates).chain(steiglitz).collect()
    }
}
