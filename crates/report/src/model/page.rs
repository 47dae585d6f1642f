//! The page of what was understood of a user's model, and parts of other pages.

use super::mathml::equation;
use crate::chart::{Form, Panel, Series};
use crate::page::{Page, Part};
use crate::pages::section;
use crate::recorded::Recorded;
use crate::table::Table;
use motorfit_core::text::{Shortest, significant};
use motorfit_evaluate::model::ModelRecording;
use motorfit_model::{InitialState, Model, ModelTerm};

/// Returns the page of what was understood of a model.
#[must_use]
pub fn model_check_page(model: &Model, notes: &[String]) -> Page {
    let mut about: Vec<Part> = notes.iter().cloned().map(Part::Text).collect();
    about.push(Part::Table(signals(model)));
    about.push(Part::Table(bounds(model)));
    about.extend(terms(model).map(Part::Text));
    Page {
        title: model.name().to_owned(),
        sections: vec![section("Equations", equations(model)), section("Signals and parameters", about)],
        ..Page::default()
    }
}

/// Returns the equations of a model, section by section.
pub(super) fn equations(model: &Model) -> Vec<Part> {
    let mut parts = Vec::new();
    let sections = [("signals", "Signals"), ("let", "Definitions"), ("states", "States"), ("outputs", "Outputs")];
    for (of, heading) in sections {
        let own: Vec<String> = model.equations().iter().filter(|e| e.section == of).map(equation).collect();
        if !own.is_empty() {
            parts.push(Part::Math { heading: heading.to_owned(), equations: own });
        }
    }
    parts
}

/// Returns a panel for each input that varies and each measured output.
pub(super) fn signal_panels(model: &Model, recording: &ModelRecording) -> Vec<Panel> {
    let recorded = Recorded::of_model(model, recording, false);
    let Recorded { time_s, outputs, .. } = &recorded;
    let panel = |label: &str, color: usize, form: Form, values: &[f64]| {
        let points = time_s.iter().copied().zip(values.iter().copied()).collect();
        Panel::new(label, vec![Series::new("", color, form, points)])
    };
    let inputs = recorded.drawn().map(|of| panel(&of.label, 0, Form::Steps, &of.values));
    let measured = outputs.iter().filter_map(|of| Some(panel(&of.label, 1, Form::Line, of.measured.as_ref()?)));
    inputs.chain(measured).collect()
}

fn signals(model: &Model) -> Table {
    let mut table = Table::new("signals", "Signals", &["signal", "kind", "unit", "column or initial value"]);
    for input in model.inputs() {
        let column = input.column.clone().unwrap_or_else(|| input.name.clone());
        let default = input.default.map_or(String::new(), |value| format!(", else {}", significant(value, 6)));
        table.row(vec![input.name.clone(), "input".to_owned(), input.unit.text.clone(), format!("{column}{default}")]);
    }
    for state in model.states() {
        let initial = match state.initial {
            InitialState::Given(_) => "given",
            InitialState::Measured(_) => "first sample of its output",
            InitialState::Free => "estimated for each recording",
        };
        table.row(vec![state.name.clone(), "state".to_owned(), state.unit.text.clone(), initial.to_owned()]);
    }
    for output in model.outputs() {
        let column = output.column.clone().unwrap_or_else(|| output.name.clone());
        table.row(vec![output.name.clone(), "output".to_owned(), output.unit.text.clone(), column]);
    }
    table
}

/// Returns a sentence on the optional terms; `None` if there are none.
fn terms(model: &Model) -> Option<String> {
    let name = |n: &usize| model.parameters()[*n].name.as_str();
    let term =
        |of: &ModelTerm| format!("{} ({})", of.name, of.parameters.iter().map(name).collect::<Vec<_>>().join(", "));
    let terms: Vec<String> = model.terms().iter().map(term).collect();
    (!terms.is_empty()).then(|| format!("Optional terms: {}.", terms.join("; ")))
}

fn bounds(model: &Model) -> Table {
    let mut table = Table::new("bounds", "Parameters", &["parameter", "unit", "bounds", "scale", "description"]);
    for of in model.parameters() {
        let scale = if of.is_logarithmic { "logarithmic" } else { "linear" };
        let neutral = of.neutral.map_or(String::new(), |value| format!("; neutral {}", Shortest(value)));
        let range = format!("{} … {}{neutral}", Shortest(of.min), Shortest(of.max));
        table.row(vec![of.name.clone(), of.unit.text.clone(), range, scale.to_owned(), of.description.clone()]);
    }
    table
}
