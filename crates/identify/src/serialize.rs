//! Serialization of the result of an identification, shared by documents, results of studies and the Python bindings.

use super::estimates;
use super::result::Identification;
use crate::analysis::{characteristics_document, residuals_document};
use motorfit_core::channels::Channels;
use motorfit_motor::{Input, Space};
use motorfit_record::Severity;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

impl Serialize for Identification {
    /// Serializes all keys of a result in their order, except those of the spec.
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let uncertainty = self.uncertainty.as_ref();
        // A current that is the input is not a state.
        let state = |[current, speed]: [f64; 2]| json!({"current": (self.input == Input::Voltage).then_some(current), "speed": speed});
        let warnings = |severity| self.warnings.iter().filter(move |w| w.severity == severity).collect::<Vec<_>>();
        let mut verification = json!(self.verification);
        verification["cpu_gpu_cost_difference"] = json!(self.cost_difference);
        let record = json!({
            "trust": self.trust,
            "input": self.input.name(),
            "discretization": self.model.discretization.name(),
            "left_out": self.left_out,
            "bounds": bounds(&self.space),
            "device": self.device,
            "parameters": estimates::document(&self.estimates()),
            "with": self.extensions(),
            "ladder": self.selection,
            "alternatives": self.alternatives,
            "cost": self.cost,
            "searched": self.searched,
            "fit_percent": Channels::from(self.fit_percent),
            "fit_percent_by_recording":
                self.fit_percent_by_recording.iter().map(|fit| Channels::from(*fit)).collect::<Vec<_>>(),
            "residual_sigma": Channels::from(self.residual_sigma),
            "initial_state": self.initial.iter().copied().map(state).collect::<Value>(),
            "correlation": uncertainty.map(|u| self.correlation(u)),
            "rank": uncertainty.map(|u| u.rank),
            "condition": uncertainty.map(|u| u.condition),
            "errors_widened_by": uncertainty.map(|u| u.widened_by),
            "residuals": uncertainty.map(|u| residuals_document(&self.residual_tests, u)),
            "characteristics": characteristics_document(self.into(), &self.regressions),
            "repeatability": self.noise_floor,
            "verification": verification,
            "validation": self.validation,
            "warnings": warnings(Severity::Report),
            "remarks": warnings(Severity::Mention),
            "stop": self.stop.name(),
            "evaluations": self.evaluations,
            "history": self.history,
            "seconds": self.seconds,
        });
        record.serialize(serializer)
    }
}

/// Returns the bounds of the free parameters by symbol.
fn bounds(space: &Space) -> Map<String, Value> {
    space.free().iter().map(|axis| (axis.parameter.symbol().to_owned(), json!([axis.min, axis.max]))).collect()
}
