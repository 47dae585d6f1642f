//! Keys of the document of a result that those with a user's model have.

use super::result::{ModelFit, OwnModel};
use crate::analysis::by_output;
use crate::estimates::Combination;
use crate::machine::{Keys, Machine};
use crate::result::Identification;
use motorfit_core::Result;
use motorfit_evaluate::model::{ModelAxis, ModelMethod};
use motorfit_model::{InitialState, Model};
use motorfit_record::Record;
use serde_json::{Map, Value, json};

impl Machine for OwnModel {
    fn title(&self) -> String {
        self.model.name().to_owned()
    }

    fn free(&self) -> Vec<String> {
        self.space.names(&self.model)
    }

    fn groups(&self) -> &[String] {
        &self.combinations
    }

    fn combinations(&self) -> &[Combination] {
        &self.identified
    }

    fn bounds(&self) -> Map<String, Value> {
        let parameters = self.model.parameters();
        let entry =
            |axis: &ModelAxis| Some((parameters.get(axis.parameter)?.name.clone(), json!([axis.min, axis.max])));
        self.space.free.iter().filter_map(entry).collect()
    }

    fn modelled(found: &Identification<Self>, _: &[Record]) -> Result<Vec<Vec<Vec<f64>>>> {
        Ok(found.fits.iter().map(|fit| fit.simulated.clone()).collect())
    }

    fn equations(found: &Identification<Self>) -> Keys {
        vec![("integration", integration(&found.method))]
    }

    fn states(found: &Identification<Self>) -> Keys {
        let initial: Value = found.fits.iter().map(|fit| initial(&found.model, &fit.initial)).collect();
        let correlation = found.uncertainty.as_ref().map(|of| &of.correlation);
        vec![("initial_state", initial), ("correlation", json!(correlation))]
    }

    fn residuals(found: &Identification<Self>) -> Value {
        found.residual_tests.iter().map(|tests| by_output(&found.outputs, tests)).collect()
    }

    fn analysis(found: &Identification<Self>) -> Keys {
        vec![("unidentifiable", json!(found.combinations)), ("combinations", json!(found.identified))]
    }

    fn validation(found: &Identification<Self>) -> Value {
        if found.held_out.is_empty() {
            return Value::Null;
        }
        let fit = |fit: &ModelFit| {
            json!({
                "fit_percent": by_output(&found.outputs, &fit.fit_percent),
                "residual_sigma": by_output(&found.outputs, &fit.residual_sigma),
                "residuals": by_output(&found.outputs, &fit.residuals),
                "initial_state": initial(&found.model, &fit.initial),
            })
        };
        json!({
            "fit_percent": by_output(&found.outputs, &found.held_out_percent),
            "records": found.held_out.iter().map(fit).collect::<Vec<_>>(),
        })
    }
}

/// Returns the integration method of a model.
#[must_use]
pub fn integration(method: &ModelMethod) -> Value {
    json!({
        "method": method.method.name(),
        "substeps": method.substeps,
        "stiffness": method.stiffness.per_step,
        "text": method.described(),
    })
}

/// Returns initial values by the names of the states that are measured or free.
fn initial(model: &Model, values: &[f64]) -> Value {
    let open = model.states().iter().filter(|state| !matches!(state.initial, InitialState::Given(_)));
    Value::Object(open.zip(values).map(|(state, value)| (state.name.clone(), json!(value))).collect())
}
