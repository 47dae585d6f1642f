//! Identification from recordings that lack a channel. Speed alone determines three combinations of R, L, K, B and J: the motor
//! with
//! R = 1 Ω and next to no friction that does the same under the same voltage stands for all of them, and gives kV and kA,
//! gain and time constant. Current alone shows four: a motor with some K stands for all of them, and its R and L are
//! right. What there is without a voltage has a file of its own, `current_driven.rs`.

use super::normalized::{NormalizedModel, informative, is_measured, is_usual, peaks};
use super::spec::IdentifySpec;
use crate::analysis::{guess_by_load, guess_by_speed, load_varies, unused_columns};
use crate::motor::{Axis, Parameter};
use crate::numeric::peak;
use crate::record::{Record, driver, is_driven_by_current};
use crate::setting::{Text, text};
use crate::warning::Warning;
use crate::{Error, Result};

/// Friction of the motor that stands for others by their speed, in parts of K²/R.
const FRICTION: f64 = 1e-6;
/// Parameters that speed alone does not identify.
const BY_SPEED: [Parameter; 7] = {
    let [r, l, k, b, j] = Parameter::ALL;
    [r, l, k, b, j, Parameter::Coulomb, Parameter::Load]
};
/// The parameters that current alone leaves open.
const BY_CURRENT: [Parameter; 3] = [Parameter::K, Parameter::B, Parameter::J];

/// Returns the normalized model of recordings with a voltage and one output; `None` where both outputs were measured,
/// enough is fixed, or nothing is refined.
pub(super) fn single_channel(records: &[Record], spec: &IdentifySpec) -> Result<Option<NormalizedModel>> {
    if !spec.is_polished() {
        return Ok(None);
    }
    let held = |parameter| spec.fixed(parameter).is_some();
    let free = Parameter::ALL.into_iter().filter(|p| !held(*p)).count();
    let by_speed = !is_measured(records, 0) && !is_loaded(records) && free > 3 && !held(Parameter::K);
    let by_current = !is_measured(records, 1) && !BY_CURRENT.into_iter().any(held);
    let Some((what, remedy)) = missing_channel(records, spec).filter(|_| by_speed || by_current) else {
        return Ok(None);
    };
    check_informative(records, usize::from(by_speed))?;
    let warning = |told: &str| Warning::new("channel_missing", text!({what} "; {told}; for the others " {remedy}));
    let model = if by_speed {
        // Torques go with the resistance.
        let warning = warning("gain, time constants, kV and kA are told");
        NormalizedModel::new(spec, of_speed(records, spec), &[Parameter::R, Parameter::B], &BY_SPEED, warning)
    } else {
        let warning = warning("R and L are told");
        NormalizedModel::new(spec, of_current(records, spec), &[Parameter::K], &BY_CURRENT, warning)
    };
    model.map(Some)
}

/// Returns whether a load torque that was recorded moves the motor: it gives speed alone the scale of torques, and with it what
/// the current would.
fn is_loaded(records: &[Record]) -> bool {
    records.iter().any(load_varies)
}

/// A motor that about does what one channel shows, where there is only one.
pub(super) fn guess(records: &[Record], spec: &IdentifySpec) -> Option<[f64; 5]> {
    match [0, 1].map(|channel| is_measured(records, channel)) {
        [false, true] => Some(of_load(records).unwrap_or_else(|| of_speed(records, spec))),
        [true, false] => Some(of_current(records, spec)),
        _ => None,
    }
}

/// A motor that about does what the speed shows.
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

/// A motor that about does what the speed shows under a load torque that was recorded; `None` without one.
fn of_load(records: &[Record]) -> Option<[f64; 5]> {
    let mut loaded = records.iter().filter(|record| load_varies(record));
    loaded.find_map(|record| guess_by_load(record).filter(|motor| motor.iter().all(is_usual)))
}

/// A motor that about does what the current shows: the resistance by the largest current, time constants that the
/// recording can show.
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

/// Checks that some recording has an input and an answer to it.
fn check_informative(records: &[Record], channel: usize) -> Result<()> {
    let is_loaded = |record: &Record| record.samples().torque.as_deref().is_some_and(|torque| peak(torque) > 0.0);
    if !informative(records, channel).is_empty() || records.iter().any(is_loaded) {
        return Ok(());
    }
    let (input, output) = (driver(records), ["current", "speed"][channel]);
    let zero = |signal: &[f64]| peak(signal) <= 0.0;
    let what = match records.iter().all(|record| zero(record.input())) {
        true => format!("the {input} is zero throughout, so that nothing is known of what drives the motor"),
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

/// Returns warnings on parameters that speed alone or current alone does not identify, with remedies.
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
            text!("no current" {unused} ": speed alone fixes three combinations of the {count} free parameters"),
            text!("record the current, or hold two with " [Fix] ", R and K for example"),
        ))
    } else if !is_measured(records, 1) && BY_CURRENT.into_iter().all(is_free) {
        Some((
            text!("no speed" {unused} ": current alone leaves K, B and J free along K : B : J = 1 : 2 : 2"),
            text!("record the speed or hold K with "[Fix]),
        ))
    } else {
        None
    }
}
