//! Identification from recordings that lack the current or the speed.
//!
//! Speed alone identifies three combinations of R, L, K, B and J. The normalized model has R = 1 Ω and negligible friction; its
//! kV, kA, gain and time constant are those of the motor. Current alone identifies four combinations. The normalized model has
//! an assumed K; its R and L are those of the motor. Recordings without a voltage are treated in `current_driven.rs`.

use super::normalized::{NormalizedModel, informative, is_measured, is_usual, peaks};
use super::spec::IdentifySpec;
use crate::analysis::{guess_by_load, guess_by_speed, load_varies, unused_columns};
use motorfit_core::numeric::peak;
use motorfit_core::setting::{Text, text};
use motorfit_core::{Error, Result};
use motorfit_motor::{Axis, Parameter};
use motorfit_record::warning::Warning;
use motorfit_record::{Record, driver, is_driven_by_current};

/// Viscous friction of the normalized model of speed alone, relative to K²/R.
const FRICTION: f64 = 1e-6;
/// Parameters that speed alone does not identify.
const BY_SPEED: [Parameter; 7] = {
    let [r, l, k, b, j] = Parameter::ALL;
    [r, l, k, b, j, Parameter::Coulomb, Parameter::Load]
};
/// Parameters that current alone does not identify.
const BY_CURRENT: [Parameter; 3] = [Parameter::K, Parameter::B, Parameter::J];

/// Returns the normalized model of recordings with a voltage and one output; `None` if both outputs were measured, enough
/// parameters are fixed, or there is no refinement.
pub(super) fn single_channel(records: &[Record], spec: &IdentifySpec) -> Result<Option<NormalizedModel>> {
    if !spec.is_polished() {
        return Ok(None);
    }
    let is_fixed = |parameter| spec.fixed(parameter).is_some();
    let free = Parameter::ALL.into_iter().filter(|p| !is_fixed(*p)).count();
    let by_speed = !is_measured(records, 0) && !is_loaded(records) && free > 3 && !is_fixed(Parameter::K);
    let by_current = !is_measured(records, 1) && !BY_CURRENT.into_iter().any(is_fixed);
    let Some((what, remedy)) = missing_channel(records, spec).filter(|_| by_speed || by_current) else {
        return Ok(None);
    };
    check_informative(records, usize::from(by_speed))?;
    let warning =
        |identified: &str| Warning::new("channel_missing", text!({what} "; {identified}; for the others " {remedy}));
    let model = if by_speed {
        let warning = warning("gain, time constants, kV and kA are identifiable");
        NormalizedModel::new(spec, of_speed(records, spec), &[Parameter::R, Parameter::B], &BY_SPEED, warning)
    } else {
        let warning = warning("R and L are identifiable");
        NormalizedModel::new(spec, of_current(records, spec), &[Parameter::K], &BY_CURRENT, warning)
    };
    model.map(Some)
}

/// Returns true if a recorded load torque varies. It gives speed alone the scale of torques that the current would give.
fn is_loaded(records: &[Record]) -> bool {
    records.iter().any(load_varies)
}

/// Returns an initial estimate of R, L, K, B and J from the only measured channel; `None` if there is not exactly one.
pub(super) fn guess(records: &[Record], spec: &IdentifySpec) -> Option<[f64; 5]> {
    match [0, 1].map(|channel| is_measured(records, channel)) {
        [false, true] => Some(of_load(records).unwrap_or_else(|| of_speed(records, spec))),
        [true, false] => Some(of_current(records, spec)),
        _ => None,
    }
}

/// Returns an initial estimate of R, L, K, B and J from the speed.
fn of_speed(records: &[Record], spec: &IdentifySpec) -> [f64; 5] {
    let informative = informative(records, 1);
    let guess = |record: &&Record| guess_by_speed(record).ok().filter(|guess| guess.iter().all(is_usual));
    let [l, k, j] = informative.iter().find_map(guess).unwrap_or_else(|| {
        let [volts, speed] = peaks(records, 1);
        let (k, seconds) = (volts / speed, informative.first().map_or(1.0, |record| record.duration_s()));
        [0.001 * seconds, k, 0.03 * seconds * k * k]
    });
    let r = spec.fixed(Parameter::R).unwrap_or(1.0);
    [r, spec.fixed(Parameter::L).unwrap_or(r * l), k, spec.fixed(Parameter::B).unwrap_or(FRICTION * k * k / r), j / r]
}

