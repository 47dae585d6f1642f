//! The motors of a production line: their parameters, and which are outside of limits.

use super::words::{Unit, block_name, many, plural};
use crate::motor::Parameter;
use crate::numeric::{quantile, sorted};
use crate::report::Table;
use crate::study::sweep::{Limits, NamedRun, Quantiles, SweepSummary};

/// A parameter over all motors.
pub(super) struct Spread {
    pub parameter: Parameter,
    pub values: Vec<f64>,
    /// The median standard error, NaN without any.
    pub std_error: f64,
    pub limits: Option<[f64; 2]>,
    /// Motors outside of the limits.
    pub outside: usize,
    /// Motors inside whose 95 % interval reaches over a limit; `None` where no motor has intervals.
    pub unsure: Option<usize>,
}

/// All five parameters over all motors.
pub(super) fn spreads(summary: &SweepSummary, limits: &Limits) -> [Spread; 5] {
    Parameter::ALL.map(|p| {
        let error = |run: &NamedRun| run.outcome.std_error?.to_array()[p as usize];
        let errors: Vec<f64> = summary.results.iter().filter_map(error).collect();
        let bounds = limits.of(p);
        let within = |value: f64| bounds.is_none_or(|[low, high]| (low..=high).contains(&value));
        let inside = || summary.results.iter().filter(|run| within(run.value(p)));
        let intervals = || inside().filter_map(|run| run.interval(p));
        Spread {
            parameter: p,
            values: summary.results.iter().map(|run| run.value(p)).collect(),
            std_error: quantile(&sorted(&errors), 0.5),
            limits: bounds,
            outside: summary.results.len() - inside().count(),
            unsure: (!errors.is_empty()).then(|| intervals().filter(|ends| !ends.iter().all(|v| within(*v))).count()),
        }
    })
}

/// A parameter of a motor that is outside of its limits.
pub(super) struct Excess<'a> {
    pub run: &'a NamedRun,
    pub parameter: Parameter,
    /// The limit that it is beyond.
    pub limit: f64,
    pub is_above: bool,
    /// How far beyond, as a share of the distance between the limits.
    pub share: f64,
}

/// Everything that is outside, the farthest first.
pub(super) fn excesses<'a>(summary: &'a SweepSummary, limits: &Limits) -> Vec<Excess<'a>> {
    let one = |run: &'a NamedRun, parameter: Parameter| {
        let [low, high] = limits.of(parameter)?;
        let value = run.value(parameter);
        let is_above = value > high;
        let beyond = if is_above { value - high } else { low - value };
        let limit = if is_above { high } else { low };
        Some(Excess { run, parameter, limit, is_above, share: beyond / (high - low) })
    };
    let outside = summary.outside(limits).into_iter();
    let mut all: Vec<Excess<'a>> =
        outside.flat_map(|(run, list)| list.into_iter().filter_map(move |p| one(run, p))).collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

/// The tables: what is outside of limits, the limits, the parameters of several motors.
pub(super) fn line_tables(summary: &SweepSummary, limits: &Limits) -> Vec<Table> {
    let spreads = spreads(summary, limits);
    let units = spreads.each_ref().map(|s| Unit::for_all(s.parameter, &s.values));
    let mut tables = Vec::new();
    if summary.results.is_empty() {
        return tables;
    }
    if !limits.is_empty() {
        tables.extend(outside(&excesses(summary, limits), &units));
        tables.push(self::limits(&spreads, &units));
    }
    if summary.motors > 1 {
        tables.push(motors(summary, &spreads, &units));
    }
    tables
}

fn motors(summary: &SweepSummary, spreads: &[Spread; 5], units: &[Unit; 5]) -> Table {
    let heads = ["parameter", "min", "5 %", "median", "95 %", "max", "std. error"];
    let count = summary.results.len();
    let title = format!("Parameters of {} {}", many(count), plural(count as u64, "motor", "motors"));
    let mut table = Table::new("motors", title, &heads);
    for (spread, unit) in spreads.iter().zip(units) {
        let q = Quantiles::of(&spread.values);
        let mut row = vec![unit.head()];
        row.extend([q.min, q.q05, q.median, q.q95, q.max].map(|value| unit.write(value, 4)));
        row.push(unit.write(spread.std_error, 2));
        table.row(row);
    }
    let block = summary.blocks.first().map_or_else(String::new, block_name);
    table.note(format!("Of each motor the best run ({block}); std. error: that of a typical motor, the median."));
    table
}

fn limits(spreads: &[Spread; 5], units: &[Unit; 5]) -> Table {
    let heads = ["parameter", "lower", "upper", "inside", "not sure", "outside"];
    let mut table = Table::new("limits", "Limits", &heads);
    let mut has_intervals = false;
    for (spread, unit) in spreads.iter().zip(units) {
        let Some([low, high]) = spread.limits else { continue };
        has_intervals |= spread.unsure.is_some();
        table.row(vec![
            unit.head(),
            unit.limit(low),
            unit.limit(high),
            many(spread.values.len() - spread.outside),
            spread.unsure.map_or_else(|| "\u{2013}".to_owned(), many),
            many(spread.outside),
        ]);
    }
    table.note(if has_intervals {
        "Not sure: of the motors inside, those whose 95 % interval reaches over a limit."
    } else {
        "There are no intervals, which a polish gives: how sure this is, is not known."
    });
    table
}

/// What is outside; `None` where nothing is.
fn outside(excesses: &[Excess<'_>], units: &[Unit; 5]) -> Option<Table> {
    let motors = excesses.iter().map(|e| e.run.job.motor).collect::<std::collections::BTreeSet<_>>().len();
    if motors == 0 {
        return None;
    }
    let heads = ["motor", "parameter", "value", "95 % interval", "limit", "fit [%]"];
    let title = format!("Outside of the limits: {} {}", many(motors), plural(motors as u64, "motor", "motors"));
    let mut table = Table::new("outside", title, &heads);
    let dash = || "\u{2013}".to_owned();
    for Excess { run, parameter, limit, is_above, .. } in excesses {
        let unit = &units[*parameter as usize];
        let write = |value: f64| unit.write(value, 5);
        let fit = run.outcome.fit_percent.map(|fit| [fit.current, fit.speed]);
        let fit = fit.map(|fit| fit.map(|f| f.map_or_else(dash, |f| format!("{f:.2}"))).join(" / "));
        table.row(vec![
            run.motor.clone(),
            unit.head(),
            write(run.value(*parameter)),
            run.interval(*parameter).map_or_else(dash, |[low, high]| format!("{} … {}", write(low), write(high))),
            format!("{} {}", if *is_above { "≤" } else { "≥" }, unit.limit(*limit)),
            fit.unwrap_or_else(dash),
        ]);
    }
    table.note("The farthest first, measured by the distance between the limits; fit: of current and speed.");
    Some(table)
}
