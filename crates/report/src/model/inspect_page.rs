//! Page of an inspection with a user's model: the signals, and what they identify.

use super::inspect::{ModelInspection, ModelSignalFacts};
use super::page::signal_panels;
use crate::chart::Chart;
use crate::inspect::name;
use crate::page::{Item, Page, Part, capital};
use crate::pages::{Reproduced, reproduce, section};
use crate::spelling::command_line;
use crate::table::{Table, dash};
use motorfit_core::Result;
use motorfit_core::text::{engineering, significant};
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::model::ModelIdentification;
use motorfit_model::Model;

/// Returns the page of inspections with a model.
#[must_use]
pub fn model_inspect_page(model: &Model, inspections: &[ModelInspection<'_>], how: &Reproduced) -> Page {
    let mut sections = Vec::new();
    for (n, one) in (1..).zip(inspections) {
        let of = if inspections.len() > 1 { format!(" of {}", name(one.record)) } else { String::new() };
        sections.push(section(&format!("Signals{of}"), vec![Part::Chart(signals(n, model, &one.recording))]));
        sections.push(section(&format!("Statistics{of}"), vec![Part::Table(statistics(n, &one.facts))]));
        sections.push(section(&format!("Parameters that the recording identifies{of}"), identified(n, &one.found)));
    }
    sections.push(reproduce(inspections.iter().map(|one| one.record), how, None));
    let (title, answer) = match inspections {
        [one] => (format!("Inspection of {}", name(one.record)), holds(one)),
        many => (format!("Inspection of {} recordings", many.len()), String::new()),
    };
    Page { title, answer: format!("Model: {}. {answer}", model.name()), sections, ..Page::default() }
}

fn holds(one: &ModelInspection<'_>) -> String {
    let time = &one.record.samples().time_s;
    let length = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first);
    let names: Vec<&str> = one.facts.iter().map(|facts| facts.name.as_str()).collect();
    let period = engineering(one.record.period_s(), "s", 4);
    let mut text = format!(
        "{} samples every {period} for {} of {}.",
        one.record.len(),
        engineering(length, "s", 4),
        names.join(", ")
    );
    if !one.record.source().ignored.is_empty() {
        text.push_str(&format!(" Not used: {}.", one.record.source().ignored.join(", ")));
    }
    text
}

fn signals(n: usize, model: &Model, recording: &ModelRecording) -> Chart {
    Chart {
        id: format!("signals-{n}"),
        axis: "time [s]".to_owned(),
        panels: signal_panels(model, recording),
        alternative: "inputs and measured outputs over time".to_owned(),
        caption: "The signals of the recording in the units of the model.".to_owned(),
        ..Chart::default()
    }
}

fn statistics(n: usize, facts: &[ModelSignalFacts]) -> Table {
    let heads = ["signal", "kind", "unit", "min", "max", "mean", "rms", "noise σ"];
    let mut table = Table::new(format!("statistics-{n}"), "Statistics", &heads);
    for one in facts {
        let of = &one.statistics;
        let numbers = [of.min, of.max, of.mean, of.rms].map(|value| significant(value, 4));
        let first = [one.name.clone(), if one.is_input { "input" } else { "output" }.to_owned(), one.unit.clone()];
        table.row(first.into_iter().chain(numbers).chain([significant(of.noise_sigma, 2)]));
    }
    table
}

fn identified(n: usize, found: &Result<ModelIdentification>) -> Vec<Part> {
    let found = match found {
        Ok(found) => found,
        Err(error) => {
            let (message, hint) = (error.spelled(command_line), error.hint().spelled(command_line));
            return vec![Part::Text(format!("None: {message}. {hint}"))];
        }
    };
    let mut table =
        Table::new(format!("errors-{n}"), "Standard errors", &["parameter", "estimate", "unit", "standard error"]);
    for e in &found.estimates {
        let relative = e.std_error.zip(e.value).map(|(error, value)| 100.0 * (error / value).abs());
        table.row([
            e.label(),
            e.value.map_or_else(dash, |value| significant(value, 5)),
            e.unit.clone(),
            relative.map_or_else(dash, |percent| format!("{} %", significant(percent, 2))),
        ]);
    }
    table.note(format!("Of an identification from this recording alone. Integration: {}.", found.method.described()));
    let mut parts = vec![Part::Table(table)];
    parts.extend(found.combinations.iter().map(|text| Part::Warning(format!("{}.", capital(text)))));
    let outliers = found.trust.reasons.iter().filter(|reason| reason.code == "outliers");
    let item = |reason: &motorfit_identify::TrustReason| Item {
        name: "Suspect:".to_owned(),
        grave: true,
        text: reason.message.spelled(command_line),
        details: Vec::new(),
    };
    let items: Vec<Item> = outliers.map(item).collect();
    if !items.is_empty() {
        parts.push(Part::Items(items));
    }
    parts
}
