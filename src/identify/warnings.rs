//! What the reader of a result should know.

use super::characteristics::Characteristics;
use super::estimated::Estimated;
use super::mechanical::is_driven_by_current;
use super::spec::{Identification, IdentifySpec};
use super::verify::Status;
use crate::estimate::{Estimate, SmFailure, Whiteness};
use crate::evaluate::Initial;
use crate::motor::{Axis, Input, Parameter};
use crate::record::{Finding, Quantity, Record, Severity, diagnose};
use crate::setting::{Spelling, Text, text};
use crate::text::{engineering, significant};
use std::fmt;

/// Something that the reader of a result should know.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// A short name that does not change.
    pub code: &'static str,
    /// Whether parameters are likely off for it, or it is just good to know.
    pub severity: Severity,
    /// In words.
    pub message: Text,
    /// Where it is, of what is found in a recording.
    pub place: Option<Place>,
    /// What to do about it, where the message does not say.
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
            quantity: finding.quantity,
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

    /// What is found in a recording, its samples as times and lines.
    fn found(record: &Record, finding: Finding) -> Self {
        let place = Some(Place::of(record, &finding));
        let Finding { code, severity, message, remedy, .. } = finding;
        Self { code, severity, message, place, remedy: Some(remedy) }
    }

    /// On one line, in the words of a front end.
    #[must_use]
    pub fn spelled(&self, spelling: Spelling) -> String {
        let place = self.place.as_ref().map_or_else(String::new, |place| format!("{place}: "));
        let message = self.message.spelled(spelling);
        let remedy = self.remedy.as_ref().map_or_else(String::new, |remedy| format!(" {}", remedy.spelled(spelling)));
        let end = if self.remedy.is_some() && !message.ends_with('.') { "." } else { "" };
        format!("{place}{message}{end}{remedy}")
    }
}

/// Below so many samples 95 % intervals cover 81 to 90 % (measured).
const SAMPLES_FEW: usize = 12;
/// A fit below this is none.
const POOR_FIT_PERCENT: f64 = 50.0;

pub(super) fn poor_fit(fit_percent: [Option<f64>; 2]) -> Option<Warning> {
    let poor = |(name, fit): (&str, Option<f64>)| {
        fit.filter(|fit| *fit < POOR_FIT_PERCENT).map(|fit| format!("{name} {} %", significant(fit, 3)))
    };
    let list: Vec<String> = ["current", "speed"].into_iter().zip(fit_percent).filter_map(poor).collect();
    (!list.is_empty()).then(|| {
        let message = text!(
            ("the model does not fit ({}): do not use these parameters; check columns, ", list.join(", "))
            "units and signs, and " [Bounds]
        );
        Warning::new("poor_fit", message)
    })
}

pub(super) fn warnings_of(records: &[Record], spec: &IdentifySpec) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(warnings_of_records(records));
    let samples: usize = records.iter().map(Record::len).sum();
    if samples < SAMPLES_FEW {
        let message = format!("{samples} samples: from fewer than {SAMPLES_FEW} the intervals come out too narrow");
        warnings.push(Warning::new("few_samples", message));
    }
    warnings.extend(
        missing_channel(records, spec)
            .map(|(what, remedy)| Warning::new("channel_missing", what.and("; ").and(remedy))),
    );
    if spec.model.initial == Initial::Zero && records.iter().flat_map(Record::measured).flatten().any(moves_at_start) {
        let say = "a recording does not start at rest, but ";
        let message = text!("{say}" [Initial = "zero"] " says so; use " [Initial = "free"]);
        warnings.push(Warning::new("initial_state", message));
    }
    warnings
}

/// What is suspicious about recordings, each named.
#[must_use]
pub fn warnings_of_records(records: &[Record]) -> Vec<Warning> {
    let named = |record: &Record| {
        let name = name_of(record);
        let place = move |warning: Warning| {
            let place = Place { recording: Some(name.clone()), ..warning.place.unwrap_or_default() };
            Warning { place: Some(place), ..warning }
        };
        record_warnings(record).into_iter().map(place).collect::<Vec<_>>()
    };
    records.iter().flat_map(named).collect()
}

