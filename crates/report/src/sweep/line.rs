//! Motors of a production line: their parameters, and the motors outside limits.

use super::capability::Capability;
use super::words::{Unit, block_name, counted, many};
use crate::table::{Table, dash};
use motorfit_core::numeric::{quantile, sorted};
use motorfit_core::text::{decimals, significant};
use motorfit_study::sweep::{Limits, NamedRun, Quantiles, RunEstimate, RunEstimates, SweepParameter, SweepSummary};
use std::collections::BTreeSet;

/// Values of a parameter over all motors.
pub(super) struct Spread {
    pub parameter: SweepParameter,
    pub values: Vec<f64>,
    /// Median standard error; NaN without any.
    pub std_error: f64,
    pub limits: Option<[f64; 2]>,
    /// Number of motors outside the limits.
    pub outside: usize,
    /// Number of motors inside the limits whose 95 % interval extends beyond one; `None` if no motor has intervals.
    pub unsure: Option<usize>,
    /// Number of motors without a value.
    pub untested: usize,
}

/// Returns the values of the parameters that motors have.
pub(super) fn spreads(summary: &SweepSummary, limits: &Limits) -> Vec<Spread> {
    let of = |parameter: &SweepParameter| {
        let estimates = || summary.results.iter().filter_map(|run| run.estimate(&parameter.name));
        let errors: Vec<f64> = estimates().filter_map(|e| e.std_error).collect();
        let bounds = limits.of(&parameter.symbol);
        let within = |value: f64| limits.permit(&parameter.symbol, value);
        let inside = || estimates().filter(|e| e.value.is_some_and(within));
        let intervals = || inside().filter_map(|e| e.ci95);
        let values: Vec<f64> = estimates().filter_map(|e| e.value).collect();
        Spread {
            parameter: parameter.clone(),
            std_error: quantile(&sorted(&errors), 0.5),
            limits: bounds,
            outside: values.len() - inside().count(),
            unsure: (!errors.is_empty()).then(|| intervals().filter(|ends| !ends.iter().all(|v| within(*v))).count()),
            untested: summary.motors.saturating_sub(values.len()),
            values,
        }
    };
    let is_known = |symbol: &&str| summary.parameters.iter().any(|parameter| parameter.symbol == *symbol);
    let unknown = limits.symbols().filter(|symbol| !is_known(symbol)).map(SweepParameter::unknown);
    let parameters: Vec<SweepParameter> = summary.parameters.iter().cloned().chain(unknown).collect();
    let all: Vec<Spread> = parameters.iter().map(of).collect();
    // Parameters that no motor identifies are not shown where characteristics are.
    let has_others = all.iter().any(|spread| !spread.parameter.is_always && !spread.values.is_empty());
    let is_shown = |spread: &Spread| {
        !spread.values.is_empty() || spread.limits.is_some() || (spread.parameter.is_always && !has_others)
    };
    all.into_iter().filter(is_shown).collect()
}

/// Returns the symbols of limits that were not tested in each motor, with the number of motors.
pub(super) fn untested(summary: &SweepSummary, limits: &Limits) -> Vec<(String, usize)> {
    let open = |spread: &Spread| spread.limits.is_some() && spread.untested > 0;
    let all = spreads(summary, limits).into_iter().filter(open);
    all.map(|spread| (spread.parameter.name, spread.untested)).collect()
}

/// A parameter of a motor that is outside its limits.
pub(super) struct Excess<'a> {
    pub run: &'a NamedRun,
    pub parameter: &'a SweepParameter,
    pub estimate: &'a RunEstimate,
    pub value: f64,
    /// Limit that the value exceeds.
    pub limit: f64,
    pub is_above: bool,
    /// Excess as a fraction of the distance between the limits.
    pub share: f64,
}

/// Returns all values outside their limits, the largest excess first. Parameters that are not identifiable are not
/// included.
pub(super) fn excesses<'a>(summary: &'a SweepSummary, limits: &Limits) -> Vec<Excess<'a>> {
    let one = |run: &'a NamedRun, estimate: &'a RunEstimate| {
        let parameter = summary.parameters.iter().find(|of| of.name == estimate.name)?;
        let ([low, high], value) = (limits.of(&parameter.symbol)?, estimate.value?);
        let is_above = value > high;
        let limit = if is_above { high } else { low };
        let share = (value - limit).abs() / (high - low);
        let excess = Excess { run, parameter, estimate, value, limit, is_above, share };
        (!limits.permit(&parameter.symbol, value)).then_some(excess)
    };
    let estimates = |run: &'a NamedRun| run.outcome.estimates.iter().flat_map(RunEstimates::all);
    let all = summary.results.iter().flat_map(|run| estimates(run).map(move |estimate| (run, estimate)));
    let mut all: Vec<Excess<'a>> = all.filter_map(|(run, estimate)| one(run, estimate)).collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

