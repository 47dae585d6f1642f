//! Serialization of the result of an identification, shared by documents, results of studies and the Python bindings.

use super::dc_motor::DcMotor;
use super::estimates::{self, Combination};
use super::forward_selection::{Alternative, SelectionStep};
use super::machine::{Keys, Machine};
use super::result::Identification;
use crate::analysis::{Output, by_output, characteristics_document, residuals_document};
use motorfit_core::Result;
use motorfit_motor::{Input, Space};
use motorfit_record::{Record, Severity};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

impl<M: Machine> Serialize for Identification<M> {
    /// Serializes all keys of a result in their order, except those of the spec.
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let uncertainty = self.uncertainty.as_ref();
        let warnings = |severity| self.warnings.iter().filter(move |w| w.severity == severity).collect::<Vec<_>>();
        let mut verification = json!(self.verification);
        verification["cpu_gpu_cost_difference"] = json!(self.cost_difference);
        let by_recording: Value =
            self.fit_percent_by_recording.iter().map(|fit| by_output(&self.outputs, fit)).collect();
        let mut keys: Keys = vec![("trust", json!(self.trust))];
        keys.extend(M::equations(self));
        keys.extend([
            ("left_out", json!(self.left_out)),
            ("bounds", self.machine.bounds().into()),
            ("device", json!(self.device)),
            ("parameters", estimates::document(&self.estimates).into()),
        ]);
        keys.extend([
            ("with", json!(self.with)),
            ("ladder", json!(self.selection.as_ref().map(|steps| ladder(&self.outputs, steps)))),
            ("alternatives", alternatives(&self.outputs, &self.alternatives)),
            ("cost", json!(self.cost)),
            ("searched", json!(self.searched)),
            ("fit_percent", by_output(&self.outputs, &self.fit_percent)),
            ("fit_percent_by_recording", by_recording),
            ("residual_sigma", by_output(&self.outputs, &self.residual_sigma)),
        ]);
        keys.extend(M::states(self));
        keys.extend([
            ("rank", json!(uncertainty.map(|u| u.rank))),
            ("condition", json!(uncertainty.map(|u| u.condition))),
            ("errors_widened_by", json!(uncertainty.map(|u| u.widened_by))),
            ("residuals", M::residuals(self)),
        ]);
        keys.extend(M::analysis(self));
        keys.extend([
            ("verification", verification),
            ("validation", M::validation(self)),
            ("warnings", json!(warnings(Severity::Report))),
            ("remarks", json!(warnings(Severity::Mention))),
            ("stop", self.stop.name().into()),
            ("evaluations", self.evaluations.into()),
            ("history", json!(self.history)),
            ("seconds", json!(self.seconds)),
        ]);
        serializer.collect_map(keys)
    }
}

impl Machine for DcMotor {
    fn title(&self) -> String {
        "Motor".to_owned()
    }

    fn free(&self) -> Vec<String> {
        self.space.free().iter().map(|axis| axis.scope.name(axis.parameter)).collect()
    }

    fn combinations(&self) -> &[Combination] {
        &self.identified
    }

    fn missing_channel(found: &Identification<Self>) -> Option<String> {
        let [by_current, by_speed] = [0, 1].map(|channel| found.residual_sigma[channel].is_some());
        match found.input {
            Input::Current => Some("a voltage".to_owned()),
            Input::Voltage if !by_current => Some("a current".to_owned()),
            Input::Voltage if !by_speed => Some("a speed".to_owned()),
            Input::Voltage => None,
        }
    }

    fn bounds(&self) -> Map<String, Value> {
        bounds(&self.space)
    }

    fn modelled(found: &Identification<Self>, records: &[Record]) -> Result<Vec<Vec<Vec<f64>>>> {
        Ok(found.modelled(records)?.into_iter().map(|signals| signals.to_vec()).collect())
    }

    fn equations(found: &Identification<Self>) -> Keys {
        vec![("input", found.input.name().into()), ("discretization", json!(found.model.discretization.name()))]
    }

    fn states(found: &Identification<Self>) -> Keys {
        // A current that is the input is not a state.
        let state = |[current, speed]: [f64; 2]| json!({"current": (found.input == Input::Voltage).then_some(current), "speed": speed});
        let correlation = found.uncertainty.as_ref().map(|u| found.correlation(u));
        vec![("initial_state", found.initial.iter().copied().map(state).collect()), ("correlation", json!(correlation))]
    }

    fn residuals(found: &Identification<Self>) -> Value {
        let uncertainty = found.uncertainty.as_ref();
        uncertainty.map_or(Value::Null, |u| residuals_document(&found.outputs, &found.residual_tests, u))
    }

    fn analysis(found: &Identification<Self>) -> Keys {
        vec![
            ("characteristics", characteristics_document(found.into(), &found.regressions)),
            ("repeatability", json!(found.noise_floor)),
        ]
    }

    fn validation(found: &Identification<Self>) -> Value {
        json!(found.validation)
    }
}

/// Returns the bounds of the free parameters by symbol.
fn bounds(space: &Space) -> Map<String, Value> {
    space.free().iter().map(|axis| (axis.parameter.symbol().to_owned(), json!([axis.min, axis.max]))).collect()
}

/// Returns the models that a selection fitted.
fn ladder(outputs: &[Output], steps: &[SelectionStep]) -> Value {
    let one = |step: &SelectionStep| {
        json!({
            "with": step.with, "free": step.free, "fit_percent": by_output(outputs, &step.fit_percent),
            "criterion_gain": step.gain, "taken": step.taken,
        })
    };
    steps.iter().map(one).collect()
}

/// Returns the models that cannot be distinguished from the selected one.
fn alternatives(outputs: &[Output], all: &[Alternative]) -> Value {
    let one = |of: &Alternative| {
        json!({
            "with": of.with, "fit_percent": by_output(outputs, &of.fit_percent), "criterion_gain": of.gain,
            "parameters": of.parameters.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<Map<_, _>>(),
        })
    };
    all.iter().map(one).collect()
}