pub(super) fn name_of(record: &Record) -> String {
    let Some(path) = &record.source().path else { return "the recording".to_owned() };
    record.source().part.iter().fold(path.display().to_string(), |name, part| format!("{name} ({part})"))
}

/// What is said of a result.
pub(super) fn of_result(found: &Identification, estimate: &std::result::Result<Estimate, SmFailure>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |code, message: Text| warnings.push(Warning::new(code, message));
    if found.searched.is_fallback && found.input == Input::Voltage {
        let failure = estimate.as_ref().err().copied().unwrap_or(SmFailure::PoorFit);
        let message = format!("Steiglitz–McBride cannot serve: {}; a population search took over", failure.message());
        warn("sm_failed", message.into());
    }
    for parameter in Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS) {
        if let Some(side) = found.at_bound(parameter) {
            let symbol = parameter.symbol();
            if is_idle(found, parameter, side) {
                let name = parameter.name();
                warn(
                    "extension_idle",
                    format!("the recordings show no {name}: {symbol} ended where it changes nothing").into(),
                );
                continue;
            }
            warn(
                "at_bound",
                text!(
                    "{symbol} ended at its {side} bound; widen it with " [Bounds]
                    ", or the others hold only if it is right"
                ),
            );
        }
    }
    warnings.extend(poor_fit(found.fit_percent));
    let mut warn = |code, message: Text| warnings.push(Warning::new(code, message));
    if !found.converged {
        warn("not_converged", "the refinement has not come to its end: the result may be near the optimum only".into());
    }
    if let Some(uncertainty) = &found.uncertainty {
        let colored = |(name, white): (&str, &Option<Whiteness>)| {
            white.filter(|w| !w.is_white).map(|w| format!("{name} (from sample to sample {:.2})", w.lag1))
        };
        let list: Vec<String> =
            ["current", "speed"].into_iter().zip(&uncertainty.whiteness).filter_map(colored).collect();
        if !list.is_empty() {
            warn(
                "residuals_not_white",
                format!(
                    "the residuals are correlated, {}: the model misses something, or the sensors filter; the standard \
                     errors are then too small",
                    list.join(", ")
                )
                .into(),
            );
        }
    }
    if found.verification.status == Status::SearchStuck {
        let times = significant(1.0 + found.verification.cost_gap.unwrap_or(f64::NAN), 3);
        let rescued = found.uncertainty.is_some() && found.verification.refined_agrees;
        let what = if rescued { "the refinement left it for a better one" } else { "a reference fits better" };
        warn(
            "search_stuck",
            text!(
                "the search ended in another optimum, whose weighted sum of squares is {times} times the best; {what}; \
                 use " [Method = "auto"] ", more " [Generations] " or another " [Seed]
            ),
        );
    }
    warnings
}

/// Whether a parameter of an extension stands at the bound at which it changes nothing.
fn is_idle(found: &Identification, parameter: Parameter, side: &str) -> bool {
    let Some(axis) = found.space.free().iter().find(|axis| axis.parameter == parameter) else { return false };
    let at = if side == "min" { axis.min } else { axis.max };
    parameter.is_extension()
        && (at.to_bits() == parameter.neutral().to_bits() || (side == "max" && parameter == Parameter::Saturation))
}

/// A dead time of more than so many time constants does not belong to a motor.
const DEAD_TIME_MAX: f64 = 3.0;

/// The warning for a dead time that is long against the motor.
pub(super) fn long_dead_time(found: &Identification) -> Option<Warning> {
    let constant = Characteristics::of(found)?.time_constant.value;
    let estimates = found.estimates();
    let long =
        |e: &&Estimated| e.parameter == Parameter::DeadTime && e.value.is_some_and(|td| td > DEAD_TIME_MAX * constant);
    let dead_time = estimates.iter().find(long)?.value?;
    let message = format!(
        "the dead time, {}, is {} of the motor's time constants ({}): a clock that is off, or a recording that begins \
         before the drive, looks like that",
        engineering(dead_time, "s", 3),
        significant(dead_time / constant, 2),
        engineering(constant, "s", 3)
    );
    Some(Warning::new("dead_time_long", message))
}

