//! Conversion of settings to an [`IdentifySpec`] and to the options for reading and preparing files.

use super::given::{Fault, Given};
use super::parse;
use motorfit_core::named::Named as _;
use motorfit_core::setting::{Setting, text};
use motorfit_core::{Error, Result};
use motorfit_evaluate::Model;
use motorfit_evaluate::criterion::Criterion;
use motorfit_identify::device::check_threads;
use motorfit_identify::{IdentifySpec, Method};
use motorfit_motor::{Discretization, Space, With};
use motorfit_record::{
    Offset, Preparation, ReadOptions, Reading, Record, is_driven_by_current, parse_columns, parse_crop, parse_masks,
    parse_offset,
};

pub(super) type Read<T> = std::result::Result<T, Fault>;

/// Returns the options for reading and preparing files. If a discretization is given, it decides the intersample behaviour of
/// the input in resampling.
///
/// # Errors
/// Returns a usage error if a value is invalid.
pub fn reading(given: &Given) -> Read<Reading> {
    let rate_hz = given.number(Setting::Rate);
    let wrong = |setting: Setting, message: String, remedy: &str| {
        Err(Fault { setting, error: Error::usage(text!({setting} " is {message}"), remedy) })
    };
    if let Some(rate) = rate_hz.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
        return wrong(Setting::Rate, rate.to_string(), "Give a positive number of samples per second.");
    }
    let decimate = given.count(Setting::Decimate);
    if decimate == Some(0) {
        return wrong(Setting::Decimate, "0".to_owned(), "Give a whole number of at least 1.");
    }
    let discretization: Option<Discretization> = given.choice(Setting::Discretization)?;
    Ok(Reading {
        options: ReadOptions {
            columns: given.read(Setting::Columns, parse_columns)?.unwrap_or_default(),
            rate_hz,
            sheet: given.text(Setting::Sheet).map(str::to_owned),
            bad_rows: given.choice(Setting::BadRows)?.unwrap_or_default(),
            gaps: given.choice(Setting::Gaps)?.unwrap_or_default(),
            drop_repeats: given.switch(Setting::DropRepeats),
            signals: Vec::new(),
        },
        preparation: Preparation {
            crop: given.read(Setting::Crop, parse_crop)?.unwrap_or_default(),
            offset: given.read(Setting::Offset, parse_offset)?.unwrap_or(Offset::None),
            mask: given.items(Setting::Mask, parse_masks)?,
            rate_hz,
            decimate,
            filter: given.read(Setting::Filter, str::parse)?,
            sampled_input: discretization.map(Discretization::uses_next_input),
        },
    })
}

/// Returns a spec with a first-order hold if the recordings are driven by a measured current and no discretization is given: a current is
/// continuous, which a first-order hold describes better than a zero-order hold.
#[must_use]
pub fn with_intersample_of(mut spec: IdentifySpec, given: &Given, records: &[Record]) -> IdentifySpec {
    if is_driven_by_current(records) && !given.has(Setting::Discretization) {
        spec.model.discretization = Discretization::Foh;
    }
    spec
}

/// Returns a spec with the criterion, model, search space and device set; the other fields have their defaults.
///
/// # Errors
/// Returns a usage error if a value is invalid.
pub fn problem(given: &Given) -> Read<IdentifySpec> {
    let time_origin_s = given.number(Setting::TimeOrigin);
    if time_origin_s.is_some_and(|time| !time.is_finite()) {
        let error = Error::usage(text!([TimeOrigin] " is not finite"), "Give seconds from the start of the recording.");
        return Err(Fault { setting: Setting::TimeOrigin, error });
    }
    let with = given.items(Setting::With, With::parse)?;
    // With extensions all parameters of the linear motor may be fixed.
    let space = if with == With::default() { Space::table2_with } else { Space::table2_to_extend };
    let limits = given.items(Setting::Bounds, parse::bounds)?;
    let fixed = given.items(Setting::Fix, |items| parse::parameters(items, Setting::Fix))?;
    let of_space = if given.has(Setting::Bounds) { Setting::Bounds } else { Setting::Fix };
    Ok(IdentifySpec {
        criterion: Criterion {
            norm: given.choice(Setting::Criterion)?.unwrap_or_default(),
            scale: given.choice(Setting::Scale)?.unwrap_or_default(),
            time_origin_s,
            noise: given.read(Setting::Noise, parse::noise)?.unwrap_or_default(),
        },
        model: Model {
            discretization: given.choice(Setting::Discretization)?.unwrap_or_default(),
            initial: given.choice(Setting::Initial)?.unwrap_or_default(),
        },
        auto_discretization: !given.has(Setting::Discretization),
        space: space(&limits, &fixed).map_err(|error| Fault { setting: of_space, error })?,
        auto_bounds: given.items(Setting::Bounds, parse::auto_bounds)?,
        with,
        per_recording: given.items(Setting::PerRecording, |items| parse::named(items, Setting::PerRecording))?,
        ..device(given)?
    })
}

/// Returns a spec with device, precision, evaluator and threads set, without a throughput profile; the other fields have their defaults.
///
/// # Errors
/// Returns a usage error if a value is invalid.
pub fn device(given: &Given) -> Read<IdentifySpec> {
    let count = given.count(Setting::Threads);
    check_threads(count).map_err(|error| Fault { setting: Setting::Threads, error })?;
    Ok(IdentifySpec {
        device: given.read(Setting::Device, str::parse)?.unwrap_or_default(),
        precision: given.choice(Setting::Precision)?.unwrap_or_default(),
        evaluator: given.choice(Setting::Evaluator)?.unwrap_or_default(),
        threads: count,
        ..IdentifySpec::default()
    })
}

/// Returns the spec of an identification, with all settings.
///
/// # Errors
/// Returns a usage error if a value is invalid.
pub fn identify(given: &Given) -> Read<IdentifySpec> {
    let usual = IdentifySpec::default();
    let name = given.text(Setting::Method).unwrap_or(usual.method.name());
    let seed = given.count(Setting::Seed).map(|seed| seed as u64);
    Ok(IdentifySpec {
        method: given.items(Setting::Set, |items| method(name, items))?,
        polish: given.choice(Setting::Polish)?.unwrap_or_default(),
        population: given.count(Setting::Population).unwrap_or(usual.population),
        generations: given.count(Setting::Generations).unwrap_or(usual.generations),
        seed: seed.unwrap_or(usual.seed),
        ..problem(given)?
    })
}

/// Returns the method with a name and with its settings, `KEY=VALUE` or `METHOD.KEY=VALUE`, applied.
///
/// # Errors
/// Returns a usage error for an unknown method, an unknown setting or an invalid value.
pub fn method(name: &str, settings: &[String]) -> Result<Method> {
    let mut method = Method::named(Setting::Method.name(), name)?;
    for item in settings {
        let (key, value) = parse::pair(item, Setting::Set, "mutation=0.1")?;
        method.set(key.strip_prefix(&format!("{name}.")).unwrap_or(key), value)?;
    }
    Ok(method)
}
