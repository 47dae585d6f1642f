//! JSON documents of results with a user's model.

use crate::document::{EvaluateDocument, warnings};
use motorfit_evaluate::model::{ModelAxis, ModelSpace};
use motorfit_identify::model::ModelCosts;
use motorfit_model::{InitialState, Model};
use motorfit_record::{Record, Severity};
use serde_json::{Value, json};

/// Returns the bounds of the free parameters by their names.
fn bounds(model: &Model, space: &ModelSpace) -> Value {
    let entry =
        |axis: &ModelAxis| Some((model.parameters().get(axis.parameter)?.name.clone(), json!([axis.min, axis.max])));
    Value::Object(space.free.iter().filter_map(entry).collect())
}

/// Returns the JSON document of evaluated candidates of a model with the best of them, each a cost and the values of the free parameters.
#[must_use]
pub fn model_costs_document(
    document: &EvaluateDocument,
    records: &[Record],
    costs: &ModelCosts,
    best: &[(f64, &[f64])],
) -> Value {
    let problem = costs.problem();
    let model = problem.model();
    let entry =
        |(cost, values): &(f64, &[f64])| json!({"cost": cost, "parameters": named(model, problem.space(), values)});
    json!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "model": {"name": model.name(), "sha256": model.digest()},
        "records": records,
        "criterion": problem.criterion().norm.name(),
        "scale": problem.criterion().scale.name(),
        "bounds": bounds(model, problem.space()),
        "device": costs.device(),
        "candidates": document.candidates,
        "stop": document.stop(),
        "seconds": document.seconds,
        "best": best.iter().map(entry).collect::<Vec<_>>(),
        "warnings": warnings(costs.warnings(), Severity::Report),
    })
}

/// Returns values of the free parameters by name.
fn named(model: &Model, space: &ModelSpace, values: &[f64]) -> Value {
    Value::Object(space.names(model).into_iter().zip(values.iter().map(|value| json!(value))).collect())
}

/// Returns the JSON document of what was understood of a model.
#[must_use]
pub fn model_check_document(model: &Model) -> Value {
    let parameter = |of: &motorfit_model::ModelParameter| {
        json!({
            "name": of.name, "unit": of.unit.text, "min": of.min, "max": of.max, "log": of.is_logarithmic,
            "value": of.value, "per_recording": of.is_per_recording, "description": of.description,
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
