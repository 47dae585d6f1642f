//! Diagnostics of a recording before it is used: rules on the clock, the input, the sensors and the motion of the motor.
//!
//! A rule that is inconclusive reports nothing. Thresholds were chosen on real recordings; `tests/statistics/diagnose` bounds the rate of
//! false alarms on simulated ones. A new rule is a function in a file of this folder, a row of `RULES` and the rows of its
//! codes in [`FINDINGS`].

mod clock;
mod comb;
mod curve;
mod drive;
mod finding;
mod input;
mod input_outliers;
mod lag;
mod latency;
mod motion;
mod off;
mod outlier_search;
mod outliers;
mod predictor;
mod pulses;
mod regression;
mod reset;
mod rest;
mod ripple;
mod sampling;
mod saturation;
mod sensor;
mod sign;
mod spectrum;
mod start;
mod undersampled;
mod units;
mod view;
mod winding;

pub use finding::{FINDINGS, Finding, Severity, can_cause_poor_fit};

use crate::heading::Quantity;
use crate::record::Record;
use motorfit_core::numeric::{extremes, interpolate_between};
use outliers::Outliers;
use std::ops::Range;
use view::View;

/// Largest number of ranges of samples in a finding.
const PLACES_MAX: usize = 20;

/// Examines a recording and appends its findings.
type Rule = fn(&View<'_>, &mut Vec<Finding>);

/// Signals that a rule examines.
#[derive(Clone, Copy, PartialEq, Eq)]
enum About {
    /// The times and the input, at all samples.
    Input,
    /// The outputs too, at the samples of the slowest.
    Outputs,
}

/// Rules in the order in which they are applied, each with true if it also applies to recordings whose input is the current, and with
/// what it examines. A rule sees the findings of those before it; some rules apply only without certain findings.
const RULES: [(Rule, bool, About); 16] = [
    (clock::jitter, true, About::Outputs),
    (units::units, true, About::Outputs),
    (sign::sign_reversed, true, About::Outputs),
    (undersampled::undersampled, false, About::Input),
    (input::input, false, About::Input),
    (rest::rest, false, About::Outputs),
    (motion::motion, false, About::Outputs),
    (drive::drive, false, About::Outputs),
    (off::off, false, About::Outputs),
    (comb::averaged_sensor, false, About::Outputs),
    (sampling::sampling, true, About::Outputs),
    (curve::curve, false, About::Outputs),
    (saturation::saturation, false, About::Outputs),
    (latency::start_latency, false, About::Outputs),
    (start::start, false, About::Outputs),
    (ripple::speed_ripple, false, About::Outputs),
];

/// Returns the findings about a recording, in decreasing order of importance.
#[must_use]
pub fn diagnose(record: &Record) -> Vec<Finding> {
    let mut findings = findings(record);
    findings.iter_mut().for_each(|finding| finding.places.truncate(PLACES_MAX));
    findings
}

/// Returns the findings with all their ranges. Of outputs that were measured at some of the samples, those of the slowest one are
/// examined: values between samples resemble those of a filter.
pub(super) fn findings(record: &Record) -> Vec<Finding> {
    // The rules are those of a DC motor.
    if record.is_of_model() {
        return Vec::new();
    }
    let mut findings = match record.at_slowest_output() {
        None => findings_of(record, None),
        Some((slow, rows)) => {
            let mut found = findings_of(&slow, Some(About::Outputs));
            let place = |place: &Range<usize>| rows[place.start]..rows[place.end.saturating_sub(1)] + 1;
            for finding in &mut found {
                finding.places = finding.places.iter().map(place).collect();
            }
            found.extend(findings_of(record, Some(About::Input)));
            found
        }
    };
    let rank = |code: &str| FINDINGS.iter().position(|(listed, _)| *listed == code);
    debug_assert!(findings.iter().all(|finding| rank(finding.code).is_some()), "every code is in the table");
    findings.sort_by_key(|finding| (finding.severity == Severity::Mention, rank(finding.code)));
    findings
}

/// Applies the rules about some signals, or all. Outliers are detected first and replaced before the other rules are applied; masked
/// samples beyond the range of the others are replaced too.
fn findings_of(record: &Record, about: Option<About>) -> Vec<Finding> {
    let mut findings = Vec::new();
    let view = View::new(record);
    let outliers = match about {
        None => outliers(&view),
        Some(About::Input) => input_outliers::of_input(&view).into_iter().collect(),
        Some(About::Outputs) => outliers::of_outputs(&view),
    };
    outliers::report(&view, &outliers, &mut findings);
    let repaired = (!outliers.is_empty()).then(|| record.with_repaired(&outliers));
    let repaired = repaired.as_ref().unwrap_or(record).with_masked_interpolated().or(repaired);
    let view = repaired.as_ref().map_or(view, View::new);
    let applies =
        |by_current: bool, of: About| (by_current || !view.by_current()) && about.is_none_or(|about| about == of);
    for (rule, _, _) in RULES.iter().filter(|(_, by_current, of)| applies(*by_current, *of)) {
        rule(&view, &mut findings);
    }
    findings
}

/// Returns the outliers of each signal. Those of the input are found first and replaced, because it predicts the outputs.
fn outliers(view: &View<'_>) -> Vec<Outliers> {
    let of_input = input_outliers::of_input(view);
    let of_outputs = match &of_input {
        Some(outliers) => {
            let repaired = view.record.with_repaired(std::slice::from_ref(outliers));
            outliers::of_outputs(&View::new(&repaired))
        }
        None => outliers::of_outputs(view),
    };
    of_input.into_iter().chain(of_outputs).collect()
}

impl Record {
    /// Returns a copy with outliers replaced by predictions from the surrounding samples.
    fn with_repaired(&self, outliers: &[Outliers]) -> Self {
        let mut record = self.clone();
        record.samples.change(|quantity, values| {
            for of in outliers.iter().filter(|of| of.quantity == quantity) {
                of.repaired.iter().for_each(|(n, value)| values[*n] = *value);
            }
        });
        record
    }

    /// Returns a copy with masked samples of the outputs that are outside the range of the others interpolated between their
    /// neighbours; `None` if no sample is masked.
    fn with_masked_interpolated(&self) -> Option<Self> {
        let counting = self.counting();
        if counting.is_empty() {
            return None;
        }
        let mut record = self.clone();
        record.samples.change(|quantity, values| {
            let channel = match quantity {
                Quantity::Current => 0,
                Quantity::Speed => 1,
                _ => return,
            };
            let others = values.iter().zip(&counting).filter(|(_, counts)| counts[channel]).map(|(value, _)| *value);
            let [low, high] = extremes(&others.collect::<Vec<_>>());
            let is_inside = |value: &f64| (low..=high).contains(value);
            let kept: Vec<usize> = (0..values.len()).filter(|n| is_inside(&values[*n])).collect();
            interpolate_between(&self.samples.time_s, values, &kept);
        });
        Some(record)
    }

    /// Returns a copy with outliers of the voltage replaced by interpolation, and their number of samples; `None` without
    /// outliers.
    pub(super) fn with_repaired_input(&self) -> Option<(Self, usize)> {
        let outliers = input_outliers::of_input(&View::new(self))?;
        let samples = outliers.repaired.len();
        Some((self.with_repaired(&[outliers]), samples))
    }
}

/// Returns the segments in which the voltage changes faster than it is sampled.
pub(super) fn undersampled_segments(record: &Record) -> Vec<Range<usize>> {
    undersampled::segments(&View::new(record))
}
