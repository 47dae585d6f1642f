//! What is odd about a recording, looked for before it is used: rules on its clock, its input, its sensors and what
//! the motor does. Each rule is quiet where it cannot tell.
//!
//! Thresholds come from trials on real recordings; false alarms are held down on simulated ones (`tests/diagnose.rs`).

mod clock;
mod comb;
mod curve;
mod drive;
mod input;
mod latency;
mod motion;
mod rest;
mod ripple;
mod sampling;
mod sign;
mod spectrum;
mod undersampled;
mod units;
mod view;

use super::{Quantity, Record};
use crate::setting::{Text, text};
use std::ops::Range;
use view::{Channel, ConstantInput, View};

/// How much a finding matters.
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
    /// How much it matters.
    pub severity: Severity,
    /// The signal it is about.
    pub quantity: Quantity,
    /// The samples it is about, at most 20 ranges; empty where it is about the whole recording.
    pub places: Vec<Range<usize>>,
    /// In words.
    pub message: Text,
    /// What to do about it.
    pub remedy: Text,
    /// The figures that it rests on, by name.
    pub figures: Vec<(&'static str, f64)>,
}

/// How many places a finding names.
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

    fn at(mut self, places: impl IntoIterator<Item = Range<usize>>) -> Self {
        self.places.extend(places);
        self
    }

    fn figure(mut self, name: &'static str, value: f64) -> Self {
        self.figures.push((name, value));
        self
    }
}

/// The codes of findings, each with what it says.
pub static FINDINGS: [(&str, &str); 19] = [
    ("jitter", "Samples are not evenly spaced."),
    ("units", "Magnitudes fit no motor, but would in another unit."),
    ("sign_reversed", "A channel has the opposite sign of the others."),
    ("undersampled_input", "The voltage changes faster than it is sampled."),
    ("single_edge", "The voltage changes once only."),
    ("input_reset", "The voltage is reset at the end."),
    ("idle_input", "The voltage is not zero while the motor rests."),
    ("rest_offset", "A sensor is not zero while the motor rests."),
    ("no_motion", "The motor does not move under voltage."),
    ("motion_without_input", "The motor moves without voltage."),
    ("current_clipped", "The current is cut off or limited."),
    ("voltage_without_current", "The voltage does not reach the motor."),
    ("averaged_sensor", "A sensor shows an average over samples."),
    ("held_samples", "Values are repeated over several samples."),
    ("coarse_quantization", "The steps of a sensor are coarse."),
    ("speed_falls", "The speed falls where the voltage rises."),
    ("speed_saturates", "The speed no longer follows the voltage."),
    ("start_latency", "The first movement comes late."),
    ("speed_ripple", "The speed has a periodic ripple in the steady state."),
];

/// Looks at a recording and adds what it finds.
type Rule = fn(&View<'_>, &mut Vec<Finding>);

/// The rules in the order in which they look, each with whether it also is one of recordings whose input is the current.
const RULES: [(Rule, bool); 13] = [
    (clock::jitter, true),
    (units::units, true),
    (sign::sign_reversed, true),
    (undersampled::undersampled, false),
    (input::input, false),
    (rest::rest, false),
    (motion::motion, false),
    (drive::drive, false),
    (comb::averaged_sensor, false),
    (sampling::sampling, true),
    (curve::curve, false),
    (latency::start_latency, false),
    (ripple::speed_ripple, false),
];

/// Everything odd that is found about a recording, what matters most first.
#[must_use]
pub fn diagnose(record: &Record) -> Vec<Finding> {
    let mut findings = findings(record);
    findings.iter_mut().for_each(|finding| finding.places.truncate(PLACES_MAX));
    findings
}

/// The same with all places.
pub(super) fn findings(record: &Record) -> Vec<Finding> {
    let view = View::new(record);
    let mut findings = Vec::new();
    for (rule, _) in RULES.iter().filter(|(_, by_current)| *by_current || !view.by_current()) {
        rule(&view, &mut findings);
    }
    let is_listed = |finding: &Finding| FINDINGS.iter().any(|(code, _)| *code == finding.code);
    debug_assert!(findings.iter().all(is_listed), "every code is in the table");
    findings.sort_by_key(|finding| finding.severity == Severity::Mention);
    findings
}

/// Returns the stretches in which the voltage changes faster than it is sampled.
pub(super) fn undersampled_stretches(record: &Record) -> Vec<Range<usize>> {
    undersampled::stretches(&View::new(record))
}
