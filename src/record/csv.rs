//! CSV in its variants: separators `,` `;` tab, decimal commas, CRLF, byte-order mark, comments, trailing separator.
//!
//! Lines are counted as a text editor does, so that an error names the line that its reader will find.

use super::heading::{ColumnRequest, Quantity, understand};
use super::parse::{cells, parse_number};
use super::time::rounded;
use super::{Column, Record, SAMPLES_MAX, Samples, Source};
use crate::text::{excerpt, printable};
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

/// The largest file that is read.
const BYTES_MAX: u64 = 2 << 30;
/// The longest line that is read.
const LINE_MAX: usize = 64 << 10;

/// Reads a recording from a CSV file.
///
/// # Errors
/// `Data` with file, line and column when the file cannot be read, understood or trusted.
pub fn read_csv(path: &Path, columns: &[ColumnRequest]) -> Result<Record> {
    let bytes = read_bytes(path).map_err(|error| error.in_file(path))?;
    read_csv_bytes(&bytes, Some(path), columns)
}

/// Reads a recording from the bytes of a CSV file; `path` names it in errors.
///
/// # Errors
/// `Data` with line and column when the text cannot be understood or trusted.
pub fn read_csv_bytes(bytes: &[u8], path: Option<&Path>, columns: &[ColumnRequest]) -> Result<Record> {
    let located = |error: Error| match path {
        Some(path) => error.in_file(path),
        None => error,
    };
    let (samples, mut source) = parse(bytes, columns, &Quantity::ALL).map_err(located)?;
    source.path = path.map(Path::to_path_buf);
    Record::from_file(samples, source)
}

/// Reads time, voltage and load torque alone: what drives a simulation.
///
/// # Errors
/// As [`read_csv`], but neither current nor speed is needed.
pub fn read_inputs(path: &Path, columns: &[ColumnRequest]) -> Result<Samples> {
    let read = || {
        let bytes = read_bytes(path)?;
        let (samples, source) = parse(&bytes, columns, &[Quantity::Time, Quantity::Voltage, Quantity::Torque])?;
        // A recording needs an output; what is checked here are time and inputs.
        let checked = Samples { current: Some(vec![0.0; samples.time_s.len()]), ..samples };
        Ok(Record::from_file(checked, source)?.samples().clone())
    };
    read().map_err(|error: Error| error.in_file(path))
}

fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let failed = |error: std::io::Error| {
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => "Check the path; relative paths start at the current folder.",
            std::io::ErrorKind::PermissionDenied => "Allow reading it, or run as a user who may.",
            _ => "Check the file and its disk.",
        };
        Error::data(format!("cannot be read: {error}"), remedy)
    };
    let file = std::fs::File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(Error::data("is a folder, expected a CSV file", "Name the recording inside it."));
    }
    let mut bytes = Vec::new();
    if metadata.len() <= BYTES_MAX {
        file.take(BYTES_MAX + 1).read_to_end(&mut bytes).map_err(failed)?;
    }
    if metadata.len() > BYTES_MAX || bytes.len() as u64 > BYTES_MAX {
        return Err(Error::data("is larger than 2 GiB", "Cut the recording, or lower its rate."));
    }
    Ok(bytes)
}

/// The text of the file, or why it is none.
fn text_of(bytes: &[u8]) -> Result<String> {
    const SAVE_AS: &str = "Save it as CSV in UTF-8 with a heading such as time_s,voltage_V,current_A,speed_rad_s.";
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.is_empty() {
        return Err(Error::data("is empty, expected a heading and rows of numbers", SAVE_AS));
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(Error::data("is UTF-16 text, expected UTF-8", SAVE_AS));
    }
    if let Some(at) = bytes.iter().position(|&b| b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c)) {
        let line = 1 + bytes[..at].iter().filter(|&&b| b == b'\n').count() as u64;
        let sort = if bytes[at] == 0 { "a zero byte: binary data or UTF-16" } else { "a control character" };
        return Err(Error::data(format!("found {sort}, expected text"), SAVE_AS).at_line(line));
    }
    for (n, line) in bytes.split(|&b| b == b'\n').enumerate() {
        if line.len() > LINE_MAX {
            let message = format!("is {} bytes long, expected at most {LINE_MAX}", line.len());
            return Err(Error::data(message, "Check that it is CSV with one sample per line.").at_line(n as u64 + 1));
        }
    }
    // Only headings and comments hold other letters than numbers do; what is no UTF-8 is read as Latin-1.
    let text =
        std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|&b| char::from(b)).collect(), str::to_owned);
    // Line ends of old systems.
    Ok(if text.contains('\n') { text } else { text.replace('\r', "\n") })
}

/// A column that is used: where it stands and what turns its cells into SI.
struct Used {
    at: usize,
    column: Column,
    factor: f64,
}

