//! Page of a sweep: the result in a sentence, the motors, costs by factor, runs without a result, and the command that
//! reproduces it.

use super::figures;
use super::line::{excesses, line_tables, motors_outside, untested};
use super::tables::{block_tables, failed, sweep_tables};
use super::terminal::shortened;
use super::trust::trust_sentence;
use super::words::{block_name, counted, grouped, lowest, many, plural};
use crate::pages::{reproduce, section};
use crate::{Page, Part, Reproduced, Section};
use motorfit_study::sweep::{Limits, SweepSummary};

/// Returns the answer of a sweep, its warnings, and the figure and tables of its motors or of its runs.
#[must_use]
pub fn sweep_parts(summary: &SweepSummary, limits: &Limits) -> Vec<Part> {
    let mut parts = vec![Part::Text(sweep_answer(summary, limits))];
    parts.extend(warnings(summary));
    parts.extend(figures::motors(summary, limits).map(Part::Chart));
    parts.extend(sweep_tables(summary, limits).iter().map(|table| Part::Table(shortened(table, ROWS_SHOWN))));
    parts
}

/// Largest number of rows of a table outside of a page.
const ROWS_SHOWN: usize = 20;

/// Returns the page of a sweep.
#[must_use]
pub fn sweep_page(summary: &SweepSummary, limits: &Limits, how: &Reproduced) -> Page {
    let mut sections = Vec::new();
    let warnings = warnings(summary);
    if !warnings.is_empty() {
        sections.push(section("Warnings", warnings));
    }
    // The motors outside the limits come first, and the other tables after the charts.
    let tables = line_tables(summary, limits);
    let (first, last): (Vec<_>, Vec<_>) = tables.into_iter().partition(|table| table.id == "outside");
    let mut motors: Vec<Part> = first.into_iter().map(Part::Table).collect();
    motors.extend(figures::run_chart(summary, limits).map(Part::Chart));
    motors.extend(figures::motors(summary, limits).map(Part::Chart));
    motors.extend(last.into_iter().map(Part::Table));
    if !motors.is_empty() {
        sections.push(section(if summary.motors > 1 { "The motors" } else { "The motor" }, motors));
    }
    for (n, block) in summary.blocks.iter().enumerate() {
        let mut parts: Vec<Part> = figures::costs(summary, n).map(Part::Chart).into_iter().collect();
        parts.extend(block_tables(summary, n).into_iter().map(Part::Table));
        sections.push(section(&format!("Runs under {}", block_name(block)), parts));
    }
    sections.extend(failed(summary).map(|table| section("Runs without a result", vec![Part::Table(table)])));
    sections.push(made(summary, how));
    Page {
        title: format!("Sweep \u{201c}{}\u{201d}", summary.name),
        answer: sweep_answer(summary, limits),
        sections,
        ..Page::default()
    }
}

/// Returns the result in one or two sentences.
#[must_use]
pub fn sweep_answer(summary: &SweepSummary, limits: &Limits) -> String {
    let found = if summary.motors > 1 {
        format!("{} of {} motors identified", many(summary.results.len()), many(summary.motors))
    } else {
        let done = summary.runs.saturating_sub(summary.missing).saturating_sub(summary.failed);
        let all = counted(summary.runs, "run", "runs");
        format!("{} of {all} of one motor {} a result", grouped(done), plural(done, "has", "have"))
    };
    let verdict = match (limits.is_empty() || summary.results.is_empty(), motors_outside(&excesses(summary, limits))) {
        (true, _) => String::new(),
        (_, 0) if !untested(summary, limits).is_empty() => String::new(),
        (_, 0) if summary.motors > 1 => "; all of them are within the limits".to_owned(),
        (_, 0) => "; it is within the limits".to_owned(),
        (_, _) if summary.motors == 1 => "; it is outside the limits".to_owned(),
        (_, n) => format!("; {} outside the limits", counted(n, "is", "are")),
    };
    let open = if summary.results.is_empty() { Vec::new() } else { untested(summary, limits) };
    let of_all = |n: usize| open.len() == limits.symbols().count() && open.iter().all(|(_, motors)| *motors == n);
    let open = match &open[..] {
        [] => String::new(),
        [(_, n), ..] if of_all(*n) => format!("; {} not tested", counted(*n as u64, "motor was", "motors were")),
        _ => {
            let each = open.iter().map(|(name, n)| format!("{name} in {}", counted(*n as u64, "motor", "motors")));
            format!("; not tested: {}", each.collect::<Vec<_>>().join(", "))
        }
    };
    let verdict = verdict + &open;
    let best = summary.blocks.first().and_then(|block| lowest(summary, block));
    let best = best.map_or_else(String::new, |[under, best]| format!(" Lowest median cost{under}: {best}."));
    format!("{found}{verdict}.{}{best}", trust_sentence(&summary.trust.levels))
}

/// Returns the warnings.
fn warnings(summary: &SweepSummary) -> Vec<Part> {
    let SweepSummary { missing, failed, taken_over, .. } = *summary;
    let poor = summary.trust.levels.poor;
    let (all, device) = (counted(summary.runs, "run", "runs"), &summary.device[0]);
    let texts = [
        (missing, plural(missing, "is", "are"), "not finished: continue the sweep and merge it again."),
        (failed, plural(failed, "has", "have"), "no result: see below."),
        (poor, plural(poor, "has", "have"), "a poor level of trust: see below."),
    ];
    // The noun follows the total and the verb the part: 1 of 151 runs has no result.
    let texts = texts.map(|(count, verb, what)| (count, format!("{} of {all} {verb} {what}", grouped(count))));
    let taken_over_runs = counted(taken_over, "run was", "runs were");
    let by = format!("{taken_over_runs} executed on the cpu in place of the {device}: the last digits may differ.");
    let shown = texts.into_iter().chain([(taken_over, by)]).filter(|(count, _)| *count > 0);
    shown.map(|(_, text)| Part::Warning(text)).collect()
}

fn made(summary: &SweepSummary, how: &Reproduced) -> Section {
    let mut how = how.clone();
    let facts = [
        ("runs", grouped(summary.runs)),
        ("motors", many(summary.motors)),
        ("factors varied", if summary.varied.is_empty() { "none".to_owned() } else { summary.varied.join(", ") }),
    ];
    let facts = facts.map(|(name, value)| (name.to_owned(), value));
    how.options.splice(0..0, facts);
    reproduce([], &how, Some(summary.device.join(", ")))
}
