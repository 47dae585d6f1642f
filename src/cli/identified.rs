//! The result of an identification as text for the terminal, of any machine.

use super::prelude::*;
use super::terminal::Stream;
use motorfit::identify::model::OwnModel;
use motorfit::identify::{DcMotor, Identification, ParameterEstimate};
use motorfit::motor::Input;
use motorfit::record::{Quantity, Record};
use motorfit::report::{
    EstimateRow, Requested, Shown, characteristics_lines, estimate_rows, noise_floor_text, selection_text, verdict,
    verdicts,
};
use motorfit::text::decimals;

/// A line of the result: its name, which is empty if it goes on from the line before, and its text.
type Line = (&'static str, String);

/// A machine whose results are printed.
pub(super) trait Told: Shown {
    /// Returns the lines that follow the fit.
    fn after_fit(found: &Identification<Self>) -> Vec<Line>;

    /// Describes the method that found the first optimum.
    fn method(found: &Identification<Self>, requested: &Requested) -> String;

    /// Returns the settings that a report names.
    fn options(spec: &Self::Spec, found: &Identification<Self>) -> Vec<(&'static str, String)>;
}

/// Describes a population search.
fn of_search<M>(found: &Identification<M>, of: &Requested) -> String {
    let (name, evaluations) = (found.searched.method, found.evaluations);
    let Requested { population, generations, seed, .. } = of;
    format!("{name}, {population} agents × {generations} generations, {evaluations} evaluations, seed {seed}")
}

/// Returns the settings that reports of all machines name.
fn options<M: Shown>(spec: &M::Spec, found: &Identification<M>) -> Vec<(&'static str, String)> {
    let Requested { method, polish, seed, population, generations, criterion } = M::requested(spec);
    vec![
        ("method", format!("{method} (found by {})", found.searched.method)),
        ("polish", polish.to_owned()),
        ("population, generations", format!("{population}, {generations}")),
        ("seed", seed.to_string()),
        ("criterion, scale", format!("{}, {}", criterion.norm.name(), criterion.scale.name())),
        ("evaluations", format!("{}, {}", found.evaluations, found.stop.name())),
        ("time", engineering(found.seconds, "s", 3)),
    ]
}

impl Told for DcMotor {
    fn after_fit(found: &Identification<Self>) -> Vec<Line> {
        let mut lines = held_out(found);
        lines.extend(found.noise_floor.iter().map(|of| ("best fit", noise_floor_text(of))));
        lines.extend(characteristics_lines(found));
        lines
    }

    fn method(found: &Identification<Self>, requested: &Requested) -> String {
        match found.searched.method {
            "sm" => format!("Steiglitz–McBride, {} iterations", found.evaluations),
            "grid" if found.input == Input::Current => {
                "initial estimate by least squares, grids over extension parameters".to_owned()
            }
            "grid" => {
                "initial estimates by Steiglitz–McBride or from one channel, grids over extension parameters".to_owned()
            }
            _ => of_search(found, requested),
        }
    }

    fn options(spec: &Self::Spec, found: &Identification<Self>) -> Vec<(&'static str, String)> {
        let bounds = found.space.free().iter().map(|a| format!("{}={}:{}", a.parameter.symbol(), a.min, a.max));
        let mut list = options(spec, found);
        let model = found.model;
        list.push(("discretization, initial", format!("{}, {}", model.discretization.name(), model.initial.name())));
        list.push(("bounds", bounds.collect::<Vec<_>>().join(", ")));
        list
    }
}

impl Told for OwnModel {
    fn after_fit(found: &Identification<Self>) -> Vec<Line> {
        let held_out = Some(&found.held_out_percent).filter(|fits| !fits.is_empty());
        let mut lines: Vec<Line> = held_out.map(|fits| ("held out", fit_text(found, fits))).into_iter().collect();
        lines.push(("steps", found.machine.method.described()));
        lines
    }

    fn method(found: &Identification<Self>, requested: &Requested) -> String {
        match found.searched.has_population {
            true => of_search(found, requested),
            false => format!("multistart, {} evaluations, seed {}", found.evaluations, requested.seed),
        }
    }

    fn options(spec: &Self::Spec, found: &Identification<Self>) -> Vec<(&'static str, String)> {
        let mut list = vec![("model", format!("{}, sha256 {}", found.model.name(), found.model.digest()))];
        list.extend(options(spec, found));
        list.push(("integration", found.machine.method.described()));
        list
    }
}

/// Width of the table of parameters \[characters\].
const PARAMETERS_WIDTH: usize = 84;
/// Longest description that stands in the table of parameters \[characters\].
const DESCRIPTION_MAX: usize = 24;

/// Writes the parameters and identified combinations of others, each with its standard error and confidence interval, or with its bounds
/// if it has no standard error.
pub(super) fn parameters<M: Shown>(text: &mut String, found: &Identification<M>) {
    // In a narrow terminal the uncertainty is below the value.
    let is_narrow = terminal::width(Stream::Stdout).is_some_and(|columns| columns < PARAMETERS_WIDTH);
    let (open, rows): (Vec<EstimateRow>, Vec<_>) = estimate_rows(found).into_iter().partition(EstimateRow::is_list);
    let estimates = || rows.iter().map(|row| &row.estimate);
    let longest = |lengths: &mut dyn Iterator<Item = usize>| lengths.max().unwrap_or(0);
    let chars = |text: &str| text.chars().count();
    let width = longest(&mut estimates().map(|e| chars(&e.name)));
    let described = |e: &ParameterEstimate| {
        let of = e.recording.map_or_else(String::new, |n| format!(" {}", n + 1));
        format!("{}{of}", e.description)
    };
    let description = longest(&mut estimates().map(|e| chars(&described(e))));
    // Long descriptions would push the values out of sight; the numbers of recordings remain.
    let is_described = description <= DESCRIPTION_MAX;
    let described = |e: &ParameterEstimate| match is_described {
        true => described(e),
        false => e.recording.map_or_else(String::new, |n| (n + 1).to_string()),
    };
    let description = longest(&mut estimates().map(|e| chars(&described(e)))).max(if is_described { 17 } else { 0 });
    let shown = |unit: &str| if unit == "1" { String::new() } else { unit.to_owned() };
    let units = longest(&mut estimates().map(|e| chars(&e.unit))).max(10);
    if found.uncertainty.is_some() && !is_narrow {
        let left = width + 2 + description + 12;
        let _ = writeln!(text, "  {DIM}{:<left$} {:<units$} {:>11}   95 % interval{DIM:#}", "", "", "std. error");
    }
    let uncertainty = |error: f64, [low, high]: [f64; 2]| match is_narrow {
        true => {
            let [low, high] = [low, high].map(|end| significant(end, 6));
            format!("\n     {DIM}± {} (std. error), {low} … {high}{DIM:#}", significant(error, 2))
        }
        false => format!("{:>11}   {} … {}", significant(error, 2), significant(low, 6), significant(high, 6)),
    };
    for EstimateRow { estimate: e, remark } in &rows {
        let remark = match (e.bounds, e.std_error.zip(e.ci95)) {
            (_, Some((error, ends))) => uncertainty(error, ends),
            (Some([min, max]), None) if e.value.is_some() => {
                let bound = e.at_bound.map_or(String::new(), |side| format!(" (at its {side})"));
                format!("{DIM}within {} … {}{bound}{DIM:#}", significant(min, 3), significant(max, 3))
            }
            _ => format!("{DIM}{remark}{DIM:#}"),
        };
        let value = e.value.map_or_else(|| "\u{2013}".to_owned(), |value| significant(value, 6));
        let (name, described, unit) = (&e.name, described(e), shown(&e.unit));
        let _ = writeln!(
            text,
            "  {STRONG}{name:<width$}{STRONG:#}  {described:<description$}{value:>12} {unit:<units$} {remark}"
        );
    }
    for row in open {
        let _ = writeln!(text, "  {STRONG}{}{STRONG:#}  {DIM}{}{DIM:#}", row.estimate.name, row.remark);
    }
}

/// Largest number of recordings whose fits are printed separately.
const RECORDINGS_MAX: usize = 12;

/// Returns the fit of each output as text.
fn fit_text<M>(found: &Identification<M>, fit: &[Option<f64>]) -> String {
    let one = |(output, value): (&motorfit::identify::Output, &Option<f64>)| {
        Some(format!("{} {} %", output.name, decimals((*value)?, 2)))
    };
    found.outputs.iter().zip(fit).filter_map(one).collect::<Vec<_>>().join(", ")
}

/// Returns the standard deviation of the residuals of each output as text.
fn residuals<M>(found: &Identification<M>, sigma: &[Option<f64>]) -> String {
    let one = |(output, sigma): (&motorfit::identify::Output, &Option<f64>)| {
        Some(format!("{} {} {}", output.name, significant((*sigma)?, 3), output.unit))
    };
    found.outputs.iter().zip(sigma).filter_map(one).collect::<Vec<_>>().join(", ")
}

/// Returns a line for each recording with its fit, or no lines for a single recording.
fn fits_by_recording<'a, M>(
    found: &Identification<M>,
    fits: impl ExactSizeIterator<Item = (&'a Record, &'a Vec<Option<f64>>)>,
) -> Vec<Line> {
    let count = fits.len();
    if count < 2 {
        return Vec::new();
    }
    let one = |(record, fit): (&Record, &Vec<Option<f64>>)| {
        ("", format!("{}: {}", inputs::name(record.source()), fit_text(found, fit)))
    };
    let more = count.saturating_sub(RECORDINGS_MAX);
    let rest = (more > 0).then(|| ("", format!("{more} more recordings, see --json")));
    fits.take(RECORDINGS_MAX).map(one).chain(rest).collect()
}

/// Returns the lines on the fit of held-out recordings of the DC motor.
fn held_out(found: &Identification) -> Vec<Line> {
    let Some(validation) = &found.validation else { return Vec::new() };
    let fit = fit_text(found, &validation.fit_percent);
    let count = validation.held_out.len();
    let of = if count == 1 { String::new() } else { format!(" over {count} recordings") };
    let started = match validation.held_out.iter().filter(|held| held.initial_is_estimated).count() {
        0 => "",
        _ if count == 1 => "; its initial state was estimated",
        _ => "; initial states were estimated where they begin in motion",
    };
    let own: Vec<&str> = validation.held_out.first().into_iter().flat_map(|h| &h.own).map(|o| o.0.symbol()).collect();
    let own = if own.is_empty() { String::new() } else { format!("; {} estimated from each", own.join(", ")) };
    let left = residuals(found, &validation.residual_sigma);
    let mut lines = vec![("held out", format!("{fit}; residual {left}{of}{started}{own}"))];
    lines.extend(fits_by_recording(found, validation.held_out.iter().map(|held| (&held.record, &held.fit_percent))));
    let tests: Vec<_> = validation.held_out.iter().map(|held| held.residual_tests.clone()).collect();
    let [white, independent] = verdicts(&tests, found.outputs.len()).map(|verdicts| verdicts.join(", "));
    let input = if found.input == Input::Current { Quantity::Current } else { Quantity::Voltage };
    let tested = format!("residuals (current, speed) white: {white}; independent of the {input}: {independent}");
    lines.push(("", tested));
    lines
}

/// Returns the lines below the parameters.
pub(super) fn lines<M: Told>(records: &[Record], requested: &Requested, found: &Identification<M>) -> Vec<Line> {
    let polish = if found.uncertainty.is_some() { ", then Levenberg–Marquardt" } else { "" };
    let (criterion, scale) = (requested.criterion.norm.name(), requested.criterion.scale.name());
    let mut lines = vec![("fit", fit_text(found, &found.fit_percent))];
    lines.extend(fits_by_recording(found, records.iter().zip(&found.fit_percent_by_recording)));
    lines.extend(M::after_fit(found));
    lines.extend(selection_text(found).map(|text| ("model", text)));
    if found.residual_sigma.iter().any(Option::is_some) {
        let residuals = residuals(found, &found.residual_sigma);
        lines.push(("residual", format!("{residuals} (standard deviation)")));
    }
    lines.extend([
        ("cost", format!("{} ({criterion}, scale {scale})", significant(found.cost, 4))),
        ("method", format!("{}{polish}", M::method(found, requested))),
        ("search", verdict(found)),
        ("device", found.device.to_string()),
        ("time", engineering(found.seconds, "s", 3)),
    ]);
    lines
}
