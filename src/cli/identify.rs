//! The command `identify`: parameters of one motor from one or more recordings.

use super::args::IdentifyArgs;
use super::prelude::*;
use super::terminal::Stream;
use super::{export, next, output, plot};
use motorfit::analysis::suspicions;
use motorfit::estimate::ReferenceKind;
use motorfit::identify::{Identification, IdentifySpec, Polish, Status, TrustLevel, hold_out, identify_with};
use motorfit::motor::{Input, Scope};
use motorfit::optimize::Stop;
use motorfit::record::{Quantity, Record};
use motorfit::report::figures;
use motorfit::report::{
    characteristics_lines, curves_csv, exported_motor, identify_document, identify_page, noise_floor_text,
    selection_table, selection_text, verdicts,
};

pub(super) fn run(args: &IdentifyArgs, style: &Style) -> Result<Outcome> {
    if let Some(model) = &args.model.model {
        return super::model::identify::run(args, model, style);
    }
    if !args.start.is_empty() {
        let hint = "Leave it out: the DC motor's estimates do not depend on a start.";
        return Err(Error::usage("--start is for own models", hint));
    }
    let given = args.search.0.and(&args.problem.0).and(&args.device.0);
    let spec = inputs::checked(settings::identify(&given)?, &given, style)?;
    let reading = args.recordings.reading.0.and(&args.problem.0);
    let records = inputs::records(&args.recordings.records, &reading)?;
    let mut held_out = inputs::records(&args.validate, &reading)?;
    let spec = settings::with_intersample_of(spec, &given, &records);
    let records = inputs::fitted_part(records, args.split, &mut held_out)?;
    export::check(args)?;
    out::check_drawings(args.svg.as_deref(), args.json || records.len() > 1)?;
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let mut observe = progress::reporter(style, "generation");
    let found = identify_with(&records, &spec, &mut |progress| {
        observe(progress);
        signals::searching(progress.generation < progress.generations);
        signals::interrupted()
    });
    drop(observe);
    let mut found = found.inspect_err(|_| style.warnings(&suspicions(&records, spec.model.discretization)))?;
    hold_out(&mut found, &records, &held_out, &spec)?;
    style.warnings(&found.warnings);
    if found.stop == Stop::Interrupted {
        style.note("interrupted: the result is the best so far");
    }
    let next = found.trust.next.as_ref().map(|step| next::command(step, &args.recordings.records));
    let document = || {
        let mut document = identify_document(&records, &spec, &found);
        document["trust"]["next"] = next.clone().into();
        json(&document)
    };
    if args.json {
        data(&document())?;
    } else if !args.svg.as_deref().is_some_and(stdio::is_stdio) && !export::is_printed(args) {
        show(
            &(output::trust_line(&found.trust, WITHOUT_REASONS, next.as_deref())
                + &table(&records, &spec, &found, style)),
        )?;
        if args.plot {
            data(&plots(&records, &found)?)?;
        }
    }
    let exported = export::file(args, || exported_motor(&records, &found))?;
    export::print(args, exported.as_ref(), &found.trust, style)?;
    if let Some(path) = &args.svg {
        draw(path, &records, &found, style)?;
    }
    if let Some(out) = out {
        let mut files = report(&records, &spec, &found, document(), !args.page.no_script);
        files.extend(exported);
        out.write(&files, style)?;
    }
    Ok(match found.trust.level {
        _ if found.stop == Stop::Interrupted => Outcome::Interrupted,
        TrustLevel::Check | TrustLevel::Poor if args.strict => Outcome::Untrusted,
        _ => Outcome::Done,
    })
}

