//! Recordings as every command reads them: files, what columns hold, preparation.

use super::args::Reading;
use motorfit::Result;
use motorfit::motor::Discretization;
use motorfit::record::{
    self, Offset, Preparation, ReadOptions, Record, Source, parse_columns, parse_crop, parse_masks, parse_offset,
};
use motorfit::text::{engineering, printable};
use std::path::PathBuf;

/// Reads and prepares all recordings; an input between samples goes on as `discretization` has it, where that is given.
pub(super) fn records(
    paths: &[PathBuf],
    args: &Reading,
    discretization: Option<Discretization>,
) -> Result<Vec<Record>> {
    let reading = record::Reading { options: options(args)?, preparation: preparation(args, discretization)? };
    let mut records = Vec::new();
    for path in paths {
        records.extend(reading.records(path)?);
    }
    Ok(records)
}

fn options(args: &Reading) -> Result<ReadOptions> {
    Ok(ReadOptions {
        columns: parse_columns(args.columns.columns.as_deref().unwrap_or_default())?,
        rate_hz: args.rate,
        sheet: args.sheet.clone(),
        gaps: args.gaps,
        drop_repeats: args.drop_repeats,
    })
}

fn preparation(args: &Reading, discretization: Option<Discretization>) -> Result<Preparation> {
    Ok(Preparation {
        crop: args.crop.as_deref().map(parse_crop).transpose()?.unwrap_or_default(),
        offset: args.offset.as_deref().map_or(Ok(Offset::None), parse_offset)?,
        mask: parse_masks(&args.mask)?,
        rate_hz: args.rate,
        decimate: args.decimate,
        filter: args.filter.as_deref().map(str::parse).transpose()?,
        sampled_input: discretization.map(Discretization::uses_next_input),
    })
}

/// The file of a recording, and which part of it.
pub(super) fn name(source: &Source) -> String {
    let path = source.path.as_ref().map_or_else(String::new, |path| path.display().to_string());
    source.part.as_ref().map_or(path.clone(), |part| format!("{path} ({part})"))
}

/// One line: file, samples, period, duration, columns with units; others for what was left out or prepared.
pub(super) fn understood(record: &Record) -> String {
    let source = record.source();
    let time = &record.samples().time_s;
    let columns: Vec<String> = source
        .columns
        .iter()
        .map(|c| {
            let conversion = if c.conversion.is_empty() { String::new() } else { format!(" {}", c.conversion) };
            format!("{}{conversion} [{}{}]", c.heading, c.unit, if c.unit_named { "" } else { " assumed" })
        })
        .collect();
    let mut text = printable(&format!(
        "{}: {} samples every {}, {}; {}",
        name(source),
        record.len(),
        engineering(record.period_s(), "s", 4),
        engineering(time[time.len() - 1] - time[0], "s", 4),
        columns.join(", ")
    ));
    for note in &source.notes {
        text.push_str(&format!("\n  {}", printable(note)));
    }
    text
}
