//! Warnings: what the reader of a result should know, with its place in a recording.

use crate::record::{Finding, Quantity, Record, Severity};
use crate::setting::{Spelling, Text};
use crate::text::significant;
use serde_json::{Map, Value, json};
use std::fmt;

/// Something that the reader of a result should know.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Warning {
    /// A short name that does not change.
    pub code: &'static str,
    /// True if parameters are likely wrong because of it; else it is a remark.
    #[serde(skip)]
    pub severity: Severity,
    /// In words.
    pub message: Text,
    /// Where it is, of what is found in a recording.
    pub place: Option<Place>,
    /// The remedy, where the message does not contain it.
    pub remedy: Option<Text>,
}

/// Where in a recording something is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Place {
    /// The recording, where there are several.
    pub recording: Option<String>,
    /// The signal; `None` where it is about several.
    pub quantity: Option<Quantity>,
    /// From when to when \[s\]; empty where it is all of the recording.
    pub times_s: Vec<[f64; 2]>,
    /// The lines of the file for each of the times, where it has lines.
    pub lines: Vec<[u64; 2]>,
    /// The figures that it rests on, by name.
    pub figures: Vec<(&'static str, f64)>,
}

/// Times that are spelled out.
const TIMES_SHOWN: usize = 3;

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from_to = |a: String, b: String| if a == b { a } else { format!("{a} to {b}") };
        let mut parts: Vec<String> = self.recording.iter().cloned().collect();
        parts.extend(self.quantity.map(|quantity| quantity.to_string()));
        for (n, [from, to]) in self.times_s.iter().take(TIMES_SHOWN).enumerate() {
            let lines = self
                .lines
                .get(n)
                .map_or_else(String::new, |[a, b]| format!(" (line {})", from_to(a.to_string(), b.to_string())));
            parts.push(format!("{} s{lines}", from_to(significant(*from, 5), significant(*to, 5))));
        }
        let more = self.times_s.len().saturating_sub(TIMES_SHOWN);
        if more > 0 {
            parts.push(format!("{more} more"));
        }
        f.write_str(&if parts.is_empty() { "the whole recording".to_owned() } else { parts.join(", ") })
    }
}

impl serde::Serialize for Place {
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

impl Place {
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
    /// A warning without a place.
    pub fn new(code: &'static str, message: impl Into<Text>) -> Self {
        Self { code, severity: Severity::Report, message: message.into(), place: None, remedy: None }
    }

    /// Returns a finding as a warning, its samples as times and lines.
    pub(crate) fn found(record: &Record, finding: Finding) -> Self {
        let place = Some(Place::of(record, &finding));
        let Finding { code, severity, message, remedy, .. } = finding;
        Self { code, severity, message, place, remedy: Some(remedy) }
    }

    /// Returns whether it is a finding that may explain why a fit fails or is poor.
    #[must_use]
    pub fn explains_failure(&self) -> bool {
        self.severity == Severity::Report && crate::record::explains_failure(self.code)
    }

    /// Returns the warning on one line, in the words of a front end.
    #[must_use]
    pub fn spelled(&self, spelling: Spelling) -> String {
        let place = self.place.as_ref().map_or_else(String::new, |place| format!("{place}: "));
        let message = self.message.spelled(spelling);
        let remedy = self.remedy.as_ref().map_or_else(String::new, |remedy| format!(" {}", remedy.spelled(spelling)));
        let end = if self.remedy.is_some() && !message.ends_with('.') { "." } else { "" };
        format!("{place}{message}{end}{remedy}")
    }
}

/// Returns the name of a recording in messages: its path and part.
pub(crate) fn name_of(record: &Record) -> String {
    let Some(path) = &record.source().path else { return "the recording".to_owned() };
    record.source().part.iter().fold(path.display().to_string(), |name, part| format!("{name} ({part})"))
}
