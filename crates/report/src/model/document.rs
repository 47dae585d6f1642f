//! JSON documents of results with a user's model.

use crate::document::{EvaluateDocument, warnings};
use crate::spelling::command_line;
use motorfit_evaluate::model::{ModelAxis, ModelMethod, ModelSpace};
use motorfit_identify::model::{
    ModelAlternative, ModelCosts, ModelEstimate, ModelFit, ModelIdentification, ModelSpec, ModelStep,
};
use motorfit_model::{InitialState, Model};
use motorfit_record::{Record, Severity};
use serde_json::{Map, Value, json};

/// Returns values by the names of the outputs of a model.
fn by_output<T: serde::Serialize>(model: &Model, values: &[T]) -> Value {
    let entries = model.outputs().iter().zip(values).map(|(output, value)| (output.name.clone(), json!(value)));
    Value::Object(entries.collect())
}

/// Returns the integration method of a model.
pub(crate) fn integration(method: &ModelMethod) -> Value {
    json!({
        "method": method.method.name(),
        "substeps": method.substeps,
        "stiffness": method.stiffness.per_step,
        "text": method.described(),
    })
}

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

/// Returns the JSON document of an identification with a model.
#[must_use]
pub fn model_document(records: &[Record], model: &Model, spec: &ModelSpec, found: &ModelIdentification) -> Value {
    let bounds = bounds(model, &found.space);
    let searched = named(model, &found.space, &found.searched.values);
    let uncertainty = found.uncertainty.as_ref();
    let fit = |fit: &ModelFit| {
        json!({
            "fit_percent": by_output(model, &fit.fit_percent),
            "residual_sigma": by_output(model, &fit.residual_sigma),
            "residuals": by_output(model, &fit.residuals),
            "initial_state": initial(model, &fit.initial),
        })
    };
    json!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "trust": trust(found),
        "model": {"name": model.name(), "sha256": model.digest()},
        "records": records,
        "method": motorfit_core::named::Named::name(&spec.method),
        "polish": if spec.is_polished { "lm" } else { "none" },
        "seed": spec.seed,
        "population": spec.population,
        "generations": spec.generations,
        "criterion": spec.criterion.norm.name(),
        "scale": spec.criterion.scale.name(),
        "discretization": if spec.is_first_order_hold { "foh" } else { "zoh" },
        "integration": integration(&found.method),
        "bounds": bounds,
        "device": found.device,
        "parameters": parameters(&found.estimates),
        "with": found.with,
        "ladder": found.selection.as_ref().map(|of| ladder(model, &of.steps)),
        "alternatives": found.selection.as_ref().map_or_else(Vec::new, |of| alternatives(model, &of.alternatives)),
        "cost": found.cost,
        "searched": {"method": found.searched.method, "parameters": searched, "cost": found.searched.cost},
        "fit_percent": by_output(model, &found.fit_percent),
        "fit_percent_by_recording": found.fits.iter().map(|fit| by_output(model, &fit.fit_percent)).collect::<Vec<_>>(),
        "residual_sigma": by_output(model, &found.residual_sigma),
        "initial_state": found.fits.iter().map(|fit| initial(model, &fit.initial)).collect::<Vec<_>>(),
        "correlation": uncertainty.map(|of| &of.correlation),
        "condition": uncertainty.map(|of| of.condition).filter(|value| value.is_finite()),
        "errors_widened_by": uncertainty.map(|of| of.widened_by),
        "unidentifiable": found.combinations,
        "combinations": found.identified,
        "residuals": found.fits.iter().map(|fit| by_output(model, &fit.residuals)).collect::<Vec<_>>(),
        "verification": {
            "status": found.verification.status,
            "starts": found.verification.starts,
            "arrivals": found.verification.arrivals,
            "cost_gap": found.verification.cost_gap,
        },
        "validation": (!found.held_out.is_empty()).then(|| json!({
            "fit_percent": by_output(model, &found.held_out_percent),
            "records": found.held_out.iter().map(fit).collect::<Vec<_>>(),
        })),
        "warnings": warnings(&found.warnings, Severity::Report),
        "remarks": warnings(&found.warnings, Severity::Mention),
        "stop": found.stop.name(),
        "evaluations": found.evaluations,
        "history": found.history,
        "seconds": found.seconds,
    })
}

/// Returns the models that a selection fitted.
fn ladder(model: &Model, steps: &[ModelStep]) -> Vec<Value> {
    let one = |step: &ModelStep| {
        json!({
            "with": step.with, "free": step.free, "fit_percent": by_output(model, &step.fit_percent),
            "criterion_gain": step.gain, "taken": step.taken,
        })
    };
    steps.iter().map(one).collect()
}

/// Returns the models that cannot be distinguished from the selected one.
fn alternatives(model: &Model, all: &[ModelAlternative]) -> Vec<Value> {
    let one = |of: &ModelAlternative| {
        json!({
            "with": of.with, "fit_percent": by_output(model, &of.fit_percent), "criterion_gain": of.gain,
            "parameters": of.parameters.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<Map<_, _>>(),
        })
    };
    all.iter().map(one).collect()
}

fn trust(found: &ModelIdentification) -> Value {
    let reasons = found.trust.reasons.iter();
    let reasons: Vec<Value> =
        reasons.map(|reason| json!({"code": reason.code, "message": reason.message.spelled(command_line)})).collect();
    let next = found.trust.next.as_ref().map(|next| next.spelled(command_line));
    json!({"level": found.trust.level.name(), "reasons": reasons, "next": next})
}

/// Returns the parameters by name; one of single recordings has a list.
fn parameters(estimates: &[ModelEstimate]) -> Map<String, Value> {
    let mut parameters: Map<String, Value> = Map::new();
    for estimate in estimates {
        match estimate.recording {
            None => {
                parameters.insert(estimate.name.clone(), json!(estimate));
            }
            Some(_) => {
                let entry = parameters
                    .entry(estimate.name.clone())
                    .or_insert_with(|| json!({"unit": estimate.unit, "recordings": []}));
                if let Some(list) = entry["recordings"].as_array_mut() {
                    list.push(json!(estimate));
                }
            }
        }
    }
    parameters
}

/// Returns values of the free parameters by name.
fn named(model: &Model, space: &ModelSpace, values: &[f64]) -> Value {
    Value::Object(space.names(model).into_iter().zip(values.iter().map(|value| json!(value))).collect())
}

/// Returns initial values by the names of the states that are measured or free.
fn initial(model: &Model, values: &[f64]) -> Value {
    let open = model.states().iter().filter(|state| !matches!(state.initial, InitialState::Given(_)));
    Value::Object(open.zip(values).map(|(state, value)| (state.name.clone(), json!(value))).collect())
}

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
