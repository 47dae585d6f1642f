//! Findings: possible faults of a recording, with their codes.

use crate::heading::Quantity;
use crate::record::Record;
use motorfit_core::setting::Text;
use std::ops::Range;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// A fault that is certain enough and likely biases the parameters; it is reported with them.
    Report,
    /// A remark: a minor or less certain fault.
    Mention,
}

/// A possible fault of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Stable short name, for programs.
    pub code: &'static str,
    /// Severity of the fault.
    pub severity: Severity,
    /// Signal concerned.
    pub quantity: Quantity,
    /// Ranges of samples concerned, at most 20; empty if the complete recording is meant.
    pub places: Vec<Range<usize>>,
    /// Description for people.
    pub message: Text,
    /// Remedy, as one or more sentences.
    pub remedy: Text,
    /// Numbers that support the finding, by name.
    pub figures: Vec<(&'static str, f64)>,
}

impl Finding {
    pub(super) fn new(
        code: &'static str,
        quantity: Quantity,
        message: impl Into<Text>,
        remedy: impl Into<Text>,
    ) -> Self {
        let (message, remedy) = (message.into(), remedy.into());
        let (places, figures) = (Vec::new(), Vec::new());
        Self { code, severity: Severity::Report, quantity, places, message, remedy, figures }
    }

    /// Returns true if it is about the complete recording, or about samples that are not all excluded.
    #[doc(hidden)]
    pub fn is_visible(&self, record: &Record) -> bool {
        let masked =
            |place: &Range<usize>| record.excluded().iter().any(|e| e.start <= place.start && place.end <= e.end);
        self.places.is_empty() || !self.places.iter().all(masked)
    }

    pub(super) fn mention_if(mut self, milder: bool) -> Self {
        if milder {
            self.severity = Severity::Mention;
        }
        self
    }

    pub(super) fn report_if(mut self, graver: bool) -> Self {
        if graver {
            self.severity = Severity::Report;
        }
        self
    }

    pub(super) fn at(mut self, places: impl IntoIterator<Item = Range<usize>>) -> Self {
        self.places.extend(places);
        self
    }

    pub(super) fn figure(mut self, name: &'static str, value: f64) -> Self {
        self.figures.push((name, value));
        self
    }
}

/// Codes of findings with their meanings, in decreasing order of their likelihood to cause a poor fit.
pub static FINDINGS: [(&str, &str); 22] = [
    ("sign_reversed", "A channel has the opposite sign of the others."),
    ("units", "The magnitudes are implausible for a motor, but plausible in another unit."),
    ("units_disagree", "The speed is not the derivative of the position beside it."),
    (
        "position_ratio",
        "The position changes by another factor or sign than the integral of the speed, as behind a gear.",
    ),
    ("no_motion", "The motor does not move under voltage."),
    ("motion_without_input", "The motor moves without voltage."),
    ("voltage_without_current", "The voltage does not reach the motor."),
    ("outliers", "Single samples are far from their neighbours."),
    ("current_clipped", "The current is clipped or limited."),
    ("start_latency", "The motor responds late to the first voltage."),
    ("speed_falls", "The speed falls where the voltage rises."),
    ("speed_saturates", "The speed no longer follows the voltage."),
    ("undersampled_input", "The voltage changes faster than it is sampled."),
    ("averaged_sensor", "A sensor averages over samples."),
    ("held_samples", "Values are repeated over several samples."),
    ("rest_offset", "A sensor is not zero while the motor is at rest."),
    ("coarse_quantization", "The quantization of a sensor is coarse."),
    ("speed_ripple", "The speed has a periodic ripple in the steady state."),
    ("input_reset", "The voltage is reset at the end."),
    ("idle_input", "The voltage is not zero while the motor is at rest."),
    ("single_edge", "The voltage changes only once."),
    ("jitter", "Samples are not evenly spaced."),
];

/// Codes of findings that affect the errors of a fit but do not make it fail.
const MINOR: [&str; 6] = ["rest_offset", "speed_ripple", "input_reset", "idle_input", "single_edge", "jitter"];

/// Returns true if reported findings of a code can cause a failed or poor fit.
#[must_use]
pub fn can_cause_poor_fit(code: &str) -> bool {
    FINDINGS.iter().any(|(listed, _)| *listed == code) && !MINOR.contains(&code)
}
