//! Diagnostics of a recording before it is used: rules on its clock, its input, its sensors and what
//! the motor does. Each rule is quiet where it cannot tell.
//!
//! Thresholds come from trials on real recordings; false alarms are held down on simulated ones (`tests/diagnose`).

mod clock;
mod comb;
mod curve;
mod drive;
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

use super::{Quantity, Record};
use crate::setting::{Text, text};
use outliers::Outliers;
use std::ops::Range;
use view::{Channel, ConstantInput, View};

/// Severities of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Sure enough, and parameters from such a recording are likely off: to be reported with them.
    Report,
    /// Good to know, or less sure.
    Mention,
}

/// Something odd about a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// A short name that does not change.
    pub code: &'static str,
    /// Its severity.
    pub severity: Severity,
    /// The signal it is about.
    pub quantity: Quantity,
    /// The samples it is about, at most 20 ranges; empty where it is about the whole recording.
    pub places: Vec<Range<usize>>,
    /// In words.
    pub message: Text,
    /// The remedy.
    pub remedy: Text,
    /// The figures that it rests on, by name.
    pub figures: Vec<(&'static str, f64)>,
}

/// The largest number of places that a finding names.
const PLACES_MAX: usize = 20;

impl Finding {
    fn new(code: &'static str, quantity: Quantity, message: impl Into<Text>, remedy: impl Into<Text>) -> Self {
        let (message, remedy) = (message.into(), remedy.into());
        let (places, figures) = (Vec::new(), Vec::new());
        Self { code, severity: Severity::Report, quantity, places, message, remedy, figures }
    }

    fn mention_if(mut self, milder: bool) -> Self {
        if milder {
            self.severity = Severity::Mention;
        }
        self
    }

    fn report_if(mut self, graver: bool) -> Self {
        if graver {
            self.severity = Severity::Report;
        }
        self
    }

    fn at(mut self, places: impl IntoIterator<Item = Range<usize>>) -> Self {
        self.places.extend(places);
        self
    }

    fn figure(mut self, name: &'static str, value: f64) -> Self {
        self.figures.push((name, value));
        self
    }
}

/// The codes of findings, each with what it says; what more likely explains a poor fit comes first.
pub static FINDINGS: [(&str, &str); 20] = [
    ("sign_reversed", "A channel has the opposite sign of the others."),
    ("units", "Magnitudes fit no motor, but would in another unit."),
    ("no_motion", "The motor does not move under voltage."),
    ("motion_without_input", "The motor moves without voltage."),
    ("voltage_without_current", "The voltage does not reach the motor."),
    ("outliers", "Single samples are far off those around them."),
    ("current_clipped", "The current is cut off or limited."),
    ("start_latency", "The first movement comes late."),
    ("speed_falls", "The speed falls where the voltage rises."),
    ("speed_saturates", "The speed no longer follows the voltage."),
    ("undersampled_input", "The voltage changes faster than it is sampled."),
    ("averaged_sensor", "A sensor shows an average over samples."),
    ("held_samples", "Values are repeated over several samples."),
    ("rest_offset", "A sensor is not zero while the motor rests."),
    ("coarse_quantization", "The steps of a sensor are coarse."),
    ("speed_ripple", "The speed has a periodic ripple in the steady state."),
    ("input_reset", "The voltage is reset at the end."),
    ("idle_input", "The voltage is not zero while the motor rests."),
    ("single_edge", "The voltage changes once only."),
    ("jitter", "Samples are not evenly spaced."),
];

/// The codes of findings that do not explain why a fit fails, though they may matter to its errors.
const MINOR: [&str; 6] = ["rest_offset", "speed_ripple", "input_reset", "idle_input", "single_edge", "jitter"];

/// Returns whether findings of a code, where they are more than remarks, may explain why a fit fails or is poor.
#[must_use]
pub fn explains_failure(code: &str) -> bool {
    FINDINGS.iter().any(|(listed, _)| *listed == code) && !MINOR.contains(&code)
}

/// Looks at a recording and adds what it finds.
type Rule = fn(&View<'_>, &mut Vec<Finding>);

/// The rules in the order in which they look, each with whether it also is one of recordings whose input is the current.
const RULES: [(Rule, bool); 16] = [
    (clock::jitter, true),
    (units::units, true),
    (sign::sign_reversed, true),
    (undersampled::undersampled, false),
    (input::input, false),
    (rest::rest, false),
    (motion::motion, false),
    (drive::drive, false),
    (off::off, false),
    (comb::averaged_sensor, false),
    (sampling::sampling, true),
    (curve::curve, false),
    (saturation::saturation, false),
    (latency::start_latency, false),
    (start::start, false),
    (ripple::speed_ripple, false),
];

/// Everything odd that is found about a recording, what matters most first.
#[must_use]
pub fn diagnose(record: &Record) -> Vec<Finding> {
    let mut findings = findings(record);
    findings.iter_mut().for_each(|finding| finding.places.truncate(PLACES_MAX));
    findings
}

/// The same with all places. Outliers are found first, and the other rules look at the recording without them.
pub(super) fn findings(record: &Record) -> Vec<Finding> {
    let mut findings = Vec::new();
    let outliers = outliers(record);
    let view = View::new(record);
    outliers::report(&view, &outliers, &mut findings);
    let repaired = (!outliers.is_empty()).then(|| record.with_repaired(&outliers));
    let view = repaired.as_ref().map_or(view, View::new);
    for (rule, _) in RULES.iter().filter(|(_, by_current)| *by_current || !view.by_current()) {
        rule(&view, &mut findings);
    }
    let rank = |code: &str| FINDINGS.iter().position(|(listed, _)| *listed == code);
    debug_assert!(findings.iter().all(|finding| rank(finding.code).is_some()), "every code is in the table");
    findings.sort_by_key(|finding| (finding.severity == Severity::Mention, rank(finding.code)));
    findings
}

/// The outliers of each signal: those of the voltage first, because the outputs are explained by it.
fn outliers(record: &Record) -> Vec<Outliers> {
    let of_input = input_outliers::of_input(&View::new(record));
    let repaired = of_input.as_ref().map(|outliers| record.with_repaired(std::slice::from_ref(outliers)));
    let of_outputs = outliers::of_outputs(&View::new(repaired.as_ref().unwrap_or(record)));
    of_input.into_iter().chain(of_outputs).collect()
}

impl Record {
    /// Returns a copy with outliers replaced by what the samples around them predict.
    fn with_repaired(&self, outliers: &[Outliers]) -> Self {
        let mut record = self.clone();
        record.samples.change(|quantity, values| {
            for of in outliers.iter().filter(|of| of.quantity == quantity) {
                of.repaired.iter().for_each(|(n, value)| values[*n] = *value);
            }
        });
        record
    }

    /// Returns a copy with outliers of the voltage replaced by the voltage around them, and how many samples they are.
    pub(super) fn with_repaired_input(&self) -> Option<(Self, usize)> {
        let outliers = input_outliers::of_input(&View::new(self))?;
        let samples = outliers.repaired.len();
        Some((self.with_repaired(&[outliers]), samples))
    }
}

/// Returns the stretches in which the voltage changes faster than it is sampled.
pub(super) fn undersampled_stretches(record: &Record) -> Vec<Range<usize>> {
    undersampled::stretches(&View::new(record))
}
