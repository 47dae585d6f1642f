//! Warnings about the box of a comparison: methods whose best runs end at a bound, and bounds that come from no recording.

use super::result::{Block, Comparison, MethodResult};
use super::subject::ComparedMachine;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{Shortest, counted, listed, significant};
use motorfit_identify::side;
use motorfit_motor::Space;
use motorfit_record::warning::Warning;

/// Returns the warnings about the box in which the methods searched.
pub(super) fn of_box(comparison: &Comparison) -> Vec<Warning> {
    let assumed = not_from_recording(comparison);
    let free = comparison.parameters.iter().enumerate();
    let free =
        free.filter_map(|(index, of)| Some(Axis { index, name: &of.name, unit: &of.unit, bounds: of.bounds()? }));
    let ends = free.flat_map(|axis| ["min", "max"].map(|end| (axis, end)));
    assumed.into_iter().chain(ends.filter_map(|(axis, end)| at_bound(comparison, &axis, end))).collect()
}

/// A free parameter.
#[derive(Clone, Copy)]
struct Axis<'a> {
    /// Index among the parameters.
    index: usize,
    name: &'a str,
    unit: &'a str,
    bounds: [f64; 2],
}

/// Returns the bound at which a run ended on an axis; `None` inside the bounds and for a run that diverged.
fn ended(run: &super::result::Outcome, axis: &Axis<'_>) -> Option<&'static str> {
    side(axis.bounds, *run.parameters.as_ref()?.get(axis.index)?)
}

/// Returns the warning that the best runs of methods ended at one end of an axis; `None` if none did.
fn at_bound(comparison: &Comparison, axis: &Axis<'_>, end: &str) -> Option<Warning> {
    let is_there = |run: &super::result::Outcome| ended(run, axis) == Some(end);
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
    let Axis { name, unit, bounds: [min, max], .. } = axis;
    let (which, bound) = if end == "min" { ("lower", *min) } else { ("upper", *max) };
    let best = if names.len() == 1 { "the best run of" } else { "the best runs of" };
    let what = format!(
        "{best} {} ended at the {which} bound of {name}, {} {unit} ({there} of {all})",
        listed(&names, "and"),
        significant(bound, 4)
    );
    Some(Warning::new("at_bound", Text::from(what).and(advice(comparison, axis, end))))
}

/// Returns what follows from a method that ends at a bound: the optimum is inside and the method has missed it, or the box is
/// too small.
fn advice(comparison: &Comparison, axis: &Axis<'_>, end: &str) -> Text {
    let Axis { name, bounds: [min, max], .. } = *axis;
    let refined = comparison.reference.as_ref().ok().filter(|_| comparison.subject.truth().is_none());
    if refined.is_some_and(|found| found.is_unidentified(name)) {
        return format!("; the recordings do not identify {name}").into();
    }
    let known = comparison.expected().and_then(|values| values.get(axis.index).copied());
    match known.filter(|value| (min..=max).contains(value) && side(axis.bounds, *value).is_none()) {
        Some(value) => {
            let of = if comparison.subject.truth().is_some() { "the true value" } else { "the refined estimate" };
            format!("; {of}, {}, is inside: these runs have missed the optimum", significant(value, 4)).into()
        }
        None => {
            // A bound of a positive parameter moves by a decade, another one by the width of the box.
            let [lower, upper] = if min > 0.0 { [0.1 * min, 10.0 * max] } else { [2.0 * min - max, 2.0 * max - min] };
            let [low, high] = if end == "min" { [lower, max] } else { [min, upper] };
            let [low, high] = [low, high].map(rounded);
            // The parameters of all recordings have the same bounds.
            let name = name.split('[').next().unwrap_or(name);
            text!("; the optimum may be outside: widen the box, as with "[Bounds = "{name}={low}:{high}"])
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
    let is_measured = matches!(comparison.subject.machine, ComparedMachine::Motor { truth: None });
    if !is_measured || comparison.interrupted || comparison.reference.is_ok() {
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
