//! The estimates of a result: a list of parameters.

use motorfit_motor::{Parameter, Scope};
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
    pub(super) fn of_motor(parameter: Parameter, scope: Scope, value: Option<f64>) -> Self {
        let named = Self::named(parameter.symbol(), parameter.unit());
        Self { recording: scope.recording(), description: parameter.name().to_owned(), value, ..named }
    }

    /// Makes an estimate without a value, of all recordings.
    #[must_use]
    pub fn named(name: &str, unit: &str) -> Self {
        Self {
            name: name.to_owned(),
            recording: None,
            description: String::new(),
            unit: unit.to_owned(),
            value: None,
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

/// A combination of parameters that recordings identify, while they do not identify each of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Combination {
    /// Expression of the parameters, as `J/K`.
    pub name: String,
    /// Value in the units of the parameters.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Standard error.
    pub std_error: f64,
    /// 95 % confidence interval.
    pub ci95: [f64; 2],
}

/// Returns the bound at which a value is, `min` or `max`: within 1e-4 of the range and 1 % of the bound.
pub fn side([min, max]: [f64; 2], value: f64) -> Option<&'static str> {
    let near = 1e-4 * (max - min);
    // A bound of zero has no relative tolerance.
    let by_size = |bound: f64| if bound == 0.0 { near } else { near.min(0.01 * bound.abs()) };
    if value - min <= by_size(min) {
        Some("min")
    } else if max - value <= by_size(max) {
        Some("max")
    } else {
        None
    }
}
