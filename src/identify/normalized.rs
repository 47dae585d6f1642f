//! The normalized model: one motor that represents all that are consistent with recordings which lack a channel.

use super::spec::IdentifySpec;
use crate::Result;
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::numeric::peak;
use crate::record::Record;
use crate::warning::Warning;

/// The factor between a guessed motor and its bounds, to each side.
const SPREAD: f64 = 1e3;

/// A normalized representative of all motors consistent with recordings.
pub(super) struct NormalizedModel {
    /// Its free and fixed parameters.
    pub space: Space,
    /// R, L, K, B and J of one that is near.
    pub motor: [f64; 5],
    /// The parameters that the recordings do not identify.
    pub unknown: Vec<Parameter>,
    pub warning: Warning,
}

impl NormalizedModel {
    /// Returns the model of a motor: free parameters that are `assumed` are fixed at its values, the others are free around
    /// them, or within bounds of their own. Of `unknown` those count that the spec does not fix.
    ///
    /// # Errors
    /// As for a space.
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
        // All of the motor may be held where its extensions are asked for.
        let space = if free.is_empty() { Space::unchecked(free, fix) } else { Space::new(free, fix)? };
        let unknown = unknown.iter().copied().filter(|parameter| spec.fixed(*parameter).is_none()).collect();
        Ok(Self { space, motor, unknown, warning })
    }
}

/// Returns whether any recording has measured a channel.
pub(super) fn is_measured(records: &[Record], channel: usize) -> bool {
    records.iter().any(|record| record.measured()[channel].is_some())
}

/// Peaks below this, in SI units, are none.
const NOTHING: f64 = 1e-12;

/// Returns whether a guessed value can be one of a motor; a stretch that shows next to nothing gives any.
pub(super) fn is_usual(value: &f64) -> bool {
    (1e-18..1e18).contains(value)
}

/// Returns the recordings whose input and output of a channel are not zero throughout, the longest first.
pub(super) fn informative(records: &[Record], channel: usize) -> Vec<&Record> {
    let is_alive = |record: &&Record| {
        peak(record.input()) > NOTHING && record.measured()[channel].is_some_and(|signal| peak(signal) > NOTHING)
    };
    let mut list: Vec<&Record> = records.iter().filter(is_alive).collect();
    list.sort_by_key(|record| std::cmp::Reverse(record.len()));
    list
}

/// Returns the peaks of the input and of the output of a channel in the longest informative recording; 1 where there is none.
pub(super) fn peaks(records: &[Record], channel: usize) -> [f64; 2] {
    let record = informative(records, channel).into_iter().next();
    let of = |signal: Option<&[f64]>| signal.map_or(1.0, peak);
    [of(record.map(Record::input)), of(record.and_then(|record| record.measured()[channel]))]
}
