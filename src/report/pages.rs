//! Pages of `identify` and `compare`: the result first, then its reliability, the plots, and the command that
//! reproduces it.

use super::compare::{best, invariance, paper_tables, setting_name, tables};
use super::figures;
use super::held_out::held_out;
use super::identified::{noise_floor_text, with_error};
use super::identified_tables::{characteristics_table, fit_table, parameters_table, selected, selection_table};
use super::page::{Page, Part, Section, capital};
use super::spelling::command_line;
use crate::analysis::{Characteristics, Named};
use crate::identify::{Identification, IdentifySpec, ParameterEstimate, Status};
use crate::motor::{Parameters, Scope};
use crate::record::{Record, Severity};
use crate::setting::Spelling;
use crate::study::compare::{Block, Comparison};
use crate::text::{engineering, significant};
use crate::warning::Warning;

/// Command and settings that reproduce a result.
#[derive(Debug, Clone)]
pub struct Reproduced {
    /// Command line.
    pub command: String,
    /// Names and values of all options.
    pub options: Vec<(String, String)>,
}

pub(super) fn section(heading: &str, parts: Vec<Part>) -> Section {
    Section { heading: heading.to_owned(), parts }
}

fn warnings(list: &[Warning], spelling: Spelling) -> Vec<Part> {
    list.iter().filter(|w| w.severity == Severity::Report).map(|w| Part::Warning(w.spelled(spelling))).collect()
}

/// Returns the section with the command, settings, device and recordings that reproduce a result.
pub(super) fn reproduce<'a>(
    records: impl IntoIterator<Item = &'a Record>,
    how: &Reproduced,
    device: Option<(&str, &str)>,
) -> Section {
    let mut list = vec![("version".to_owned(), format!("motorfit {}", env!("CARGO_PKG_VERSION")))];
    list.extend(device.map(|(name, precision)| ("device".to_owned(), format!("{name}, {precision}"))));
    for record in records {
        let source = record.source();
        let path = source.path.as_ref().map_or("simulated".to_owned(), |path| path.display().to_string());
        let digest = source.sha256.as_ref().map_or(String::new(), |digest| format!(", sha256 {digest}"));
        let period = format!(" every {}", engineering(record.period_s(), "s", 6));
        list.push(("recording".to_owned(), format!("{path}: {} samples{period}{digest}", record.len())));
    }
    list.extend(how.options.iter().cloned());
    section("Reproduction", vec![Part::Typed(how.command.clone()), Part::List(list)])
}

/// Returns the page of an identification.
#[must_use]
pub fn identify_page(records: &[Record], spec: &IdentifySpec, found: &Identification, how: &Reproduced) -> Page {
    let value = |e: &ParameterEstimate| {
        let spread = e.std_error.map_or(String::new(), |error| format!(" ± {}", significant(1.96 * error, 2)));
        let unit = if e.parameter.unit() == "1" { String::new() } else { format!(" {}", e.parameter.unit()) };
        Some(format!("{} = {}{spread}{unit}", e.parameter.symbol(), significant(e.value?, 5)))
    };
    let shared = |e: &&ParameterEstimate| e.scope == Scope::Shared || records.len() == 1;
    // The result has the characteristics if parameters are not identifiable.
    let shown = |(name, unit, c): &Named| Some(format!("{} = {} {unit}", name.replace('_', " "), with_error((*c)?)));
    let characteristics = Characteristics::named_of(found);
    let instead = characteristics.iter().filter(|_| !found.unidentified.is_empty()).filter_map(shown);
    let estimates = found.estimates();
    let answer = estimates.iter().filter(shared).filter_map(value).chain(instead).collect::<Vec<_>>().join(", ");
    let tail = if found.uncertainty.is_some() { " (95 % intervals)" } else { " (without a polish: no intervals)" };
    let mut sure = identify_parts(spec, found, command_line);
    sure.push(Part::Table(characteristics_table(found)));
    if let Some(selection) = &found.selection {
        sure.push(Part::Text(format!("Model: {}.", selected(found))));
        sure.push(Part::Table(selection_table(selection)));
    }
    sure.extend(figures::correlations(found).map(Part::Figure));
    let modelled = found.modelled(records).unwrap_or_default();
    let response = |(n, (record, signals))| figures::responses(&format!("response-{n}"), record, "model", signals);
    let plots = (1..)
        .zip(records.iter().zip(&modelled))
        .map(response)
        .chain(figures::history(found, spec))
        .map(Part::Figure)
        .collect();
    let mut sections = vec![section("Reliability", sure), section("Measured and modelled", plots)];
    sections.extend(found.validation.as_ref().map(|held| section("Held-out recordings", held_out(found, held))));
    if let (Some(of), None) = (&found.noise_floor, &found.validation) {
        sections.push(section("Noise floor", vec![Part::Text(format!("{}.", noise_floor_text(of)))]));
    }
    sections.push(reproduce(records, how, Some((&found.device, found.precision))));
    let name = records.first().and_then(|record| record.source().path.as_ref()?.file_name());
    let name = name.map_or("a recording".into(), |name| name.to_string_lossy());
    Page { title: format!("Motor of {name}"), answer: format!("{answer}{tail}."), sections }
}

