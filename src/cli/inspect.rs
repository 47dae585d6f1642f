//! The command `inspect`: the contents of recordings, how columns were interpreted, and findings.

use super::args::InspectArgs;
use super::failure;
use super::prelude::*;
use super::signal_table::signal_table;
use motorfit::identify::{Identifiability, Inspection};
use motorfit::record::{ChannelFacts, channels};
use motorfit::report::{SignalFacts, Table, command_line, inspect_document, inspect_page};
use motorfit::setting::Text;
use serde_json::{Value, json as value};
use std::path::PathBuf;

pub(super) fn run(args: &InspectArgs, style: &Style) -> Result<Outcome> {
    if let Some(model) = &args.model.model {
        return super::model::inspect::run(args, model, style);
    }
    let band = band(args.band.settling_band)?;
    let catalogs = catalogs(&args.recordings.records)?;
    if !args.json {
        for (path, channels) in &catalogs {
            show(&catalog(path, channels, style.verbose))?;
        }
    }
    let logs: Value = catalogs
        .iter()
        .map(|(path, channels)| value!({"path": path.to_string_lossy(), "channels": channels}))
        .collect();
    let records = inputs::records(&args.recordings.records, &args.recordings.reading.0).or_else(|error| {
        // The channels are what a program needs to name the columns.
        if args.json && !catalogs.is_empty() {
            data(&failure::document(&error, &[("logs", logs.clone())]))?;
        }
        Err(error)
    })?;
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let inspections: Vec<Inspection<'_>> = records.iter().map(Inspection::of).collect();
    let mut document = inspect_document(&inspections, band);
    if !catalogs.is_empty() {
        document["logs"] = logs;
    }
    let document = json(&document);
    if args.json {
        data(&document)?;
    }
    for inspection in inspections.iter().filter(|_| !args.json) {
        show(&text(inspection, band))?;
        style.findings(&inspection.warnings);
    }
    if let Some(out) = out {
        let how = out::reproduced(vec![("settling band", format!("{} %", args.band.settling_band))]);
        let page = inspect_page(&inspections, band, &how).html(!args.page.no_script);
        out.write(&[("report.html".to_owned(), page), ("result.json".to_owned(), document)], style)?;
    }
    Ok(Outcome::Done)
}

/// Returns the channels of the recordings that are logs.
fn catalogs(paths: &[PathBuf]) -> Result<Vec<(&PathBuf, Vec<ChannelFacts>)>> {
    let files = paths.iter().filter(|path| !stdio::is_stdio(path) && path.is_file());
    files.filter_map(|path| channels(path).map(|found| Some((path, found?))).transpose()).collect()
}

/// Largest number of channels that are listed without `--verbose`.
const CHANNELS_MAX: usize = 40;

/// Returns the table of the channels of a log, those whose quantity is understood first.
fn catalog(path: &Path, channels: &[ChannelFacts], is_complete: bool) -> String {
    let title = format!("Channels of {}", path.display());
    let mut table = Table::new("channels", title, &["channel", "unit", "read as", "samples", "rate [Hz]", "times [s]"]);
    let mut order: Vec<&ChannelFacts> = channels.iter().collect();
    order.sort_by_key(|of| of.quantity.is_none());
    let most = if is_complete { usize::MAX } else { CHANNELS_MAX };
    for of in order.iter().take(most) {
        let times = of.span_s.filter(|_| of.samples > 0).map(|span| span.map(|time| significant(time, 5)).join(" … "));
        table.row(vec![
            of.name.clone(),
            of.unit.clone().unwrap_or_default(),
            of.quantity.unwrap_or_default().to_owned(),
            of.samples.to_string(),
            of.rate_hz.map_or_else(String::new, |rate| significant(rate, 4)),
            times.unwrap_or_default(),
        ]);
    }
    if channels.len() > most {
        table.note(format!("{} more channels; --verbose lists all.", channels.len() - most));
    }
    table.text(terminal::table_width(WIDTH)) + "\n"
}

/// Width of the table of channels \[characters\].
const WIDTH: usize = 110;

/// Returns the settling band as a fraction of the steady state.
pub(super) fn band(percent: f64) -> Result<f64> {
    if percent > 0.0 && percent < 100.0 {
        return Ok(percent / 100.0);
    }
    Err(Error::usage(format!("--settling-band is {percent}"), "Give percent between 0 and 100, usually 2 or 5."))
}

fn text(inspection: &Inspection<'_>, band: f64) -> String {
    let record = inspection.record;
    let mut text = format!("{}\n", inputs::understood(record));
    if record.steps().jitter > 1e-6 {
        let jitter = significant(100.0 * record.steps().jitter, 2);
        let _ = writeln!(text, "  jitter of the sampling period: at most {jitter} %");
    }
    if !record.source().ignored.is_empty() {
        let _ = writeln!(text, "  not used: {}", printable(&record.source().ignored.join(", ")));
    }
    let facts = SignalFacts::of(record, band);
    let row = |f: &SignalFacts| (f.quantity.to_string(), f.quantity.unit().to_owned(), f.statistics);
    text.push_str(&signal_table(facts.iter().map(row)));
    for facts in &facts {
        let Some(response) = facts.response else { continue };
        let unit = facts.quantity.unit();
        let settled = match response.settling_time_s {
            Some(time) => format!("settled from {} s on", significant(time, 5)),
            None if facts.settling_hidden => "settling time hidden by noise".to_owned(),
            None => "not settled".to_owned(),
        };
        let overshoot = response
            .overshoot_percent
            .filter(|p| *p < 1000.0)
            .map_or_else(String::new, |p| format!(" ({p:.1} % overshoot)"));
        let [peak, at, steady] =
            [response.peak, response.peak_time_s, response.steady_state].map(|value| significant(value, 5));
        let band = significant(100.0 * band, 3);
        let band = band.trim_end_matches('0').trim_end_matches('.');
        let _ = write!(text, "  {STRONG}{}{STRONG:#}: peak {peak} {unit} at {at} s{overshoot}, ", facts.quantity);
        let _ = writeln!(text, "steady state {steady} {unit}, {settled} (within {band} %)");
    }
    text.push_str(&identifiability(&inspection.identifiability));
    text
}

fn identifiability(identifiability: &Identifiability) -> String {
    match identifiability {
        Identifiability::Identifies { .. } => {
            let errors = identifiability.errors().unwrap_or_default();
            format!("  {STRONG}identifies{STRONG:#}: {errors} (standard errors)\n")
        }
        Identifiability::Lacks { message, remedy } => {
            let spelled = |text: &Text| printable(&text.spelled(command_line));
            format!("  {STRONG}does not identify all five{STRONG:#}: {}. {}\n", spelled(message), spelled(remedy))
        }
    }
}