/// Returns the number of motors outside the limits.
pub(super) fn motors_outside(excesses: &[Excess<'_>]) -> u64 {
    excesses.iter().map(|excess| excess.run.job.motor).collect::<BTreeSet<_>>().len() as u64
}

/// Returns true if every motor was tested for all limits and is within them.
#[must_use]
pub fn all_within_limits(summary: &SweepSummary, limits: &Limits) -> bool {
    excesses(summary, limits).is_empty() && untested(summary, limits).is_empty()
}

/// Returns the tables of the motors outside limits, of the limits, and of the parameters of several motors.
pub(super) fn line_tables(summary: &SweepSummary, limits: &Limits) -> Vec<Table> {
    let spreads = spreads(summary, limits);
    let units: Vec<Unit> = spreads.iter().map(|s| Unit::for_all(&s.parameter, &s.values)).collect();
    let mut tables = Vec::new();
    if summary.results.is_empty() {
        return tables;
    }
    if !limits.is_empty() {
        tables.extend(outside(&excesses(summary, limits), &units));
        tables.push(self::limits(&spreads, &units));
        tables.extend(capability(&spreads, &units));
    }
    if summary.motors > 1 {
        tables.push(motors(summary, &spreads, &units));
    }
    tables
}

fn motors(summary: &SweepSummary, spreads: &[Spread], units: &[Unit]) -> Table {
    let heads = ["parameter", "min", "5 %", "median", "95 %", "max", "std. error"];
    let title = format!("Parameters of {}", counted(summary.results.len() as u64, "motor", "motors"));
    let mut table = Table::new("motors", title, &heads);
    for (spread, unit) in spreads.iter().zip(units) {
        let q = Quantiles::of(&spread.values);
        let quantiles = [q.min, q.q05, q.median, q.q95, q.max].map(|value| unit.write(value, 4));
        table.named_row(&unit.head(), quantiles.into_iter().chain([unit.write(spread.std_error, 2)]));
    }
    let block = summary.blocks.first().map_or_else(String::new, block_name);
    table.note(format!("Best run of each motor ({block}); std. error: median over the motors."));
    table
}

fn limits(spreads: &[Spread], units: &[Unit]) -> Table {
    let heads = ["parameter", "lower", "upper", "inside", "uncertain", "outside", "not tested"];
    let mut table = Table::new("limits", "Limits", &heads);
    let [mut has_intervals, mut has_values] = [false; 2];
    for (spread, unit) in spreads.iter().zip(units) {
        let Some([low, high]) = spread.limits else { continue };
        has_intervals |= spread.unsure.is_some();
        has_values |= !spread.values.is_empty();
        table.row([
            unit.head(),
            unit.limit(low),
            unit.limit(high),
            many(spread.values.len() - spread.outside),
            spread.unsure.map_or_else(dash, many),
            many(spread.outside),
            many(spread.untested),
        ]);
    }
    table.note(match (has_intervals, has_values) {
        (true, _) => {
            "Uncertain: motors inside whose 95 % interval extends beyond a limit. Not tested: motors without a value."
        }
        (_, true) => "Without a refinement (polish) there are no confidence intervals: the uncertainty is unknown.",
        _ => "No motor has a value: its model lacks the parameter, or its recordings do not identify it.",
    });
    table
}

/// Returns the table of the capability indices; `None` for fewer than two motors.
fn capability(spreads: &[Spread], units: &[Unit]) -> Option<Table> {
    let heads = ["parameter", "motors", "mean", "std. dev.", "Cp", "Cp, 95 %", "Cpk", "Cpk, 95 %"];
    let mut table = Table::new("capability", "Process capability", &heads);
    for (spread, unit) in spreads.iter().zip(units) {
        let Some(ends) = spread.limits.filter(|_| spread.values.len() > 1) else { continue };
        let of = Capability::of(&spread.values, ends);
        let index = |value: f64| if value.is_nan() { dash() } else { significant(value, 3) };
        let interval = |[low, high]: [f64; 2]| match low.is_nan() {
            true => dash(),
            false => format!("{}…{}", index(low), index(high)),
        };
        table.row([
            unit.head(),
            many(spread.values.len()),
            unit.write(of.mean, 4),
            unit.write(of.deviation, 3),
            index(of.cp),
            interval(of.cp_ci95),
            index(of.cpk),
            interval(of.cpk_ci95),
        ]);
    }
    table.note(
        "Cp: distance of the limits over six standard deviations; Cpk: distance of the mean from the nearer limit over three. \
         Intervals by the χ² distribution and by Bissell (1990), for normally distributed parameters; the spread includes the \
         error of the estimates.",
    );
    (!table.rows.is_empty()).then_some(table)
}

/// Returns the table of motors outside the limits; `None` without any.
fn outside(excesses: &[Excess<'_>], units: &[Unit]) -> Option<Table> {
    if excesses.is_empty() {
        return None;
    }
    let heads = ["motor", "parameter", "value", "95 % interval", "limit", "fit [%]"];
    let title = format!("Outside the limits: {}", counted(motors_outside(excesses), "motor", "motors"));
    let mut table = Table::new("outside", title, &heads);
    for Excess { run, parameter, estimate, value, limit, is_above, .. } in excesses {
        let Some(unit) = units.iter().find(|unit| unit.parameter.name == parameter.name) else { continue };
        let write = |value: f64| unit.write(value, 5);
        let percent = |(_, fit): &(String, Option<f64>)| fit.map_or_else(dash, |fit| decimals(fit, 2));
        let fits = run.outcome.fit_percent.as_ref();
        let fit = fits.map(|fits| fits.0.iter().map(percent).collect::<Vec<_>>().join(" / "));
        table.row([
            run.motor.clone(),
            unit.head(),
            write(*value),
            estimate.ci95.map_or_else(dash, |[low, high]| format!("{} … {}", write(low), write(high))),
            format!("{} {}", if *is_above { "≤" } else { "≥" }, unit.limit(*limit)),
            fit.unwrap_or_else(dash),
        ]);
    }
    table.note("Sorted by the excess relative to the distance between the limits; fit: current / speed.");
    Some(table)
}
