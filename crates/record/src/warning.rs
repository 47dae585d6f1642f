//! Warnings about recordings and results: code, severity, message, location in a recording and remedy.

use super::diagnose::{Finding, Severity};
use super::heading::Quantity;
use super::record::Record;
use motorfit_core::setting::{Spelling, Text};
use motorfit_core::text::significant;
use serde_json::{Map, Value, json};
use std::fmt;

/// A warning about a recording or a result.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Warning {
    /// Stable short name, for programs.
    pub code: &'static str,
    /// Severity: a report, which makes wrong parameters likely, or a remark.
    #[serde(skip)]
    pub severity: Severity,
    /// Description for people.
    pub message: Text,
    /// Location in a recording; `None` if the warning does not come from a diagnosis of one.
    pub place: Option<Location>,
    /// Remedy; `None` if the message already contains it.
    pub remedy: Option<Text>,
}

/// A location in a recording: signal, times and lines of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Location {
    /// Name of the recording; `None` if there is only one.
    pub recording: Option<String>,
    /// Signal concerned; `None` if there are several.
    pub quantity: Option<Quantity>,
    /// First and last time of each segment \[s\]; empty if the complete recording is meant.
    pub times_s: Vec<[f64; 2]>,
    /// First and last line of the file for each segment; empty if the samples have no lines.
    pub lines: Vec<[u64; 2]>,
    /// Numbers that support the finding, by name.
    pub figures: Vec<(&'static str, f64)>,
}

/// Largest number of segments that are shown in full.
const TIMES_SHOWN: usize = 3;

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from_to = |a: String, b: String| if a == b { a } else { format!("{a} to {b}") };
        let mut parts: Vec<String> = self.recording.iter().cloned().collect();
        parts.extend(self.quantity.map(|quantity| quantity.to_string()));
        for (n, [from, to]) in self.times_s.iter().take(TIMES_SHOWN).enumerate() {
            let lines = self.lines.get(n).map_or_else(String::new, |[a, b]| {
                let word = if a == b { "line" } else { "lines" };
                format!(" ({word} {})", from_to(a.to_string(), b.to_string()))
            });
            parts.push(format!("{} s{lines}", from_to(significant(*from, 5), significant(*to, 5))));
        }
        let more = self.times_s.len().saturating_sub(TIMES_SHOWN);
        if more > 0 {
            parts.push(format!("{more} more"));
        }
        f.write_str(&if parts.is_empty() { "the complete recording".to_owned() } else { parts.join(", ") })
    }
}

impl serde::Serialize for Location {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let figures: Map<String, Value> =
            self.figures.iter().map(|(name, v)| ((*name).to_owned(), (*v).into())).collect();
        let place = json!({
            "record": self.recording, "quantity": self.quantity, "times_s": self.times_s,
            "lines": self.lines, "figures": figures, "text": self.to_string(),
        });
        place.serialize(serializer)
    }
}

impl Location {
    fn of(record: &Record, finding: &Finding) -> Self {
        let (time, lines) = (&record.samples().time_s, &record.source().lines);
        let ends = |range: &std::ops::Range<usize>| {
            let last = time.len() - 1;
            [range.start.min(last), (range.end.max(range.start + 1) - 1).min(last)]
        };
        let line_of = |range| {
            let [first, last] = ends(range);
            Some([lines.get(first)?, lines.get(last)?])
        };
        Self {
            recording: None,
            quantity: Some(finding.quantity),
            times_s: finding.places.iter().map(|range| ends(range).map(|n| time[n])).collect(),
            lines: finding.places.iter().filter_map(line_of).collect(),
            figures: finding.figures.clone(),
        }
    }
}

impl Warning {
    /// Creates a warning without a location.
    pub fn new(code: &'static str, message: impl Into<Text>) -> Self {
        Self { code, severity: Severity::Report, message: message.into(), place: None, remedy: None }
    }

    /// Creates a warning from a finding, with the samples as times and lines of the file.
    #[doc(hidden)]
    pub fn found(record: &Record, finding: Finding) -> Self {
        let place = Some(Location::of(record, &finding));
        let Finding { code, severity, message, remedy, .. } = finding;
        Self { code, severity, message, place, remedy: Some(remedy) }
    }

    /// Returns true if this is a reported finding that can cause a failed or poor fit.
    #[must_use]
    pub fn can_cause_poor_fit(&self) -> bool {
        self.severity == Severity::Report && super::diagnose::can_cause_poor_fit(self.code)
    }

    /// Returns the warning as one line, with settings spelled as in a front end.
    #[must_use]
    pub fn spelled(&self, spelling: Spelling) -> String {
        let place = self.place.as_ref().map_or_else(String::new, |place| format!("{place}: "));
        let message = self.message.spelled(spelling);
        let remedy = self.remedy.as_ref().map_or_else(String::new, |remedy| format!(" {}", remedy.spelled(spelling)));
        let end = if self.remedy.is_some() && !message.ends_with('.') { "." } else { "" };
        format!("{place}{message}{end}{remedy}")
    }
}

/// Returns the name of a recording in messages: the path, and the part of the file in parentheses.
#[doc(hidden)]
pub fn name_of(record: &Record) -> String {
    let Some(path) = &record.source().path else { return "the recording".to_owned() };
    record.source().part.iter().fold(path.display().to_string(), |name, part| format!("{name} ({part})"))
}