/// Returns the level of trust in a result, its warnings, its parameters and its fit; `spelling` is that of the front end.
#[must_use]
pub fn identify_parts(spec: &IdentifySpec, found: &Identification, spelling: Spelling) -> Vec<Part> {
    let mut parts = vec![Part::Text(trust_text(found, spelling)), Part::Text(verdict(found).to_owned())];
    parts.extend(warnings(&found.warnings, spelling));
    parts.push(Part::Table(parameters_table(found)));
    parts.push(Part::Table(fit_table(found, spec)));
    parts
}

/// Describes the level of trust in the result, with its reasons and the next step.
fn trust_text(found: &Identification, spelling: Spelling) -> String {
    let reasons: Vec<String> = found.trust.reasons.iter().map(|reason| reason.message.spelled(spelling)).collect();
    let level = found.trust.level.name();
    if reasons.is_empty() {
        return format!(
            "Trust: {level}. No test of the residuals, the search or the recordings contradicts the standard errors."
        );
    }
    let next = found.trust.next.as_ref().map_or(String::new(), |next| format!(" Next: {}.", next.spelled(spelling)));
    format!("Trust: {level}. {}.{next}", capital(&reasons.join("; ")))
}

fn verdict(found: &Identification) -> &'static str {
    let check = &found.verification;
    match check.status {
        Status::Agrees => "A global search finds the same optimum.",
        Status::SearchStuck if check.refined_agrees => {
            "The search was stuck away from the optimum; the refinement reached it, and a global search agrees."
        }
        Status::SearchStuck => "The search is stuck: a better optimum exists.",
        Status::ReferenceFailed => "The global search ended in a worse optimum and is inconclusive.",
        Status::NotApplicable => "No global search verifies the result.",
    }
}

/// Returns the warnings of a comparison, and the reasons for which results are missing.
fn doubts(comparison: &Comparison, spelling: Spelling) -> Vec<Part> {
    let mut parts = warnings(&comparison.warnings, spelling);
    if comparison.interrupted {
        parts.push(Part::Warning("This comparison was interrupted: the results are incomplete.".to_owned()));
    }
    let missing = comparison.reference.as_ref().err().map(|e| e.spelled(spelling));
    parts.extend(missing.map(|why| Part::Warning(format!("There is no refined estimate: {why}"))));
    let failed = comparison.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().err());
    parts.extend(failed.map(|e| Part::Warning(format!("Steiglitz\u{2013}McBride gives no estimate: {e}."))));
    parts
}

/// Returns the answer of a comparison, its warnings, and the table of costs and the convergence of each block; `spelling` is that
/// of the front end.
#[must_use]
pub fn compare_parts(comparison: &Comparison, spelling: Spelling) -> Vec<Part> {
    let mut parts = vec![Part::Text(answer(comparison))];
    parts.extend(doubts(comparison, spelling));
    for (n, block) in comparison.blocks.iter().enumerate() {
        parts.extend(tables(comparison, block).into_iter().take(1).map(Part::Table));
        if block.has_results() {
            parts.push(Part::Figure(figures::convergence(&format!("block{}", n + 1), block)));
        }
    }
    parts
}

