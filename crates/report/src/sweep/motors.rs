//! All motors of a sweep as one CSV table: a line for each, with its parameters and their uncertainty.

use super::line::excesses;
use crate::table::Table;
use motorfit_core::text::Shortest;
use motorfit_study::sweep::{Limits, NamedRun, RunEstimate, SweepSummary};

/// Returns CSV with a line for each motor: its name, parameters in their units with standard errors and 95 % intervals, the parameters
/// outside the limits, fit, cost and level of trust. A motor without a result has its error. Cells without a value are empty.
#[must_use]
pub fn motors_csv(summary: &SweepSummary, limits: &Limits) -> String {
    let names: Vec<String> = summary.parameters.iter().map(|of| of.name.clone()).collect();
    let own =
        names.iter().flat_map(|name| ["", "_std_error", "_ci95_low", "_ci95_high"].map(|what| format!("{name}{what}")));
    let first = std::iter::once("motor".to_owned());
    let fits = summary.outputs.iter().map(|output| format!("fit_{output}_percent"));
    let last = ["cost", "trust", "error"].map(str::to_owned);
    let heads: Vec<String> = first.chain(own).chain(["outside".to_owned()]).chain(fits).chain(last).collect();
    let mut table = Table::new("motors", "Motors", &heads);
    let excesses = excesses(summary, limits);
    for run in &summary.results {
        let outside = excesses.iter().filter(|excess| excess.run.job.id == run.job.id).map(|e| e.estimate.name.clone());
        let outside: Vec<String> = outside.collect();
        let cells = summary.parameters.iter().flat_map(|of| values(run.estimate(&of.name)));
        let fits = run.outcome.fit_percent.as_ref();
        let fit = summary.outputs.iter().map(|output| cell(fits.and_then(|fits| fits.of(output))));
        let trust = run.outcome.trust.as_ref().map_or_else(String::new, |trust| trust.level.name().to_owned());
        let rest = [cell(run.outcome.cost), trust, String::new()];
        table.named_row(&run.motor, cells.chain([outside.join(" ")]).chain(fit).chain(rest));
    }
    let is_found = |motor: &str| summary.results.iter().any(|run: &NamedRun| run.motor == motor);
    for failed in summary.failures.named.iter().filter(|failed| !is_found(&failed.motor)) {
        let empty = vec![String::new(); heads.len() - 2];
        table.named_row(&failed.motor, empty.into_iter().chain([failed.message.clone()]));
    }
    table.csv()
}

/// Returns the cells of an estimate: value, standard error and interval.
fn values(estimate: Option<&RunEstimate>) -> [String; 4] {
    let interval = estimate.and_then(|e| e.ci95).map_or([None; 2], |ends| ends.map(Some));
    let [low, high] = interval;
    [estimate.and_then(|e| e.value), estimate.and_then(|e| e.std_error), low, high].map(cell)
}

fn cell(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or_else(String::new, |value| Shortest(value).to_string())
}
