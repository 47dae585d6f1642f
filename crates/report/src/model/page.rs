//! Pages of results with a user's model.

use super::mathml::equation;
use super::selection::{model_selection_table, model_selection_text};
use crate::chart::{Band, Chart, Figure, Form, Panel, Series, correlation};
use crate::page::{Card, Page, Part, Trust, capital};
use crate::pages::{Reproduced, folded, reproduce, section, warnings};
use crate::spelling::command_line;
use crate::table::{Table, dash};
use motorfit_core::numeric::rms;
use motorfit_core::text::{Shortest, decimals, in_suitable_unit, significant};
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::model::{ModelEstimate, ModelFit, ModelIdentification};
use motorfit_model::{InitialState, Model, ModelInput, ModelOutput, ModelTerm};
use motorfit_record::Record;

/// Returns the page of an identification with a model.
#[must_use]
pub fn model_page(
    records: &[Record],
    (model, recordings): (&Model, &[ModelRecording]),
    found: &ModelIdentification,
    how: &Reproduced,
) -> Page {
    let mut sections = Vec::new();
    let reported = warnings(&found.warnings, command_line);
    if !reported.is_empty() {
        sections.push(section("Warnings", reported));
    }
    let charts = (1..).zip(recordings.iter().zip(&found.fits));
    let charts = charts.map(|(n, (recording, fit))| {
        let mut chart = model_chart(&format!("response-{n}"), model, recording, &[("model", &fit.simulated)]);
        add_start(&mut chart, model, recording, fit);
        Part::Chart(chart)
    });
    sections.push(section("Measured and modelled", charts.collect()));
    let mut estimates =
        vec![Part::Table(parameters(model, found)), Part::Text(verdict(found)), Part::Table(fits(model, found))];
    estimates.extend(found.combinations.iter().map(|text| Part::Text(format!("{}.", capital(text)))));
    estimates.extend(model_correlations(model, found).map(Part::Figure));
    sections.push(section("Estimates", estimates));
    if let Some(table) = model_selection_table(model, found) {
        let words = model_selection_text(found).unwrap_or_default();
        sections.push(folded("Model selection", vec![Part::Text(format!("Model: {words}.")), Part::Table(table)]));
    }
    sections.push(section("Equations", equations(model)));
    sections.push(reproduce(records, how, None));
    let name = records.first().and_then(|record| record.source().file_name());
    let name = name.unwrap_or_else(|| "a recording".to_owned());
    Page {
        title: format!("{} of {name}", model.name()),
        trust: Some(trust(found)),
        cards: found.estimates.iter().filter(|e| e.recording.is_none()).map(|e| card(model, e)).collect(),
        answer: String::new(),
        sections,
    }
}

/// Adds the response at the start values to the panels of the outputs, below the others.
fn add_start(chart: &mut Chart, model: &Model, recording: &ModelRecording, fit: &ModelFit) {
    for (output, values) in model.outputs().iter().zip(fit.at_start.iter().flatten()) {
        let label = label(&output.name, &output.unit.text);
        if let Some(panel) = chart.panels.iter_mut().rfind(|panel| panel.label == label) {
            panel.series.insert(0, Series::new("start", 2, Form::Line, curve(&recording.time_s, values)));
        }
    }
}

/// Returns the chart of the measured and modelled signals of a recording, as a drawing for a file.
#[must_use]
pub fn model_figure(model: &Model, recording: &ModelRecording, fit: &ModelFit) -> Figure {
    model_chart("response", model, recording, &[("model", &fit.simulated)]).figure()
}

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

fn equations(model: &Model) -> Vec<Part> {
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

fn trust(found: &ModelIdentification) -> Trust {
    let reasons: Vec<String> = found.trust.reasons.iter().map(|reason| reason.message.spelled(command_line)).collect();
    let next = found.trust.next.as_ref();
    let next = next.map_or(String::new(), |next| format!(" Next: {}", next.spelled(command_line)));
    let text = match reasons.is_empty() {
        true => "No test of the residuals or the search contradicts the standard errors.".to_owned(),
        false => format!("{}.{next}", capital(&reasons.join("; "))),
    };
    Trust { level: found.trust.level.name(), text }
}

fn remark(estimate: &ModelEstimate) -> &'static str {
    match (estimate.value, estimate.fixed, estimate.at_bound) {
        (None, ..) => "not identifiable",
        (_, true, _) => "fixed",
        (_, _, Some("max")) => "at its upper bound",
        (_, _, Some(_)) => "at its lower bound",
        _ => "",
    }
}

