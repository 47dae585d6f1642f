//! Page of an identification: charts, estimates with intervals, and the settings that reproduce it.

use super::chart::{Chart, Form, Series};
use super::estimate_rows::{EstimateRow, estimate_rows};
use super::figures::{correlations, history, residual_correlations, response_charts};
use super::identified::verdict;
use super::identified_tables::{fit_table, parameters_table, selected, selection_table};
use super::page::{Card, Page, Part, Section, Trust, capital};
use super::pages::{Reproduced, folded, reproduce, section, warnings};
use super::recorded::Recorded;
use super::shown::Shown;
use super::spelling::command_line;
use motorfit_core::setting::Spelling;
use motorfit_core::text::in_suitable_unit;
use motorfit_identify::Identification;
use motorfit_record::Record;

/// Returns the page of an identification; `recorded` has the signals of each recording.
#[must_use]
pub fn identify_page<M: Shown>(
    (records, recorded): (&[Record], &[Recorded]),
    spec: &M::Spec,
    found: &Identification<M>,
    how: &Reproduced,
) -> Page {
    let mut sections = Vec::new();
    let reported = warnings(&found.warnings, command_line);
    if !reported.is_empty() {
        sections.push(section("Warnings", reported));
    }
    sections.extend(responses(records, recorded, found));
    let requested = M::requested(spec);
    let mut estimates =
        vec![Part::Table(parameters_table(found)), Part::Text(format!("{}.", capital(&verdict(found))))];
    estimates.push(Part::Table(fit_table(found, &requested)));
    estimates.extend(found.machine.groups().iter().map(|text| Part::Text(format!("{}.", capital(text)))));
    estimates.extend(correlations(found).map(Part::Figure));
    estimates.extend(history(found, &requested).map(Part::Chart));
    sections.push(section(M::ESTIMATES, estimates));
    sections.extend(M::sections(found));
    sections.extend(selection_table(found).map(|table| {
        let parts = vec![Part::Text(format!("Model: {}.", selected(found))), Part::Table(table)];
        folded("Model selection", parts)
    }));
    sections.push(reproduce(records, how, Some(found.device.to_string())));
    let name = records.first().and_then(|record| record.source().file_name());
    let name = name.unwrap_or_else(|| "a recording".to_owned());
    Page {
        title: format!("{} of {name}", found.machine.title()),
        trust: Some(trust(found, command_line)),
        cards: cards(records, found),
        sections,
        ..Page::default()
    }
}

/// Returns the charts of measured and modelled signals, and of the correlations of the residuals.
fn responses<M: Shown>(records: &[Record], recorded: &[Recorded], found: &Identification<M>) -> Vec<Section> {
    let modelled = M::modelled(found, records).unwrap_or_default();
    let pairs = || (1..).zip(recorded.iter().zip(&modelled));
    let plots = pairs().flat_map(|(n, (recorded, signals))| {
        let mut charts =
            response_charts(&format!("response-{n}"), recorded, &[("model", signals)], &left_out(found, n));
        charts.iter_mut().for_each(|chart| add_start(chart, recorded, M::at_start(found, n - 1)));
        charts
    });
    let mut sections = vec![section("Measured and modelled", plots.map(Part::Chart).collect())];
    let residuals = pairs().filter_map(|(n, (recorded, signals))| {
        residual_correlations(&format!("residuals-{n}"), recorded, signals, &left_out(found, n))
    });
    let residuals: Vec<Part> = residuals.map(Part::Chart).collect();
    if !residuals.is_empty() {
        sections.push(section("Correlation of the residuals", residuals));
    }
    sections
}

/// Adds the response at the start values to the panels of the outputs, below the others.
fn add_start(chart: &mut Chart, recorded: &Recorded, at_start: Option<&[Vec<f64>]>) {
    for output in &recorded.outputs {
        let Some(values) = at_start.and_then(|outputs| outputs.get(output.number)) else { continue };
        if let Some(panel) = chart.panels.iter_mut().rfind(|panel| panel.label == output.label) {
            let points = recorded.time_s.iter().copied().zip(values.iter().copied()).collect();
            panel.series.insert(0, Series::new("start", 2, Form::Line, points));
        }
    }
}

/// Returns the intervals of recording `number`, from 1, that were excluded automatically \[s\].
fn left_out<M>(found: &Identification<M>, number: usize) -> Vec<[f64; 2]> {
    let own = found.left_out.iter().filter(|of| of.recording + 1 == number);
    own.map(|of| [of.from_s, of.to_s]).collect()
}

/// Returns the values that all recordings share.
fn cards<M: Shown>(records: &[Record], found: &Identification<M>) -> Vec<Card> {
    let shared = |row: &EstimateRow| row.estimate.recording.is_none() || records.len() == 1;
    let card = |EstimateRow { estimate: e, remark }: EstimateRow| {
        let (symbol, name) = (e.name, e.description);
        let Some(value) = e.value else {
            return Card { symbol, name, value: "\u{2013}".to_owned(), unit: String::new(), remark };
        };
        let [value, unit] = in_suitable_unit(value, e.std_error, &e.unit.replace('*', "·"));
        let is_bare = remark.is_empty() && e.std_error.is_none();
        let remark = if is_bare { "without a standard error".to_owned() } else { remark };
        Card { symbol, name, value, unit, remark }
    };
    estimate_rows(found).into_iter().filter(shared).map(card).collect()
}

/// Returns the level of trust in a result, its warnings, its parameters and its fit; `spelling` is that of the front end.
#[must_use]
pub fn identify_parts<M: Shown>(spec: &M::Spec, found: &Identification<M>, spelling: Spelling) -> Vec<Part> {
    let Trust { level, text } = trust(found, spelling);
    let verdict = Part::Text(format!("{}.", capital(&verdict(found))));
    let mut parts = vec![Part::Text(format!("Trust: {level}. {text}")), verdict];
    parts.extend(warnings(&found.warnings, spelling));
    parts.push(Part::Table(parameters_table(found)));
    parts.push(Part::Table(fit_table(found, &M::requested(spec))));
    parts
}

/// Describes the level of trust in the result: to what it applies, its reasons and the next step.
fn trust<M>(found: &Identification<M>, spelling: Spelling) -> Trust {
    let reasons: Vec<String> = found.trust.reasons.iter().map(|reason| reason.message.spelled(spelling)).collect();
    let next = found.trust.next.as_ref();
    let next = next.map_or(String::new(), |next| format!(" Next: {}.", next.spelled(spelling).trim_end_matches('.')));
    let text = match reasons.is_empty() {
        true => "No test of the residuals, the search or the recordings contradicts the standard errors.".to_owned(),
        false => format!("{}.{next}", capital(&reasons.join("; "))),
    };
    let of = match found.trust.subject() {
        of if of.is_empty() => of,
        of => format!("For {of}. "),
    };
    Trust { level: found.trust.level.name(), text: of + &text }
}
