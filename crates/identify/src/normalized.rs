//! The normalized model: a representative of all motors that are consistent with recordings that lack a channel.

use super::spec::IdentifySpec;
use motorfit_core::Result;
use motorfit_core::numeric::peak;
use motorfit_motor::{Axis, Parameter, Scope, Space};
use motorfit_record::Record;
use motorfit_record::warning::Warning;

/// Ratio of the bounds to the initial estimate, on each side.
const SPREAD: f64 = 1e3;

/// A normalized representative of all motors consistent with the recordings.
pub(super) struct NormalizedModel {
    /// Space of the model: some parameters are fixed at assumed values.
    pub space: Space,
    /// Initial estimates of R, L, K, B and J.
    pub motor: [f64; 5],
    /// Parameters that the recordings do not identify.
    pub unknown: Vec<Parameter>,
    /// Warning about the missing channel.
    pub warning: Warning,
}

impl NormalizedModel {
    /// Makes the normalized model around an initial estimate. Free parameters in `assumed` are fixed at the values of `motor`;
    /// the others are free, with automatic bounds around these values. Parameters in `unknown` that the spec fixes are left
    /// out.
    ///
    /// # Errors
    /// Propagates the errors of [`Space::new`].
    pub(super) fn new(
        spec: &IdentifySpec,
        motor: [f64; 5],
        assumed: &[Parameter],
        unknown: &[Parameter],
        warning: Warning,
    ) -> Result<Self> {
        let (mut free, mut fix) = (Vec::new(), spec.space.fixed().to_vec());
        for axis in spec.space.free() {
            match motor.get(axis.parameter as usize) {
                Some(&value) if assumed.contains(&axis.parameter) => fix.push((axis.parameter, Scope::Shared, value)),
                Some(value) if spec.auto_bounds.contains(&axis.parameter) => {
                    free.push(Axis { min: value / SPREAD, max: value * SPREAD, ..*axis });
                }
                _ => free.push(*axis),
            }
        }
        // All parameters of the motor may be fixed if only extensions are to be identified.
        let space = if free.is_empty() { Space::unchecked(free, fix) } else { Space::new(free, fix)? };
        let unknown = unknown.iter().copied().filter(|parameter| spec.fixed(*parameter).is_none()).collect();
        Ok(Self { space, motor, unknown, warning })
    }
}

/// Returns true if a channel was measured in any recording.
pub(super) fn is_measured(records: &[Record], channel: usize) -> bool {
    records.iter().any(|record| record.measured()[channel].is_some())
}

/// Smallest peak of a signal that is not zero, in SI units.
const PEAK_MIN: f64 = 1e-12;

/// Returns true if an initial estimate has a plausible magnitude; a recording with hardly any information can give any value.
pub(super) fn is_usual(value: &f64) -> bool {
    (1e-18..1e18).contains(value)
}

/// Returns the recordings whose input and output of a channel are not zero throughout, the longest first.
pub(super) fn informative(records: &[Record], channel: usize) -> Vec<&Record> {
    let is_alive = |record: &&Record| {
        peak(record.input()) > PEAK_MIN && record.measured()[channel].is_some_and(|signal| peak(signal) > PEAK_MIN)
    };
    let mut list: Vec<&Record> = records.iter().filter(is_alive).collect();
    list.sort_by_key(|record| std::cmp::Reverse(record.len()));
    list
}

/// Returns the peaks of the input and of an output in the longest informative recording; 1 if there is none.
pub(super) fn peaks(records: &[Record], channel: usize) -> [f64; 2] {
    let record = informative(records, channel).into_iter().next();
    let of = |signal: Option<&[f64]>| signal.map_or(1.0, peak);
    [of(record.map(Record::input)), of(record.and_then(|record| record.measured()[channel]))]
}
