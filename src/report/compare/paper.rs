//! The paper's Tables 4 to 8 and its discussion, ours beside.

use super::tables::{cell, current_of, fixed, percent, setting_name, steiglitz_note};
use crate::motor::{Parameter, Parameters};
use crate::report::Table;
use crate::study::compare::paper::{NOTES, PRINTED, Printed, REAL};
use crate::study::compare::{Block, Comparison, MethodResult};
use crate::text::significant;

/// Footnotes by their marks.
fn noted(table: &mut Table, marks: &str) {
    for (mark, note) in NOTES.iter().filter(|(mark, _)| marks.contains(mark)) {
        table.note(format!("{mark}) {note}"));
    }
}

fn result<'a>(block: &'a Block, method: &str) -> Option<&'a MethodResult> {
    block.results.iter().find(|result| result.method.name() == method)
}

/// Tables 4 to 8 and the figures of the discussion; the first block is the one that the paper's tables show.
#[must_use]
pub fn paper_tables(comparison: &Comparison) -> Vec<Table> {
    let mut tables = vec![costs(comparison)];
    let Some(first) = comparison.blocks.first() else { return tables };
    tables.extend(PRINTED.iter().map(|printed| parameters(comparison, first, printed)));
    tables.push(summary(comparison, first));
    tables.push(times(comparison, first));
    tables.push(deviations(comparison, first));
    tables.push(responses(comparison, first));
    tables
}

/// Table 4.
fn costs(comparison: &Comparison) -> Table {
    let heads = ["method", "paper best", "worst", "average", "ours best", "worst", "average", "median"];
    let mut table = Table::new("table4", "Table 4: cost over runs (a)", &heads);
    for (n, block) in comparison.blocks.iter().enumerate() {
        let scale = block.setting.criterion.scale.name();
        for result in &block.results {
            let name = result.method.name();
            let printed = PRINTED.iter().find(|p| p.method == name).and_then(|p| p.cost).filter(|_| n == 0);
            let mark = if name == "ga" && n == 0 { " (b)" } else { "" };
            let theirs = |k: usize| printed.map_or("\u{2013}".to_owned(), |cost| cost[k].to_string());
            let s = result.summary(comparison.spec.seed);
            let ours = [s.best, s.worst, s.average, s.median].map(|cost| cell(cost, 3));
            let head = format!("{name}, {scale}{mark}");
            table.row([head].into_iter().chain([0, 1, 2].map(theirs)).chain(ours).collect());
        }
    }
    let runs = comparison.spec.runs;
    table.note(format!(
        "{runs} runs each, seed {}, {}.",
        comparison.spec.seed,
        setting_name(&comparison.blocks[0].setting)
    ));
    noted(&mut table, "ab");
    table
}

/// Tables 5 and 6, a method each.
fn parameters(comparison: &Comparison, block: &Block, printed: &Printed) -> Table {
    let number = if matches!(printed.method, "sm" | "gwo") { 5 } else { 6 };
    let mark = if printed.method == "jaya" { "c, d" } else { "d" };
    let title = format!("Table {number}, {}: parameters and relative errors [%] ({mark})", printed.method);
    let heads = ["parameter", "nominal", "paper", "error", "ours best", "error", "mean error"];
    let mut table = Table::new(format!("table{number}-{}", printed.method), title, &heads);
    let truth = Parameters::M2;
    let (best, errors) = ours(comparison, block, printed.method);
    for (n, parameter) in Parameter::ALL.into_iter().enumerate() {
        table.row(vec![
            format!("{} [{}]", parameter.symbol(), parameter.unit()),
            significant(truth.get(parameter), 6),
            significant(printed.parameters.get(parameter), 6),
            percent(printed.error_percent[n]),
            best.map_or("\u{2013}".to_owned(), |p| significant(p.get(parameter), 6)),
            percent(errors[n][0]),
            percent(errors[n][1]),
        ]);
    }
    let mse = best.and_then(|p| mean_squares(comparison, &p));
    if let Some([current, speed]) = mse {
        table.note(format!(
            "True mean squared error of the best run (Eq. 14): current {} A², speed {} rad²/s².",
            significant(current, 3),
            significant(speed, 3)
        ));
    }
    if printed.method == "sm" {
        table.note(steiglitz_note(comparison));
    }
    noted(&mut table, mark);
    table
}

/// The best parameters of a method and their errors: best run, mean over runs.
fn ours(comparison: &Comparison, block: &Block, method: &str) -> (Option<Parameters>, [[f64; 2]; 5]) {
    let none = (None, [[f64::NAN; 2]; 5]);
    if method == "sm" {
        let Some(sm) = &comparison.steiglitz else { return none };
        return (sm.estimate.as_ref().ok().copied(), sm.all_errors(&Parameters::M2));
    }
    let Some(result) = result(block, method) else { return none };
    (result.best().and_then(|run| run.parameters), result.errors(&Parameters::M2))
}