fn report(
    records: &[Record],
    spec: &IdentifySpec,
    found: &Identification,
    document: String,
    has_script: bool,
) -> Vec<(String, String)> {
    let bounds = found.space.free().iter().map(|a| format!("{}={}:{}", a.parameter.symbol(), a.min, a.max));
    let how = out::reproduced(vec![
        ("method", format!("{} (found by {})", spec.method.name(), found.searched.method)),
        ("polish", spec.polish.name().to_owned()),
        ("population, generations", format!("{}, {}", spec.population, spec.generations)),
        ("seed", spec.seed.to_string()),
        ("criterion, scale", format!("{}, {}", spec.criterion.norm.name(), spec.criterion.scale.name())),
        ("discretization, initial", format!("{}, {}", found.model.discretization.name(), found.model.initial.name())),
        ("bounds", bounds.collect::<Vec<_>>().join(", ")),
        ("evaluations", format!("{}, {}", found.evaluations, found.stop.name())),
        ("time", engineering(found.seconds, "s", 3)),
    ]);
    vec![
        ("report.html".to_owned(), identify_page(records, spec, found, &how).html(has_script)),
        ("curves.csv".to_owned(), curves_csv(records, found)),
        ("result.json".to_owned(), document),
    ]
}

/// Draws measured and modelled signals, one file for each recording.
fn draw(path: &Path, records: &[Record], found: &Identification, style: &Style) -> Result<()> {
    let drawing = |(record, signals): (&Record, &[Vec<f64>; 2])| {
        figures::responses("response", record, "model", signals).file("", false)
    };
    let drawings: Vec<String> = records.iter().zip(&found.modelled(records)?).map(drawing).collect();
    out::drawings(path, &drawings, style)
}

/// Returns plots of the measured channels of all recordings for the terminal.
fn plots(records: &[Record], found: &Identification) -> Result<String> {
    let mut text = String::new();
    for (record, models) in records.iter().zip(&found.modelled(records)?) {
        let channels = [("current", "A"), ("speed", "rad/s")].into_iter().zip(record.measured()).zip(models);
        for (((name, unit), measured), model) in channels {
            let Some(measured) = measured else { continue };
            let time_s = &record.samples().time_s;
            let signal = plot::Signal { name, unit, time_s, measured, model };
            let drawn = plot::drawn(&signal, terminal::table_width(WIDTH));
            if records.len() > 1 && !drawn.is_empty() {
                let _ = write!(text, "\n{}", inputs::name(record.source()));
            }
            let _ = write!(text, "\n{drawn}");
        }
    }
    Ok(text)
}

/// Text in place of reasons for a level of trust.
pub(super) const WITHOUT_REASONS: &str =
    "no test of the residuals, the search or the recordings contradicts the standard errors";
/// Width of printed tables \[characters\].
const WIDTH: usize = 100;

fn table(records: &[Record], spec: &IdentifySpec, found: &Identification, style: &Style) -> String {
    let mut text = String::new();
    if !style.quiet {
        let _ = writeln!(text, "{}\n", inputs::all_understood(records));
    }
    parameters(&mut text, found);
    text.push('\n');
    for (name, value) in lines(records, spec, found) {
        let _ = writeln!(text, "  {name:<10}{value}");
    }
    if !style.quiet && found.uncertainty.is_none() {
        let _ =
            writeln!(text, "\n  {DIM}Without a polish there are no standard errors: leave out --polish none.{DIM:#}");
    }
    if let (true, Some(selection)) = (style.verbose, &found.selection) {
        let _ = write!(text, "\n{}", selection_table(selection).text(terminal::table_width(WIDTH)));
    }
    if style.verbose && !found.history.is_empty() {
        let _ = writeln!(text, "\n  generation  lowest cost");
        for (n, cost) in found.history.iter().enumerate() {
            let _ = writeln!(text, "  {:>10}  {}", n + 1, significant(*cost, 6));
        }
    }
    text
}

/// Width of the table of parameters \[characters\].
const PARAMETERS_WIDTH: usize = 84;

