//! Page of `identify`: trust and values first, then the plots, the tables, and the command that reproduces it.

use super::figures::{correlations, history, residual_correlations, response_charts};
use super::held_out::held_out;
use super::identified::{noise_floor_text, with_error};
use super::identified_tables::{
    characteristics_table, fit_table, parameters_table, selected, selection_table, transfer_functions,
};
use super::page::{Card, Page, Part, Trust, capital};
use super::pages::{Reproduced, folded, reproduce, section, warnings};
use super::spelling::command_line;
use motorfit_core::setting::Spelling;
use motorfit_core::text::in_suitable_unit;
use motorfit_identify::analysis::{Characteristics, Named};
use motorfit_identify::{Identification, IdentifySpec, ParameterEstimate, Status};
use motorfit_motor::Scope;
use motorfit_record::Record;

/// Returns the page of an identification.
#[must_use]
pub fn identify_page(records: &[Record], spec: &IdentifySpec, found: &Identification, how: &Reproduced) -> Page {
    let modelled = found.modelled(records).unwrap_or_default();
    let mut sections = Vec::new();
    let reported = warnings(&found.warnings, command_line);
    if !reported.is_empty() {
        sections.push(section("Warnings", reported));
    }
    let plots = (1..).zip(records.iter().zip(&modelled)).flat_map(|(n, (record, signals))| {
        response_charts(&format!("response-{n}"), record, &[("model", signals)], &left_out(found, n))
    });
    sections.push(section("Measured and modelled", plots.map(Part::Chart).collect()));
    let residuals = (1..).zip(records.iter().zip(&modelled)).filter_map(|(n, (record, signals))| {
        residual_correlations(&format!("residuals-{n}"), record, signals, &left_out(found, n))
    });
    let residuals: Vec<Part> = residuals.map(Part::Chart).collect();
    if !residuals.is_empty() {
        sections.push(section("Correlation of the residuals", residuals));
    }
    let mut estimates = vec![Part::Table(parameters_table(found)), Part::Text(verdict(found).to_owned())];
    estimates.push(Part::Table(fit_table(found, spec)));
    estimates.extend(correlations(found).map(Part::Figure));
    estimates.extend(history(found, spec).map(Part::Chart));
    sections.push(section("Estimates in SI units", estimates));
    let dynamics = transfer_functions(found).map(Part::List).into_iter();
    sections.push(section("Dynamics", dynamics.chain([Part::Table(characteristics_table(found))]).collect()));
    if let Some(selection) = &found.selection {
        let parts = vec![Part::Text(format!("Model: {}.", selected(found))), Part::Table(selection_table(selection))];
        sections.push(folded("Model selection", parts));
    }
    sections.extend(found.validation.as_ref().map(|held| section("Held-out recordings", held_out(found, held))));
    if let (Some(of), None) = (&found.noise_floor, &found.validation) {
        sections.push(section("Noise floor", vec![Part::Text(format!("{}.", noise_floor_text(of)))]));
    }
    sections.push(reproduce(records, how, Some(found.device.to_string())));
    let name = records.first().and_then(|record| record.source().file_name());
    let name = name.unwrap_or_else(|| "a recording".to_owned());
    Page {
        title: format!("Motor of {name}"),
        trust: Some(trust(found, command_line)),
        cards: cards(records, found),
        answer: instead(found),
        sections,
    }
}

/// Returns the intervals of recording `number`, from 1, that were excluded automatically \[s\].
fn left_out(found: &Identification, number: usize) -> Vec<[f64; 2]> {
    let own = found.left_out.iter().filter(|of| of.recording + 1 == number);
    own.map(|of| [of.from_s, of.to_s]).collect()
}

/// Returns the values of the parameters that all recordings share.
fn cards(records: &[Record], found: &Identification) -> Vec<Card> {
    let shared = |e: &ParameterEstimate| e.scope == Scope::Shared || records.len() == 1;
    let card = |e: ParameterEstimate| {
        let (symbol, name) = (e.parameter.symbol().to_owned(), e.parameter.name().to_owned());
        let Some(value) = e.value else {
            return Card {
                symbol,
                name,
                value: "\u{2013}".to_owned(),
                unit: String::new(),
                remark: "not identifiable".to_owned(),
            };
        };
        let [value, unit] = in_suitable_unit(value, e.std_error, e.parameter.unit());
        let remark = match (e.fixed, e.at_bound, e.std_error) {
            (true, ..) => "fixed".to_owned(),
            (_, Some(side), _) => format!("at its {} bound", if side == "max" { "upper" } else { "lower" }),
            (_, _, None) => "without a standard error".to_owned(),
            _ => String::new(),
        };
        Card { symbol, name, value, unit, remark }
    };
    found.estimates().into_iter().filter(shared).map(card).collect()
}

/// Returns the characteristics as a sentence if parameters are not identifiable; they are the result then.
fn instead(found: &Identification) -> String {
    let shown = |(name, unit, c): &Named| Some(format!("{} = {} {unit}", name.replace('_', " "), with_error((*c)?)));
    if found.unidentified.is_empty() {
        return String::new();
    }
    let list: Vec<String> = Characteristics::named_of(found).iter().filter_map(shown).collect();
    if list.is_empty() { String::new() } else { format!("The recordings identify {}.", list.join(", ")) }
}

/// Returns the level of trust in a result, its warnings, its parameters and its fit; `spelling` is that of the front end.
#[must_use]
pub fn identify_parts(spec: &IdentifySpec, found: &Identification, spelling: Spelling) -> Vec<Part> {
    let Trust { level, text } = trust(found, spelling);
    let mut parts = vec![Part::Text(format!("Trust: {level}. {text}")), Part::Text(verdict(found).to_owned())];
    parts.extend(warnings(&found.warnings, spelling));
    parts.push(Part::Table(parameters_table(found)));
    parts.push(Part::Table(fit_table(found, spec)));
    parts
}

/// Describes the level of trust in the result, with its reasons and the next step.
fn trust(found: &Identification, spelling: Spelling) -> Trust {
    let reasons: Vec<String> = found.trust.reasons.iter().map(|reason| reason.message.spelled(spelling)).collect();
    let next = found.trust.next.as_ref();
    let next = next.map_or(String::new(), |next| format!(" Next: {}.", next.spelled(spelling).trim_end_matches('.')));
    let text = match reasons.is_empty() {
        true => "No test of the residuals, the search or the recordings contradicts the standard errors.".to_owned(),
        false => format!("{}.{next}", capital(&reasons.join("; "))),
    };
    Trust { level: found.trust.level.name(), text }
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
