//! The estimates of a result: a list of parameters.

use super::result::{Identification, side};
use motorfit_core::Result;
use motorfit_estimate::fit_problem;
use motorfit_motor::{Axis, Extension, Input, Parameter, Scope};
use motorfit_record::Record;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

/// The estimate of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterEstimate {
    /// Parameter that is estimated.
    pub parameter: Parameter,
    /// Scope of the parameter: shared by all recordings, or of one recording.
    pub scope: Scope,
    /// Estimate in the unit of the parameter; `None` if it is not identifiable.
    pub value: Option<f64>,
    /// Standard error in the unit of the parameter; `None` at a bound, for a fixed parameter, and without a polish.
    pub std_error: Option<f64>,
    /// 95 % confidence interval; `None` in the same cases as the standard error.
    pub ci95: Option<[f64; 2]>,
    /// Bound at which the parameter ended, `min` or `max`.
    pub at_bound: Option<&'static str>,
    /// True if the parameter was fixed.
    pub fixed: bool,
    /// Axis of a free parameter with its bounds.
    pub axis: Option<Axis>,
}

impl ParameterEstimate {
    /// Makes the estimate of a parameter without a standard error, an interval or bounds.
    #[must_use]
    pub fn new(parameter: Parameter, scope: Scope, value: Option<f64>) -> Self {
        Self { parameter, scope, value, std_error: None, ci95: None, at_bound: None, fixed: false, axis: None }
    }

    /// Returns the symbol of the parameter, with the index of the recording if it belongs to one.
    #[must_use]
    pub fn name(&self) -> String {
        self.scope.name(self.parameter)
    }

    /// Returns the sort key: by parameter, then by recording.
    pub(crate) fn order(&self) -> (usize, Option<u32>) {
        self.scope.order(self.parameter)
    }
}

impl Serialize for ParameterEstimate {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let own = matches!(self.scope, Scope::Recording(_)) || self.parameter == Parameter::Latency;
        let entry = json!({
            "value": self.value,
            "unit": self.parameter.unit(),
            "std_error": self.std_error,
            "ci95": self.ci95,
            "at_bound": self.at_bound,
            "fixed": self.fixed,
            "identified": self.value.is_some(),
            "scope": if own { "recording" } else { "shared" },
        });
        entry.serialize(serializer)
    }
}

/// Returns the key `parameters` of a result: all estimates by symbol. A parameter with one value per recording has a list, each
/// entry with the index of its recording.
pub(super) fn document(estimates: &[ParameterEstimate]) -> Map<String, Value> {
    let groups = estimates.chunk_by(|a, b| a.parameter == b.parameter);
    let of = |e: &ParameterEstimate| {
        let mut entry = json!(e);
        if let Scope::Recording(n) = e.scope {
            entry["record"] = n.into();
        }
        entry
    };
    let entry = |group: &[ParameterEstimate]| {
        let first = group.first()?;
        let symbol = first.parameter.symbol().to_owned();
        if group.len() == 1 {
            return Some((symbol, json!(first)));
        }
        let all = ParameterEstimate { value: None, std_error: None, ci95: None, at_bound: None, ..*first };
        let mut entry = json!(all);
        entry["identified"] = first.value.is_some().into();
        entry["recordings"] = group.iter().map(of).collect();
        Some((symbol, entry))
    };
    groups.filter_map(entry).collect()
}

impl Identification {
    /// Returns all estimates: R, L, K, B and J, then those of extensions, each in the order of the recordings.
    #[must_use]
    pub fn estimates(&self) -> Vec<ParameterEstimate> {
        let uncertainty = self.uncertainty.as_ref();
        let free = self.space.free().iter().zip(&self.values).enumerate().map(|(n, (axis, value))| ParameterEstimate {
            std_error: uncertainty.and_then(|u| *u.std_error.get(n)?),
            ci95: uncertainty.and_then(|u| *u.ci95.get(n)?),
            at_bound: side([axis.min, axis.max], *value),
            axis: Some(*axis),
            ..ParameterEstimate::new(axis.parameter, axis.scope, Some(*value))
        });
        let fixed = self.space.fixed().iter().map(|&(parameter, scope, value)| ParameterEstimate {
            fixed: true,
            ..ParameterEstimate::new(parameter, scope, Some(value))
        });
        let mut all: Vec<ParameterEstimate> = free.chain(fixed).collect();
        for unknown in all.iter_mut().filter(|e| self.unidentified.contains(&(e.parameter, e.scope))) {
            *unknown = ParameterEstimate::new(unknown.parameter, unknown.scope, None);
        }
        all.sort_by_key(ParameterEstimate::order);
        all
    }

    /// Returns the extensions of the identified motor.
    #[must_use]
    pub fn extensions(&self) -> Vec<Extension> {
        self.space.features().extensions()
    }

    /// Simulates current \[A\] and speed \[rad/s\] of the recordings of the fit, one value per sample. The current is NaN where
    /// it is the input.
    ///
    /// # Errors
    /// Propagates the errors of [`fit_problem`].
    pub fn modelled(&self, records: &[Record]) -> Result<Vec<[Vec<f64>; 2]>> {
        let problem = fit_problem(records, &self.space, self.model)?;
        let initial = |n: usize| self.initial.get(n).copied().unwrap_or_default();
        let mut shown: Vec<_> = (0..records.len()).map(|n| problem.simulate(&self.values, n, initial(n))).collect();
        if self.input == Input::Current {
            shown.iter_mut().for_each(|[current, _]| current.fill(f64::NAN));
        }
        Ok(shown)
    }
}
