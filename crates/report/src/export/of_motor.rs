//! Exported contents of an identification of the DC motor.

use super::contents::{Exported, ExportedParameter, effect, files, first_estimates};
use motorfit_core::Result;
use motorfit_identify::{Identification, ParameterEstimate};
use motorfit_model::{BuiltIn, Model, ModelParameter, Role};
use motorfit_motor::Parameter;
use motorfit_record::Record;

/// Largest voltage of a drive without a known saturation \[V\].
const UNLIMITED: f64 = 1e9;

/// Returns what simulators need of an identified DC motor. Parameters of single recordings have the values of the first.
///
/// # Errors
/// Propagates the errors of [`BuiltIn::model`], of which a built-in model has none.
pub fn exported_motor(records: &[Record], found: &Identification) -> Result<Exported> {
    let own = first_estimates(found);
    let is_linear = own.iter().all(|e| Parameter::ALL.iter().any(|p| p.symbol() == e.name));
    let model = if is_linear { BuiltIn::DcMotor } else { BuiltIn::DcExtended }.model()?;
    // A parameter that is not identifiable has no value, as if it were fixed; one that the motor does not have has no effect.
    let value = |p: &ModelParameter| {
        let found = own.iter().find(|e| e.name == p.name);
        found.map_or_else(|| usual(p), |e| e.value.unwrap_or(f64::NAN))
    };
    let values: Vec<f64> = model.parameters().iter().map(value).collect();
    let roles = roles(&model, &values);
    let in_roles = model.parameters_in_roles();
    let place = |e: &ParameterEstimate| model.parameters().iter().position(|p| p.name == e.name);
    let effects = |is_held: &dyn Fn(usize) -> bool| -> Vec<String> {
        let others = own.iter().filter(|e| !place(e).is_some_and(is_held));
        others.map(|e| effect(&ExportedParameter::from(*e))).collect()
    };
    let (not_held, not_in_equations) = (effects(&|n| in_roles.contains(&n)), effects(&|_| true));
    let voltages = records.iter().flat_map(|record| &record.samples().voltage).map(|voltage| voltage.abs());
    let initial = found.initial.first().copied().unwrap_or_default().to_vec();
    Ok(Exported {
        title: "DC motor".to_owned(),
        initial,
        roles,
        parameters: own.iter().map(|e| (*e).into()).collect(),
        not_held,
        not_in_equations,
        records: files(records),
        trust: found.trust.level.name(),
        voltage: voltages.reduce(f64::max),
        period_s: records.first().map_or(1e-3, Record::period_s),
        model,
        values,
    })
}

/// Returns the value of a parameter that the motor does not have.
fn usual(parameter: &ModelParameter) -> f64 {
    if parameter.name == Parameter::Saturation.symbol() { UNLIMITED } else { parameter.value.unwrap_or(f64::NAN) }
}

/// Returns the roles, without a limit of the voltage that is not known.
fn roles(model: &Model, values: &[f64]) -> Vec<(Role, f64)> {
    let is_known = |(role, value): &(Role, f64)| *role != Role::Voltage || *value < UNLIMITED;
    model.roles(values).into_iter().filter(is_known).collect()
}
