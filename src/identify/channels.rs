//! What recordings tell that lack a channel. Speed alone shows three combinations of R, L, K, B and J: the motor with
//! R = 1 Ω and next to no friction that does the same under the same voltage stands for all of them, and gives kV and kA,
//! gain and time constant. Current alone shows four: a motor with some K stands for all of them, and its R and L are
//! right. What there is without a voltage has a file of its own, `mechanical.rs`.

use super::Polish;
use super::held::guess_by_speed;
use super::mechanical;
use super::spec::IdentifySpec;
use super::warnings::{Warning, missing_channel};
use crate::Result;
use crate::criterion::peak;
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::record::Record;
use crate::setting::text;

/// A motor that stands for all that do the same.
pub(super) struct Stand {
    /// What is free of it, and what is held.
    pub space: Space,
    /// R, L, K, B and J of one that is near.
    pub motor: [f64; 5],
    /// The parameters that the recordings do not tell.
    pub unknown: Vec<Parameter>,
    pub warning: Warning,
}

/// Friction of the motor that stands for others by their speed, in parts of K²/R.
const FRICTION: f64 = 1e-6;
/// What speed alone does not tell.
const BY_SPEED: [Parameter; 7] = {
    let [r, l, k, b, j] = Parameter::ALL;
    [r, l, k, b, j, Parameter::Coulomb, Parameter::Load]
};
/// How far around a motor that was guessed the bounds are.
const SPREAD: f64 = 1e3;

/// The motor that stands for those that recordings without current, or without speed, could be of; `None` where both were
/// measured, or enough is held.
pub(super) fn stand_in(records: &[Record], spec: &IdentifySpec) -> Result<Option<Stand>> {
    if let Some(stand) = mechanical::stand_in(records, spec)? {
        return Ok(Some(stand));
    }
    if spec.polish == Polish::None {
        return Ok(None);
    }
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    let held = |parameter| fixed(spec, parameter).is_some();
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
    Ok(Some(Stand {
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

fn fixed(spec: &IdentifySpec, parameter: Parameter) -> Option<f64> {
    spec.space.fixed().iter().find(|(p, _, _)| *p == parameter).map(|(_, _, value)| *value)
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
    let r = fixed(spec, Parameter::R).unwrap_or(1.0);
    [r, fixed(spec, Parameter::L).unwrap_or(r * l), k, fixed(spec, Parameter::B).unwrap_or(FRICTION * k * k / r), j / r]
}

/// A motor that about does what the current shows: the resistance by the largest current, time constants that the
/// recording can show.
fn of_current(records: &[Record], spec: &IdentifySpec) -> [f64; 5] {
    let record = longest(records);
    let current = record.and_then(|r| r.samples().current.as_deref()).map_or(1.0, peak).max(f64::MIN_POSITIVE);
    let volts = record.map_or(1.0, |r| peak(r.input())).max(f64::MIN_POSITIVE);
    let (seconds, period) = (record.map_or(1.0, Record::duration_s), record.map_or(0.001, Record::period_s));
    let r = fixed(spec, Parameter::R).unwrap_or(0.8 * volts / current);
    let middle = || spec.space.free().iter().find(|a| a.parameter == Parameter::K).map(Axis::middle);
    let k = fixed(spec, Parameter::K).or_else(middle).unwrap_or(0.05);
    let l = fixed(spec, Parameter::L).unwrap_or(r * (period * seconds).sqrt().min(5.0 * period));
    [r, l, k, 0.05 * k * k / r, 0.03 * seconds * k * k / r]
}
