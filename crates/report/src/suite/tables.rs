//! Tables and CSV files of a suite.

use crate::table::{Table, dash};
use motorfit_core::numeric::count_u64;
use motorfit_core::text::{Shortest, significant};
use motorfit_study::suite::{GAP, SuiteMeasure, SuiteResult, SuiteRun};
use std::fmt::Write as _;

/// Formats a number of evaluations: 874, 12k, 1.3M.
pub(super) fn compact(evaluations: f64) -> String {
    let digits = |value: f64| significant(value, 2).trim_end_matches(".0").to_owned();
    match evaluations {
        v if v.is_nan() => dash(),
        v if v.is_infinite() => "\u{221e}".to_owned(),
        v if v < 995.0 => digits(v),
        v if v < 995e3 => format!("{}k", digits(v / 1e3)),
        v => format!("{}M", digits(v / 1e6)),
    }
}

/// Returns the indices of the budgets with a complete problem, and their headings.
fn budgets(result: &SuiteResult) -> (Vec<usize>, Vec<String>) {
    let has = |n: &usize| result.blocks.iter().any(|block| block.budget == *n);
    let complete: Vec<usize> = (0..result.spec.budgets.len()).filter(has).collect();
    let heads = complete.iter().map(|n| compact(count_u64(result.spec.budgets[*n]))).collect();
    (complete, heads)
}

/// Returns the tables of a suite: success rates, expected running times and ranks by budget, and success rates by problem.
#[must_use]
pub fn suite_tables(result: &SuiteResult) -> Vec<Table> {
    vec![solved(result), times(result), ranks(result), problems(result)]
}

/// Returns a table with a row for each entrant and a column for each budget.
fn by_budget(result: &SuiteResult, (id, title): (&str, &str), cell: impl Fn(usize, usize) -> String) -> Table {
    let (budgets, heads) = budgets(result);
    let heads: Vec<String> = std::iter::once("method".to_owned()).chain(heads).collect();
    let mut table = Table::new(id, title, &heads);
    for entrant in 0..result.spec.entrants.len() {
        table.named_row(&result.name(entrant), budgets.iter().map(|budget| cell(*budget, entrant)));
    }
    table
}

fn measure(result: &SuiteResult, budget: usize, entrant: usize) -> SuiteMeasure {
    result.measure(budget, entrant, GAP)
}

fn percent(share: f64) -> String {
    if share.is_nan() { dash() } else { format!("{:.0} %", 100.0 * share) }
}

fn solved(result: &SuiteResult) -> Table {
    let title = "Runs that reached the optimum, by budget [evaluations]";
    let mut table =
        by_budget(result, ("solved", title), |budget, entrant| percent(measure(result, budget, entrant).success));
    let complete = result.blocks.len();
    let of = result.problems.len() * result.spec.budgets.len();
    if result.interrupted {
        table.note(format!("Interrupted: {complete} of {of} pairs of a problem and a budget are complete."));
    }
    table.note(format!(
        "{} problems, {} runs each, seed {}. Reached: a relative gap of {GAP:e}, where 1 is the gap between the known optimum and a random \
         candidate.",
        result.problems.len(),
        result.spec.runs,
        result.spec.seed
    ));
    table
}

fn times(result: &SuiteResult) -> Table {
    let title = "Expected running time to the optimum [evaluations], by budget";
    let mut table = by_budget(result, ("ert", title), |budget, entrant| {
        let SuiteMeasure { ert, ert_interval: [low, high], .. } = measure(result, budget, entrant);
        match ert.is_finite() {
            true => format!("{} ({}\u{2026}{})", compact(ert), compact(low), compact(high)),
            false => compact(ert),
        }
    });
    table.note(
        "Evaluations of all runs, up to the target or to the end, divided by the number of runs that reached it (Hansen et al. 2021), over all \
         problems: the expectation for a problem drawn at random and a search that is restarted. 95 % bootstrap intervals over runs.",
    );
    table
}

fn ranks(result: &SuiteResult) -> Table {
    let title = "Mean rank over problems by the median gap, by budget";
    let all: Vec<_> = (0..result.spec.budgets.len()).map(|budget| result.ranks(budget)).collect();
    let mut table = by_budget(result, ("ranks", title), |budget, entrant| {
        let Some(ranks) = &all[budget] else { return dash() };
        let p = ranks.p_holm[entrant];
        let mark = match entrant == ranks.first {
            true => " first",
            false if p >= 0.05 => " =",
            false => "",
        };
        format!("{:.2}{mark}", ranks.mean_rank[entrant])
    });
    table.note(
        "Gaps below 1e-8 are ties. =: not significantly different from the first at 5 % (Wilcoxon's signed-rank test over problems of the \
         median gaps, with Holm's correction; Demšar 2006).",
    );
    table
}

/// Returns the table of success rates on each problem at the largest complete budget.
fn problems(result: &SuiteResult) -> Table {
    let names: Vec<String> = (0..result.spec.entrants.len()).map(|n| result.name(n)).collect();
    let heads: Vec<&str> = std::iter::once("problem").chain(names.iter().map(String::as_str)).collect();
    let last = result.last_budget();
    let size = last.map_or_else(dash, |last| compact(count_u64(result.spec.budgets[last])));
    let title = format!("Runs that reached the optimum of each problem within {size} evaluations [%]");
    let mut table = Table::new("problems", title, &heads);
    let Some(last) = last else { return table };
    let by_entrant: Vec<_> = (0..names.len()).map(|entrant| result.measures(last, entrant, GAP)).collect();
    for (n, (name, _)) in by_entrant.first().into_iter().flatten().enumerate() {
        table.named_row(name, by_entrant.iter().map(|measures| format!("{:.0}", 100.0 * measures[n].1.success)));
    }
    table
}

/// Returns CSV with a line for each run: budget, problem, method, number, final cost and gap, evaluations, and evaluations to gaps of
/// 1e-1 to 1e-8, empty where a run did not reach them.
#[must_use]
pub fn suite_csv(result: &SuiteResult) -> String {
    let gaps: Vec<f64> = (1..=8).map(|n| 10_f64.powi(-n)).collect();
    let mut text = String::from("budget,problem,method,run,cost,gap,evaluations");
    gaps.iter().for_each(|gap| {
        let _ = write!(text, ",to_{gap:e}");
    });
    text.push('\n');
    let finite = |value: f64| if value.is_finite() { Shortest(value).to_string() } else { String::new() };
    for block in &result.blocks {
        let (Some(problem), Some(budget)) = (result.problems.get(block.problem), result.spec.budgets.get(block.budget))
        else {
            continue;
        };
        for (entrant, runs) in block.runs.iter().enumerate() {
            for (number, run) in runs.iter().enumerate() {
                let SuiteRun { evaluations, .. } = run;
                let (name, method) = (&problem.name, result.name(entrant));
                let (cost, gap) = (finite(run.cost()), finite(problem.gap(run.cost())));
                let _ = write!(text, "{budget},{name},{method},{number},{cost},{gap},{evaluations}");
                for gap in &gaps {
                    let reached = run.evaluations_to(problem.cost(*gap)).map_or(String::new(), |n| n.to_string());
                    let _ = write!(text, ",{reached}");
                }
                text.push('\n');
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_above_a_thousand_have_units() {
        let texts = [3.0, 874.0, 996.0, 12_400.0, 994_000.0, 996_000.0, f64::INFINITY].map(compact);
        assert_eq!(texts, ["3", "874", "1k", "12k", "994k", "1M", "\u{221e}"]);
    }
}
