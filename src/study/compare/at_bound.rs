//! Warnings about the box of a comparison: methods whose best runs end at a bound, and bounds that come from no recording.

use super::{Block, Comparison, MethodResult};
use crate::identify::side;
use crate::motor::{Axis, Space};
use crate::setting::{Text, text};
use crate::text::{Shortest, counted, listed, significant};
use crate::warning::Warning;

/// Returns the warnings about the box in which the methods searched.
pub(super) fn of_box(comparison: &Comparison) -> Vec<Warning> {
    let assumed = not_from_recording(comparison);
    let free = comparison.spec.space.free();
    let ends = free.iter().flat_map(|axis| ["min", "max"].map(|end| (axis, end)));
    assumed.into_iter().chain(ends.filter_map(|(axis, end)| at_bound(comparison, axis, end))).collect()
}

/// Returns the bound at which a run ended on an axis; `None` inside the bounds and for a run that diverged.
fn ended(run: &super::Outcome, axis: &Axis) -> Option<&'static str> {
    side(axis, run.parameters?.get(axis.parameter))
}

/// Returns the warning that the best runs of methods ended at one end of an axis; `None` if none did.
fn at_bound(comparison: &Comparison, axis: &Axis, end: &str) -> Option<Warning> {
    let is_there = |run: &super::Outcome| ended(run, axis) == Some(end);
    let results = || comparison.blocks.iter().flat_map(|block: &Block| &block.results);
    let mut names: Vec<&str> = Vec::new();
    for result in results().filter(|result| result.best().is_some_and(is_there)) {
        if !names.contains(&result.method.name()) {
            names.push(result.method.name());
        }
    }
    if names.is_empty() {
        return None;
    }
    let runs = || results().filter(|result| names.contains(&result.method.name())).flat_map(|r: &MethodResult| &r.runs);
    let (there, all) = (runs().filter(|run| is_there(run)).count(), counted(runs().count(), "run"));
    let (symbol, unit) = (axis.parameter.symbol(), axis.parameter.unit());
    let (which, bound) = if end == "min" { ("lower", axis.min) } else { ("upper", axis.max) };
    let best = if names.len() == 1 { "the best run of" } else { "the best runs of" };
    let what = format!(
        "{best} {} ended at the {which} bound of {symbol}, {} {unit} ({there} of {all})",
        listed(&names, "and"),
        significant(bound, 4)
    );
    Some(Warning::new("at_bound", Text::from(what).and(advice(comparison, axis, end))))
}

/// Returns what follows from a method that ends at a bound: the optimum is inside and the method has missed it, or the box is
/// too small.
fn advice(comparison: &Comparison, axis: &Axis, end: &str) -> Text {
    let symbol = axis.parameter.symbol();
    let refined = comparison.reference.as_ref().ok().filter(|_| comparison.subject.truth.is_none());
    let estimates = refined.map_or_else(Vec::new, |found| found.estimates());
    if estimates.iter().any(|e| e.parameter == axis.parameter && e.value.is_none()) {
        return format!("; the recordings do not identify {symbol}").into();
    }
    let known = comparison.expected().map(|motor| motor.get(axis.parameter));
    match known.filter(|value| (axis.min..=axis.max).contains(value) && side(axis, *value).is_none()) {
        Some(value) => {
            let of = if comparison.subject.truth.is_some() { "the true value" } else { "the refined estimate" };
            format!("; {of}, {}, is inside: these runs have missed the optimum", significant(value, 4)).into()
        }
        None => {
            let [low, high] = if end == "min" { [0.1 * axis.min, axis.max] } else { [axis.min, 10.0 * axis.max] };
            let [low, high] = [low, high].map(rounded);
            text!("; the optimum may be outside: widen the box, as with "[Bounds = "{symbol}={low}:{high}"])
        }
    }
}

/// Returns a value rounded to three digits, without zeros at its end.
fn rounded(value: f64) -> Shortest {
    Shortest(significant(value, 3).parse().unwrap_or(value))
}

/// Returns the warning that measured motors were searched in the box of Table 2 although no estimate says that they are in it;
/// `None` if there is an estimate, or no bound is that of Table 2.
fn not_from_recording(comparison: &Comparison) -> Option<Warning> {
    if comparison.subject.truth.is_some() || comparison.interrupted || comparison.reference.is_ok() {
        return None;
    }
    let table2 = Space::table2();
    let free = comparison.spec.space.free();
    let taken = free.iter().filter(|axis| table2.free().contains(axis)).map(|axis| axis.parameter.symbol());
    let taken: Vec<&str> = taken.collect();
    (!taken.is_empty()).then(|| {
        let list = listed(&taken, "and");
        let message = text!(
            "the recordings give no estimate of the motor, so that the bounds of {list} are those of the paper's motor; give \
             bounds that contain this one with " [Bounds]
        );
        Warning::new("bounds_assumed", message)
    })
}
