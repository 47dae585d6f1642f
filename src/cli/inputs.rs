//! Inputs that commands share: recordings, and the fields of a spec that flags set (criterion, model, space and device).

use super::args::{DeviceArgs, ProblemArgs};
use super::cache;
use super::output::Style;
use super::stdio::{is_stdio, stdin};
use motorfit::analysis::split;
use motorfit::criterion::Scale;
use motorfit::device::DeviceSpec;
use motorfit::identify::IdentifySpec;
use motorfit::record::{Reading, Record, Source};
use motorfit::setting::Setting;
use motorfit::settings::{self, Given};
use motorfit::text::{engineering, printable};
use motorfit::{Error, Result};
use std::path::PathBuf;

pub(super) fn records(paths: &[PathBuf], given: &Given) -> Result<Vec<Record>> {
    records_with(paths, &settings::reading(given)?)
}

/// Reads recordings; `-` is stdin.
pub(super) fn records_with(paths: &[PathBuf], reading: &Reading) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    if paths.iter().filter(|path| is_stdio(path)).count() > 1 {
        return Err(Error::usage("- is given twice, but stdin can be read once", "Give one recording as -."));
    }
    for path in paths {
        if is_stdio(path) {
            records.extend(reading.records_from_bytes(&stdin()?, None).map_err(|e| e.in_part("stdin"))?);
        } else {
            records.extend(reading.records(path)?);
        }
    }
    Ok(records)
}

/// Returns the parts of recordings that are fitted, the fraction `--split` of each; the rest is held out.
pub(super) fn fitted_part(
    records: Vec<Record>,
    fraction: Option<f64>,
    held_out: &mut Vec<Record>,
) -> Result<Vec<Record>> {
    match fraction {
        None => Ok(records),
        Some(fraction) if fraction > 0.0 && fraction < 1.0 => split(records, fraction, held_out),
        Some(fraction) => {
            let remedy = "Give a fraction between 0 and 1, as in --split 0.7.";
            Err(Error::usage(format!("--split is {fraction}"), remedy))
        }
    }
}

pub(super) fn name(source: &Source) -> String {
    let path = source.path.as_ref().map_or_else(|| "stdin".to_owned(), |path| path.display().to_string());
    source.part.as_ref().map_or(path.clone(), |part| format!("{path} ({part})"))
}

/// Returns a summary of recordings as they were read: a line for each, and notes on omitted or prepared data. A note that
/// applies to several recordings is printed once, after all of them.
pub(super) fn all_understood(records: &[Record]) -> String {
    let of_several = |note: &String| records.iter().filter(|record| record.source().notes.contains(note)).count() > 1;
    let mut lines = Vec::new();
    for record in records {
        lines.push(headline(record));
        let own = record.source().notes.iter().filter(|note| !of_several(note));
        lines.extend(own.map(|note| format!("  {}", printable(note))));
    }
    let mut shared: Vec<&String> = Vec::new();
    for note in records.iter().flat_map(|record| &record.source().notes).filter(|note| of_several(note)) {
        if !shared.contains(&note) {
            shared.push(note);
        }
    }
    for note in shared {
        let having: Vec<&Record> = records.iter().filter(|record| record.source().notes.contains(note)).collect();
        let of = match having.len() {
            2 if records.len() == 2 => "both".to_owned(),
            count if count == records.len() => format!("all {count}"),
            1..=3 => having.iter().map(|record| name(record.source())).collect::<Vec<_>>().join(", "),
            count => format!("{count} of {}", records.len()),
        };
        lines.push(printable(&format!("  {of}: {note}")));
    }
    lines.join("\n")
}

/// Returns a summary of a recording as it was read: file, samples, period, duration and columns with units on one line, then
/// notes on omitted or prepared data.
pub(super) fn understood(record: &Record) -> String {
    all_understood(std::slice::from_ref(record))
}

fn headline(record: &Record) -> String {
    let source = record.source();
    let columns: Vec<String> = source
        .columns
        .iter()
        .map(|c| {
            let conversion = if c.conversion.is_empty() { String::new() } else { format!(" {}", c.conversion) };
            let unit = format!("[{}{}]", c.unit, if c.unit_named { "" } else { " assumed" });
            // A heading that ends with its unit in brackets is not repeated.
            let is_shown = conversion.is_empty() && c.heading.ends_with(&unit);
            if is_shown { c.heading.clone() } else { format!("{}{conversion} {unit}", c.heading) }
        })
        .collect();
    let [period, duration] = [record.period_s(), record.duration_s()].map(|seconds| engineering(seconds, "s", 4));
    let (name, count, columns) = (name(source), record.len(), columns.join(", "));
    printable(&format!("{name}: {count} samples every {period}, {duration}; {columns}"))
}

/// Returns a spec with the problem and the device of the flags.
pub(super) fn spec(problem: &ProblemArgs, device: &DeviceArgs, style: &Style) -> Result<IdentifySpec> {
    let spec = checked(settings::problem(&problem.0.and(&device.0))?, &problem.0, style)?;
    Ok(measured(spec, style))
}

/// Returns a spec, with the stored throughput profile of this machine if its method is a search, or a usage error if a given
/// flag has no effect.
pub(super) fn checked(spec: IdentifySpec, given: &Given, style: &Style) -> Result<IdentifySpec> {
    if given.has(Setting::Noise) && spec.criterion.scale != Scale::Noise {
        let message = "--noise has no effect without --scale noise";
        return Err(Error::usage(message, "Add --scale noise or leave --noise out."));
    }
    if given.has(Setting::TimeOrigin) && !spec.criterion.norm.is_time_weighted() {
        let message = "--time-origin has no effect without --criterion itse or itae";
        return Err(Error::usage(message, "Choose one of them or leave --time-origin out."));
    }
    // Other methods search only if their estimates fail. Limits on the work then select the device, without a measurement.
    Ok(if spec.method.is_search() { measured(spec, style) } else { spec })
}

pub(super) fn device(args: &DeviceArgs, style: &Style) -> Result<IdentifySpec> {
    Ok(measured(settings::device(&args.0)?, style))
}

fn measured(spec: IdentifySpec, style: &Style) -> IdentifySpec {
    IdentifySpec {
        throughput_profile: if spec.device == DeviceSpec::Auto { cache::throughput_profile(style) } else { None },
        ..spec
    }
}