/// Returns an initial estimate of R, L, K, B and J from the speed under a recorded load torque; `None` without one.
fn of_load(records: &[Record]) -> Option<[f64; 5]> {
    let mut loaded = records.iter().filter(|record| load_varies(record));
    loaded.find_map(|record| guess_by_load(record).filter(|motor| motor.iter().all(is_usual)))
}

/// Returns an initial estimate of R, L, K, B and J from the current: the resistance from the peak current, the time constants
/// from the period and the duration of the recording.
fn of_current(records: &[Record], spec: &IdentifySpec) -> [f64; 5] {
    let record = informative(records, 0).into_iter().next();
    let [volts, current] = peaks(records, 0);
    let (seconds, period) = (record.map_or(1.0, Record::duration_s), record.map_or(0.001, Record::period_s));
    let r = spec.fixed(Parameter::R).unwrap_or(0.8 * volts / current);
    let middle = || spec.space.free().iter().find(|a| a.parameter == Parameter::K).map(Axis::middle);
    let k = spec.fixed(Parameter::K).or_else(middle).unwrap_or(0.05);
    let l = spec.fixed(Parameter::L).unwrap_or(r * (period * seconds).sqrt().min(5.0 * period));
    [r, l, k, 0.05 * k * k / r, 0.03 * seconds * k * k / r]
}

/// Checks that at least one recording has an input and a response to it.
fn check_informative(records: &[Record], channel: usize) -> Result<()> {
    let is_loaded = |record: &Record| record.samples().torque.as_deref().is_some_and(|torque| peak(torque) > 0.0);
    if !informative(records, channel).is_empty() || records.iter().any(is_loaded) {
        return Ok(());
    }
    let (input, output) = (driver(records), ["current", "speed"][channel]);
    let zero = |signal: &[f64]| peak(signal) <= 0.0;
    let what = match records.iter().all(|record| zero(record.input())) {
        true => format!("the {input} is zero throughout, so that the actual input is unknown"),
        false if records.iter().all(|record| record.measured()[channel].is_none_or(zero)) => {
            format!("the {output} is zero throughout")
        }
        false => format!("the {output} is zero wherever the {input} is not"),
    };
    let error = Error::not_identified(
        what,
        format!("Record while the {input} changes and the motor moves; check the columns."),
    );
    let path = if let [record] = records { record.source().path.as_deref() } else { None };
    Err(path.into_iter().fold(error, Error::in_file))
}

/// Describes which parameters speed alone or current alone does not identify, and the remedy; `None` if no channel is missing.
pub(super) fn missing_channel(records: &[Record], spec: &IdentifySpec) -> Option<(Text, Text)> {
    if is_driven_by_current(records) {
        return None;
    }
    let free: Vec<&Axis> = spec.space.free().iter().filter(|axis| !axis.parameter.is_extension()).collect();
    let is_free = |parameter| free.iter().any(|axis| axis.parameter == parameter);
    let unused = unused_columns(records);
    if !is_measured(records, 0) && !is_loaded(records) && free.len() > 3 {
        let count = free.len();
        Some((
            text!("no current" {unused} ": speed alone identifies three combinations of the {count} free parameters"),
            text!("record the current, or fix two with " [Fix] ", R and K for example"),
        ))
    } else if !is_measured(records, 1) && BY_CURRENT.into_iter().all(is_free) {
        Some((
            text!(
                "no speed" {unused} ": current alone determines K, B and J only up to a factor c: c·K, c²·B and c²·J fit "
                "equally well"
            ),
            text!("record the speed or fix K with "[Fix]),
        ))
    } else {
        None
    }
}