/// Writes the parameters, each with its standard error and confidence interval, or with its bounds if it has no standard error.
fn parameters(text: &mut String, found: &Identification) {
    let uncertainty = found.uncertainty.as_ref();
    // In a narrow terminal the uncertainty is below the value.
    let is_narrow = terminal::width(Stream::Stdout).is_some_and(|columns| columns < PARAMETERS_WIDTH);
    if uncertainty.is_some() && !is_narrow {
        let _ = writeln!(text, "  {DIM}{:<20}{:>12} {:<10} {:>11}   95 % interval{DIM:#}", "", "", "", "std. error");
    }
    let estimates = found.estimates();
    let width = estimates.iter().map(|e| e.parameter.symbol().len()).max().unwrap_or(1);
    for e in estimates {
        let remark = match (e.axis, e.std_error.zip(e.ci95)) {
            _ if e.value.is_none() => format!("{DIM}not identifiable{DIM:#}"),
            (None, _) => format!("{DIM}fixed{DIM:#}"),
            (Some(_), Some((error, [low, high]))) if is_narrow => {
                let [low, high] = [low, high].map(|end| significant(end, 6));
                format!("\n     {DIM}± {} (std. error), {low} … {high}{DIM:#}", significant(error, 2))
            }
            (Some(_), Some((error, [low, high]))) => {
                format!("{:>11}   {} … {}", significant(error, 2), significant(low, 6), significant(high, 6))
            }
            (Some(axis), None) => {
                let bound = e.at_bound.map_or(String::new(), |side| format!(" (at its {side})"));
                format!("{DIM}within {} … {}{bound}{DIM:#}", significant(axis.min, 3), significant(axis.max, 3))
            }
        };
        let of = if let Scope::Recording(n) = e.scope { format!(" {}", n + 1) } else { String::new() };
        let unit = if e.parameter.unit() == "1" { "" } else { e.parameter.unit() };
        let _ = writeln!(
            text,
            "  {STRONG}{:<width$}{STRONG:#}  {:<17}{:>12} {unit:<10} {remark}",
            e.parameter.symbol(),
            format!("{}{of}", e.parameter.name()),
            e.value.map_or_else(|| "\u{2013}".to_owned(), |value| significant(value, 6)),
        );
    }
}

/// Largest number of recordings whose fits are printed separately.
const RECORDINGS_MAX: usize = 12;

/// Returns the fit of each channel as text.
fn fit_text(fit: [Option<f64>; 2]) -> String {
    let named = ["current", "speed"].into_iter().zip(fit);
    named.filter_map(|(name, value)| Some(format!("{name} {:.2} %", value?))).collect::<Vec<_>>().join(", ")
}

/// Returns a line for each recording with its fit, or no lines for a single recording.
fn fits_by_recording<'a>(
    fits: impl ExactSizeIterator<Item = (&'a Record, [Option<f64>; 2])>,
) -> Vec<(&'static str, String)> {
    let count = fits.len();
    if count < 2 {
        return Vec::new();
    }
    let one = |(record, fit): (&Record, _)| ("", format!("{}: {}", inputs::name(record.source()), fit_text(fit)));
    let more = count.saturating_sub(RECORDINGS_MAX);
    let rest = (more > 0).then(|| ("", format!("{more} more recordings, see --json")));
    fits.take(RECORDINGS_MAX).map(one).chain(rest).collect()
}

