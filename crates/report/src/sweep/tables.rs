//! Tables of a sweep: costs and parameters by factor, worst runs, runs without a result.

use super::line::line_tables;
use super::trust::trust;
use super::words::{Unit, block_name, cell_of, counted, factors, grouped, heads, id, level, levels, lowest};
use crate::compare::cell as number;
use crate::table::{Table, dash};
use motorfit_core::numeric::count_u64;
use motorfit_core::text::{decimals, engineering, significant};
use motorfit_study::sweep::{Cell, Limits, Quantiles, SweepParameter, SweepSummary};

/// Returns all tables of a sweep: motors and limits, then those of each block, then runs without a result.
#[must_use]
pub fn sweep_tables(summary: &SweepSummary, limits: &Limits) -> Vec<Table> {
    let mut tables = line_tables(summary, limits);
    for n in 0..summary.blocks.len() {
        tables.extend(block_tables(summary, n));
    }
    tables.extend(failed(summary));
    tables
}

/// Returns the tables of a block.
pub(super) fn block_tables(summary: &SweepSummary, n: usize) -> Vec<Table> {
    let mut tables = vec![costs(summary, n)];
    tables.extend(trust(summary, n));
    // With one run per motor the table of motors has the same parameters.
    let is_shown = summary.motors > 1 && summary.blocks.len() == 1 && summary.blocks[n].cells.len() == 1;
    tables.extend(parameters(summary, n).filter(|_| !is_shown));
    tables.extend(worst(summary, n));
    tables
}

/// Returns the table of costs by factor.
fn costs(summary: &SweepSummary, n: usize) -> Table {
    let block = &summary.blocks[n];
    let has_failed = block.cells.iter().any(|cell| cell.failed > 0);
    let mut heads = heads(summary);
    heads.push("runs");
    heads.extend(has_failed.then_some("failed"));
    heads.extend(["5 %", "25 %", "median", "75 %", "95 %", "run time"]);
    let mut table = Table::new(id(summary, "cost", n), format!("Cost ({})", block_name(block)), &heads);
    for cell in &block.cells {
        let q = Quantiles::of(&cell.costs);
        let mut row = levels(summary, cell);
        row.push(grouped(cell.runs));
        row.extend(has_failed.then(|| grouped(cell.failed)));
        row.extend([q.q05, q.q25, q.median, q.q75, q.q95].map(|value| number(value, 3)));
        row.push(seconds(cell));
        table.row(row);
    }
    if let Some([under, best]) = lowest(summary, block) {
        table.note(format!("Lowest median{under}: {best}."));
    }
    if summary.stride > 1 {
        table.note(format!("Quantiles are computed from one run in {}.", grouped(summary.stride)));
    }
    table.note("Run time: mean; the runs of a batch share its time, so it ranks no methods.");
    table
}

/// Formats the mean time of a run. Searches of one batch share its time equally, and a fit that does not depend on a factor
/// is computed once for all of its levels.
fn seconds(cell: &Cell) -> String {
    let mean = cell.seconds / count_u64(cell.runs);
    if mean > 0.0 { engineering(mean, "s", 3) } else { dash() }
}

/// Returns the table of parameters by factor; `None` without results.
fn parameters(summary: &SweepSummary, n: usize) -> Option<Table> {
    let block = &summary.blocks[n];
    let of = |parameter: &SweepParameter| {
        let all: Vec<Quantiles> = block.cells.iter().map(|cell| Quantiles::of(cell.values(&parameter.name))).collect();
        let typical = all.iter().map(|q| q.median).find(|median| !median.is_nan());
        let is_shown = typical.is_some() || parameter.is_always;
        is_shown.then(|| (Unit::of(parameter, typical.unwrap_or(f64::NAN)), all))
    };
    if block.cells.iter().all(|cell| cell.costs.is_empty()) {
        return None;
    }
    let columns: Vec<(Unit, Vec<Quantiles>)> = summary.parameters.iter().filter_map(of).collect();
    let symbols: Vec<String> = columns.iter().map(|(unit, _)| unit.head()).collect();
    let mut heads = heads(summary);
    heads.extend(symbols.iter().map(String::as_str));
    let title = format!("Parameters ({})", block_name(block));
    let mut table = Table::new(id(summary, "parameters", n), title, &heads);
    for (place, cell) in block.cells.iter().enumerate() {
        let values = columns.iter().map(|(unit, all)| {
            let q = &all[place];
            if q.median.is_nan() { dash() } else { spread(unit, q) }
        });
        table.row(levels(summary, cell).into_iter().chain(values));
    }
    let over = if summary.motors > 1 { "runs and motors" } else { "runs" };
    table.note(format!("Median over {over} ± half the interquartile range in percent of the median."));
    Some(table)
}

/// Formats a median with half the interquartile range in percent of it.
fn spread(unit: &Unit, q: &Quantiles) -> String {
    let percent = (50.0 * (q.q75 - q.q25) / q.median).abs();
    let percent = match percent {
        p if p >= 10.0 => decimals(p, 0),
        p if p >= 0.01 => significant(p, 2),
        p if p > 0.0 => "<0.01".to_owned(),
        _ => "0".to_owned(),
    };
    format!("{} ±{percent}%", unit.write(q.median, 4))
}

/// Returns the table of the runs with the highest costs; `None` for fewer than two runs.
fn worst(summary: &SweepSummary, n: usize) -> Option<Table> {
    let block = &summary.blocks[n];
    let runs: u64 = block.cells.iter().map(|cell| cell.runs).sum();
    if runs < 2 || block.worst.is_empty() {
        return None;
    }
    let others: Vec<&str> = factors(summary).into_iter().filter(|name| *name != "method").collect();
    let title = format!("Runs with the highest costs ({})", block_name(block));
    let motor = if summary.motors > 1 { &["motor"][..] } else { &[] };
    let heads = [&["run"], motor, &["method"], &others, &["seed", "cost"]].concat();
    let mut table = Table::new(id(summary, "worst", n), title, &heads);
    for run in &block.worst {
        let f = &run.job.factors;
        let mut row = vec![run.job.id.to_string()];
        row.extend(motor.iter().map(|_| run.motor.clone()));
        row.push(f.method.name().to_owned());
        row.extend(others.iter().map(|name| cell_of(block, f).map_or_else(String::new, |cell| level(name, f, cell))));
        row.extend([f.seed.to_string(), number(run.outcome.cost.unwrap_or(f64::NAN), 4)]);
        table.row(row);
    }
    Some(table)
}

/// Returns the table of runs without a result; `None` without any.
pub(super) fn failed(summary: &SweepSummary) -> Option<Table> {
    if summary.failed == 0 {
        return None;
    }
    let title = format!("{} without a result", counted(summary.failed, "run that ended", "runs that ended"));
    let mut table = Table::new("failed", title, &["motor", "runs", "first run", "reason"]);
    for failed in &summary.failures.named {
        table.named_row(&failed.motor, [grouped(failed.runs), failed.id.to_string(), failed.message.clone()]);
    }
    if summary.failures.others > 0 {
        table.note(format!("And {} more; all are in results.jsonl.", grouped(summary.failures.others)));
    }
    Some(table)
}
