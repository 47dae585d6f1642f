//! Signals of a test: time, voltage, velocity and position.

use motorfit_core::units::{Unit, parse_unit};
use motorfit_record::{Record, SignalRequest};

// Numbers of the signals: the inputs of the models, then their outputs.
const VOLTAGE: usize = 0;
const VELOCITY: usize = 1;
const POSITION: usize = 2;

/// Returns the signals that are read of a mechanism, in the order of the models: voltage, velocity and, if it was logged, position;
/// of a length in metres or of an angle in radians.
#[must_use]
pub fn mechanism_signals(is_linear: bool) -> Vec<SignalRequest> {
    let [velocity, position] = if is_linear { ["m/s", "m"] } else { ["rad/s", "rad"] };
    let of = |name: &str, unit: &str, is_input, is_optional| SignalRequest {
        name: name.to_owned(),
        column: None,
        unit_text: unit.to_owned(),
        unit: parse_unit(unit).unwrap_or(Unit::ONE),
        is_input,
        is_optional,
    };
    vec![of("voltage", "V", true, false), of("speed", velocity, false, false), of("position", position, false, true)]
}

/// Signals of a recording, of equal length.
#[derive(Clone, Copy)]
pub(super) struct Signals<'a> {
    pub time_s: &'a [f64],
    pub voltage: &'a [f64],
    pub velocity: &'a [f64],
    pub position: Option<&'a [f64]>,
}

impl<'a> Signals<'a> {
    /// Returns the signals of a recording that was read for a mechanism; `None` if it lacks voltage or velocity.
    pub(super) fn of(record: &'a Record) -> Option<Self> {
        let samples = record.samples();
        let signal = |number| samples.named.iter().find(|signal| signal.number == number).map(|s| &s.values[..]);
        let (voltage, velocity) = (signal(VOLTAGE)?, signal(VELOCITY)?);
        Some(Self { time_s: &samples.time_s, voltage, velocity, position: signal(POSITION) })
    }

    /// Returns the number of samples.
    pub(super) fn len(&self) -> usize {
        self.time_s.len()
    }
}
