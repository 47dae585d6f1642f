//! Identification from current and speed without a voltage: the mechanical equation of the motor,
//! `J dω/dt = K i − B ω − TL − Tc sgn(ω)` (Eq. 7 with load and Coulomb friction), with the measured current as its input.
//!
//! Scaling K, B, J, TL and Tc by a common factor leaves the speed unchanged, so that only their ratios are identifiable. They
//! are reported as characteristics of a normalized model with an assumed K. If one of the five is fixed, the others are
//! identifiable.

use super::method::Method;
use super::normalized::{NormalizedModel, informative, is_usual, peaks};
use super::spec::IdentifySpec;
use crate::analysis::{lag_by_speed, unused_columns};
use motorfit_core::setting::{Text, text};
use motorfit_core::{Error, Result};
use motorfit_motor::{Axis, Discretization, Extension, Parameter, With};
use motorfit_record::warning::Warning;
use motorfit_record::{Quantity, Record, is_driven_by_current};

/// Parameters that are identifiable up to a common factor.
const SCALED: [Parameter; 5] = [Parameter::K, Parameter::B, Parameter::J, Parameter::Coulomb, Parameter::Load];

/// Checks that all recordings have a voltage.
///
/// # Errors
/// Returns `Data` with the first recording that has no voltage.
pub fn needs_voltage(records: &[Record]) -> Result<()> {
    let Some(record) = records.iter().find(|record| record.driver() == Quantity::Current) else { return Ok(()) };
    let hint = text!(
        "Use " [Command::Identify] ", which takes the current as the input, or name the column: "
        [Columns = "voltage=HEADING:V"] "."
    );
    let error = Error::data("has no voltage: costs of R, L, K, B and J cannot be computed without one", hint);
    Err(record.source().path.iter().fold(error, |error, path| error.in_file(path)))
}

/// Returns the normalized model of recordings without a voltage; `None` if they have one.
///
/// # Errors
/// Returns `Usage` for a method, extensions or bounds that need a voltage.
pub(super) fn current_driven(records: &[Record], spec: &IdentifySpec) -> Result<Option<NormalizedModel>> {
    if !is_driven_by_current(records) {
        return Ok(None);
    }
    check(spec)?;
    let scaled = SCALED.into_iter().any(|p| spec.fixed(p).is_some_and(|value| value != 0.0));
    if !scaled {
        check_bounds(spec)?;
    }
    let electrical = [Parameter::R, Parameter::L];
    let (assumed, unknown) = match scaled {
        true => (electrical.to_vec(), electrical.to_vec()),
        false => ([&electrical[..], &[Parameter::K]].concat(), [&electrical[..], &SCALED].concat()),
    };
    let warning = warning(records, spec, scaled);
    NormalizedModel::new(spec, guess(records, spec), &assumed, &unknown, warning).map(Some)
}

/// Checks that the method and the extensions need no voltage.
fn check(spec: &IdentifySpec) -> Result<()> {
    if spec.method == Method::SteiglitzMcBride {
        let message = "Steiglitz–McBride needs voltage, current and speed, and the recordings have no voltage";
        let hint = text!("Use " [Method = "auto"] ", or name the column: " [Columns = "voltage=HEADING:V"] ".");
        return Err(Error::usage(message, hint));
    }
    let requested: &[Extension] = if let With::These(list) = &spec.with { list } else { &[] };
    let features = spec.space.features();
    let meant = |e: &Extension| requested.contains(e) || features.has_any(e.parameters());
    let no_sensor = features.has(Parameter::CurrentAverage).then_some(Extension::SensorAverage);
    let Some(extension) = Extension::ALL.into_iter().find(|e| meant(e) && !e.acts_on_current()).or(no_sensor) else {
        return Ok(());
    };
    if extension == Extension::SensorAverage {
        let message = "Ni averages a measured current, but the current is the input of these recordings";
        return Err(Error::usage(message, "Leave Ni out; the average of the speed sensor is Nw."));
    }
    let message = format!("{} acts on the voltage, and the recordings have none", extension.name());
    let hint = match extension {
        Extension::Offset => {
            text!("An offset of the current acts as a load: " [With = "load"] ", or subtract it with " [Offset] ".")
        }
        _ => text!("Leave it out, or name the voltage's column: " [Columns = "voltage=HEADING:V"] "."),
    };
    Err(Error::usage(message, hint))
}

/// Checks that no parameter that is identifiable only up to the common factor has explicit bounds.
fn check_bounds(spec: &IdentifySpec) -> Result<()> {
    let given = |axis: &&Axis| SCALED.contains(&axis.parameter) && !spec.auto_bounds.contains(&axis.parameter);
    let Some(axis) = spec.space.free().iter().find(given) else { return Ok(()) };
    let symbol = axis.parameter.symbol();
    let message = format!("{symbol} has bounds, but current and speed identify only ratios of K, B, J, Tc and TL");
    Err(Error::usage(message, text!("Fix K with " [Fix = "K=…"] ", or leave the bounds of {symbol} out.")))
}

/// Returns an initial estimate of R, L, K, B and J from current and speed, with the fixed parameters of the spec.
fn guess(records: &[Record], spec: &IdentifySpec) -> [f64; 5] {
    let informative = informative(records, 1);
    let lag = |record: &&Record| lag_by_speed(record).ok().filter(|lag| lag.iter().all(is_usual));
    let [gain, constant] = informative.iter().find_map(lag).unwrap_or_else(|| {
        let [amperes, speed] = peaks(records, 1);
        [speed / amperes, 0.1 * informative.first().map_or(1.0, |record| record.duration_s())]
    });
    let middle = |parameter| {
        let axis = spec.space.free().iter().find(|axis: &&Axis| axis.parameter == parameter);
        axis.map_or(1.0, Axis::middle)
    };
    let [r, l, k, b, j] = Parameter::ALL.map(|parameter| spec.fixed(parameter));
    let by_others = j.map(|j| j * gain / constant).or(b.map(|b| b * gain));
    let k = k.or(by_others).unwrap_or_else(|| middle(Parameter::K));
    let [r, l] = [r.unwrap_or_else(|| middle(Parameter::R)), l.unwrap_or_else(|| middle(Parameter::L))];
    [r, l, k, b.unwrap_or(k / gain), j.unwrap_or(k * constant / gain)]
}

fn warning(records: &[Record], spec: &IdentifySpec, scaled: bool) -> Warning {
    let between = match spec.model.discretization {
        Discretization::Foh => "with a first-order hold".into(),
        _ => text!(
            "with a zero-order hold, which delays a measured current by half a period (see "
            [Discretization = "foh"] ")"
        ),
    };
    let ratios = match scaled {
        true => Text::default(),
        false => text!(
            "only ratios are identifiable: kS, kV, kA, kG, gain and time constant; for K, B, J, Tc and TL fix one of "
            "them, as in " [Fix = "K=…"] "; "
        ),
    };
    let unused = unused_columns(records);
    let message = text!("no voltage" {unused} ": the current is the input, " {between} "; " {ratios});
    Warning::new("channel_missing", message.and("R and L do not affect the speed"))
}
