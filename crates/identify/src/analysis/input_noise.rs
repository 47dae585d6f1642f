//! Effect of the noise of a measured input current on the standard errors.

use super::fitted::FittedMotor;
use motorfit_core::numeric::noise_sigma;
use motorfit_core::text::{engineering, significant};
use motorfit_motor::Input;
use motorfit_record::Record;
use motorfit_record::warning::Warning;

/// Smallest factor by which standard errors are too small at which a warning is given.
const TOO_SMALL: f64 = 1.5;

/// Returns the warning about noise of an input current, which the standard errors neglect: they include the noise of the speed
/// only.
///
/// The motor filters white noise of the current, of standard deviation σ_i, into noise of the speed that is correlated over the
/// mechanical time constant. For parameters whose effects are as slow it acts like white noise of standard deviation
/// `K/J min(J/B, T) σ_i`, with T the duration of the longest recording.
pub(crate) fn input_noise(records: &[Record], found: &FittedMotor<'_>) -> Option<Warning> {
    let sigma = found.sigma(1).filter(|sigma| found.input == Input::Current && *sigma > 0.0)?;
    found.uncertainty?;
    let longest = records.iter().max_by_key(|record| record.len())?;
    let noise = noise_sigma(longest.input());
    let [_, _, k, b, j] = found.parameters.to_array();
    let speed = k / j * (j / b).min(longest.duration_s()) * noise;
    let times = (1.0 + (speed / sigma).powi(2)).sqrt();
    (times > TOO_SMALL).then(|| {
        let (noise, times) = (engineering(noise, "A", 2), significant(times, 2));
        let message = format!(
            "the current has noise of {noise}, which acts on the speed: the standard errors include only the noise of the \
             speed sensor and are too small by up to a factor of {times}"
        );
        Warning::new("input_noise", message)
    })
}
