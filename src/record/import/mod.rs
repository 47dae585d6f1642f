//! Files as recordings: formats, headings, units, and what loggers do to them.
//!
//! A file becomes lines of cells ([`text`], or those of another format), the lines a table with a heading
//! ([`layout`], [`columns`], [`formula`]), its rows signals ([`collect`], [`signals`]).

mod collect;
mod columns;
mod decimal;
mod formats;
mod formula;
mod layout;
mod parse;
mod quick;
mod signals;
mod text;
mod write;

pub use parse::parse_number;
pub use write::write_csv;

use super::heading::ColumnRequest;
use super::{Gaps, Record, Samples, Source, time};
use crate::setting::text;
use crate::{Error, Result};
use collect::{Collected, collect};
use columns::Need;
use formats::{CellLines, HEAD};
pub use formats::{FORMATS, Format};
use layout::Wish;
use signals::Signals;
use std::io::Read;
use std::path::{Path, PathBuf};
use text::{TextLines, unreadable};

/// How files are read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// What columns hold, where their headings do not say so.
    pub columns: Vec<ColumnRequest>,
    /// Samples per second \[Hz\] of files without a time column.
    pub rate_hz: Option<f64>,
    /// The sheet of a workbook; the first with numbers otherwise.
    pub sheet: Option<String>,
    /// What becomes of gaps in time.
    pub gaps: Gaps,
    /// Whether rows whose time repeats that of the row before are left out.
    pub drop_repeats: bool,
}

/// A table of a file, named where a file holds several.
struct Table {
    part: Option<String>,
    collected: Collected,
}

/// Reads the recordings of a file: one, or one for each test that it holds or stretch between gaps.
///
/// # Errors
/// `Data` with file, line and column when the file cannot be read, understood or trusted.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Vec<Record>> {
    let (tables, sha256) = tables(path, options, Need::Recording)?;
    of_tables(tables, &sha256, Some(path), options)
}

/// The recordings of the tables of a file.
fn of_tables(tables: Vec<Table>, sha256: &str, path: Option<&Path>, options: &ReadOptions) -> Result<Vec<Record>> {
    let located = |error: Error| path.iter().fold(error, |error, path| error.in_file(path));
    let mut records = Vec::new();
    for Table { part, collected } in tables {
        let (path, sha256) = (path.map(Path::to_path_buf), Some(sha256.to_owned()));
        let source = Source { path, sha256, part, ..Source::default() };
        records.extend(finish(collected, source, options).map_err(located)?);
    }
    Ok(records)
}

/// Reads several files as one recording: one after the other in time where they hold the same quantities, side by side
/// where they hold different ones at the same times.
///
/// # Errors
/// As [`read`], and when files hold several recordings or do not belong together.
pub fn read_joined(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<Record>> {
    let mut joined: Option<Signals> = None;
    let mut source = Source::default();
    let mut digests = String::new();
    for path in paths {
        let (mut tables, sha256) = tables(path, options, Need::Part)?;
        let (Some(Table { mut collected, .. }), true) = (tables.pop(), tables.is_empty()) else {
            let message = "holds several recordings, so it cannot be part of one";
            return Err(Error::data(message, "Give it alone.").in_file(path));
        };
        digests.push_str(&sha256);
        let part = Signals::new(&mut collected, options.rate_hz);
        let have = |column: &super::Column| source.columns.iter().any(|c| c.quantity == column.quantity);
        let new: Vec<_> = collected.columns.into_iter().filter(|column| !have(column)).collect();
        source.columns.extend(new);
        source.ignored.extend(collected.ignored);
        source.last_line_open |= collected.last_line_open;
        joined = Some(match joined.take() {
            None => Signals { lines: super::Lines::default(), ..part },
            Some(before) => before.joined(part).map_err(|e| e.in_file(path))?,
        });
    }
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    source.path = Some(PathBuf::from(names.join("+")));
    source.sha256 = Some(text::digest(digests.as_bytes()));
    let Some(signals) = joined else { return Ok(Vec::new()) };
    records(signals, source, options)
}

/// Reads a recording from a CSV file.
///
/// # Errors
/// As [`read`].
pub fn read_csv(path: &Path, columns: &[ColumnRequest]) -> Result<Record> {
    let options = ReadOptions { columns: columns.to_vec(), ..ReadOptions::default() };
    read(path, &options)?.pop().ok_or_else(|| Error::data("holds no recording", "Check the file.").in_file(path))
}

/// Reads a recording from the bytes of a CSV file; `path` names it in errors.
///
/// # Errors
/// `Data` with line and column when the text cannot be understood or trusted.
pub fn read_csv_bytes(bytes: &[u8], path: Option<&Path>, columns: &[ColumnRequest]) -> Result<Record> {
    let options = ReadOptions { columns: columns.to_vec(), ..ReadOptions::default() };
    let located = |error: Error| path.iter().fold(error, |error, path| error.in_file(path));
    read_bytes(bytes, path, &options)?
        .pop()
        .ok_or_else(|| located(Error::data("holds no recording", "Check the file.")))
}

/// Like [`read`], from the bytes of a file of any format; `path` names it in errors.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(bytes: &[u8], path: Option<&Path>, options: &ReadOptions) -> Result<Vec<Record>> {
    let located = |error: Error| path.iter().fold(error, |error, path| error.in_file(path));
    let (tables, sha256) = tables_of(bytes, options, Need::Recording).map_err(located)?;
    of_tables(tables, &sha256, path, options)
}

