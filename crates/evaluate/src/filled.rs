//! Values of channels at samples that do not count.

use motorfit_core::numeric::interpolate_between;
use motorfit_record::Record;

/// Returns the measured channels with masked samples interpolated linearly, so that their values have no effect; `None` for a
/// channel that is not masked.
pub(super) fn filled(record: &Record, counting: &[[bool; 2]]) -> [Option<Vec<f64>>; 2] {
    [0, 1].map(|channel| {
        let signal = record.measured()[channel].filter(|_| counting.iter().any(|c| !c[channel]))?;
        let own: Vec<usize> = (0..signal.len()).filter(|n| counting[*n][channel]).collect();
        let mut values = if own.is_empty() { vec![0.0; signal.len()] } else { signal.to_vec() };
        interpolate_between(&record.samples().time_s, &mut values, &own);
        Some(values)
    })
}