/// Returns the page of a comparison; with `paper` it includes the paper's tables.
#[must_use]
pub fn compare_page(comparison: &Comparison, paper: bool, how: &Reproduced) -> Page {
    let mut sections = Vec::new();
    let sure = doubts(comparison, command_line);
    if !sure.is_empty() {
        sections.push(section("Warnings", sure));
    }
    if paper {
        let tables = paper_tables(comparison).into_iter().map(Part::Table).collect();
        sections.push(section("The paper's tables and these results", tables));
    }
    sections.extend(invariance(comparison).map(|table| section("Invariance", vec![Part::Table(table)])));
    for (n, block) in comparison.blocks.iter().enumerate() {
        let id = format!("block{}", n + 1);
        let mut parts: Vec<Part> = tables(comparison, block).into_iter().map(Part::Table).collect();
        if block.has_results() {
            parts.push(Part::Figure(figures::convergence(&id, block)));
            parts.push(Part::Figure(figures::distributions(&id, comparison, block)));
            parts.push(Part::Figure(figures::waterfall(&id, block)));
            parts.extend(figures::errors(&id, comparison, block).map(Part::Figure));
        }
        sections.push(section(&setting_name(&block.setting), parts));
    }
    sections.push(section("Measured and modelled", responses(comparison)));
    let correlations = comparison.reference.as_ref().ok().and_then(|found| figures::correlations(found));
    let correlations = correlations.map(|figure| vec![Part::Figure(figure)]);
    sections.extend(correlations.map(|parts| section("Correlation of the refined estimate", parts)));
    let device = (comparison.device.1.as_str(), comparison.device.2);
    sections.push(reproduce(&comparison.subject.records, how, Some(device)));
    Page { title: "Methods compared".to_owned(), answer: answer(comparison), sections }
}

/// Names the method with the lowest median cost of each block.
fn answer(comparison: &Comparison) -> String {
    let one = |block: &Block| {
        if !block.has_results() {
            let is_run = block.results.iter().any(|c| !c.runs.is_empty());
            let why = if is_run { "every candidate diverged" } else { "was not run" };
            return format!("For {}: {why}.", setting_name(&block.setting));
        }
        let ranking = block.ranking();
        let name = |n: usize| block.results[n].method.name();
        let first = ranking.order[0];
        let ahead = ranking.pairs.iter().find(|pair| pair.methods[0] == first);
        let median = block.results[first].summary(comparison.spec.seed).median;
        let sure = match ahead {
            Some(pair) if pair.p_holm < 0.05 && pair.superiority > 0.5 => {
                format!(", ahead of {} (significant at 5 %)", name(pair.methods[1]))
            }
            Some(pair) => format!(", but its lead over {} is not significant", name(pair.methods[1])),
            None => String::new(),
        };
        let cost = significant(median, 3);
        format!("For {}: {} has the lowest median cost ({cost}){sure}.", setting_name(&block.setting), name(first))
    };
    let sm = comparison.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().ok().map(|_| sm.seconds));
    let sm = sm.map_or(String::new(), |s| format!(" Steiglitz\u{2013}McBride takes {}.", engineering(s, "s", 2)));
    comparison.blocks.iter().map(one).collect::<Vec<_>>().join(" ") + &sm
}

/// Returns the figures of the best run of each method under the first setting, with the measured signals (the paper's
/// Figs. 11–18).
fn responses(comparison: &Comparison) -> Vec<Part> {
    let (Some(block), Some(record)) = (comparison.blocks.first(), comparison.subject.records.first()) else {
        return Vec::new();
    };
    let how = comparison.spec.model.discretization;
    let initial = comparison.initial.first().copied().unwrap_or_default();
    let figure = |(name, parameters): (&str, Parameters)| {
        let signals = figures::model(record, &parameters, initial, how);
        let mut figure = figures::responses(&format!("response-{name}"), record, name, &signals);
        figure.caption = format!("{name}, best run. {}", figure.caption);
        Part::Figure(figure)
    };
    best(comparison, block).into_iter().map(figure).collect()
}
