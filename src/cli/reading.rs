//! Recordings as every command reads them: files, what columns hold, preparation.

use motorfit::Result;
use motorfit::record::{Record, Source};
use motorfit::settings::{self, Given};
use motorfit::text::{engineering, printable};
use std::path::PathBuf;

/// Reads and prepares all recordings.
pub(super) fn records(paths: &[PathBuf], given: &Given) -> Result<Vec<Record>> {
    let reading = settings::reading(given)?;
    let mut records = Vec::new();
    for path in paths {
        records.extend(reading.records(path)?);
    }
    Ok(records)
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
