//! The input of a simulated motor.

use motorfit_core::numeric::{count, whole};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_record::SAMPLES_MAX;

/// The input of a simulated motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Times of the samples \[s\].
    pub time_s: Vec<f64>,
    /// Voltage \[V\].
    pub voltage: Vec<f64>,
    /// Load torque \[N·m\].
    pub torque: Option<Vec<f64>>,
}

impl Excitation {
    /// Returns a voltage step: 0 V before `at_s`, `volts` from then on, for `duration_s` in steps of `period_s`, both ends
    /// included.
    ///
    /// # Errors
    /// Returns a usage error if duration or period are not positive and finite, voltage or time of the step are not finite, or
    /// there would be more than [`SAMPLES_MAX`] samples.
    pub fn step(volts: f64, at_s: f64, duration_s: f64, period_s: f64) -> Result<Self> {
        let samples = Self::samples(duration_s, period_s)?;
        Self::check_step(volts, at_s)?;
        let time_s: Vec<f64> = (0..samples).map(|n| count(n) * period_s).collect();
        let voltage = time_s.iter().map(|t| Self::voltage(volts, t - at_s, period_s)).collect();
        Ok(Self { time_s, voltage, torque: None })
    }

    pub(super) fn check_step(volts: f64, at_s: f64) -> Result<()> {
        if !(volts.is_finite() && at_s.is_finite()) {
            let message = "the voltage and the time of a step must be finite";
            return Err(Error::usage(message, "Write step:VOLTS@SECONDS, as in step:10.5@1."));
        }
        Ok(())
    }

    /// Returns the voltage \[V\] at a time `after_s` after a step. A tolerance of 1e-6 periods absorbs rounding: the step at 1
    /// s is at sample 1000 of a period of 1 ms, although 1000 × 0.001 may be rounded.
    pub(super) fn voltage(volts: f64, after_s: f64, period_s: f64) -> f64 {
        if after_s > -1e-6 * period_s { volts } else { 0.0 }
    }

    /// Returns the number of samples, both ends included.
    pub(super) fn samples(duration_s: f64, period_s: f64) -> Result<usize> {
        let good = |v: f64| v.is_finite() && v > 0.0;
        if !(good(duration_s) && good(period_s)) {
            return Err(Error::usage(
                format!("a duration of {duration_s} s in steps of {period_s} s cannot be simulated"),
                "Give a positive duration and a positive period, in seconds.",
            ));
        }
        let steps = (duration_s / period_s * (1.0 + 1e-12)).floor();
        if !(1.0..count(SAMPLES_MAX)).contains(&steps) {
            return Err(Error::usage(
                format!("{steps} steps, expected 1 to {}", SAMPLES_MAX - 1),
                text!("Change " [Duration] " or " [Period] "."),
            ));
        }
        Ok(whole(steps) + 1)
    }
}

/// Returns the error for a simulated motor whose signals leave the range of a recording.
pub(super) fn diverges(error: &Error) -> Error {
    let hint = "Shorten the period and check the units of the parameters.";
    Error::data(format!("the simulated motor diverges: {error}"), hint)
}
