//! Recordings of a model that are inspected: facts of their signals, and what each identifies by itself.

use crate::inspect::facts::SignalStatistics;
use crate::spelling::command_line;
use motorfit_core::Result;
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::ParameterEstimate;
use motorfit_identify::model::{ModelIdentification, ModelProgress, ModelSpec, identify_model, integration};
use motorfit_model::Model;
use motorfit_record::Record;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::ops::ControlFlow;

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

/// A recording of a model that was inspected.
#[derive(Debug)]
pub struct ModelInspection<'a> {
    /// The recording as it was imported.
    pub record: &'a Record,
    /// The signals in the units of the model.
    pub recording: ModelRecording,
    /// Facts of the signals.
    pub facts: Vec<ModelSignalFacts>,
    /// The identification from this recording alone, or the reason why there is none.
    pub found: Result<ModelIdentification>,
}

impl<'a> ModelInspection<'a> {
    /// Inspects a recording; `observe` may end the identification.
    ///
    /// # Errors
    /// Propagates the errors of [`ModelRecording::new`].
    pub fn of(
        model: &Model,
        record: &'a Record,
        observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
    ) -> Result<Self> {
        let recording = ModelRecording::new(model, record)?;
        let facts = ModelSignalFacts::of(model, &recording);
        let found = identify_model(model, std::slice::from_ref(&recording), &ModelSpec::default(), observe);
        Ok(Self { record, recording, facts, found })
    }
}

/// Returns the JSON document of inspected recordings of a model, as for the motor: of each its signals, the relative standard errors of
/// the parameters at their estimates, and the integration method.
#[must_use]
pub fn model_inspect_document(model: &Model, inspections: &[ModelInspection<'_>]) -> Value {
    let records: Vec<Value> = inspections.iter().map(record_document).collect();
    let model = json!({"name": model.name(), "sha256": model.digest()});
    json!({"motorfit": env!("CARGO_PKG_VERSION"), "model": model, "records": records})
}

fn record_document(ModelInspection { record, facts, found, .. }: &ModelInspection<'_>) -> Value {
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