fn card(model: &Model, estimate: &ModelEstimate) -> Card {
    let description =
        model.parameters().iter().find(|own| own.name == estimate.name).map(|own| own.description.clone());
    let remark = remark(estimate).to_owned();
    let (symbol, name) = (estimate.name.clone(), description.unwrap_or_default());
    let Some(value) = estimate.value else {
        return Card { symbol, name, value: "\u{2013}".to_owned(), unit: String::new(), remark };
    };
    let [value, unit] = in_suitable_unit(value, estimate.std_error, &estimate.unit.replace('*', "·"));
    Card { symbol, name, value, unit, remark }
}

fn parameters(model: &Model, found: &ModelIdentification) -> Table {
    let heads = ["parameter", "value", "unit", "standard error", "95 % interval", "remark"];
    let mut table = Table::new("parameters", "Parameters", &heads);
    for e in &found.estimates {
        let description = model.parameters().iter().find(|own| own.name == e.name).map(|own| own.description.as_str());
        let description = description.filter(|text| !text.is_empty()).map_or(String::new(), |text| format!(", {text}"));
        let of = e.recording.map_or(String::new(), |n| format!(" of recording {}", n + 1));
        table.row(vec![
            format!("{}{description}{of}", e.name),
            e.value.map_or_else(dash, |value| significant(value, 6)),
            e.unit.clone(),
            e.std_error.map_or_else(dash, |error| significant(error, 2)),
            e.ci95.map_or_else(dash, |[low, high]| format!("{} … {}", significant(low, 6), significant(high, 6))),
            remark(e).to_owned(),
        ]);
    }
    for c in &found.identified {
        table.row(vec![
            c.name.clone(),
            significant(c.value, 6),
            c.unit.clone(),
            significant(c.std_error, 2),
            format!("{} … {}", significant(c.ci95[0], 6), significant(c.ci95[1], 6)),
            "identified combination".to_owned(),
        ]);
    }
    table
}

fn fits(model: &Model, found: &ModelIdentification) -> Table {
    let has_held_out = !found.held_out_percent.is_empty();
    let mut heads = vec!["output", "fit [%]", "residual σ", "residuals white", "independent of inputs"];
    if has_held_out {
        heads.push("held out [%]");
    }
    let mut table = Table::new("fit", "Fit", &heads);
    for (n, output) in model.outputs().iter().enumerate() {
        let tests: Vec<_> = found.fits.iter().filter_map(|fit| fit.residuals.get(n)?.as_ref()).collect();
        let verdict = |pass: &dyn Fn(&motorfit_identify::analysis::ResidualTest) -> Option<bool>| {
            let all: Vec<bool> = tests.iter().filter_map(|test| pass(test)).collect();
            match (all.is_empty(), all.iter().all(|pass| *pass)) {
                (true, _) => dash(),
                (_, true) => "yes".to_owned(),
                _ => "no".to_owned(),
            }
        };
        let sigma = found
            .residual_sigma
            .get(n)
            .copied()
            .flatten()
            .map_or_else(dash, |s| format!("{} {}", significant(s, 3), output.unit.text));
        let mut cells = vec![
            output.name.clone(),
            found.fit_percent.get(n).copied().flatten().map_or_else(dash, |fit| decimals(fit, 3)),
            sigma,
            verdict(&|test| Some(test.whiteness.is_white)),
            verdict(&|test| test.voltage.map(|input| input.is_independent)),
        ];
        if has_held_out {
            cells.push(found.held_out_percent.get(n).copied().flatten().map_or_else(dash, |fit| decimals(fit, 3)));
        }
        table.row(cells);
    }
    table.note(format!("Integration: {}.", found.method.described()));
    table
}

fn verdict(found: &ModelIdentification) -> String {
    let of = &found.verification;
    match of.status {
        "agrees" => {
            format!("{} of {} starts spread over the bounds lead to this optimum, the lowest.", of.arrivals, of.starts)
        }
        "search_stuck" => "The search is stuck: a better optimum exists.".to_owned(),
        "reference_failed" => format!("Only {} of {} starts lead to the lowest optimum.", of.arrivals, of.starts),
        _ => "No other search verifies the result.".to_owned(),
    }
}

/// Returns the matrix of the correlations of the estimates; `None` without standard errors, and for one or too many parameters.
pub(crate) fn model_correlations(model: &Model, found: &ModelIdentification) -> Option<Figure> {
    let uncertainty = found.uncertainty.as_ref()?;
    let names = found.space.names(model);
    let values: Vec<Vec<f64>> =
        uncertainty.correlation.iter().map(|row| row.iter().map(|value| value.unwrap_or(f64::NAN)).collect()).collect();
    let is_shown = names.len() > 1 && names.len() <= 24 && names.len() == values.len();
    is_shown.then(|| crate::chart::Figure {
        id: "correlation".to_owned(),
        svg: correlation(&names, &values),
        alternative: "correlations of the estimates".to_owned(),
        caption: "Correlations of the estimates.".to_owned(),
        map: true,
    })
}

