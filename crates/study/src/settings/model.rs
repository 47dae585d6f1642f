//! Settings of an identification with a user's model.

use super::given::{Fault, Given};
use super::parse;
use super::read::{Read, device, reading};
use motorfit_core::setting::{Setting, Text, text};
use motorfit_core::{Error, Result};
use motorfit_evaluate::Initial;
use motorfit_evaluate::criterion::{Criterion, Noise};
use motorfit_evaluate::model::signal_requests;
use motorfit_identify::device::EvaluatorSpec;
use motorfit_identify::model::{ModelSpec, ModelTerms};
use motorfit_identify::{Method, Polish};
use motorfit_model::{IntegrationMethod, Model};
use motorfit_motor::Discretization;
use motorfit_record::{Mask, Offset, Reading, SignalRequest, parse_signal_columns};

/// Returns the options for reading recordings of a model.
///
/// # Errors
/// Returns a usage error if a value is invalid.
pub fn model_reading(given: &Given, model: &Model) -> Read<Reading> {
    signal_reading(given, signal_requests(model))
}

/// Returns the options for reading recordings of signals, such as those of a model.
///
/// # Errors
/// Returns a usage error if a value is invalid.
pub fn signal_reading(given: &Given, signals: Vec<SignalRequest>) -> Read<Reading> {
    let names: Vec<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
    let columns = given.read(Setting::Columns, |text| parse_signal_columns(text, &names))?.unwrap_or_default();
    let mut reading = reading(&given.without(Setting::Columns))?;
    if reading.preparation.offset != Offset::None {
        let message = text!([Offset] " names the signals of a DC motor");
        return wrong(
            Setting::Offset,
            message,
            text!("Subtract it in the columns: " [Columns = "NAME=HEADING-0.02"] "."),
        );
    }
    let is_of_all = |mask: &Mask| matches!(mask, Mask::Auto | Mask::Time { channels: [true, true], .. });
    if !reading.preparation.mask.iter().all(is_of_all) {
        let message = text!([Mask] " names the signals of a DC motor");
        return wrong(
            Setting::Mask,
            message,
            text!("Give times, which exclude all outputs, as " [Mask = "0.2:0.3"] "."),
        );
    }
    reading.options.columns = columns;
    reading.options.signals = signals;
    Ok(reading)
}

/// Returns the spec of an identification with a model.
///
/// # Errors
/// Returns a usage error if a value is invalid, or a setting has no meaning for a model.
pub fn model_spec(given: &Given) -> Read<ModelSpec> {
    let usual = ModelSpec::default();
    let name = given.text(Setting::Method).unwrap_or(Method::Auto.name());
    let polish: Polish = given.choice(Setting::Polish)?.unwrap_or_default();
    let initial: Initial = given.choice(Setting::Initial)?.unwrap_or_default();
    if initial == Initial::Zero {
        let message = text!([Initial](" is zero, but a model states its initial values"));
        return wrong(Setting::Initial, message, "Write initial = 0 for the states in the model.".into());
    }
    let discretization: Option<Discretization> = given.choice(Setting::Discretization)?;
    let integration = match discretization {
        None | Some(Discretization::Zoh | Discretization::Foh) => None,
        Some(Discretization::Rk4) => Some((IntegrationMethod::RungeKutta, 1)),
        Some(other) => {
            let message = text!([Discretization](" is {}", other.name()));
            return wrong(Setting::Discretization, message, "Choose zoh, foh or rk4 for a model.".into());
        }
    };
    let noise = given.read(Setting::Noise, parse::noise)?.unwrap_or_default();
    if matches!(noise, Noise::Sigma(_)) {
        let message = text!([Noise] " names the channels of a DC motor");
        return wrong(Setting::Noise, message, text!("Give a ratio for all outputs, as " [Noise = "40dB"] "."));
    }
    let device = device(given)?;
    if device.evaluator == EvaluatorSpec::Tables {
        let message = text!([Evaluator] " is tables, which serve the DC motor only");
        return wrong(Setting::Evaluator, message, "Leave it out for a model.".into());
    }
    Ok(ModelSpec {
        device: device.device,
        precision: device.precision,
        method: given.items(Setting::Set, |items| super::read::method(name, items))?,
        is_polished: polish != Polish::None,
        population: given.count(Setting::Population).unwrap_or(usual.population),
        generations: given.count(Setting::Generations).unwrap_or(usual.generations),
        seed: given.count(Setting::Seed).map_or(usual.seed, |seed| seed as u64),
        criterion: Criterion {
            norm: given.choice(Setting::Criterion)?.unwrap_or_default(),
            scale: given.choice(Setting::Scale)?.unwrap_or_default(),
            time_origin_s: given.number(Setting::TimeOrigin),
            noise,
        },
        bounds: given.items(Setting::Bounds, bounds)?,
        fixed: given.items(Setting::Fix, |items| values(items, Setting::Fix))?,
        starts: given.items(Setting::Start, starts)?,
        with: given.items(Setting::With, ModelTerms::parse)?,
        per_recording: given.list(Setting::PerRecording).to_vec(),
        estimates_initial: !matches!(initial, Initial::Measured | Initial::Zero),
        is_first_order_hold: discretization == Some(Discretization::Foh),
        integration,
    })
}

fn wrong<T>(setting: Setting, message: Text, hint: Text) -> Read<T> {
    Err(Fault { setting, error: Error::usage(message, hint) })
}

/// Parses `NAME=MIN:MAX` items; `auto` stands for the bounds of the model.
fn bounds(items: &[String]) -> Result<Vec<(String, [f64; 2])>> {
    let own: Vec<String> = items.iter().filter(|item| item.trim() != "auto").cloned().collect();
    let ranges = parse::named_ranges(&own, Setting::Bounds)?;
    Ok(ranges.into_iter().map(|(name, min, max)| (name, [min, max])).collect())
}

/// Parses starts, each item a list `NAME=VALUE,…`. An item that gives a name of the last start again begins another one; others add to it.
fn starts(items: &[String]) -> Result<Vec<Vec<(String, f64)>>> {
    let mut starts: Vec<Vec<(String, f64)>> = Vec::new();
    for item in items {
        let parts: Vec<String> = item.split(',').map(str::to_owned).collect();
        let own = values(&parts, Setting::Start)?;
        let is_again = |start: &Vec<(String, f64)>| start.iter().any(|(name, _)| own.iter().any(|(n, _)| n == name));
        match starts.last_mut().filter(|last| !is_again(last)) {
            Some(last) => last.extend(own),
            None => starts.push(own),
        }
    }
    Ok(starts)
}

/// Parses `NAME=VALUE` items, each name at most once.
fn values(items: &[String], of: Setting) -> Result<Vec<(String, f64)>> {
    let mut values: Vec<(String, f64)> = Vec::new();
    for item in items.iter().filter(|item| !item.trim().is_empty()) {
        let (name, value) = parse::pair(item, of, "R=0.92")?;
        if values.iter().any(|(own, _)| own == name) {
            return Err(Error::usage(text!({ of }(" gives {name} twice")), "Give each parameter once."));
        }
        values.push((name.to_owned(), parse::number(value, of)?));
    }
    Ok(values)
}
