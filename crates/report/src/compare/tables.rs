//! Tables of a comparison: costs, ranking, targets, invariance.

use super::cells::{cell, percent, setting_name};
use super::parameters::{deviations, errors, parameters};
use super::responses::responses;
use crate::table::{Table, dash};
use motorfit_core::numeric::{quantile, sorted};
use motorfit_core::text::engineering;
use motorfit_study::compare::{Block, Comparison, FEW, MethodResult, reached};

/// Returns the table of the tests of invariance; `None` without other coordinates.
#[must_use]
pub fn invariance(comparison: &Comparison) -> Option<Table> {
    let title = "Invariance: each method in other coordinates against itself";
    let heads = ["method", "transform", "median excess", "ratio", "p (Holm)", "verdict"];
    let mut table = Table::new("invariance", title, &heads);
    let is_one = comparison.invariance.windows(2).all(|pair| pair[0].blocks[0] == pair[1].blocks[0]);
    for test in &comparison.invariance {
        let (result, [base, other]) = test.of(comparison)?;
        let name = result.method.name();
        let under = if is_one { String::new() } else { format!(" ({})", setting_name(&base.setting)) };
        let ratio = |ratio: f64| if ratio < 1e4 { cell(ratio, 2) } else { format!("{ratio:.1e}") };
        let [low, high] = test.ratio_interval.map(ratio);
        let interval = if test.ratio_interval[0].is_nan() { String::new() } else { format!(" ({low}\u{2026}{high})") };
        table.named_row(
            &format!("{name}{under}"),
            [
                other.setting.coordinates.to_string(),
                format!("{} \u{2192} {}", cell(test.excess[0], 2), cell(test.excess[1], 2)),
                format!("{}{interval}", ratio(test.ratio)),
                cell(test.p_holm, 2),
                test.verdict.name().replace('_', " "),
            ],
        );
    }
    table.note(
        "Excess: final cost above the lowest cost known; excesses below 1e-8 of the first costs count as equal. Ratio: of the medians, \
         with its 95 % bootstrap interval. p: two-sided Wilcoxon signed-rank test, paired by run number, with Holm's correction for \
         all methods and transforms. A method is biased if it finds other costs in a mirrored or shifted box: it searches some parts \
         of the box better than others. In logarithms the problem has another shape for every search, so that a change is no bias.",
    );
    (!table.rows.is_empty()).then_some(table)
}

/// Returns all tables of a block.
#[must_use]
pub fn tables(comparison: &Comparison, block: &Block) -> Vec<Table> {
    let mut tables = vec![costs(comparison, block)];
    if !block.has_results() {
        return tables;
    }
    if block.results.len() > 1 {
        tables.push(ranking(block));
    }
    tables.push(parameters(comparison, block));
    tables.extend(errors(comparison, block));
    tables.push(deviations(comparison, block));
    tables.push(targets(comparison, block));
    tables.extend(responses(comparison, block));
    tables
}

/// Returns the number of runs of each method.
fn runs(block: &Block) -> usize {
    block.results.iter().map(|result| result.runs.len()).max().unwrap_or(0)
}

/// Returns the table of final costs.
fn costs(comparison: &Comparison, block: &Block) -> Table {
    let title = format!("Cost ({})", setting_name(&block.setting));
    let heads = ["method", "best", "median", "95 % interval", "worst", "average", "run time"];
    let mut table = Table::new("cost", title, &heads);
    let time = |seconds: Option<f64>| seconds.map_or_else(dash, |s| engineering(s, "s", 3));
    let seed = comparison.spec.seed;
    for result in &block.results {
        let s = result.summary(seed);
        let [low, high] = s.interval.map(|end| cell(end, 3));
        let interval = if s.interval[0].is_nan() { dash() } else { format!("{low}\u{2026}{high}") };
        let [best, median, worst, average] = [s.best, s.median, s.worst, s.average].map(|cost| cell(cost, 3));
        let name = result.method.name();
        table.named_row(name, [best, median, interval, worst, average, time(result.seconds)]);
        if s.failed > 0 {
            table.note(format!("{name}: in {} runs every candidate diverged.", s.failed));
        }
    }
    let mut single = |name: &str, cost: f64, seconds: Option<f64>| {
        table.named_row(name, [cell(cost, 3), dash(), dash(), dash(), dash(), time(seconds)]);
    };
    if let (Some(cost), Some(sm)) = (block.steiglitz_cost, &comparison.steiglitz) {
        single("sm", cost, Some(sm.seconds));
    }
    if let Some(cost) = block.reference_cost {
        single("refined", cost, None);
    }
    let runs = runs(block);
    if runs == 0 {
        table.note("Interrupted before the first run.");
        return table;
    }
    if comparison.interrupted {
        table.note("Interrupted: the runs did not complete their budget.");
    }
    if comparison.subject.records.len() > 1 && block.steiglitz_cost.is_some() {
        table.note("sm: estimated from the first recording only; its cost is over all recordings.");
    }
    table.note(format!(
        "{runs} runs each, seed {seed}. The interval is a percentile bootstrap interval of the median; the run time is the \
         median of three single runs."
    ));
    table
}

