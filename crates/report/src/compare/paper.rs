//! The paper's Tables 4 to 8 and its discussion beside the results of a comparison.

use super::cells::{cell, fixed, percent, setting_name};
use super::parameters::steiglitz_note;
use super::responses::{current_of, motor, settled, simulated};
use crate::table::{Table, dash};
use motorfit_core::text::{decimals, significant};
use motorfit_motor::{Parameter, Parameters};
use motorfit_study::compare::paper::{NOTES, PRINTED, Printed, REAL, printed};
use motorfit_study::compare::{Comparison, MethodEstimates};

/// Adds the footnotes with the given marks.
fn noted(table: &mut Table, marks: &str) {
    for (mark, note) in NOTES.iter().filter(|(mark, _)| marks.contains(mark)) {
        table.note(format!("{mark}) {note}"));
    }
}

/// The paper's results of a method, and its estimates here if it is compared.
type Pair = (&'static Printed, Option<MethodEstimates>);

/// Returns the motor of the best run.
fn best(ours: &MethodEstimates) -> Option<Parameters> {
    motor(ours.best.as_ref()?)
}

/// Returns Tables 4 to 8 and the table of the discussion. The first block must have the setting of the paper's tables.
#[must_use]
pub fn paper_tables(comparison: &Comparison) -> Vec<Table> {
    let mut tables = vec![costs(comparison)];
    let Some(first) = comparison.blocks.first() else { return tables };
    let found = comparison.estimates(first);
    let ours = |printed: &'static Printed| (printed, found.iter().find(|of| of.method == printed.method).cloned());
    let pairs: Vec<Pair> = PRINTED.iter().map(ours).collect();
    tables.extend(pairs.iter().map(|pair| parameters(comparison, pair)));
    tables.push(summary(&pairs));
    tables.push(times(comparison, &pairs));
    tables.push(deviations(comparison, &pairs));
    tables.push(responses(comparison, &pairs));
    tables
}

/// Returns Table 4, costs.
fn costs(comparison: &Comparison) -> Table {
    let heads = ["method", "paper best", "worst", "average", "ours best", "worst", "average", "median"];
    let mut table = Table::new("table4", "Table 4: cost over runs (a)", &heads);
    let (runs, seed) = (comparison.spec.runs, comparison.spec.seed);
    for (n, block) in comparison.blocks.iter().enumerate() {
        let scale = block.setting.criterion.scale.name();
        for result in &block.results {
            let name = result.method.name();
            let theirs = printed(name).and_then(|p| p.cost).filter(|_| n == 0);
            let theirs = theirs.map_or_else(|| [dash(), dash(), dash()], |cost| cost.map(|cost| cost.to_string()));
            let mark = if name == "ga" && n == 0 { " (b)" } else { "" };
            let s = result.summary(seed);
            let ours = [s.best, s.worst, s.average, s.median].map(|cost| cell(cost, 3));
            table.named_row(&format!("{name}, {scale}{mark}"), theirs.into_iter().chain(ours));
        }
    }
    let under =
        comparison.blocks.first().map_or_else(String::new, |block| format!(", {}", setting_name(&block.setting)));
    table.note(format!("{runs} runs each, seed {seed}{under}."));
    noted(&mut table, "ab");
    table
}

/// Returns the part of Table 5 or 6 for one method, parameters and their errors.
fn parameters(comparison: &Comparison, (printed, ours): &Pair) -> Table {
    let number = if matches!(printed.method, "sm" | "gwo") { 5 } else { 6 };
    let mark = if printed.method == "jaya" { "c, d" } else { "d" };
    let title = format!("Table {number}, {}: parameters and relative errors [%] ({mark})", printed.method);
    let heads = ["parameter", "nominal", "paper", "error", "ours best", "error", "mean error"];
    let mut table = Table::new(format!("table{number}-{}", printed.method), title, &heads);
    let truth = Parameters::M2;
    let best = ours.as_ref().and_then(best);
    for ((n, parameter), [error, mean]) in Parameter::ALL.into_iter().enumerate().zip(errors(ours.as_ref())) {
        let value = |of: &Parameters| significant(of.get(parameter), 6);
        table.named_row(
            &format!("{} [{}]", parameter.symbol(), parameter.unit()),
            [
                value(&truth),
                value(&printed.parameters),
                percent(printed.error_percent[n]),
                best.as_ref().map_or_else(dash, value),
                percent(error),
                percent(mean),
            ],
        );
    }
    if let Some(squares) = best.and_then(|motor| mean_squares(comparison, &motor)) {
        let [current, speed] = squares.map(|square| significant(square, 3));
        table
            .note(format!("Mean squared error of the best run (Eq. 14): current {current} A², speed {speed} rad²/s²."));
    }
    if printed.method == "sm" {
        table.note(steiglitz_note(comparison));
    }
    noted(&mut table, mark);
    table
}

/// Returns for each parameter the relative error of the best run and the mean over runs \[%\]; NaN for a method that is
/// not compared.
fn errors(ours: Option<&MethodEstimates>) -> [[f64; 2]; 5] {
    let errors = ours.and_then(|ours| ours.errors(&Parameters::M2.to_array()).try_into().ok());
    errors.unwrap_or([[f64::NAN; 2]; 5])
}

/// Returns the mean squared errors (Eq. 14) of current \[A²\] and speed \[rad²/s²\] on the first recording.
fn mean_squares(comparison: &Comparison, motor: &Parameters) -> Option<[f64; 2]> {
    let model = simulated(comparison, motor)?;
    let [current, speed] = comparison.subject.records.first()?.measured();
    let of = |measured: Option<&[f64]>, model: &[f64]| {
        let squares: Vec<f64> = measured?.iter().zip(model).map(|(a, b)| (a - b).powi(2)).collect();
        Some(motorfit_core::numeric::mean(&squares))
    };
    Some([of(current, &model[0])?, of(speed, &model[1])?])
}

/// Returns the averages over the parameters, as in the paper's text.
fn summary(pairs: &[Pair]) -> Table {
    let title = "Summary: mean relative error over the five parameters [%] (h)";
    let mut table = Table::new("averages", title, &["method", "paper", "ours best", "ours mean over runs"]);
    for (printed, ours) in pairs {
        let errors = errors(ours.as_ref());
        let average = |n: usize| percent(errors.iter().map(|e| e[n]).sum::<f64>() / 5.0);
        let theirs = percent(printed.error_percent.iter().sum::<f64>() / 5.0);
        table.named_row(printed.method, [theirs, average(0), average(1)]);
    }
    noted(&mut table, "h");
    table
}

/// Returns Table 7, computation times.
fn times(comparison: &Comparison, pairs: &[Pair]) -> Table {
    let heads = ["method", "paper [min]", "ours [ms]", "ratio"];
    let mut table = Table::new("table7", "Table 7: computation time (e)", &heads);
    for (printed, ours) in pairs {
        let seconds = ours.as_ref().and_then(|ours| ours.seconds);
        let milliseconds = seconds.map_or_else(dash, |s| significant(1e3 * s, 3));
        let ratio = seconds.map_or_else(dash, |s| significant(60.0 * printed.minutes / s, 2));
        table.named_row(printed.method, [printed.minutes.to_string(), milliseconds, ratio]);
    }
    table.note(format!("On {}.", comparison.device));
    noted(&mut table, "e");
    table
}

/// Returns Table 8, standard deviations.
fn deviations(comparison: &Comparison, pairs: &[Pair]) -> Table {
    let heads = ["method", "", "R", "L", "K", "B", "J"];
    let mut table = Table::new("table8", "Table 8: standard deviations of the parameters [SI units] (f)", &heads);
    for (printed, ours) in pairs {
        let ours = ours.as_ref().map_or_else(|| vec![f64::NAN; 5], |ours| ours.deviations(&comparison.parameters));
        for (whose, values) in [("paper", printed.deviation.to_vec()), ("ours", ours)] {
            let cells = values.into_iter().map(|v| cell(v, 3));
            table.named_row(printed.method, std::iter::once(whose.to_owned()).chain(cells));
        }
    }
    noted(&mut table, "f");
    table
}

/// Returns the table of the discussion, characteristics of the current.
fn responses(comparison: &Comparison, pairs: &[Pair]) -> Table {
    let heads = ["method", "", "peak [A]", "at [s]", "settled 2 %", "5 % [s]", "steady [A]", "error [A]"];
    let mut table = Table::new("discussion", "Discussion: the current (g)", &heads);
    let mut row =
        |[method, whose]: [&str; 2], [peak, at]: [f64; 2], settled: [String; 2], steady: f64, error: String| {
            let [two, five] = settled;
            let cells = [whose.to_owned(), decimals(peak, 4), decimals(at, 3), two, five];
            table.named_row(method, cells.into_iter().chain([decimals(steady, 4), error]));
        };
    let [peak, at, after, steady] = REAL;
    let real = ("real", [peak, at], Some(after), steady);
    let theirs = PRINTED.iter().map(|printed| (printed.method, printed.peak, printed.settling_s, printed.steady));
    for (method, peak, after, own) in std::iter::once(real).chain(theirs) {
        row([method, "paper"], peak, [settled(after), dash()], own, format!("{:.4}", own - steady));
    }
    let truth = current_of(comparison, &Parameters::M2).map_or(f64::NAN, |[two, _]| two.steady_state);
    let mut motors = vec![(["nominal", "ours"], Some(Parameters::M2))];
    for (printed, ours) in pairs {
        motors.push(([printed.method, "printed*"], Some(printed.parameters)));
        motors.push(([printed.method, "ours"], ours.as_ref().and_then(best)));
    }
    for (names, motor) in motors {
        let Some([two, five]) = motor.and_then(|motor| current_of(comparison, &motor)) else { continue };
        let times = [two, five].map(|response| settled(response.settling_time_s));
        let error = fixed(two.steady_state - truth);
        row(names, [two.peak, two.peak_time_s], times, two.steady_state, error);
    }
    table.note("*) Simulated here with the parameters that the paper prints.");
    noted(&mut table, "g");
    table
}
