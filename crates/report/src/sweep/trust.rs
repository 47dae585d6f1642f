//! Numbers of results of a sweep by level of trust.

use super::words::{block_name, grouped, heads, id, levels};
use crate::table::Table;
use motorfit_study::sweep::{LevelCounts, SweepSummary, TrustCounts};

/// Largest number of reasons in a row.
const NAMED: usize = 3;

/// Returns the table of results by factor and level of trust with the most frequent reasons; `None` if all are good or
/// none has a level.
pub(super) fn trust(summary: &SweepSummary, n: usize) -> Option<Table> {
    let block = &summary.blocks[n];
    let is_shown = |counts: &LevelCounts| counts.is_known() && counts.not_good() > 0;
    if !block.cells.iter().any(|cell| is_shown(&cell.trust.levels)) {
        return None;
    }
    let has_unknown = block.cells.iter().any(|cell| cell.trust.levels.unknown > 0);
    let mut heads = heads(summary);
    heads.extend(["good", "check", "poor"]);
    heads.extend(has_unknown.then_some("unknown"));
    heads.push("commonest reasons");
    let title = format!("Trust in the results ({})", block_name(block));
    let mut table = Table::new(id(summary, "trust", n), title, &heads);
    for cell in &block.cells {
        let LevelCounts { good, check, poor, unknown } = cell.trust.levels;
        let mut row = levels(summary, cell);
        row.extend([good, check, poor].map(grouped));
        row.extend(has_unknown.then(|| grouped(unknown)));
        row.push(commonest(&cell.trust));
        table.row(row);
    }
    let meaning =
        "Good: no test contradicts the standard errors; check: look at the reasons first; poor: they are not reliable.";
    table.note(format!("{meaning} The codes of each run are in results.jsonl."));
    if has_unknown {
        table.note("Unknown: results of an earlier version of the program.");
    }
    Some(table)
}

/// Formats the most frequent reasons with their numbers, as in `search_stuck 12, at_bound 3, …`.
fn commonest(counts: &TrustCounts) -> String {
    let all = counts.commonest();
    let named: Vec<String> = all.iter().take(NAMED).map(|(code, runs)| format!("{code} {}", grouped(*runs))).collect();
    match all.len() {
        0 => "none".to_owned(),
        n if n > NAMED => named.join(", ") + ", …",
        _ => named.join(", "),
    }
}

/// Returns the sentence on the levels; empty if no result has a level.
pub(super) fn trust_sentence(counts: &LevelCounts) -> String {
    if !counts.is_known() {
        return String::new();
    }
    if counts.not_good() == 0 {
        let what = if counts.good == 1 { "result" } else { "results" };
        return format!(" Trust in the {} {what}: good.", grouped(counts.good));
    }
    let LevelCounts { good, check, poor, unknown } = *counts;
    let parts = [(good, "good"), (check, "to be checked"), (poor, "poor"), (unknown, "of unknown level")];
    let parts: Vec<String> = parts
        .into_iter()
        .filter(|(runs, _)| *runs > 0)
        .map(|(runs, word)| format!("{} {word}", grouped(runs)))
        .collect();
    format!(" Trust in the results: {}.", parts.join(", "))
}