/// Eq. 14 of both channels of the first recording.
fn mean_squares(comparison: &Comparison, parameters: &Parameters) -> Option<[f64; 2]> {
    let record = comparison.subject.records.first()?;
    let drive = crate::experiment::drive(record);
    let initial = comparison.initial.first().copied().unwrap_or_default();
    let model = crate::motor::simulate(parameters, &drive, initial, comparison.spec.model.discretization);
    let [current, speed] = record.measured();
    let of = |measured: Option<&[f64]>, model: &[f64]| {
        let squares: Vec<f64> = measured?.iter().zip(model).map(|(a, b)| (a - b).powi(2)).collect();
        Some(crate::numeric::mean(&squares))
    };
    Some([of(current, &model[0])?, of(speed, &model[1])?])
}

/// The averages over the parameters, as the text gives them.
fn summary(comparison: &Comparison, block: &Block) -> Table {
    let mut table = Table::new(
        "averages",
        "Summary: mean relative error over the five parameters [%] (h)",
        &["method", "paper", "ours best", "ours mean over runs"],
    );
    for printed in &PRINTED {
        let (_, errors) = ours(comparison, block, printed.method);
        let average = |n: usize| percent(errors.iter().map(|e| e[n]).sum::<f64>() / 5.0);
        let theirs = percent(printed.error_percent.iter().sum::<f64>() / 5.0);
        table.row(vec![printed.method.to_owned(), theirs, average(0), average(1)]);
    }
    noted(&mut table, "h");
    table
}

/// Table 7.
fn times(comparison: &Comparison, block: &Block) -> Table {
    let mut table =
        Table::new("table7", "Table 7: computation time (e)", &["method", "paper [min]", "ours [ms]", "ratio"]);
    for printed in &PRINTED {
        let seconds = match printed.method {
            "sm" => comparison.steiglitz.as_ref().map(|sm| sm.seconds),
            method => result(block, method).and_then(|result| result.seconds),
        };
        table.row(vec![
            printed.method.to_owned(),
            format!("{}", printed.minutes),
            seconds.map_or("\u{2013}".to_owned(), |s| significant(1e3 * s, 3)),
            seconds.map_or("\u{2013}".to_owned(), |s| significant(60.0 * printed.minutes / s, 2)),
        ]);
    }
    table.note(format!("On {}, {}.", comparison.device.1, comparison.device.2));
    noted(&mut table, "e");
    table
}

/// Table 8.
fn deviations(comparison: &Comparison, block: &Block) -> Table {
    let heads = ["method", "", "R", "L", "K", "B", "J"];
    let mut table = Table::new("table8", "Table 8: standard deviations of the parameters [SI units] (f)", &heads);
    for printed in &PRINTED {
        let ours = match printed.method {
            "sm" => comparison.steiglitz.as_ref().map(crate::study::compare::Steiglitz::deviations),
            method => result(block, method).map(MethodResult::deviations),
        };
        for (whose, values) in [("paper", Some(printed.deviation)), ("ours", ours)] {
            let cells = values.unwrap_or([f64::NAN; 5]).map(|v| cell(v, 3));
            table.row([printed.method.to_owned(), whose.to_owned()].into_iter().chain(cells).collect());
        }
    }
    noted(&mut table, "f");
    table
}

/// The figures of the discussion.
fn responses(comparison: &Comparison, block: &Block) -> Table {
    let heads = ["method", "", "peak [A]", "at [s]", "settled 2 %", "5 % [s]", "steady [A]", "error [A]"];
    let mut table = Table::new("discussion", "Discussion: the current (g)", &heads);
    let time = |t: Option<f64>| t.map_or("never".to_owned(), |t| format!("{t:.3}"));
    let [peak, at, settled, steady] = REAL;
    let mut theirs = |method: &str, peak: [f64; 2], settled: Option<f64>, own: f64| {
        table.row(vec![
            method.to_owned(),
            "paper".to_owned(),
            format!("{:.4}", peak[0]),
            format!("{:.3}", peak[1]),
            time(settled),
            "\u{2013}".to_owned(),
            format!("{own:.4}"),
            format!("{:.4}", own - steady),
        ]);
    };
    theirs("real", [peak, at], Some(settled), steady);
    for printed in &PRINTED {
        theirs(printed.method, printed.peak, printed.settling_s, printed.steady);
    }
    let truth = current_of(comparison, &Parameters::M2, 0.02).map_or(f64::NAN, |r| r.steady_state);
    let mut rows = vec![("nominal".to_owned(), "ours", Some(Parameters::M2))];
    for printed in &PRINTED {
        rows.push((printed.method.to_owned(), "printed*", Some(printed.parameters)));
        rows.push((printed.method.to_owned(), "ours", self::ours(comparison, block, printed.method).0));
    }
    for (method, whose, parameters) in rows {
        let response = |band: f64| parameters.and_then(|p| current_of(comparison, &p, band));
        let (Some(two), Some(five)) = (response(0.02), response(0.05)) else { continue };
        table.row(vec![
            method,
            whose.to_owned(),
            format!("{:.4}", two.peak),
            format!("{:.3}", two.peak_time_s),
            time(two.settling_time_s),
            time(five.settling_time_s),
            format!("{:.4}", two.steady_state),
            fixed(two.steady_state - truth),
        ]);
    }
    table.note("*) Our simulation of the parameters that the paper prints.");
    noted(&mut table, "g");
    table
}