/// Returns inputs, outputs and residuals over time. `models` are the simulated outputs, shape `[outputs][samples]`, each with its name.
pub(crate) fn model_chart(
    id: &str,
    model: &Model,
    recording: &ModelRecording,
    models: &[(&str, &[Vec<f64>])],
) -> Chart {
    let time = &recording.time_s;
    let curve = |values: &[f64]| curve(time, values);
    let mut panels = input_panels(model, recording);
    let mut residuals = Vec::new();
    for (number, (output, measured)) in model.outputs().iter().zip(&recording.measured).enumerate() {
        let label = label(&output.name, &output.unit.text);
        let simulated = models.iter().filter_map(|(name, outputs)| Some((*name, outputs.get(number)?)));
        let mut shown: Vec<Series> = measured
            .iter()
            .map(|measured| Series::new("measured", 0, Form::Dots, curve(&own_samples(recording, number, measured))))
            .collect();
        let (mut left, mut limits) = (Vec::new(), Vec::new());
        for (n, (name, simulated)) in (1..).zip(simulated) {
            let series = Series::new(name, n, Form::Line, curve(simulated));
            let Some(measured) = measured else {
                shown.push(series);
                continue;
            };
            let of = |(k, (y, x)): (usize, (&f64, &f64))| if recording.counts(number, k) { y - x } else { f64::NAN };
            let difference: Vec<f64> = measured.iter().zip(simulated).enumerate().map(of).collect();
            let counting: Vec<f64> = difference.iter().copied().filter(|value| value.is_finite()).collect();
            let band = 1.96 * rms(&counting);
            shown.push(series.with_band(Band::Half(band)));
            left.push(Series::new(name, n, Form::Dots, curve(&difference)));
            if models.len() == 1 {
                limits.extend([-band, band]);
            }
        }
        panels.push(Panel::new(&label, shown));
        if !left.is_empty() {
            residuals.push(Panel { limits: [Vec::new(), limits], ..Panel::new(&format!("residual of {label}"), left) });
        }
    }
    panels.extend(residuals);
    Chart {
        id: id.to_owned(),
        axis: "time [s]".to_owned(),
        panels,
        is_grid: false,
        alternative: "inputs, measured and modelled outputs and their residuals over time".to_owned(),
        caption:
            "Bands and dashed lines: \u{b1}1.96 times the root mean square of the residuals, measured minus modelled."
                .to_owned(),
    }
}

fn curve(time: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    time.iter().copied().zip(values.iter().copied()).collect()
}

fn label(name: &str, unit: &str) -> String {
    format!("{name} [{}]", unit.replace('*', "·"))
}

/// Returns a panel for each input that varies.
fn input_panels(model: &Model, recording: &ModelRecording) -> Vec<Panel> {
    let varies = |values: &[f64]| values.windows(2).any(|pair| pair[0].to_bits() != pair[1].to_bits());
    let panel = |(input, values): (&ModelInput, &Vec<f64>)| {
        let series = Series::new("", 0, Form::Steps, curve(&recording.time_s, values));
        Panel::new(&label(&input.name, &input.unit.text), vec![series])
    };
    model.inputs().iter().zip(&recording.inputs).filter(|(_, values)| varies(values)).map(panel).collect()
}

/// Returns a panel for each input that varies and each measured output.
pub(super) fn signal_panels(model: &Model, recording: &ModelRecording) -> Vec<Panel> {
    let output = |(output, values): (&ModelOutput, &Option<Vec<f64>>)| {
        let series = Series::new("", 1, Form::Line, curve(&recording.time_s, values.as_ref()?));
        Some(Panel::new(&label(&output.name, &output.unit.text), vec![series]))
    };
    let outputs = model.outputs().iter().zip(&recording.measured).filter_map(output);
    input_panels(model, recording).into_iter().chain(outputs).collect()
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

/// Returns the values of an output at its own samples, and NaN at others: between those of a slow sensor it is interpolated.
fn own_samples(recording: &ModelRecording, output: usize, measured: &[f64]) -> Vec<f64> {
    let is_scattered = recording.is_scattered(output);
    let of = |(n, value): (usize, &f64)| if is_scattered && !recording.counts(output, n) { f64::NAN } else { *value };
    measured.iter().enumerate().map(of).collect()
}