fn ranking(block: &Block) -> Table {
    let ranking = block.ranking();
    let name = |n: usize| block.results[n].method.name();
    let runs = runs(block);
    let order: Vec<&str> = ranking.order.iter().map(|n| name(*n)).collect();
    let title = format!("Ranking by median cost: {}", order.join(", "));
    let mut table = Table::new("ranking", title, &["pair", "first is lower in", "p", "p (Holm)", "at 5 %"]);
    for pair in &ranking.pairs {
        let [a, b] = pair.methods;
        let verdict = match pair.p_holm < 0.05 {
            _ if runs < FEW => "too few runs",
            true => "significant",
            false => "not significant",
        };
        table.row([
            format!("{} before {}", name(a), name(b)),
            format!("{:.0} % of pairs", 100.0 * pair.superiority),
            cell(pair.p_value, 2),
            cell(pair.p_holm, 2),
            verdict.to_owned(),
        ]);
    }
    table.note(
        "Two-sided Wilcoxon signed-rank test of the logarithms of the final costs, paired by run number (paired runs of methods that \
         begin with a uniform population start from the same one), with Holm's correction for all pairs of this block. \"Lower in\" \
         counts every run of the first method against every run of the second, ties as half (Vargha and Delaney's A). Costs that exceed \
         the lowest by less than 1e-8 of the first ones are ties. All methods have the same budget of evaluations.",
    );
    table
}

/// Returns the table of the evaluations and times until targets are reached.
fn targets(comparison: &Comparison, block: &Block) -> Table {
    let (targets, reached) = reached(block, comparison.spec.target);
    let title = match (targets.first(), targets.last()) {
        (Some(first), Some(last)) if targets.len() > 1 => {
            format!(
                "Fraction of {} targets reached, from {} down to {}",
                targets.len(),
                cell(*first, 3),
                cell(*last, 3)
            )
        }
        (Some(only), _) => format!("Fraction of runs that reached the cost {}", cell(*only, 3)),
        _ => "Targets".to_owned(),
    };
    let heads = ["method", "25 % after", "50 % after", "75 % after", "at the end", "50 % after [s]"];
    let mut table = Table::new("targets", title, &heads);
    for (result, reached) in block.results.iter().zip(&reached) {
        let index = |share: f64| reached.share.iter().position(|s| *s >= share);
        let at = |share: f64| index(share).map_or("never".to_owned(), |n| format!("{}", reached.evaluations[n]));
        let seconds = index(0.5).and_then(|n| reached.seconds.get(n));
        let seconds = seconds.map_or_else(dash, |s| engineering(*s, "s", 3));
        let last = percent(100.0 * reached.share.last().copied().unwrap_or(0.0));
        table.named_row(result.method.name(), [at(0.25), at(0.5), at(0.75), format!("{last} %"), seconds]);
    }
    table.note(
        "Evaluations of a run after which this fraction of all pairs of a run and a target is reached. Several targets are \
         equally spaced in the logarithm, the last being the lowest cost of all runs, so that the fractions depend on the \
         methods compared.",
    );
    table
}

/// Returns the quartiles over runs of the lowest cost after each generation, shape `[generations, 3]`.
#[must_use]
pub fn quartiles(result: &MethodResult) -> Vec<[f64; 3]> {
    let generations = result.runs.iter().map(|run| run.history.len()).max().unwrap_or(0);
    let at = |generation: usize| {
        let costs: Vec<f64> = result.runs.iter().filter_map(|run| run.history.get(generation).copied()).collect();
        let sorted = sorted(&costs);
        [0.25, 0.5, 0.75].map(|p| quantile(&sorted, p))
    };
    (0..generations).map(at).collect()
}
