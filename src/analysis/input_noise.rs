//! Noise of an input that was measured: what it does to standard errors.

use super::fitted::FittedMotor;
use crate::motor::Input;
use crate::numeric::noise_sigma;
use crate::record::Record;
use crate::text::{engineering, significant};
use crate::warning::Warning;

/// Noise of the current makes standard errors so many times too small before it is said.
const TOO_SMALL: f64 = 1.5;

/// Returns the effect of the current's noise on standard errors, which account for the noise of the speed alone.
///
/// Through the motor, white noise of σ_i becomes one of the speed that is correlated over its time constant. Where
/// parameters act as slowly as that, it counts as white noise of `gain σ_i` would.
pub(crate) fn input_noise(records: &[Record], found: &FittedMotor<'_>) -> Option<Warning> {
    let sigma = found.residual_sigma[1].filter(|sigma| found.input == Input::Current && *sigma > 0.0)?;
    found.uncertainty?;
    let longest = records.iter().max_by_key(|record| record.len())?;
    let noise = noise_sigma(longest.input());
    let [_, _, k, b, j] = found.parameters.to_array();
    let speed = k / j * (j / b).min(longest.duration_s()) * noise;
    let times = (1.0 + (speed / sigma).powi(2)).sqrt();
    (times > TOO_SMALL).then(|| {
        let (noise, times) = (engineering(noise, "A", 2), significant(times, 2));
        let message = format!(
            "the current has noise of {noise}, which acts on the speed: standard errors, which know the noise of the speed \
             alone, are too small by up to a factor of {times}"
        );
        Warning::new("input_noise", message)
    })
}
