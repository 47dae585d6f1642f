//! JSON document of what was understood of a user's model.

use motorfit_model::{InitialState, Model};
use serde_json::{Value, json};

/// Returns the JSON document of what was understood of a model.
#[must_use]
pub fn model_check_document(model: &Model) -> Value {
    let parameter = |of: &motorfit_model::ModelParameter| {
        json!({
            "name": of.name, "unit": of.unit.text, "min": of.min, "max": of.max, "log": of.is_logarithmic,
            "value": of.value, "neutral": of.neutral, "per_recording": of.is_per_recording, "description": of.description,
        })
    };
    let state = |of: &motorfit_model::ModelState| {
        let initial = match of.initial {
            InitialState::Given(_) => "given",
            InitialState::Measured(_) => "measured",
            InitialState::Free => "free",
        };
        json!({"name": of.name, "unit": of.unit.text, "initial": initial})
    };
    json!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "name": model.name(),
        "sha256": model.digest(),
        "inputs": model.inputs().iter().map(|of| json!({
            "name": of.name, "unit": of.unit.text, "column": of.column, "default": of.default,
        })).collect::<Vec<_>>(),
        "parameters": model.parameters().iter().map(parameter).collect::<Vec<_>>(),
        "terms": model.terms().iter().map(|of| json!({
            "name": of.name, "parameters": of.parameters.iter().map(|n| &model.parameters()[*n].name).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "states": model.states().iter().map(state).collect::<Vec<_>>(),
        "outputs": model.outputs().iter().map(|of| json!({
            "name": of.name, "unit": of.unit.text, "column": of.column,
        })).collect::<Vec<_>>(),
        "affine": model.is_affine(),
        "reactions": model.reactions(),
        "operations": model.operations(),
        "equations": model.equations().iter().map(|of| json!({
            "section": of.section, "name": of.name, "text": of.text,
        })).collect::<Vec<_>>(),
    })
}
