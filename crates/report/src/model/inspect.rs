//! Facts of the signals of a model in a recording.

use crate::inspect::facts::SignalStatistics;
use crate::spelling::command_line;
use motorfit_core::Result;
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::ParameterEstimate;
use motorfit_identify::model::{ModelIdentification, integration};
use motorfit_model::Model;
use motorfit_record::Record;
use serde::Serialize;
use serde_json::{Map, Value, json};

/// Facts about one signal of a model in a recording, in the unit of the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSignalFacts {
    /// Name in the model.
    #[serde(skip)]
    pub name: String,
    /// Unit as written in the model.
    pub unit: String,
    /// True for an input, false for an output.
    pub is_input: bool,
    /// Statistics of the signal.
    #[serde(flatten)]
    pub statistics: SignalStatistics,
}

impl ModelSignalFacts {
    /// Computes the facts of all inputs and measured outputs.
    #[must_use]
    pub fn of(model: &Model, recording: &ModelRecording) -> Vec<Self> {
        let facts = |name: &str, unit: &str, is_input: bool, signal: &[f64]| Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            is_input,
            statistics: SignalStatistics::of(signal),
        };
        let inputs = model.inputs().iter().zip(&recording.inputs);
        let outputs = model.outputs().iter().zip(&recording.measured);
        inputs
            .map(|(of, signal)| facts(&of.name, &of.unit.text, true, signal))
            .chain(outputs.filter_map(|(of, signal)| Some(facts(&of.name, &of.unit.text, false, signal.as_ref()?))))
            .collect()
    }
}

/// Returns the JSON document of an inspected recording of a model, as for the motor: its signals, the relative standard errors of the
/// parameters at their estimates, and the integration method.
#[must_use]
pub fn model_inspect_document(
    record: &Record,
    facts: &[ModelSignalFacts],
    found: &Result<ModelIdentification>,
) -> Value {
    let mut document = json!(record);
    let one = |facts: &ModelSignalFacts| (facts.name.clone(), json!(facts));
    document["signals"] = facts.iter().map(one).collect::<Map<_, _>>().into();
    document["jitter"] = record.steps().jitter.into();
    document["ignored_columns"] = record.source().ignored.clone().into();
    document["integration"] = found.as_ref().map_or(Value::Null, |found| integration(&found.method));
    document["identifiability"] = match found {
        Ok(found) => {
            let error = |e: &ParameterEstimate| {
                let relative = e.std_error.zip(e.value).map(|(error, value)| (error / value).abs());
                (e.name.clone(), json!(relative.filter(|value| value.is_finite())))
            };
            let errors: Map<String, Value> = found.estimates.iter().map(error).collect();
            let message = (!found.combinations.is_empty()).then(|| found.combinations.join("; "));
            let remedy = message.as_ref().map(|_| "Give known values with fix, or excite the machine more.");
            json!({"identifies": message.is_none(), "relative_std_error": errors, "message": message, "remedy": remedy})
        }
        Err(error) => {
            let (message, remedy) = (error.spelled(command_line), error.hint().spelled(command_line));
            json!({"identifies": false, "relative_std_error": null, "message": message, "remedy": remedy})
        }
    };
    document
}
