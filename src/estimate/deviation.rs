//! The size of signals: what residuals are compared with where no noise is known.

use crate::numeric::{rms, standard_deviation};
use crate::record::Record;

/// Returns the standard deviation of current \[A\] and speed \[rad/s\] of each recording; the root mean square of a
/// constant channel, and 1 for a channel that was not measured or is zero.
#[must_use]
pub fn signal_deviations(records: &[Record]) -> Vec<[f64; 2]> {
    let of = |signal: Option<&[f64]>| {
        let Some(signal) = signal else { return 1.0 };
        [standard_deviation(signal), rms(signal), 1.0].into_iter().find(|v| *v > 0.0).unwrap_or(1.0)
    };
    records.iter().map(|record| record.measured().map(of)).collect()
}
