//! The estimates of a result: a list of parameters.

use super::dc_motor::DcMotor;
use super::result::{Identification, side};
use motorfit_core::Result;
use motorfit_estimate::fit_problem;
use motorfit_motor::{Extension, Input, Parameter, Scope};
use motorfit_record::Record;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

/// The estimate of a parameter, or its fixed value.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterEstimate {
    /// Name: the symbol, as `R`.
    pub name: String,
    /// Index of the recording that the parameter belongs to; `None` if all recordings share it.
    pub recording: Option<usize>,
    /// Description, as `resistance`; empty if a model has none.
    pub description: String,
    /// Unit.
    pub unit: String,
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
    /// Bounds of a free parameter; `None` for a fixed one.
    pub bounds: Option<[f64; 2]>,
}

impl ParameterEstimate {
    /// Makes the estimate of a parameter of the DC motor without a standard error, an interval or bounds.
    fn of_motor(parameter: Parameter, scope: Scope, value: Option<f64>) -> Self {
        Self {
            name: parameter.symbol().to_owned(),
            recording: scope.recording(),
            description: parameter.name().to_owned(),
            unit: parameter.unit().to_owned(),
            value,
            std_error: None,
            ci95: None,
            at_bound: None,
            fixed: false,
            bounds: None,
        }
    }

    /// Returns the name with the index of the recording if the parameter belongs to one, as `R[0]`.
    #[must_use]
    pub fn label(&self) -> String {
        self.recording.map_or_else(|| self.name.clone(), |n| format!("{}[{n}]", self.name))
    }

    /// Describes why the parameter has no standard error, or where it ended; empty for an estimate with one.
    #[must_use]
    pub fn remark(&self) -> &'static str {
        match (self.value, self.fixed, self.at_bound) {
            (None, ..) => "not identifiable",
            (_, true, _) => "fixed",
            (_, _, Some("max")) => "at its upper bound",
            (_, _, Some(_)) => "at its lower bound",
            _ => "",
        }
    }
}

impl Serialize for ParameterEstimate {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let own = self.recording.is_some() || self.name == Parameter::Latency.symbol();
        let entry = json!({
            "value": self.value,
            "unit": self.unit,
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
    let groups = estimates.chunk_by(|a, b| a.name == b.name);
    let of = |e: &ParameterEstimate| {
        let mut entry = json!(e);
        if let Some(n) = e.recording {
            entry["record"] = n.into();
        }
        entry
    };
    let entry = |group: &[ParameterEstimate]| {
        let first = group.first()?;
        if group.len() == 1 && first.recording.is_none_or(|n| n == 0) {
            return Some((first.name.clone(), json!(first)));
        }
        let all = ParameterEstimate { value: None, std_error: None, ci95: None, at_bound: None, ..first.clone() };
        let mut entry = json!(all);
        entry["identified"] = first.value.is_some().into();
        entry["recordings"] = group.iter().map(of).collect();
        Some((first.name.clone(), entry))
    };
    groups.filter_map(entry).collect()
}

impl Identification<DcMotor> {
    /// Returns all estimates: R, L, K, B and J, then those of extensions, each in the order of the recordings.
    pub(super) fn listed(&self) -> Vec<ParameterEstimate> {
        let uncertainty = self.uncertainty.as_ref();
        let free = self.space.free().iter().zip(&self.values).enumerate().map(|(n, (axis, value))| {
            let estimate = ParameterEstimate {
                std_error: uncertainty.and_then(|u| *u.std_error.get(n)?),
                ci95: uncertainty.and_then(|u| *u.ci95.get(n)?),
                at_bound: side([axis.min, axis.max], *value),
                bounds: Some([axis.min, axis.max]),
                ..ParameterEstimate::of_motor(axis.parameter, axis.scope, Some(*value))
            };
            ((axis.parameter, axis.scope), estimate)
        });
        let fixed = self.space.fixed().iter().map(|&(parameter, scope, value)| {
            let estimate =
                ParameterEstimate { fixed: true, ..ParameterEstimate::of_motor(parameter, scope, Some(value)) };
            ((parameter, scope), estimate)
        });
        let mut all: Vec<((Parameter, Scope), ParameterEstimate)> = free.chain(fixed).collect();
        for ((parameter, scope), unknown) in &mut all {
            if self.unidentified.contains(&(*parameter, *scope)) {
                *unknown = ParameterEstimate::of_motor(*parameter, *scope, None);
            }
        }
        all.sort_by_key(|((parameter, scope), _)| scope.order(*parameter));
        all.into_iter().map(|(_, estimate)| estimate).collect()
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
