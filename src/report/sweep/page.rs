//! The page of a sweep: the answer, the motors, costs by factor, what failed, how it was made.

use super::line::line_tables;
use super::tables::{block_tables, failed};
use super::words::{block_name, grouped, plural, sweep_answer};
use super::{figures, words};
use crate::report::pages::{reproduce, section};
use crate::report::{Figure, Page, Part, Reproduced, Section};
use crate::study::sweep::{Limits, SweepSummary};

/// The page of a sweep.
#[must_use]
pub fn sweep_page(summary: &SweepSummary, limits: &Limits, how: &Reproduced) -> Page {
    let mut sections = Vec::new();
    let warnings = warnings(summary);
    if !warnings.is_empty() {
        sections.push(section("What to know first", warnings));
    }
    let boxed = |figure: Figure| Part::Figure(Box::new(figure));
    let mut motors: Vec<Part> = figures::motors(summary, limits).map(boxed).into_iter().collect();
    motors.extend(line_tables(summary, limits).into_iter().map(Part::Table));
    if !motors.is_empty() {
        sections.push(section(if summary.motors > 1 { "The motors" } else { "The motor" }, motors));
    }
    for (n, block) in summary.blocks.iter().enumerate() {
        let mut parts: Vec<Part> = figures::costs(summary, n).into_iter().map(boxed).collect();
        parts.extend(block_tables(summary, n).into_iter().map(Part::Table));
        sections.push(section(&format!("Runs under {}", block_name(block)), parts));
    }
    sections.extend(failed(summary).map(|table| section("Runs without a result", vec![Part::Table(table)])));
    sections.push(made(summary, how));
    Page { title: format!("Sweep \u{201c}{}\u{201d}", summary.name), answer: sweep_answer(summary, limits), sections }
}

/// What must not be overlooked.
fn warnings(summary: &SweepSummary) -> Vec<Part> {
    let mut texts = Vec::new();
    if summary.missing > 0 {
        let runs = plural(summary.missing, "run is", "runs are");
        texts.push(format!(
            "{} of {} {runs} not finished: run the sweep on, and merge it again.",
            grouped(summary.missing),
            grouped(summary.runs)
        ));
    }
    if summary.failed > 0 {
        let runs = plural(summary.failed, "run has", "runs have");
        texts.push(format!("{} of {} {runs} no result: see below.", grouped(summary.failed), grouped(summary.runs)));
    }
    if summary.taken_over > 0 {
        let runs = plural(summary.taken_over, "run was", "runs were");
        let count = grouped(summary.taken_over);
        let device = &summary.device[0];
        texts.push(format!("{count} {runs} done by the cpu in place of the {device}: its last digits differ."));
    }
    texts.into_iter().map(Part::Warning).collect()
}

fn made(summary: &SweepSummary, how: &Reproduced) -> Section {
    let mut how = how.clone();
    let facts = [
        ("runs", grouped(summary.runs)),
        ("motors", words::many(summary.motors)),
        ("factors varied", if summary.varied.is_empty() { "none".to_owned() } else { summary.varied.join(", ") }),
    ];
    let facts = facts.map(|(name, value)| (name.to_owned(), value));
    how.options.splice(0..0, facts);
    reproduce([], &how, Some((&summary.device[0], &summary.device[1])))
}