fn lines(records: &[Record], spec: &IdentifySpec, found: &Identification) -> Vec<(&'static str, String)> {
    let method = match found.searched.method {
        "sm" => format!("Steiglitz–McBride, {} iterations", found.evaluations),
        "grid" if found.input == Input::Current => {
            "initial estimate by least squares, grids over extension parameters".to_owned()
        }
        "grid" => {
            "initial estimates by Steiglitz–McBride or from one channel, grids over extension parameters".to_owned()
        }
        search => format!(
            "{search}, {} agents × {} generations, {} evaluations, seed {}",
            spec.population, spec.generations, found.evaluations, spec.seed
        ),
    };
    let polish = match spec.polish {
        Polish::LevenbergMarquardt => ", then Levenberg–Marquardt",
        Polish::None => "",
    };
    let (criterion, scale) = (spec.criterion.norm.name(), spec.criterion.scale.name());
    let mut lines = vec![("fit", fit_text(found.fit_percent))];
    lines.extend(fits_by_recording(records.iter().zip(found.fit_percent_by_recording.iter().copied())));
    if let Some(validation) = &found.validation {
        let fit = fit_text(validation.fit_percent);
        let count = validation.held_out.len();
        let of = if count == 1 { String::new() } else { format!(" over {count} recordings") };
        let started = match validation.held_out.iter().filter(|held| held.initial_is_estimated).count() {
            0 => "",
            _ if count == 1 => "; its initial state was estimated",
            _ => "; initial states were estimated where they begin in motion",
        };
        let own: Vec<&str> =
            validation.held_out.first().into_iter().flat_map(|h| &h.own).map(|o| o.0.symbol()).collect();
        let own = if own.is_empty() { String::new() } else { format!("; {} estimated from each", own.join(", ")) };
        let left = residuals(validation.residual_sigma);
        lines.push(("held out", format!("{fit}; residual {left}{of}{started}{own}")));
        lines.extend(fits_by_recording(validation.held_out.iter().map(|held| (&held.record, held.fit_percent))));
        let tests: Vec<_> = validation.held_out.iter().map(|held| held.residual_tests).collect();
        let [white, independent] = verdicts(&tests);
        let input = if found.input == Input::Current { Quantity::Current } else { Quantity::Voltage };
        let tested = format!("residuals (current, speed) white: {white}; independent of the {input}: {independent}");
        lines.push(("", tested));
    }
    lines.extend(found.noise_floor.iter().map(|of| ("best fit", noise_floor_text(of))));
    lines.extend(selection_text(found).map(|text| ("model", text)));
    lines.extend(characteristics_lines(found));
    if found.residual_sigma != [None; 2] {
        lines.push(("residual", format!("{} (standard deviation)", residuals(found.residual_sigma))));
    }
    lines.extend([
        ("cost", format!("{} ({}, scale {})", significant(found.cost, 4), criterion, scale)),
        ("method", format!("{method}{polish}")),
        ("search", verdict(found)),
        ("device", found.device.to_string()),
        ("time", engineering(found.seconds, "s", 3)),
    ]);
    lines
}

fn residuals([current, speed]: [Option<f64>; 2]) -> String {
    let parts = [
        current.map(|s| format!("current {} A", significant(s, 3))),
        speed.map(|s| format!("speed {} rad/s", significant(s, 3))),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn verdict(found: &Identification) -> String {
    let check = &found.verification;
    let reference = match check.reference {
        Some(ReferenceKind::VariableProjection) => "a global search (variable projection)",
        Some(_) => "refinements from starts spread over the bounds",
        None => "no reference",
    };
    let gap = check.cost_gap.map_or(String::new(), |gap| format!(" {} %", significant(100.0 * gap, 2)));
    let reached = match check.reference {
        Some(ReferenceKind::MultiStart) => format!(" ({} of {} starts)", check.arrivals, check.starts),
        _ => String::new(),
    };
    match check.status {
        Status::Agrees if check.cost_gap.is_some_and(|gap| gap > 1e-6) => {
            format!("agrees with {reference}: the same optimum, with a weighted sum of squares{gap} above the lowest")
        }
        Status::Agrees => format!("agrees with {reference}{reached}"),
        Status::SearchStuck if check.refined_agrees && found.uncertainty.is_some() => format!(
            "search stuck at a weighted sum of squares{gap} above the lowest; the refinement agrees with {reference}"
        ),
        Status::SearchStuck => {
            format!("search stuck at a weighted sum of squares{gap} above that of a better optimum, from {reference}")
        }
        Status::ReferenceFailed if check.cost_gap.is_some_and(|gap| gap < -1e-6) => {
            format!("reference failed: {reference} ended in a worse optimum")
        }
        Status::ReferenceFailed => format!("inconclusive: {reference} did not agree on one optimum{reached}"),
        Status::NotApplicable => "not verified: no reference is available for this fit".to_owned(),
    }
}
