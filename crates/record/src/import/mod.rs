//! Import of recordings from files: formats, headings, units and the defects of logged data.
//!
//! A file is read as lines of cells ([`text`] for CSV, the crate `motorfit-logs` otherwise). The lines give a table whose headings or the
//! user's requests select the columns ([`layout`], [`columns`], [`request`], [`formula`]); the rows of the table give the
//! signals in SI units ([`collect`], [`numbers`], [`convert`], [`signals`]). The fields of a log are columns too ([`log_columns`]);
//! those that are used are read and put on the times of all of them ([`logs`], [`routines`], [`merge`]).

mod advice;
mod bad_rows;
mod cell_lines;
mod collect;
mod columns;
mod convert;
mod decimal;
mod expression;
mod first_rows;
mod formula;
mod headings;
mod input;
mod lacking;
mod layout;
mod limits;
mod log_columns;
mod logs;
mod merge;
mod named;
mod numbers;
mod options;
mod parse;
mod quick;
mod request;
mod routines;
mod serial;
mod signals;
mod spec;
mod suggest;
mod table_rows;
mod text;
mod track;
mod used;
mod write;

pub use bad_rows::BadRows;
pub use first_rows::{ColumnPreview, ColumnUse, TablePreview, preview};
pub(super) use limits::limits;
pub use log_columns::{ChannelFacts, channels};
pub use options::{ReadOptions, SignalRequest};
pub use parse::parse_number;
pub(super) use request::name_of;
pub use routines::test_of;
pub use write::write_csv;

use super::heading::{Quantity, is_time};
use super::record::Record;
use super::requests::ColumnRequest;
use super::samples::Samples;
use super::source::Source;
use super::time;
use super::time::Gaps;
use cell_lines::CellLines;
use collect::collect;
use input::Input;
use motorfit_core::numeric::extremes;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_logs::{Cells, HEAD, Reader, unreadable};
pub use motorfit_logs::{FORMATS, Format, TESTS};
use serial::{Monitor, SerialLines};
use signals::Signals;
use spec::{Need, TableSpec};
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::TextLines;

/// Reads the recordings of a file: one, or one for each test of the file and each segment between gaps in time.
///
/// # Errors
/// Returns a `Data` error with file, line and column if the file cannot be read or interpreted or its data are invalid, and
/// a `Usage` error if the options do not fit the file.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Vec<Record>> {
    let read = || records_from(Input::open(path)?, Some(path), options);
    read().map_err(|error: Error| error.in_file(path))
}

/// Reads the recordings from the bytes of a file of any format, like [`read`]; `path` is named in errors.
///
/// # Errors
/// Returns an error in the cases of [`read`].
pub fn read_bytes(bytes: &[u8], path: Option<&Path>, options: &ReadOptions) -> Result<Vec<Record>> {
    let located = |error: Error| path.iter().fold(error, |error, path| error.in_file(path));
    records_from(Input::bytes(bytes), path, options).map_err(located)
}

/// Reads the recordings of a file; `path` is their origin.
fn records_from(input: Input<'_>, path: Option<&Path>, options: &ReadOptions) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    let need = if options.signals.is_empty() { Need::Recording } else { Need::Signals };
    for mut table in tables(input, options, need)? {
        table.source.path = path.map(Path::to_path_buf);
        let part = table.source.part.clone();
        records.extend(split(table, options).map_err(|error| in_part(error, part.as_deref()))?);
    }
    Ok(records)
}

