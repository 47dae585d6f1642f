//! Exported contents of an identification with a user's model.

use super::contents::{Exported, ExportedParameter, effect, files, first_estimates};
use motorfit_core::units::parse_unit;
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::ParameterEstimate;
use motorfit_identify::model::ModelIdentification;
use motorfit_record::Record;

/// Returns what simulators need of an identified model. Parameters of single recordings have the values of the first.
#[must_use]
pub fn exported_model(records: &[Record], recordings: &[ModelRecording], found: &ModelIdentification) -> Exported {
    let model = &found.model;
    let own = first_estimates(found);
    // A parameter that is not identifiable has no value: that of the optimum is one of many.
    let value = |name: &str| own.iter().find(|e| e.name == name).and_then(|e| e.value).unwrap_or(f64::NAN);
    let values: Vec<f64> = model.parameters().iter().map(|of| value(&of.name)).collect();
    let in_roles = model.parameters_in_roles();
    let place = |e: &ParameterEstimate| model.parameters().iter().position(|of| of.name == e.name);
    let outside = own.iter().filter(|e| !place(e).is_some_and(|n| in_roles.contains(&n)));
    let not_held = outside.map(|e| effect(&ExportedParameter::from(*e))).collect();
    let volt = parse_unit("V").ok().map(|unit| unit.dimension);
    let volts = model.inputs().iter().enumerate().filter(|(_, input)| Some(input.unit.unit.dimension) == volt);
    let magnitudes = volts.flat_map(|(n, input)| {
        let signals = recordings.iter().filter_map(move |recording| recording.inputs.get(n)).flatten();
        signals.map(move |value| (value * input.unit.unit.factor).abs())
    });
    let initial = found.fits.first().map(|fit| fit.initial.clone()).unwrap_or_default();
    Exported {
        title: model.name().to_owned(),
        model: model.clone(),
        initial,
        roles: model.roles(&values),
        parameters: own.iter().map(|e| (*e).into()).collect(),
        not_held,
        not_in_equations: Vec::new(),
        records: files(records),
        trust: found.trust.level.name(),
        voltage: magnitudes.reduce(f64::max),
        period_s: recordings.first().map_or(1e-3, ModelRecording::longest_step_s),
        values,
    }
}
