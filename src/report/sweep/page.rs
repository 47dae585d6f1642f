//! The page of a sweep: the answer, the motors, costs by factor, what failed, how it was made.

use super::line::line_tables;
use super::tables::{block_tables, failed};
use super::words::{block_name, counted, grouped, plural, sweep_answer};
use super::{figures, words};
use crate::report::pages::{reproduce, section};
use crate::report::{Page, Part, Reproduced, Section};
use crate::study::sweep::{Limits, SweepSummary};

/// The page of a sweep.
#[must_use]
pub fn sweep_page(summary: &SweepSummary, limits: &Limits, how: &Reproduced) -> Page {
    let mut sections = Vec::new();
    let warnings = warnings(summary);
    if !warnings.is_empty() {
        sections.push(section("What to know first", warnings));
    }
    let mut motors: Vec<Part> = figures::motors(summary, limits).map(Part::Figure).into_iter().collect();
    motors.extend(line_tables(summary, limits).into_iter().map(Part::Table));
    if !motors.is_empty() {
        sections.push(section(if summary.motors > 1 { "The motors" } else { "The motor" }, motors));
    }
    for (n, block) in summary.blocks.iter().enumerate() {
        let mut parts: Vec<Part> = figures::costs(summary, n).into_iter().map(Part::Figure).collect();
        parts.extend(block_tables(summary, n).into_iter().map(Part::Table));
        sections.push(section(&format!("Runs under {}", block_name(block)), parts));
    }
    sections.extend(failed(summary).map(|table| section("Runs without a result", vec![Part::Table(table)])));
    sections.push(made(summary, how));
    Page { title: format!("Sweep \u{201c}{}\u{201d}", summary.name), answer: sweep_answer(summary, limits), sections }
}

/// What must not be overlooked.
fn warnings(summary: &SweepSummary) -> Vec<Part> {
    let SweepSummary { missing, failed, taken_over, .. } = *summary;
    let (all, device) = (grouped(summary.runs), &summary.device[0]);
    let texts = [
        (missing, plural(missing, "run is", "runs are"), "not finished: run the sweep on, and merge it again."),
        (failed, plural(failed, "run has", "runs have"), "no result: see below."),
    ];
    let texts = texts.map(|(count, runs, what)| (count, format!("{} of {all} {runs} {what}", grouped(count))));
    let taken_over_runs = counted(taken_over, "run was", "runs were");
    let by = format!("{taken_over_runs} done by the cpu in place of the {device}: its last digits differ.");
    let shown = texts.into_iter().chain([(taken_over, by)]).filter(|(count, _)| *count > 0);
    shown.map(|(_, text)| Part::Warning(text)).collect()
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
