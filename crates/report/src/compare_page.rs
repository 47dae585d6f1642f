//! Page of `compare`: the result first, then the plots, tables, and the command that reproduces it.

use super::chart::Figure;
use super::compare::{best, invariance, modelled, paper_tables, setting_name, tables};
use super::figures;
use super::page::{Page, Part};
use super::pages::{Reproduced, folded, reproduce, section, warnings};
use super::recorded::Recorded;
use super::spelling::command_line;
use motorfit_core::setting::Spelling;
use motorfit_core::text::{engineering, significant};
use motorfit_study::compare::{Block, Comparison, Reference};

/// Returns the warnings of a comparison, and the reasons for which results are missing.
fn comparison_warnings(comparison: &Comparison, spelling: Spelling) -> Vec<Part> {
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
    parts.extend(comparison_warnings(comparison, spelling));
    for (n, block) in comparison.blocks.iter().enumerate() {
        parts.extend(tables(comparison, block).into_iter().take(1).map(Part::Table));
        if block.has_results() {
            parts.push(Part::Chart(figures::convergence(&format!("block{}", n + 1), block)));
        }
    }
    parts
}

/// Returns the page of a comparison; with `paper` it includes the paper's tables.
#[must_use]
pub fn compare_page(comparison: &Comparison, paper: bool, how: &Reproduced) -> Page {
    let mut sections = Vec::new();
    let sure = comparison_warnings(comparison, command_line);
    if !sure.is_empty() {
        sections.push(section("Warnings", sure));
    }
    sections.extend(invariance(comparison).map(|table| section("Invariance", vec![Part::Table(table)])));
    for (n, block) in comparison.blocks.iter().enumerate() {
        let id = format!("block{}", n + 1);
        let mut parts: Vec<Part> = Vec::new();
        if block.has_results() {
            parts.push(Part::Chart(figures::convergence(&id, block)));
            // The panels of the final costs stand beside those of the targets.
            let (mut targets, ends) = (figures::distributions(&id, comparison, block), figures::waterfall(&id, block));
            targets.panels.extend(ends.panels);
            targets.caption = format!("{} {}", targets.caption, ends.caption);
            parts.push(Part::Chart(targets));
            parts.extend(figures::errors(&id, comparison, block).map(Part::Chart));
        }
        parts.extend(tables(comparison, block).into_iter().map(Part::Table));
        sections.push(section(&setting_name(&block.setting), parts));
    }
    sections.push(section("Measured and modelled", responses(comparison)));
    if paper {
        let tables = paper_tables(comparison).into_iter().map(Part::Table).collect();
        sections.push(folded("The paper's tables and these results", tables));
    }
    let correlations = correlations(comparison).map(|figure| vec![Part::Figure(figure)]);
    sections.extend(correlations.map(|parts| section("Correlation of the refined estimate", parts)));
    sections.push(reproduce(&comparison.subject.records, how, Some(comparison.device.to_string())));
    let of = comparison.subject.model().map_or(String::new(), |of| format!(": {}", of.model.name()));
    Page { title: format!("Methods compared{of}"), answer: answer(comparison), sections, ..Page::default() }
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

/// Returns the best run of each method under the first setting over the measured signals (the paper's Figs. 11–18).
fn responses(comparison: &Comparison) -> Vec<Part> {
    let Some(block) = comparison.blocks.first() else { return Vec::new() };
    let best = best(comparison, block);
    let signals = modelled(comparison, &best);
    let named = || best.iter().map(|(name, _)| *name);
    let recorded = match comparison.subject.model() {
        None => comparison.subject.records.first().map(Recorded::from),
        Some(of) => of.recordings.first().map(|own| Recorded::of_model(&of.model, own, of.spec.is_first_order_hold)),
    };
    let Some(recorded) = recorded else { return Vec::new() };
    let models: Vec<figures::Modelled<'_>> = named().zip(signals.iter().map(Vec::as_slice)).collect();
    let mut charts = figures::response_charts("responses", &recorded, &models, &[]);
    if let Some(first) = charts.first_mut() {
        first.caption = format!("The best run of each method. {}", first.caption);
    }
    charts.into_iter().map(Part::Chart).collect()
}

/// Returns the matrix of the correlations of the refined estimate; `None` without one.
fn correlations(comparison: &Comparison) -> Option<Figure> {
    match comparison.reference.as_ref().ok()? {
        Reference::Motor(found) => figures::correlations(found),
        Reference::Model(found) => figures::correlations(found),
    }
}
