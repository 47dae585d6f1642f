//! Values of channels at samples that do not count.

use crate::numeric::count;
use crate::record::Record;

/// Returns the measured channels with masked samples interpolated linearly, so that their values have no effect; `None` for a
/// channel that is not masked.
pub(super) fn filled(record: &Record, counting: &[[bool; 2]]) -> [Option<Vec<f64>>; 2] {
    [0, 1].map(|channel| {
        let signal = record.measured()[channel].filter(|_| counting.iter().any(|c| !c[channel]))?;
        let counting: Vec<usize> = (0..signal.len()).filter(|n| counting[*n][channel]).collect();
        let between = |n: usize| {
            let next = counting.partition_point(|other| *other < n);
            if counting.get(next) == Some(&n) {
                return signal[n];
            }
            match (next.checked_sub(1).map(|last| counting[last]), counting.get(next).copied()) {
                (Some(a), Some(b)) => signal[a] + count(n - a) / count(b - a) * (signal[b] - signal[a]),
                (Some(one), None) | (None, Some(one)) => signal[one],
                (None, None) => 0.0,
            }
        };
        Some((0..signal.len()).map(between).collect())
    })
}
