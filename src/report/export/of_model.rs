//! Exported contents of an identification with a user's model.

use super::contents::{Exported, ExportedParameter, files};
use crate::evaluate::model::ModelRecording;
use crate::identify::model::{ModelEstimate, ModelIdentification};
use crate::model::Model;
use crate::record::Record;
use crate::text::{Shortest, significant};
use crate::units::parse_unit;

/// Returns what simulators need of an identified model. Parameters of single recordings have the values of the first.
#[must_use]
pub fn exported_model(
    records: &[Record],
    (model, recordings): (&Model, &[ModelRecording]),
    found: &ModelIdentification,
) -> Exported {
    let values = found.space.values(&found.values, 0);
    let own = |e: &&ModelEstimate| e.recording.is_none_or(|n| n == 0);
    let parameter = |e: &ModelEstimate| {
        let of = model.parameters().iter().find(|of| of.name == e.name);
        let name = of.map(|of| of.description.clone()).filter(|text| !text.is_empty());
        ExportedParameter {
            symbol: e.name.clone(),
            name: name.unwrap_or_else(|| e.name.clone()),
            value: e.value,
            unit: e.unit.clone(),
            std_error: e.std_error,
            ci95: e.ci95,
        }
    };
    let in_roles = model.parameters_in_roles();
    let outside = (0..).zip(model.parameters().iter().zip(&values)).filter(|(n, _)| !in_roles.contains(n));
    let not_held = outside.map(|(_, (of, value))| {
        let name = if of.description.is_empty() { &of.name } else { &of.description };
        format!("{name}, {} = {} {}", of.name, significant(*value, 6), of.unit.text)
    });
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
        parameters: found.estimates.iter().filter(own).map(parameter).collect(),
        not_held: not_held.collect(),
        records: files(records),
        trust: found.trust.level.name(),
        voltage: magnitudes.reduce(f64::max),
        period_s: recordings.first().map_or(1e-3, ModelRecording::longest_step_s),
        values,
    }
}

/// Returns a value with its unit.
pub(super) fn effect(name: &str, symbol: &str, value: f64, unit: &str) -> String {
    format!("{name}, {symbol} = {} {unit}", Shortest(value))
}
