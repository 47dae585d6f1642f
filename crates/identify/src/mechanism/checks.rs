//! Checks of the tests of a mechanism before the fit: movement, directions, signs, units and missing tests.

use super::signals::Signals;
use motorfit_core::numeric::{extremes, mean, noise_sigma, peak};
use motorfit_core::setting::text;
use motorfit_core::text::{listed, significant};
use motorfit_core::{Error, Result};
use motorfit_record::warning::Warning;
use motorfit_record::{Quantity, Record, position_disagrees, position_ratio, test_of};

/// Range of the velocity, relative to its noise, from which a mechanism moves.
const MOVES: f64 = 12.0;
/// Velocity of a moving mechanism relative to the peak.
pub(super) const MOVING: f64 = 0.05;
/// Largest voltage that may be a duty cycle \[V\]: the tests of a mechanism take several volts.
const DUTY_MAX: f64 = 1.2;
/// Range of the magnitude of the voltage, relative to the largest, up to which it is one.
const ONE_MAGNITUDE: f64 = 0.1;
/// Smallest number of moving samples of a direction.
const DIRECTION_MIN: usize = 5;
/// Returns warnings about the tests of a mechanism, and true for each recording that moves.
///
/// # Errors
/// Returns `Data` if nothing moves in any test, or the velocity falls where the voltage rises, and `NotIdentified` if the voltage has one
/// magnitude.
pub(super) fn checks(records: &[Record]) -> Result<(Vec<Warning>, Vec<bool>)> {
    let tests: Vec<(&Record, Signals<'_>)> =
        records.iter().filter_map(|record| Some((record, Signals::of(record)?))).collect();
    let name = |record: &Record| record.source().part.clone().unwrap_or_else(|| "the recording".to_owned());
    let (moving, still): (Vec<_>, Vec<_>) = tests.iter().partition(|(_, test)| moves(test));
    let Some((_, first)) = tests.first() else {
        return Err(Error::data("voltage or velocity is missing", "Log both while the tests run."));
    };
    if moving.is_empty() {
        let [low, high] = extremes(first.velocity).map(|end| significant(end, 3));
        let message = format!("nothing moves: the velocity stays between {low} and {high} in every test");
        let hint = "Check the sensor and its connection, and that the voltage of the tests exceeds friction.";
        return Err(Error::data(message, hint));
    }
    let mut warnings = Vec::new();
    if !still.is_empty() {
        let names: Vec<String> = still.iter().map(|(record, _)| name(record)).collect();
        let names = listed(&names.iter().map(String::as_str).collect::<Vec<_>>(), "and");
        let remedy = "Check the connection of motor and sensor, and repeat the tests.";
        let message = format!("nothing moves in {names}, which the fit leaves out");
        warnings.push(Warning { remedy: Some(remedy.into()), ..Warning::new("test_without_motion", message) });
    }
    let is_moving = records.iter().map(|record| Signals::of(record).is_some_and(|test| moves(&test))).collect();
    let moving: Vec<Signals<'_>> = moving.iter().map(|(_, test)| *test).collect();
    check_sign(&moving)?;
    check_voltage(&moving)?;
    warnings.extend(duty(records, &moving));
    warnings.extend(missing(records));
    warnings.extend(one_direction(&moving));
    warnings.extend(units(&moving));
    Ok((warnings, is_moving))
}

/// Returns a warning if the voltage resembles a duty cycle.
fn duty(records: &[Record], tests: &[Signals<'_>]) -> Option<Warning> {
    let most = tests.iter().map(|test| peak(test.voltage)).fold(0.0, f64::max);
    if most > DUTY_MAX {
        return None;
    }
    let message = format!("the voltage is at most {} V, as of a duty cycle", significant(most, 3));
    let columns = records.iter().flat_map(|record| &record.source().columns);
    let column = columns.into_iter().find(|column| column.quantity == Quantity::Signal(0));
    let heading = column.map_or("HEADING", |column| column.heading.as_str());
    let remedy =
        text!("If it is one, multiply it by the voltage of the battery: " [Columns = "voltage=\"{heading}\"*12:V"] ".");
    Some(Warning { remedy: Some(remedy), ..Warning::new("voltage_small", message) })
}

/// Returns true if the velocity of a test changes by more than its noise.
fn moves(test: &Signals<'_>) -> bool {
    let [low, high] = extremes(test.velocity);
    high - low > MOVES * noise_sigma(test.velocity) && high > low
}

/// Checks that the velocity rises with the voltage.
fn check_sign(tests: &[Signals<'_>]) -> Result<()> {
    let all = |signal: fn(&Signals<'_>) -> Vec<f64>| tests.iter().flat_map(signal).collect::<Vec<f64>>();
    let (volts, velocity) = (all(|test| test.voltage.to_vec()), all(|test| test.velocity.to_vec()));
    let [mean_volts, mean_velocity] = [&volts, &velocity].map(|signal| mean(signal));
    let covariance: f64 = volts.iter().zip(&velocity).map(|(v, w)| (v - mean_volts) * (w - mean_velocity)).sum::<f64>();
    if covariance >= 0.0 {
        return Ok(());
    }
    let message = "the velocity falls where the voltage rises: the sensor or the motor is reversed";
    let hint = text!(
        "Invert the sensor in the robot's code and repeat the tests, or change its sign: " [Columns = "speed=HEADING*-1:UNIT,position=HEADING*-1:UNIT"] "."
    );
    Err(Error::data(message, hint))
}

/// Checks that the voltage has more than one magnitude while the mechanism moves: at a single one a larger kS and a smaller kV explain the
/// same velocities.
fn check_voltage(tests: &[Signals<'_>]) -> Result<()> {
    let threshold = MOVING * tests.iter().map(|test| peak(test.velocity)).fold(0.0, f64::max);
    let moving = tests.iter().flat_map(|test| test.velocity.iter().zip(test.voltage));
    let magnitudes: Vec<f64> =
        moving.filter(|(velocity, _)| velocity.abs() > threshold).map(|(_, volts)| volts.abs()).collect();
    let [low, high] = extremes(&magnitudes);
    if magnitudes.is_empty() || high - low > ONE_MAGNITUDE * high {
        return Ok(());
    }
    let volts = significant(high, 3);
    let message = format!("the voltage is {volts} V whenever the mechanism moves: kS and kV cannot be told apart");
    let hint = "Run the quasistatic tests too: their voltage is a slow ramp.";
    Err(Error::not_identified(message, hint))
}

/// Returns a warning about tests that a routine lacks.
fn missing(records: &[Record]) -> Option<Warning> {
    let names: Vec<&str> = records.iter().filter_map(|record| test_of(record.source().part.as_deref()?)).collect();
    let missing: Vec<&str> = motorfit_record::TESTS.into_iter().filter(|test| !names.contains(test)).collect();
    if names.is_empty() || missing.is_empty() {
        return None;
    }
    let (noun, verb) = if missing.len() == 1 { ("test", "is") } else { ("tests", "are") };
    let message = format!("the {noun} {} {verb} missing", listed(&missing, "and"));
    let remedy = "Run the missing tests in the same session: a ramp alone leaves kS and kA as one sum, and steps alone kS and kV.";
    Some(Warning { remedy: Some(remedy.into()), ..Warning::new("test_missing", message) })
}

/// Returns a warning if all tests move in one direction.
fn one_direction(tests: &[Signals<'_>]) -> Option<Warning> {
    let threshold = MOVING * tests.iter().map(|test| peak(test.velocity)).fold(0.0, f64::max);
    let all = || tests.iter().flat_map(|test| test.velocity);
    let [forward, reverse] = [1.0, -1.0].map(|sign| all().filter(|velocity| sign * **velocity > threshold).count());
    if forward.min(reverse) >= DIRECTION_MIN {
        return None;
    }
    let message =
        "all tests move in one direction: friction, gravity and an offset of the voltage cannot be told apart";
    let remedy = "Run the tests of the other direction too.";
    Some(Warning { remedy: Some(remedy.into()), ..Warning::new("one_direction", message) })
}

/// Returns a warning if the velocity is not the derivative of the position.
fn units<'a>(tests: &[Signals<'a>]) -> Option<Warning> {
    let compared = |test: &Signals<'a>| Some([test.time_s, test.position?, test.velocity]);
    let ratio = position_ratio(tests.iter().filter_map(compared))?;
    let message = position_disagrees(ratio, "velocity")?;
    let remedy = text!("Name the units: " [Columns = "speed=HEADING:UNIT,position=HEADING:UNIT"] ".");
    Some(Warning { remedy: Some(remedy), ..Warning::new("units_disagree", message) })
}
