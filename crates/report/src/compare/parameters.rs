//! Tables of the parameters of a comparison: best runs, errors, standard deviations over runs.

use super::cells::{cell, percent};
use crate::spelling::command_line;
use crate::table::Table;
use motorfit_core::numeric::mean;
use motorfit_core::text::significant;
use motorfit_study::compare::{Block, ComparedParameter, Comparison};

/// Returns the headings of a table with a column for each parameter, with its unit.
fn headings(comparison: &Comparison) -> Vec<String> {
    let heading = |parameter: &ComparedParameter| {
        format!("{} [{}]", parameter.name, parameter.unit.replace('*', " ").replace("^2", "²").replace("^3", "³"))
    };
    std::iter::once("method".to_owned()).chain(comparison.parameters.iter().map(heading)).collect()
}

/// Returns the table of the parameters of the best run of each method.
pub(super) fn parameters(comparison: &Comparison, block: &Block) -> Table {
    let mut table = Table::new("parameters", "Parameters of the best run", &headings(comparison));
    let truth = comparison.subject.truth().map(|truth| ("true", truth.to_array().to_vec()));
    let refined = comparison.reference.as_ref().ok().map(|found| ("refined", found.values(&comparison.parameters)));
    for (name, values) in truth.into_iter().chain(best(comparison, block)).chain(refined) {
        table.named_row(name, values.into_iter().map(|value| significant(value, 6)));
    }
    if let Some(Err(reason)) = comparison.steiglitz.as_ref().map(|sm| &sm.estimate) {
        table.note(format!("Steiglitz\u{2013}McBride gives no estimate: {reason}."));
    }
    match &comparison.reference {
        Ok(found) => {
            let codes: Vec<String> = found.trust().reasons.iter().map(|of| of.code.replace('_', " ")).collect();
            let reasons = if codes.is_empty() { String::new() } else { format!(" ({})", codes.join(", ")) };
            table.note(format!(
                "refined: Levenberg\u{2013}Marquardt with noise weights, an optimum to compare the searches with; trust: {}{reasons}.",
                found.trust().level.name()
            ));
        }
        Err(reason) => table.note(format!("There is no refined estimate: {}", reason.spelled(command_line))),
    }
    table
}

/// Returns the best estimate of each method, Steiglitz–McBride last.
pub(crate) fn best(comparison: &Comparison, block: &Block) -> Vec<(&'static str, Vec<f64>)> {
    comparison.estimates(block).into_iter().filter_map(|found| Some((found.method, found.best?))).collect()
}

/// Returns the table of the relative errors of the parameters; `None` without true or refined parameters.
pub(super) fn errors(comparison: &Comparison, block: &Block) -> Option<Table> {
    let expected = comparison.expected()?;
    let against = if comparison.subject.truth().is_some() { "the truth" } else { "the refined estimate" };
    let title = format!("Relative errors against {against} [%]: best run / mean over runs");
    let names = comparison.parameters.iter().map(|parameter| parameter.name.as_str());
    let heads: Vec<&str> = std::iter::once("method").chain(names).chain(["average"]).collect();
    let mut table = Table::new("errors", title, &heads);
    let pair = |[best, mean]: [f64; 2]| format!("{}/{}", percent(best), percent(mean));
    for found in comparison.estimates(block) {
        let is_steiglitz = found.method == "sm";
        if is_steiglitz && found.best.is_none() && found.all.is_empty() {
            continue;
        }
        // Steiglitz–McBride also estimates the parameters that the searches fix.
        let is_free = |p: &ComparedParameter| is_steiglitz || p.is_free();
        let errors: Vec<_> = comparison.parameters.iter().zip(found.errors(&expected)).collect();
        let free = || errors.iter().filter(|(p, _)| is_free(p)).map(|(_, error)| error);
        let average = [0, 1].map(|n| mean(&free().map(|error| error[n]).collect::<Vec<f64>>()));
        let cells = errors.iter().map(|(p, error)| if is_free(p) { pair(*error) } else { "fixed".to_owned() });
        table.named_row(found.method, cells.chain([pair(average)]));
        if is_steiglitz {
            table.note(steiglitz_note(comparison));
        }
    }
    Some(table)
}

/// Describes the origin of the spread of Steiglitz–McBride.
pub(super) fn steiglitz_note(comparison: &Comparison) -> String {
    let Some(sm) = &comparison.steiglitz else { return String::new() };
    if sm.records == 0 {
        return "Steiglitz\u{2013}McBride has no seeds, and no records with new noise can be made from this recording, so there is no \
                spread."
            .to_owned();
    }
    format!(
        "Steiglitz\u{2013}McBride has no seeds: its spread is over {} records with new noise of {} A and {} rad/s{}, \
         {} of which gave an estimate.",
        sm.records,
        significant(sm.sigma[0], 3),
        significant(sm.sigma[1], 3),
        if comparison.subject.truth().is_some() {
            format!(" ({} dB)", comparison.spec.noise_db)
        } else {
            " (the residual σ)".to_owned()
        },
        sm.spread.len()
    )
}

/// Returns the table of the standard deviations of the parameters over runs.
pub(super) fn deviations(comparison: &Comparison, block: &Block) -> Table {
    let title = "Standard deviations of the parameters over runs";
    let mut table = Table::new("deviations", title, &headings(comparison));
    for found in comparison.estimates(block) {
        let is_steiglitz = found.method == "sm";
        if is_steiglitz && found.all.is_empty() {
            continue;
        }
        table.named_row(found.method, found.deviations(&comparison.parameters).into_iter().map(|d| cell(d, 3)));
        if is_steiglitz {
            table.note(steiglitz_note(comparison));
        }
    }
    table
}