fn parse(bytes: &[u8], requests: &[ColumnRequest], wanted: &[Quantity]) -> Result<(Samples, Source)> {
    let text = text_of(bytes)?;
    let mut lines = (1_u64..).zip(text.lines()).filter(|(_, line)| {
        let line = line.trim_start();
        !(line.is_empty() || line.starts_with(['#', '%']))
    });
    let Some((heading_line, heading)) = lines.next() else {
        return Err(Error::data(
            "holds only comments or blank lines, expected a heading and rows of numbers",
            "Put a heading such as time_s,voltage_V,current_A,speed_rad_s in front of the rows.",
        ));
    };
    let separator = separator_of(heading);
    let mut headings = Vec::new();
    let ended = |line| ended(line, separator);
    cells(ended(heading), separator, &mut headings);
    if headings.len() > 1 && headings.last().is_some_and(|h| h.is_empty()) {
        headings.pop();
    }
    let used = choose(&headings, requests, wanted).map_err(|error| error.at_line(heading_line))?;
    let mut signals = vec![Vec::new(); used.len()];
    let mut source = Source { sha256: Some(hexadecimal(&Sha256::digest(bytes))), ..Source::default() };
    let mut row = Vec::with_capacity(headings.len() + 1);
    let whole = text.ends_with('\n');
    source.last_line_open = !whole;
    let mut lines = lines.peekable();
    while let Some((line, text)) = lines.next() {
        cells(ended(text), separator, &mut row);
        check_count(&row, headings.len(), lines.peek().is_none() && !whole).map_err(|e| e.at_line(line))?;
        for (signal, Used { at, column, factor }) in signals.iter_mut().zip(&used) {
            let value = parse_number(row[*at], separator != ',' || row[*at].contains(',')).map_err(|found| {
                Error::data(found, "Correct the cell, or remove the row at the start or end of the recording.")
                    .at_line(line)
                    .in_column(&column.heading)
            })?;
            signal.push(value * factor);
        }
        source.lines.push(line);
        if source.lines.len() > SAMPLES_MAX {
            return Err(Error::data(format!("more than {SAMPLES_MAX} samples"), "Cut the recording.").at_line(line));
        }
    }
    let taken: Vec<usize> = used.iter().map(|u| u.at).collect();
    source.ignored = (0..headings.len()).filter(|at| !taken.contains(at)).map(|at| headings[at].to_owned()).collect();
    let mut samples = Samples::default();
    for (used, signal) in used.into_iter().zip(signals) {
        match used.column.quantity {
            Quantity::Time => samples.time_s = signal,
            Quantity::Voltage => samples.voltage = signal,
            Quantity::Torque => samples.torque = Some(signal),
            Quantity::Current => samples.current = Some(signal),
            Quantity::Speed => samples.speed = Some(signal),
        }
        source.columns.push(used.column);
    }
    Ok((samples, source))
}

/// The separator of the heading: the most frequent, one at the end of the line left out; `;` and tab before `,`,
/// which may stand inside a name.
fn separator_of(heading: &str) -> char {
    let inside = heading.trim().trim_end_matches([';', '\t', ',']);
    let count = |c: char| inside.matches(c).count();
    [',', '\t', ';'].into_iter().max_by_key(|&c| count(c)).filter(|&c| count(c) > 0).unwrap_or(',')
}

/// A line without the `;` that some loggers put at its end though commas separate its cells.
fn ended(line: &str, separator: char) -> &str {
    if separator == ';' { line } else { line.trim_end().trim_end_matches(';') }
}

fn check_count(row: &[&str], expected: usize, cut: bool) -> Result<()> {
    // A trailing separator makes one empty cell more.
    let found = if row.len() == expected + 1 && row[expected].is_empty() { expected } else { row.len() };
    if found == expected {
        return Ok(());
    }
    let (what, remedy) = if cut && found < expected {
        ("the last line is cut off: ", "Remove the last line, or copy the file again.")
    } else {
        ("", "Give every row as many cells as the heading; a decimal comma needs ; between the cells.")
    };
    Err(Error::data(format!("{what}found {found} cells, expected {expected} as in the heading"), remedy))
}

