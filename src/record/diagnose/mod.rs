//! What is odd about a recording, looked for before it is used: rules on its clock, its input, its sensors and what
//! the motor does. Each rule is quiet where it cannot tell.
//!
//! Thresholds come from trials on real recordings; false alarms are held down on simulated ones (`tests/diagnose.rs`).

mod clock;
mod comb;
mod current;
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
mod units;
mod view;

use super::{Quantity, Record};
use crate::setting::Text;
use std::ops::Range;
use view::View;

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
    /// The signal it is about; `None` where it is about several.
    pub quantity: Option<Quantity>,
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
    fn new(code: &'static str, message: impl Into<Text>, remedy: impl Into<Text>) -> Self {
        let (message, remedy) = (message.into(), remedy.into());
        let (places, figures) = (Vec::new(), Vec::new());
        Self { code, severity: Severity::Report, quantity: None, places, message, remedy, figures }
    }

    fn of(mut self, quantity: Quantity) -> Self {
        self.quantity = Some(quantity);
        self
    }

    fn mention_if(mut self, milder: bool) -> Self {
        if milder {
            self.severity = Severity::Mention;
        }
        self
    }

    fn reported(self) -> Self {
        Self { severity: Severity::Report, ..self }
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

/// A rule looks at a recording and adds what it finds.
type Rule = fn(&View<'_>, &mut Vec<Finding>);

const RULES: [Rule; 12] = [
    clock::jitter,
    units::units,
    sign::sign_reversed,
    input::input,
    rest::rest,
    motion::motion,
    drive::drive,
    comb::averaged_sensor,
    sampling::sampling,
    curve::curve,
    latency::start_latency,
    ripple::speed_ripple,
];

/// Those of recordings without a voltage.
const RULES_OF_CURRENT: [Rule; 4] = [clock::jitter, current::units, current::reversed, sampling::sampling];

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
    let rules: &[Rule] = if record.driver() == Quantity::Current { &RULES_OF_CURRENT } else { &RULES };
    for rule in rules {
        rule(&view, &mut findings);
    }
    findings.sort_by_key(|finding| finding.severity == Severity::Mention);
    findings
}
