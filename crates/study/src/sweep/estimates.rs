//! Estimates of a run by the names of parameters, as they are stored on its line: of the DC motor or of a user's model.

use motorfit_identify::{Identification, Output, ParameterEstimate};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value, json};

/// The estimate of a parameter of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunEstimate {
    /// Name of the parameter, with the index of the recording if it belongs to one, as in `T0[1]`.
    pub name: String,
    /// Estimate in the unit of the parameter; `None` if it is not identifiable.
    pub value: Option<f64>,
    /// Standard error; `None` at a bound, for a fixed parameter, and without a polish.
    pub std_error: Option<f64>,
    /// 95 % confidence interval; `None` in the same cases as the standard error.
    pub ci95: Option<[f64; 2]>,
    /// Bound at which the parameter ended, `min` or `max`.
    pub at_bound: Option<&'static str>,
}

/// The estimates of all parameters of a run.
///
/// They are serialized as four maps by name: `parameters`, `std_error` and `ci95` (both `null` without a polish), and
/// `at_bound`; and a map `derived`, which is absent without quantities that follow from the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct RunEstimates {
    /// Estimates in the order of the parameters.
    pub list: Vec<RunEstimate>,
    /// Quantities that follow from the parameters: those with limits, and those that are identified where parameters are not.
    pub derived: Vec<RunEstimate>,
    /// True if a polish was run, which computes standard errors.
    pub polished: bool,
}

impl From<&ParameterEstimate> for RunEstimate {
    fn from(e: &ParameterEstimate) -> Self {
        Self { name: e.label(), value: e.value, std_error: e.std_error, ci95: e.ci95, at_bound: e.at_bound }
    }
}

/// Quantile of the normal distribution of a 95 % interval; recordings have hundreds of samples and more.
const QUANTILE: f64 = 1.96;

impl RunEstimate {
    /// Returns the estimate of a quantity that follows from the parameters.
    pub(super) fn derived(name: &str, value: f64, std_error: Option<f64>) -> Self {
        let ci95 = std_error.map(|error| [value - QUANTILE * error, value + QUANTILE * error]);
        Self { name: name.to_owned(), value: Some(value), std_error, ci95, at_bound: None }
    }
}

impl<M> From<&Identification<M>> for RunEstimates {
    fn from(found: &Identification<M>) -> Self {
        let list = found.estimates.iter().map(Into::into).collect();
        Self { list, derived: Vec::new(), polished: found.uncertainty.is_some() }
    }
}

impl RunEstimates {
    /// Returns all estimates: those of parameters, then those of quantities that follow from them.
    pub fn all(&self) -> impl Iterator<Item = &RunEstimate> {
        self.list.iter().chain(&self.derived)
    }
}

/// Serialized estimates: maps by name, all `None` without a result. Bounds, and which parameters were fixed, are not included.
#[derive(Default, Serialize, Deserialize)]
struct Maps {
    parameters: Option<Map<String, Value>>,
    std_error: Option<Map<String, Value>>,
    ci95: Option<Map<String, Value>>,
    at_bound: Option<Map<String, Value>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    derived: Option<Map<String, Value>>,
}

impl From<&RunEstimates> for Maps {
    fn from(estimates: &RunEstimates) -> Self {
        let map =
            |of: fn(&RunEstimate) -> Value| Some(estimates.list.iter().map(|e| (e.name.clone(), of(e))).collect());
        let derived =
            |e: &RunEstimate| (e.name.clone(), json!({"value": e.value, "std_error": e.std_error, "ci95": e.ci95}));
        Self {
            derived: (!estimates.derived.is_empty()).then(|| estimates.derived.iter().map(derived).collect()),
            parameters: map(|e| e.value.into()),
            std_error: map(|e| e.std_error.into()).filter(|_| estimates.polished),
            ci95: map(|e| json!(e.ci95)).filter(|_| estimates.polished),
            at_bound: map(|e| e.at_bound.into()),
        }
    }
}

impl Serialize for RunEstimates {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        Maps::from(self).serialize(serializer)
    }
}

/// Serializes estimates, with each map as `null` if there are none.
pub(super) fn some_or_nulls<S: Serializer>(
    estimates: &Option<RunEstimates>,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    estimates.as_ref().map(Maps::from).unwrap_or_default().serialize(serializer)
}

impl<'de> Deserialize<'de> for RunEstimates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let Maps { parameters, std_error, ci95, at_bound, derived } = Maps::deserialize(deserializer)?;
        let ends = |value: &Value| Some([value.get(0)?.as_f64()?, value.get(1)?.as_f64()?]);
        let quantity = |(name, of): (&String, &Value)| RunEstimate {
            name: name.clone(),
            value: of["value"].as_f64(),
            std_error: of["std_error"].as_f64(),
            ci95: ends(&of["ci95"]),
            at_bound: None,
        };
        let derived = derived.iter().flatten().map(quantity).collect();
        let entry = |(name, value): (&String, &Value)| {
            let of = |map: &'_ Option<Map<String, Value>>| map.as_ref().and_then(|map| map.get(name)).cloned();
            RunEstimate {
                name: name.clone(),
                value: value.as_f64(),
                std_error: of(&std_error).and_then(|error| error.as_f64()),
                ci95: of(&ci95).as_ref().and_then(ends),
                at_bound: of(&at_bound).and_then(|side| ["min", "max"].into_iter().find(|known| side == *known)),
            }
        };
        let parameters = parameters.ok_or_else(|| D::Error::custom("the parameters are missing"))?;
        Ok(Self { list: parameters.iter().map(entry).collect(), derived, polished: std_error.is_some() })
    }
}

/// Fits of the outputs of a run \[%\], by name: `current` and `speed` of the DC motor, or the outputs of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OutputFits(pub Vec<(String, Option<f64>)>);

impl OutputFits {
    /// Returns the fits of outputs.
    pub(super) fn new(outputs: &[Output], fits: &[Option<f64>]) -> Self {
        Self(outputs.iter().zip(fits).map(|(output, fit)| (output.name.clone(), *fit)).collect())
    }

    /// Returns the fit of an output; `None` if it was not measured or there is no such output.
    #[must_use]
    pub fn of(&self, output: &str) -> Option<f64> {
        self.0.iter().find(|(name, _)| name == output).and_then(|(_, fit)| *fit)
    }
}

impl Serialize for OutputFits {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, fit)| (name, fit)))
    }
}

impl<'de> Deserialize<'de> for OutputFits {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let fits = Map::deserialize(deserializer)?;
        Ok(Self(fits.into_iter().map(|(name, fit)| (name, fit.as_f64())).collect()))
    }
}