/// What speed alone or current alone cannot give, and what to do.
pub(super) fn missing_channel(records: &[Record], spec: &IdentifySpec) -> Option<(Text, Text)> {
    if is_driven_by_current(records) {
        return None;
    }
    let free: Vec<&Axis> = spec.space.free().iter().filter(|axis| !axis.parameter.is_extension()).collect();
    let is_free = |parameter| free.iter().any(|axis| axis.parameter == parameter);
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    let unused = unused_columns(records);
    if missing(0) && free.len() > 3 {
        let count = free.len();
        Some((
            text!("no current" {unused} ": speed alone fixes three combinations of the {count} free parameters"),
            text!("record the current, or hold two with " [Fix] ", R and K for example."),
        ))
    } else if missing(1) && [Parameter::K, Parameter::B, Parameter::J].into_iter().all(is_free) {
        Some((
            text!("no speed" {unused} ": current alone leaves K, B and J free along K : B : J = 1 : 2 : 2"),
            text!("record the speed or hold K with " [Fix] "."),
        ))
    } else {
        None
    }
}

/// The columns that were not used, in words.
pub(super) fn unused_columns(records: &[Record]) -> Text {
    let unused: Vec<String> = records.iter().flat_map(|r| r.source().ignored.iter().cloned()).take(12).collect();
    match unused.len() {
        0 => Text::default(),
        _ => text!((" (columns not used: {}; name one with ", unused.join(", ")) [Columns] ")"),
    }
}

fn moves_at_start(signal: &[f64]) -> bool {
    signal[0].abs() > 0.05 * signal.iter().fold(0.0, |peak: f64, v| peak.max(v.abs()))
}

/// A period from which on it is doubted \[s\], if nobody names its unit: a motor moves faster, and a logger in
/// milliseconds is common.
const PERIOD_DOUBTED_S: f64 = 0.02;

/// What is suspicious about a recording, whatever it is used for.
#[must_use]
pub fn record_warnings(record: &Record) -> Vec<Warning> {
    let whole = |finding: &Finding| {
        let masked = |place: &std::ops::Range<usize>| {
            record.excluded().iter().any(|e| e.start <= place.start && place.end <= e.end)
        };
        finding.places.is_empty() || !finding.places.iter().all(masked)
    };
    let mut warnings: Vec<Warning> =
        diagnose(record).into_iter().filter(whole).map(|finding| Warning::found(record, finding)).collect();
    let columns = &record.source().columns;
    let period = record.period_s();
    let unit_open = columns.iter().any(|c| c.quantity == Quantity::Time && !c.unit_named);
    if period >= PERIOD_DOUBTED_S && unit_open && !warnings.iter().any(|w| w.code == "units") {
        let message = text!(
            "{period} s between samples is long for a motor; if the times are milliseconds, name the unit: "
                [Columns = "time=HEADING:ms"]
        );
        warnings.push(Warning::new("period_unit", message));
    }
    let (driver, input) = (record.driver(), record.input());
    if input.iter().all(|v| v.to_bits() == input[0].to_bits()) && input[0] != 0.0 {
        let (value, unit) = (input[0], driver.unit());
        let message =
            format!("the {driver} is {value} {unit} throughout; fine if the motor starts from rest in this recording");
        let code = if driver == Quantity::Current { "constant_current" } else { "constant_voltage" };
        warnings.push(Warning::new(code, message));
    }
    let assumed: Vec<String> =
        (columns.iter().filter(|c| !c.unit_named)).map(|c| format!("{} in {}", c.heading, c.unit)).collect();
    if !assumed.is_empty() {
        let message = text!(("no unit is named, taken to be {}; name it with ", assumed.join(", "))[Columns]);
        warnings.push(Warning::new("unit_assumed", message));
    }
    if record.source().last_line_open {
        let message = "the file ends without a line end: its last number may be cut off";
        warnings.push(Warning::new("no_line_end", message));
    }
    warnings.sort_by_key(|warning| warning.severity == Severity::Mention);
    warnings
}