/// Reads time, voltage and load torque alone: what drives a simulation.
///
/// # Errors
/// As [`read`], but neither current nor speed is needed.
pub fn read_inputs(path: &Path, columns: &[ColumnRequest]) -> Result<Samples> {
    let read = || {
        let options = ReadOptions { columns: columns.to_vec(), ..ReadOptions::default() };
        let (mut tables, _) = tables(path, &options, Need::Inputs)?;
        let (Some(Table { mut collected, .. }), true) = (tables.pop(), tables.is_empty()) else {
            return Err(Error::data("holds several recordings, expected one", "Give a CSV file."));
        };
        let columns = collected.columns.clone();
        let (samples, lines, notes) = Signals::new(&mut collected, None).samples()?;
        let source = Source { columns, lines, notes, ..Source::default() };
        // A recording needs an output; what is checked here are time and inputs.
        let checked = Samples { current: Some(vec![0.0; samples.time_s.len()]), ..samples };
        Ok(Record::from_file(checked, source, false)?.samples().clone())
    };
    read().map_err(|error: Error| error.in_file(path))
}

/// The recordings of a table.
fn finish(mut collected: Collected, source: Source, options: &ReadOptions) -> Result<Vec<Record>> {
    let part = source.part.clone();
    let named = |error: Error| part.iter().fold(error, |error, part| error.in_part(part));
    let source = Source {
        columns: collected.columns.clone(),
        ignored: std::mem::take(&mut collected.ignored),
        last_line_open: collected.last_line_open,
        ..source
    };
    records(Signals::new(&mut collected, options.rate_hz), source, options).map_err(named)
}

/// Samples that a stretch between gaps has at least.
const STRETCH_MIN: usize = 10;

/// The recordings that signals are: several where they are split at gaps.
fn records(mut signals: Signals, source: Source, options: &ReadOptions) -> Result<Vec<Record>> {
    if options.drop_repeats {
        signals.drop_repeats();
    }
    let (samples, lines, notes) = signals.samples()?;
    let source = Source { lines, notes, ..source };
    if options.gaps != Gaps::Split {
        return Ok(vec![Record::from_file(samples, source, options.gaps == Gaps::Keep)?]);
    }
    let gaps = time::gaps(&samples.time_s);
    let edges: Vec<usize> = std::iter::once(0).chain(gaps).chain([samples.time_s.len()]).collect();
    let all = edges.windows(2).map(|edge| edge[0]..edge[1]);
    let (long, short): (Vec<_>, Vec<_>) = all.partition(|stretch| stretch.len() >= STRETCH_MIN || edges.len() == 2);
    let many = long.len() > 1;
    let note = format!("{} stretches of fewer than {STRETCH_MIN} samples left out", short.len());
    let source =
        Source { notes: source.notes.into_iter().chain((!short.is_empty()).then_some(note)).collect(), ..source };
    if long.is_empty() {
        let message = format!("no stretch between gaps has {STRETCH_MIN} samples");
        return Err(Error::data(message, text!("Use " [Gaps = "keep"] ", or record without gaps.")));
    }
    let pieces = long.into_iter().enumerate();
    pieces
        .map(|(n, range)| {
            let part = source.part.clone().into_iter().chain(many.then(|| format!("stretch {}", n + 1)));
            let part: Vec<String> = part.collect();
            let source = Source {
                lines: source.lines.of(range.clone()),
                part: (!part.is_empty()).then(|| part.join(", ")),
                ..source.clone()
            };
            Record::from_file(samples.slice(range), source, false)
        })
        .collect()
}

/// The tables of a file, and the digest of its bytes.
fn tables(path: &Path, options: &ReadOptions, need: Need) -> Result<(Vec<Table>, String)> {
    let read = || {
        let file = std::fs::File::open(path).map_err(|e| unreadable(&e))?;
        if file.metadata().map_err(|e| unreadable(&e))?.is_dir() {
            return Err(Error::data("is a folder, expected a file", "Name the recording inside it."));
        }
        tables_of(file, options, need)
    };
    read().map_err(|error: Error| error.in_file(path))
}

fn tables_of(mut reader: impl Read, options: &ReadOptions, need: Need) -> Result<(Vec<Table>, String)> {
    let timed = options.rate_hz.is_some();
    let mut head = Vec::new();
    (&mut reader).take(HEAD as u64).read_to_end(&mut head).map_err(|e| unreadable(&e))?;
    let wish = |separator| Wish { requests: &options.columns, need, timed, separator };
    let format = Format::of(&head);
    let mut reader = std::io::Cursor::new(head).chain(reader);
    let Some(format) = format else {
        let mut lines = TextLines::new(reader)?;
        let collected = collect(&mut lines, &wish(None))?;
        return Ok((vec![Table { part: None, collected }], lines.sha256()?));
    };
    let mut bytes = Vec::new();
    let most = format.bytes_max;
    (&mut reader).take(most + 1).read_to_end(&mut bytes).map_err(|e| unreadable(&e))?;
    if bytes.len() as u64 > most {
        let message = format!("is larger than {} MiB", most >> 20);
        return Err(Error::data(message, "Save the recording as CSV, of which any size is read."));
    }
    let tables = (format.tables)(&bytes, options.sheet.as_deref())?;
    let read = |cells: formats::Cells| {
        let part = (!cells.name.is_empty()).then(|| cells.name.clone());
        let named = |error: Error| part.iter().fold(error, |error, part| error.in_part(part));
        let mut collected = collect(&mut CellLines::new(&cells), &wish(Some(CellLines::SEPARATOR))).map_err(named)?;
        collected.notes.extend(cells.notes);
        Ok(Table { part, collected })
    };
    Ok((tables.into_iter().map(read).collect::<Result<_>>()?, text::digest(&bytes)))
}