/// Which columns are used: those that `requests` name, the others by their headings.
fn choose(headings: &[&str], requests: &[ColumnRequest], wanted: &[Quantity]) -> Result<Vec<Used>> {
    let mut used = Vec::new();
    for &quantity in wanted {
        let request = requests.iter().find(|r| r.quantity == quantity);
        let found = match request {
            Some(request) => Some(requested(headings, request)?),
            None => recognized(headings, requests, quantity)?,
        };
        used.extend(found);
    }
    let has = |quantity| used.iter().any(|u: &Used| u.column.quantity == quantity);
    let outputs = wanted.contains(&Quantity::Current);
    let missing: Vec<&str> = [Quantity::Time, Quantity::Voltage]
        .into_iter()
        .filter(|&q| !has(q))
        .map(Quantity::canonical)
        .chain((outputs && !has(Quantity::Current) && !has(Quantity::Speed)).then_some("current_A or speed_rad_s"))
        .collect();
    if missing.is_empty() {
        let twice = used.iter().enumerate().find(|(n, u)| used[..*n].iter().any(|other| other.at == u.at));
        return match twice {
            None => Ok(used),
            Some((_, u)) => Err(Error::data(
                format!("column \"{}\" is named for two quantities", excerpt(&u.column.heading)),
                "Name a column of its own for each quantity.",
            )),
        };
    }
    let numeric = headings.iter().all(|h| parse_number(h, true).is_ok());
    let found: Vec<String> = headings.iter().map(|h| format!("\"{}\"", excerpt(h))).collect();
    Err(Error::data(
        if numeric {
            "found numbers, expected a heading".to_owned()
        } else {
            format!("no column for {}; the heading has {}", missing.join(" and "), found.join(", "))
        },
        "Rename the headings (time_s,voltage_V,current_A,speed_rad_s) or name them: \
         --columns time=HEADING:UNIT,voltage=HEADING:UNIT,current=HEADING:UNIT,speed=HEADING:UNIT.",
    ))
}

fn requested(headings: &[&str], request: &ColumnRequest) -> Result<Used> {
    let quantity = request.quantity;
    let find = |name: &str| headings.iter().position(|h| *h == name);
    let (at, unit) = match (find(&request.name), request.name.rsplit_once(':')) {
        (Some(at), _) => (Some(at), None),
        (None, Some((name, unit))) => (find(name), Some(unit.to_owned())),
        (None, None) => (None, None),
    };
    let Some(at) = at else {
        let found: Vec<String> = headings.iter().map(|h| format!("\"{}\"", excerpt(h))).collect();
        return Err(Error::data(
            format!("no column \"{}\" for {quantity}; the heading has {}", excerpt(&request.name), found.join(", ")),
            "Give --columns the exact heading, capitals included.",
        ));
    };
    let unit = unit.or_else(|| understand(headings[at]).filter(|(q, _)| *q == quantity).and_then(|(_, unit)| unit));
    column(quantity, at, headings[at], unit)
}

fn recognized(headings: &[&str], requests: &[ColumnRequest], quantity: Quantity) -> Result<Option<Used>> {
    let is_requested = |heading: &str| {
        requests.iter().any(|r| r.name == heading || r.name.rsplit_once(':').is_some_and(|(name, _)| name == heading))
    };
    if let Some(at) = headings.iter().position(|h| *h == quantity.canonical() && !is_requested(h)) {
        return column(quantity, at, headings[at], understand(headings[at]).and_then(|(_, unit)| unit)).map(Some);
    }
    let mut matches = headings.iter().enumerate().filter_map(|(at, heading)| {
        let (found, unit) = understand(heading)?;
        (found == quantity && !is_requested(heading)).then_some((at, *heading, unit))
    });
    let Some((at, heading, unit)) = matches.next() else { return Ok(None) };
    if let Some((_, other, _)) = matches.next() {
        return Err(Error::data(
            format!("both \"{}\" and \"{}\" look like {quantity}", excerpt(heading), excerpt(other)),
            format!("Say which: --columns {}={}.", quantity.key(), printable(heading)),
        ));
    }
    column(quantity, at, heading, unit).map(Some)
}

fn column(quantity: Quantity, at: usize, heading: &str, unit: Option<String>) -> Result<Used> {
    let unit_named = unit.is_some();
    let unit = unit.unwrap_or_else(|| quantity.unit().to_owned());
    let factor = if unit_named { quantity.check_unit(&unit).map_err(|e| e.in_column(heading))? } else { 1.0 };
    let unit = unit.replace("rad_s", "rad/s");
    Ok(Used { at, column: Column { quantity, heading: heading.to_owned(), unit, unit_named }, factor })
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The canonical CSV of a recording; values keep every digit, times fifteen (1.009, not 1.0089999999999999).
#[must_use]
pub fn write_csv(record: &Record) -> String {
    let samples = record.samples();
    let mut columns = vec![(Quantity::Time, &samples.time_s), (Quantity::Voltage, &samples.voltage)];
    let optional =
        [(Quantity::Current, &samples.current), (Quantity::Speed, &samples.speed), (Quantity::Torque, &samples.torque)];
    columns.extend(optional.into_iter().filter_map(|(quantity, signal)| Some((quantity, signal.as_ref()?))));
    let mut text = columns.iter().map(|(quantity, _)| quantity.canonical()).collect::<Vec<_>>().join(",");
    text.push('\n');
    for n in 0..record.len() {
        for (at, (quantity, signal)) in columns.iter().enumerate() {
            let joint = if at == 0 { "" } else { "," };
            let value = if *quantity == Quantity::Time { rounded(signal[n], 15) } else { signal[n] };
            let _ = write!(text, "{joint}{value}");
        }
        text.push('\n');
    }
    text
}