/// Reads several files as one recording: files with the same quantities follow each other in time; files with different
/// quantities at the same times are merged.
///
/// # Errors
/// Returns an error in the cases of [`read`], and a `Data` error if a file holds several recordings or the files can be
/// neither concatenated nor merged.
pub fn read_joined(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<Record>> {
    let mut joined: Option<Signals> = None;
    let mut digests = String::new();
    for path in paths {
        let need = if options.signals.is_empty() { Need::Part } else { Need::Signals };
        let Ok([part]) = <[Signals; 1]>::try_from(tables_in(path, options, need)?) else {
            let message = "holds several recordings, so it cannot be joined with other files";
            return Err(Error::data(message, "Read this file separately.").in_file(path));
        };
        digests.extend(part.source.sha256.as_deref());
        joined = Some(match joined {
            None => part,
            Some(before) => before.joined(part).map_err(|e| e.in_file(path))?,
        });
    }
    let Some(signals) = joined else { return Ok(Vec::new()) };
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let (path, sha256) = (PathBuf::from(names.join("+")), text::digest(digests.as_bytes()));
    let lines = super::lines::Lines::default();
    let source = Source { path: Some(path), sha256: Some(sha256), part: None, lines, ..signals.source };
    split(Signals { source, ..signals }, options)
}

/// Reads a recording from a file of any format with default options but for the columns; the last one if there are several.
///
/// # Errors
/// Returns an error in the cases of [`read`], and a `Data` error if the file holds no recording.
pub fn read_recording(path: &Path, columns: &[ColumnRequest]) -> Result<Record> {
    let options = ReadOptions { columns: columns.to_vec(), ..ReadOptions::default() };
    read(path, &options)?.pop().ok_or_else(|| Error::data("holds no recording", "Check the file.").in_file(path))
}

/// Reads time and the inputs of a simulation, voltage and load torque. Neither current nor speed is needed.
///
/// # Errors
/// Returns an error in the cases of [`read`], and a `Data` error if the file holds several recordings.
pub fn read_inputs(path: &Path, columns: &[ColumnRequest]) -> Result<Samples> {
    let read = || {
        let options = ReadOptions { columns: columns.to_vec(), ..ReadOptions::default() };
        let Ok([table]) = <[Signals; 1]>::try_from(tables_in(path, &options, Need::Inputs)?) else {
            return Err(Error::data("holds several recordings, expected one", "Save the input as a CSV file."));
        };
        let (samples, source, _) = table.samples()?;
        // Checks time and inputs. A recording must have an output, so that a current of zeros is added.
        let checked = Samples { current: Some(vec![0.0; samples.time_s.len()]), ..samples };
        Ok(Record::from_file(checked, source, false)?.samples().clone())
    };
    read().map_err(|error: Error| error.in_file(path))
}

/// Reads time and the inputs of a model, which `options` request; outputs are not needed.
///
/// # Errors
/// Returns an error in the cases of [`read`], and a `Data` error if the file holds several recordings.
pub fn read_signal_inputs(path: &Path, options: &ReadOptions) -> Result<Samples> {
    let read = || {
        let Ok([table]) = <[Signals; 1]>::try_from(tables_in(path, options, Need::Signals)?) else {
            return Err(Error::data("holds several recordings, expected one", "Save the inputs as a CSV file."));
        };
        let (samples, source, _) = table.samples()?;
        Ok(Record::from_file(samples, source, false)?.samples().clone())
    };
    read().map_err(|error: Error| error.in_file(path))
}

/// Longest gap in a log of changes that is kept \[s\]: the control loop of a robot was late, and its voltage held.
const LATE_MAX_S: f64 = 0.5;
/// Smallest number of samples of a segment between gaps.
const SEGMENT_MIN: usize = 10;

/// Creates the recordings of signals: several if they are split at gaps.
fn split(mut signals: Signals, options: &ReadOptions) -> Result<Vec<Record>> {
    if options.drop_repeats {
        signals.drop_repeats();
    }
    match options.gaps {
        Gaps::Error if !signals.holds => with_left_out(signals),
        Gaps::Keep | Gaps::Error => {
            let (samples, source, measured_at) = signals.samples()?;
            let time_s = samples.time_s.clone();
            let keep = |n: usize, _| options.gaps == Gaps::Keep || time_s[n + 1] - time_s[n] <= LATE_MAX_S;
            Ok(vec![Record::with_gaps(samples, source, &keep)?.with_measured_at(measured_at)?])
        }
        Gaps::Split => segments(signals),
    }
}

/// Creates one recording from signals. A gap in time that is as long as the rows skipped there is a long step, not an error.
fn with_left_out(mut signals: Signals) -> Result<Vec<Record>> {
    let left_out = std::mem::take(&mut signals.left_out);
    let (samples, mut source, measured_at) = signals.samples()?;
    let lines = source.lines.clone();
    let keep = |n: usize, periods: f64| time::is_of_left_out(periods, Signals::left_out_after(&lines, &left_out, n));
    let gaps = if left_out.is_empty() { Vec::new() } else { time::gaps(&samples.time_s) };
    if !gaps.is_empty() {
        let gaps = motorfit_core::text::counted(gaps.len(), "gap");
        source.notes.push(format!(
            "{gaps} in time where rows were left out; the voltage is constant over them (zero-order hold)"
        ));
    }
    Ok(vec![Record::with_gaps(samples, source, &keep)?.with_measured_at(measured_at)?])
}

/// Creates a recording from each segment between gaps and between restarts of the clock.
fn segments(mut signals: Signals) -> Result<Vec<Record>> {
    let time = signals.get(Quantity::Time).map_or(&[][..], Vec::as_slice);
    let edges: Vec<usize> = std::iter::once(0).chain(time::breaks(time)).chain([time.len()]).collect();
    if edges.len() == 2 {
        let (samples, source, measured_at) = signals.samples()?;
        return Ok(vec![Record::from_file(samples, source, false)?.with_measured_at(measured_at)?]);
    }
    let all = edges.windows(2).map(|edge| edge[0]..edge[1]);
    let (long, short): (Vec<_>, Vec<_>) = all.partition(|segment| segment.len() >= SEGMENT_MIN);
    if !short.is_empty() {
        let short = motorfit_core::text::counted(short.len(), "segment");
        signals.source.notes.push(format!("{short} of fewer than {SEGMENT_MIN} samples left out"));
    }
    if long.is_empty() {
        let message = format!("no segment between gaps has at least {SEGMENT_MIN} samples");
        return Err(Error::data(message, text!("Use " [Gaps = "keep"] ", or record without gaps.")));
    }
    let count = long.len();
    let record = |(n, range): (usize, Range<usize>)| {
        let (samples, source, measured_at) = signals.part(range).samples()?;
        let source = source.with_segment(n, count);
        let part = source.part.clone();
        let record = Record::from_file(samples, source, false).and_then(|record| record.with_measured_at(measured_at));
        record.map_err(|error| in_part(error, part.as_deref()))
    };
    let records: Vec<Record> = long.into_iter().enumerate().map(record).collect::<Result<_>>()?;
    Ok(with_changing_outputs(records))
}

/// Returns the segments in which no output is constant, or all of them if each has a constant output.
fn with_changing_outputs(records: Vec<Record>) -> Vec<Record> {
    let is_constant = |signal: &[f64]| {
        let [low, high] = extremes(signal);
        high - low <= 1e-12 * high.abs().max(low.abs())
    };
    let is_still = |record: &Record| record.measured().into_iter().flatten().any(is_constant);
    let still: Vec<String> = records.iter().filter(|r| is_still(r)).filter_map(|r| r.source.part.clone()).collect();
    if still.is_empty() || still.len() == records.len() {
        return records;
    }
    let shown = still.iter().take(5).cloned().collect::<Vec<_>>().join(", ");
    let more = if still.len() > 5 { ", …" } else { "" };
    let note = format!("left out because an output is constant there: {shown}{more}");
    let mut changing: Vec<Record> = records.into_iter().filter(|record| !is_still(record)).collect();
    changing.iter_mut().for_each(|record| record.source.notes.push(note.clone()));
    changing
}

/// Reads the tables of the file at a path.
fn tables_in(path: &Path, options: &ReadOptions, need: Need) -> Result<Vec<Signals>> {
    Input::open(path).and_then(|input| tables(input, options, need)).map_err(|error| error.in_file(path))
}

/// Reads the tables of a file: one, or one for each test.
fn tables(mut input: Input<'_>, options: &ReadOptions, need: Need) -> Result<Vec<Signals>> {
    let mut head = Vec::new();
    (&mut input).take(HEAD as u64).read_to_end(&mut head).map_err(|e| unreadable(&e))?;
    let spec = TableSpec::of(options, need);
    let format = Format::of(&head)?;
    if let Some(Reader::Log(open)) = format.map(|format| format.read) {
        let mut medium = input.medium(head)?;
        let sha256 = logs::digest(medium.as_mut())?;
        let tables = logs::tables(open(medium, is_time)?.as_mut(), options, need)?.into_iter().map(|mut table| {
            table.source.sha256 = Some(sha256.clone());
            table.timed(options.rate_hz)
        });
        return tables.collect();
    }
    let monitor = Monitor::of(&head);
    let mut reader = std::io::Cursor::new(head).chain(input);
    let Some(Reader::Tables { bytes_max, tables }) = format.map(|format| format.read) else {
        let mut lines = TextLines::new(reader)?;
        let mut table = match &monitor {
            None => collect(&mut lines, &spec)?,
            Some(monitor) => {
                let mut serial = SerialLines::new(lines, monitor);
                let mut table = collect(&mut serial, &TableSpec { separator: monitor.separator(), ..spec })?;
                table.source.notes.push(monitor.note());
                lines = serial.into_inner();
                table
            }
        };
        table.source.sha256 = Some(lines.sha256()?);
        return Ok(vec![table.timed(options.rate_hz)?]);
    };
    let mut bytes = Vec::new();
    (&mut reader).take(bytes_max + 1).read_to_end(&mut bytes).map_err(|e| unreadable(&e))?;
    if bytes.len() as u64 > bytes_max {
        let message = format!("is larger than {} MiB", bytes_max >> 20);
        return Err(Error::data(message, "Save the recording as CSV, which may have any size."));
    }
    let read = |cells: &Cells| {
        let part = Some(cells.name.clone()).filter(|name| !name.is_empty());
        let spec = TableSpec { separator: Some(CellLines::SEPARATOR), constants: &cells.constants, ..spec };
        let mut table = collect(&mut CellLines::new(cells), &spec).map_err(|error| in_part(error, part.as_deref()))?;
        table.source.notes.extend(cells.notes.iter().cloned());
        table.source.sha256 = Some(text::digest(&bytes));
        table.source.part = part;
        table.timed(options.rate_hz)
    };
    tables(&bytes, options.sheet.as_deref())?.iter().map(read).collect()
}

/// Returns the error located in a part of the file, if there is one.
fn in_part(error: Error, part: Option<&str>) -> Error {
    part.into_iter().fold(error, Error::in_part)
}
