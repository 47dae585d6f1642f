//! What recordings tell that lack a channel. Speed alone shows three combinations of R, L, K, B and J: the motor with
//! R = 1 Ω and next to no friction that does the same under the same voltage stands for all of them, and gives kV and kA,
//! gain and time constant. Current alone shows four: a motor with some K stands for all of them, and its R and L are
//! right. What there is without a voltage has a file of its own, `mechanical.rs`.

use super::normalized::NormalizedModel;
use super::spec::IdentifySpec;
use crate::Result;
use crate::analysis::{guess_by_speed, unused_columns};
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::numeric::peak;
use crate::record::{Record, is_driven_by_current};
use crate::setting::{Text, text};
use crate::warning::Warning;

/// Friction of the motor that stands for others by their speed, in parts of K²/R.
const FRICTION: f64 = 1e-6;
/// What speed alone does not tell.
const BY_SPEED: [Parameter; 7] = {
    let [r, l, k, b, j] = Parameter::ALL;
    [r, l, k, b, j, Parameter::Coulomb, Parameter::Load]
};
/// How far around a motor that was guessed the bounds are.
const SPREAD: f64 = 1e3;

/// Returns the normalized model of recordings with a voltage and one output; `None` where both outputs were measured,
/// enough is fixed, or nothing is refined.
pub(super) fn single_channel(records: &[Record], spec: &IdentifySpec) -> Result<Option<NormalizedModel>> {
    if !spec.is_polished() {
        return Ok(None);
    }
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    let held = |parameter| spec.fixed(parameter).is_some();
    let free = Parameter::ALL.into_iter().filter(|p| !held(*p)).count();
    let by_speed = missing(0) && free > 3 && !held(Parameter::K);
    let by_current = missing(1) && [Parameter::K, Parameter::B, Parameter::J].into_iter().all(|p| !held(p));
    let Some((what, remedy)) = missing_channel(records, spec).filter(|_| by_speed || by_current) else {
        return Ok(None);
    };
    let (motor, assumed, unknown): ([f64; 5], &[Parameter], &[Parameter]) = if by_speed {
        // Torques go with the resistance.
        (of_speed(records, spec), &[Parameter::R, Parameter::B], &BY_SPEED)
    } else {
        let unknown = &[Parameter::K, Parameter::B, Parameter::J];
        (of_current(records, spec), &[Parameter::K], unknown)
    };
    let (mut free, mut fix) = (Vec::new(), spec.space.fixed().to_vec());
    for axis in spec.space.free() {
        let value = motor.get(axis.parameter as usize).copied().unwrap_or(f64::NAN);
        if assumed.contains(&axis.parameter) {
            fix.push((axis.parameter, Scope::Shared, value));
        } else if spec.auto_bounds.contains(&axis.parameter) && !axis.parameter.is_extension() {
            free.push(Axis { min: value / SPREAD, max: value * SPREAD, ..*axis });
        } else {
            free.push(*axis);
        }
    }
    let told = if by_speed { "gain, time constants, kV and kA are told" } else { "R and L are told" };
    Ok(Some(NormalizedModel {
        space: Space::new(free, fix)?,
        motor,
        unknown: unknown.iter().copied().filter(|p| !held(*p)).collect(),
        warning: Warning::new("channel_missing", text!({what} "; {told}; for the others " {remedy})),
    }))
}

/// A motor that about does what one channel shows, where there is only one.
pub(super) fn guess(records: &[Record], spec: &IdentifySpec) -> Option<[f64; 5]> {
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    match [missing(0), missing(1)] {
        [true, false] => Some(of_speed(records, spec)),
        [false, true] => Some(of_current(records, spec)),
        _ => None,
    }
}

fn longest(records: &[Record]) -> Option<&Record> {
    records.iter().max_by_key(|record| record.len())
}

/// A motor that about does what the speed shows.
fn of_speed(records: &[Record], spec: &IdentifySpec) -> [f64; 5] {
    let guessed = longest(records).and_then(|record| guess_by_speed(record).ok());
    let [l, k, j] = guessed.unwrap_or_else(|| {
        let record = longest(records);
        let speed = record.and_then(|r| r.samples().speed.as_deref()).map_or(1.0, peak).max(f64::MIN_POSITIVE);
        let volts = record.map_or(1.0, |r| peak(r.input()));
        let (k, seconds) = (volts / speed, record.map_or(1.0, Record::duration_s));
        [0.001 * seconds, k, 0.03 * seconds * k * k]
    });
    let r = spec.fixed(Parameter::R).unwrap_or(1.0);
    [r, spec.fixed(Parameter::L).unwrap_or(r * l), k, spec.fixed(Parameter::B).unwrap_or(FRICTION * k * k / r), j / r]
}

/// A motor that about does what the current shows: the resistance by the largest current, time constants that the
/// recording can show.
fn of_current(records: &[Record], spec: &IdentifySpec) -> [f64; 5] {
    let record = longest(records);
    let current = record.and_then(|r| r.samples().current.as_deref()).map_or(1.0, peak).max(f64::MIN_POSITIVE);
    let volts = record.map_or(1.0, |r| peak(r.input())).max(f64::MIN_POSITIVE);
    let (seconds, period) = (record.map_or(1.0, Record::duration_s), record.map_or(0.001, Record::period_s));
    let r = spec.fixed(Parameter::R).unwrap_or(0.8 * volts / current);
    let middle = || spec.space.free().iter().find(|a| a.parameter == Parameter::K).map(Axis::middle);
    let k = spec.fixed(Parameter::K).or_else(middle).unwrap_or(0.05);
    let l = spec.fixed(Parameter::L).unwrap_or(r * (period * seconds).sqrt().min(5.0 * period));
    [r, l, k, 0.05 * k * k / r, 0.03 * seconds * k * k / r]
}

/// What speed alone or current alone cannot give, and what to do.
pub(super) fn missing_channel(records: &[Record], spec: &IdentifySpec) -> Option<(Text, Text)> {
    if is_driven_by_current(records) {
        return None;
    }
    let free: Vec<&Axis> = spec.space.free().iter().filter(|axis| !axis.parameter.is_extension()).collect();
    let is_free = |parameter| free.iter().any(|axis| axis.parameter == parameter);
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    let unused = unused_columns(records);
    if missing(0) && free.len() > 3 {
        let count = free.len();
        Some((
            text!("no current" {unused} ": speed alone fixes three combinations of the {count} free parameters"),
            text!("record the current, or hold two with " [Fix] ", R and K for example."),
        ))
    } else if missing(1) && [Parameter::K, Parameter::B, Parameter::J].into_iter().all(is_free) {
        Some((
            text!("no speed" {unused} ": current alone leaves K, B and J free along K : B : J = 1 : 2 : 2"),
            text!("record the speed or hold K with " [Fix] "."),
        ))
    } else {
        None
    }
}
