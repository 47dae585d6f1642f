//! The power of measured signals, and the divisors of their errors.

use crate::criterion::{Criterion, Scale};
use motorfit_core::numeric::peak;
use motorfit_core::setting::text;
use motorfit_core::{Error, ErrorKind, Result};

/// Returns the sum of squares of each channel, accumulated in four independent sums to hide the latency of additions.
pub(super) fn power(measured: &[[f64; 2]]) -> [f64; 2] {
    let (fours, rest) = measured.as_chunks::<4>();
    let mut sums = [[0.0; 2]; 4];
    let mut add = |samples: &[[f64; 2]]| {
        for (sum, y) in sums.iter_mut().zip(samples) {
            *sum = [sum[0] + y[0] * y[0], sum[1] + y[1] * y[1]];
        }
    };
    fours.iter().for_each(|four| add(four));
    add(rest);
    [0, 1].map(|channel| sums.iter().map(|sum| sum[channel]).sum())
}

/// Returns the divisor of the errors of a channel.
///
/// # Errors
/// Returns a `NotIdentified` error if the signal is constant, or has no noise to divide by.
pub(super) fn divisor(criterion: &Criterion, channel: usize, signal: &[f64]) -> Result<f64> {
    let name = ["current", "speed"][channel];
    let divisor = criterion.divisor(channel, signal);
    // A smaller divisor would amplify rounding noise.
    let smallest = 1e-12 * peak(signal).max(f64::MIN_POSITIVE);
    if divisor.is_finite() && divisor > smallest {
        return Ok(divisor);
    }
    let (message, remedy) = match criterion.scale {
        Scale::Noise => (
            format!("the noise of the {name} cannot be estimated: the signal has none"),
            text!("Give it (" [Noise = "i=SIGMA,w=SIGMA"] ") or choose another " [Scale] "."),
        ),
        _ => (
            format!("the {name} is constant at {} and has no information about the motor", signal[0]),
            "Record while the voltage changes, or leave the column out if it was not connected.".into(),
        ),
    };
    Err(Error::new(ErrorKind::NotIdentified, message, remedy))
}
