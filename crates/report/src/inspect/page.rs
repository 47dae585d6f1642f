//! Page of an inspection: the findings, the signals with the findings marked, and the columns as imported.

use super::facts::SignalFacts;
use crate::chart::{Chart, Figure, Form, Mark, Panel, Series};
use crate::page::{Item, Page, Part, Section, capital};
use crate::pages::{Reproduced, reproduce, section};
use crate::signals::input_form;
use crate::spelling::command_line;
use crate::table::{Table, dash};
use motorfit_core::text::{engineering, printable, significant};
use motorfit_identify::{Identifiability, Inspection};
use motorfit_record::warning::Warning;
use motorfit_record::{Quantity, Record, Severity};

/// Returns the page of inspections; `band` is the settling band as a fraction of the steady state.
#[must_use]
pub fn inspect_page(inspections: &[Inspection<'_>], band: f64, how: &Reproduced) -> Page {
    let count = |severity| inspections.iter().flat_map(|i| &i.warnings).filter(|w| w.severity == severity).count();
    let answer = match (inspections, count(Severity::Report), count(Severity::Mention)) {
        ([one], reports, mentions) => {
            let (what, odd) = (holds(one.record), counted(reports, mentions));
            format!("{what}. {odd} {}", identifiability(one))
        }
        (many, reports, mentions) => format!("{} recordings. {}", many.len(), counted(reports, mentions)),
    };
    let mut sections: Vec<Section> = Vec::new();
    for (n, inspection) in inspections.iter().enumerate() {
        let heading = if inspections.len() == 1 { "Findings".to_owned() } else { name(inspection.record) };
        sections.push(section(&heading, odd(inspection, inspections.len() > 1)));
        sections.push(section("Signals", vec![Part::Chart(signals(inspection, n))]));
        sections.push(section("Columns and statistics", understood(inspection.record, band)));
    }
    sections.push(reproduce(inspections.iter().map(|i| i.record), how, None));
    let title = match inspections {
        [one] => format!("Inspection of {}", name(one.record)),
        many => format!("Inspection of {} recordings", many.len()),
    };
    Page { title, answer, sections, ..Page::default() }
}

/// Returns the name of a recording's file, with its part.
pub(crate) fn name(record: &Record) -> String {
    let source = record.source();
    let file = source.file_name().unwrap_or_else(|| "a recording".to_owned());
    source.part.as_ref().map_or(file.clone(), |part| format!("{file}, {part}"))
}

fn holds(record: &Record) -> String {
    let time = &record.samples().time_s;
    let signals = record.source().columns.iter().filter(|c| c.quantity != Quantity::Time);
    let columns: Vec<String> = signals.map(|c| c.quantity.to_string()).collect();
    format!(
        "{} samples every {} for {} of {}",
        record.len(),
        engineering(record.period_s(), "s", 4),
        engineering(time[time.len() - 1] - time[0], "s", 4),
        columns.join(", ")
    )
}

fn counted(reports: usize, mentions: usize) -> String {
    let many = |count: usize, one: &str, more: &str| match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {more}"),
    };
    match (reports, mentions) {
        (0, 0) => "No fault was found.".to_owned(),
        (0, _) => format!("No fault was found, {}.", many(mentions, "remark", "remarks")),
        (_, 0) => format!("{} found.", many(reports, "fault was", "faults were")),
        _ => format!("{} found, {}.", many(reports, "fault was", "faults were"), many(mentions, "remark", "remarks")),
    }
}

fn identifiability(inspection: &Inspection<'_>) -> String {
    match &inspection.identifiability {
        Identifiability::Identifies { .. } => {
            let errors = inspection.identifiability.errors().unwrap_or_default();
            format!("The recording identifies {errors} (standard errors, if the model is adequate).")
        }
        Identifiability::Lacks { message, remedy } => {
            let message = message.spelled(command_line);
            // The heading names the file already.
            let path = inspection
                .record
                .source()
                .path
                .as_ref()
                .map(|path| format!("{}: ", printable(&path.display().to_string())));
            let message = path.and_then(|path| message.strip_prefix(&path)).unwrap_or(&message);
            format!(
                "The recording does not identify all five parameters: {message}. {}",
                capital(&remedy.spelled(command_line))
            )
        }
    }
}

/// Returns the findings, numbered as in the plots.
fn odd(inspection: &Inspection<'_>, several: bool) -> Vec<Part> {
    let mut parts = Vec::new();
    if several {
        let text = format!("{}. {}", holds(inspection.record), identifiability(inspection));
        parts.push(Part::Text(text));
    }
    if inspection.warnings.is_empty() {
        parts.push(Part::Text("No fault was found.".to_owned()));
        return parts;
    }
    let item = |(n, warning): (usize, &Warning)| {
        let grave = warning.severity == Severity::Report;
        let place = warning.place.as_ref().map(|place| ("where".to_owned(), place.to_string()));
        let remedy = warning.remedy.as_ref().map(|remedy| ("what to do".to_owned(), remedy.spelled(command_line)));
        let code = ("code".to_owned(), warning.code.to_owned());
        Item {
            name: format!("{}. {}:", n + 1, if grave { "Fault" } else { "Remark" }),
            grave,
            text: warning.message.spelled(command_line),
            details: place.into_iter().chain(remedy).chain([code]).collect(),
        }
    };
    parts.push(Part::Items(inspection.warnings.iter().enumerate().map(item).collect()));
    parts
}

/// Returns the figure of all signals of a recording over time, as a drawing for a file.
#[must_use]
pub fn record_figure(record: &Record) -> Figure {
    let caption = "The signals of the recording.".to_owned();
    let alternative = format!("The signals of {} over time", name(record));
    Figure { alternative, caption, ..signal_chart("signals".to_owned(), record, &[]).figure() }
}

/// Returns all signals over time, with the findings marked.
fn signals(inspection: &Inspection<'_>, n: usize) -> Chart {
    let chart = signal_chart(format!("signals-{}", n + 1), inspection.record, &inspection.warnings);
    let has_marks = chart.panels.iter().any(|panel| !panel.marks.is_empty());
    let caption = match (has_marks, inspection.warnings.is_empty()) {
        (true, _) => {
            "Orange: the location of a finding, by its number above. Findings without a location concern the complete signal."
        }
        (false, false) => "The findings concern complete signals.",
        (false, true) => "",
    };
    Chart { caption: caption.to_owned(), ..chart }
}

/// Returns each signal of a recording over time, with the warnings marked by their numbers.
fn signal_chart(id: String, record: &Record, warnings: &[Warning]) -> Chart {
    let panel = |(quantity, signal): (Quantity, &[f64])| {
        let points = record.samples().time_s.iter().copied().zip(signal.iter().copied()).collect();
        let is_input = quantity == Quantity::Voltage;
        let form = if is_input { input_form(record) } else { Form::Line };
        let own: Vec<(usize, &Warning)> =
            warnings.iter().enumerate().filter(|(_, w)| is_of(w, quantity, record.driver())).collect();
        let numbers: Vec<String> = own.iter().map(|(n, _)| (n + 1).to_string()).collect();
        let findings = if numbers.is_empty() { String::new() } else { format!(", findings {}", numbers.join(", ")) };
        let label = format!("{} [{}]{findings}", quantity, quantity.unit());
        let marks = own.iter().flat_map(|(n, warning)| marks(*n, warning)).collect();
        Panel { marks, ..Panel::new(&label, vec![Series::new("", usize::from(!is_input), form, points)]) }
    };
    Chart {
        id,
        axis: "time [s]".to_owned(),
        panels: super::facts::signals(record).map(panel).collect(),
        is_grid: false,
        alternative: format!("of {} over time, findings marked", name(record)),
        caption: String::new(),
    }
}

/// Returns true if a finding concerns a signal; those about time are shown with the input.
fn is_of(warning: &Warning, quantity: Quantity, driver: Quantity) -> bool {
    let Some(place) = &warning.place else { return false };
    match place.quantity {
        Some(Quantity::Time) | None => quantity == driver,
        Some(own) => own == quantity,
    }
}

fn marks(n: usize, warning: &Warning) -> Vec<Mark> {
    let times = warning.place.iter().flat_map(|place| &place.times_s);
    let label = |first: bool| if first { (n + 1).to_string() } else { String::new() };
    times.enumerate().map(|(k, range)| Mark { range: *range, label: label(k == 0) }).collect()
}

/// Returns the tables of the imported columns and of the statistics of the signals.
fn understood(record: &Record, band: f64) -> Vec<Part> {
    let source = record.source();
    let mut columns = Table::new("columns", "Columns", &["heading", "quantity", "conversion", "unit"]);
    for column in &source.columns {
        let unit = if column.unit_named { column.unit.clone() } else { format!("{}, assumed", column.unit) };
        columns.row([column.heading.clone(), column.quantity.to_string(), column.conversion.clone(), unit]);
    }
    if !source.ignored.is_empty() {
        columns.note(format!("Not used: {}.", source.ignored.join(", ")));
    }
    source.notes.iter().for_each(|note| columns.note(format!("{}.", capital(note))));
    let heads = ["signal", "min", "max", "mean", "rms", "noise σ", "peak at [s]", "overshoot [%]", "settled from [s]"];
    let mut signals = Table::new("signals", "Signals in SI units", &heads);
    for facts in SignalFacts::of(record, band) {
        let number = |value: f64| significant(value, 4);
        let response = |of: &dyn Fn(&motorfit_motor::StepResponse) -> Option<f64>| {
            facts.response.as_ref().and_then(of).map_or_else(dash, number)
        };
        signals.row([
            format!("{} [{}]", facts.quantity, facts.quantity.unit()),
            number(facts.statistics.min),
            number(facts.statistics.max),
            number(facts.statistics.mean),
            number(facts.statistics.rms),
            significant(facts.statistics.noise_sigma, 2),
            response(&|r| Some(r.peak_time_s)),
            response(&|r| r.overshoot_percent),
            response(&|r| r.settling_time_s),
        ]);
    }
    let jitter = significant(100.0 * record.steps().jitter, 2);
    let regular = record.steps().jitter < 1e-6;
    signals.note(match regular {
        true => "Samples are equally spaced.".to_owned(),
        false => format!("Sampling intervals deviate by up to {jitter} % from the period."),
    });
    vec![Part::Table(columns), Part::Table(signals)]
}
