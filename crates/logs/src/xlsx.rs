//! Workbooks in the .xlsx format.
//!
//! Cells are streamed, and empty rows and cells after the last filled one take no memory, so that a single cell at the far
//! end of a sheet is cheap.

use super::archive::{SAVE_AGAIN, check};
use super::cells::{COLUMNS_MAX, Cells, number, shortened, unpacked_limits};
use calamine::{DataRef, Reader as _, SheetType, SheetVisible, Xlsx};
use motorfit_core::numeric::rounded;
use motorfit_core::text::{counted, quoted};
use motorfit_core::{Error, Result};
use std::fmt::Display;
use std::io::Cursor;

const CUT: &str = "Delete the cells that do not belong to the recording, or cut the recording.";

type Workbook<'a> = Xlsx<Cursor<&'a [u8]>>;

/// Reads one sheet of a workbook: the named one, else the first with at least two rows that have numbers.
///
/// Empty rows are left out; the others keep their row numbers. Dates and times of day are read as seconds, Booleans as 1 and
/// 0, errors such as `#N/A` as text, formulas as their last computed value.
///
/// # Errors
/// Returns a `Data` error if the workbook is damaged, encrypted or too large, or has no such sheet.
pub fn xlsx(bytes: &[u8], sheet: Option<&str>) -> Result<Cells> {
    let (unpacked_max, cells_max) = unpacked_limits(bytes);
    read(bytes, sheet, unpacked_max, cells_max)
}

/// Reads a sheet like [`xlsx`], with the given limits.
fn read(bytes: &[u8], sheet: Option<&str>, unpacked_max: u64, cells_max: usize) -> Result<Cells> {
    check(bytes, unpacked_max)?;
    let mut workbook = Xlsx::new(Cursor::new(bytes))
        .map_err(|e| Error::data(format!("is not a readable workbook: {e}"), SAVE_AGAIN))?;
    let names = sheets(&workbook);
    let listed = || names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ");
    if let Some(given) = sheet {
        let found = names.iter().find(|name| *name == given);
        let found = found.or_else(|| names.iter().find(|name| name.to_lowercase() == given.trim().to_lowercase()));
        let Some(name) = found else {
            let message = format!("no sheet {}; the workbook has {}", quoted(given), listed());
            return Err(Error::data(message, "Name one of these sheets."));
        };
        let table = table(&mut workbook, name, cells_max)?;
        if table.rows.is_empty() {
            let message = format!("sheet {} is empty, expected a heading and rows of numbers", quoted(name));
            return Err(Error::data(message, format!("Name the sheet with the recording: {}.", listed())));
        }
        return table.into_cells(name, cells_max);
    }
    for (at, name) in names.iter().enumerate() {
        let table = table(&mut workbook, name, cells_max)?;
        if table.numeric_rows < 2 {
            continue;
        }
        let mut cells = table.into_cells(name, cells_max)?;
        let others = names[at + 1..].iter().filter(|other| holds_numbers(&mut workbook, other));
        let others: Vec<String> = others.map(|other| quoted(other)).collect();
        if !others.is_empty() {
            let (plural, verb) = if others.len() == 1 { ("", "holds") } else { ("s", "hold") };
            let others = shortened(others, 10).join(", ");
            let note = format!("read sheet {}; sheet{plural} {others} {verb} numbers too", quoted(name));
            cells.notes.insert(0, note);
        }
        return Ok(cells);
    }
    let hint = "Put a heading such as time_s,voltage_V,current_A,speed_rad_s in a sheet, and the numbers below it.";
    Err(Error::data(format!("no sheet holds two rows with numbers; the workbook has {}", listed()), hint))
}

/// Returns the names of the worksheets, hidden ones last.
fn sheets(workbook: &Workbook<'_>) -> Vec<String> {
    let mut sheets: Vec<_> =
        workbook.sheets_metadata().iter().filter(|sheet| sheet.typ == SheetType::WorkSheet).collect();
    sheets.sort_by_key(|sheet| sheet.visible != SheetVisible::Visible);
    sheets.into_iter().map(|sheet| sheet.name.clone()).collect()
}

/// Cells of a sheet.
#[derive(Default)]
struct Table {
    rows: Vec<(u64, Vec<String>)>,
    /// Number of rows with a number.
    numeric_rows: usize,
    /// Number of cells with dates or times.
    dates: usize,
    /// Address of the first cell with a date or time.
    first_date: Option<String>,
}

/// Reads the cells of a sheet.
fn table(workbook: &mut Workbook<'_>, name: &str, cells_max: usize) -> Result<Table> {
    let damaged =
        |what: &dyn Display| Error::data(format!("sheet {} cannot be read: {what}", quoted(name)), SAVE_AGAIN);
    let mut reader = workbook.worksheet_cells_reader(name).map_err(|e| damaged(&e))?;
    let mut table = Table::default();
    let mut total = 0;
    let mut last = None;
    let mut numeric_row = None;
    while let Some(cell) = reader.next_cell().map_err(|e| damaged(&e))? {
        let (row, column) = cell.get_position();
        if last.is_some_and(|last| last >= (row, column)) {
            return Err(damaged(&format!("cell {} is repeated or out of order", address(row, column))));
        }
        last = Some((row, column));
        let (text, kind) = content(cell.get_value());
        if text.is_empty() {
            continue;
        }
        let (number, at) = (u64::from(row) + 1, column as usize);
        if table.rows.last().is_none_or(|(last, _)| *last != number) {
            table.rows.push((number, Vec::new()));
        }
        let Some((_, texts)) = table.rows.last_mut() else { continue };
        total += (at + 1).saturating_sub(texts.len());
        if at >= COLUMNS_MAX || total > cells_max {
            let most = if at >= COLUMNS_MAX { format!("{COLUMNS_MAX} columns") } else { format!("{cells_max} cells") };
            let what = format!("cell {} is filled, expected at most {most}", address(row, column));
            return Err(Error::data(format!("sheet {}: {what}", quoted(name)), CUT));
        }
        texts.resize(at, String::new());
        texts.push(text);
        if kind != Kind::Text && numeric_row != Some(row) {
            numeric_row = Some(row);
            table.numeric_rows += 1;
        }
        if kind == Kind::Date {
            table.dates += 1;
            table.first_date.get_or_insert_with(|| address(row, column));
        }
    }
    Ok(table)
}

impl Table {
    /// Pads all rows to the same length.
    ///
    /// # Errors
    /// Returns a `Data` error if the table would have more than `cells_max` cells.
    fn into_cells(mut self, name: &str, cells_max: usize) -> Result<Cells> {
        let (widest, width) =
            self.rows.iter().map(|(number, texts)| (*number, texts.len())).max_by_key(|row| row.1).unwrap_or_default();
        if self.rows.len().saturating_mul(width) > cells_max {
            let found = format!("sheet {}: found {} rows of {width} columns", quoted(name), self.rows.len());
            let message = format!("{found}, expected at most {cells_max} cells; row {widest} is the widest");
            return Err(Error::data(message, CUT));
        }
        for (_, texts) in &mut self.rows {
            texts.resize(width, String::new());
        }
        let note = self.first_date.map(|first| {
            let dates = counted(self.dates, "date or time cell");
            format!("{dates}, the first in {first}, given in seconds (days times 86400)")
        });
        Ok(Cells { name: name.to_owned(), rows: self.rows, notes: note.into_iter().collect(), ..Cells::default() })
    }
}

/// Returns true if a sheet can be read and has at least two rows with numbers.
fn holds_numbers(workbook: &mut Workbook<'_>, name: &str) -> bool {
    let Ok(mut reader) = workbook.worksheet_cells_reader(name) else { return false };
    let mut first = None;
    while let Ok(Some(cell)) = reader.next_cell() {
        let row = cell.get_position().0;
        if first != Some(row) && content(cell.get_value()).1 != Kind::Text && first.replace(row).is_some() {
            return true;
        }
    }
    false
}

/// Kind of the content of a cell.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Number,
    Date,
    Text,
}

/// Returns the text of a cell and its kind; a text that parses as a number is of the kind [`Kind::Number`].
fn content(value: &DataRef<'_>) -> (String, Kind) {
    let of_text = |text: &str| {
        let text = text.trim();
        let numeric = text.replacen(',', ".", 1).parse().is_ok_and(f64::is_finite);
        (text.to_owned(), if numeric { Kind::Number } else { Kind::Text })
    };
    match value {
        DataRef::Int(value) => (value.to_string(), Kind::Number),
        DataRef::Float(value) => (number(*value), Kind::Number),
        DataRef::Bool(value) => (u8::from(*value).to_string(), Kind::Number),
        DataRef::String(text) => of_text(text),
        DataRef::SharedString(text) => of_text(text),
        DataRef::DateTime(date) => (number(seconds(date.as_f64())), Kind::Date),
        DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => match iso_days(text) {
            Some(days) => (number(seconds(days)), Kind::Date),
            None => of_text(text),
        },
        DataRef::Error(error) => (error.to_string(), Kind::Text),
        DataRef::Empty => (String::new(), Kind::Text),
    }
}

/// Converts days to seconds with the 15 significant digits of a spreadsheet; present-day dates are rounded to 10 µs.
fn seconds(days: f64) -> f64 {
    rounded(days * 86_400.0, 15)
}

/// Returns the days from the epoch of spreadsheets to an ISO 8601 date, time of day or both.
fn iso_days(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    let (date, time) = match text.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), Some(time)),
        None if text.contains(':') => (None, Some(text)),
        None => (Some(text), None),
    };
    let mut days = 0.0;
    if let Some(date) = date {
        let mut parts = date.splitn(3, '-').map(|part| part.parse::<u32>().ok().filter(|&n| n < 10_000));
        let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
        if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
            return None;
        }
        // Years are counted from March, so that the leap day is the last day of a year.
        let (year, month) = if month < 3 { (year.checked_sub(1)?, month + 9) } else { (year, month - 3) };
        let count = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day;
        days = f64::from(count) - 693_900.0;
    }
    if let Some(time) = time {
        let mut parts = time.splitn(3, ':').map(|part| part.parse::<f64>().ok().filter(|n| (0.0..61.0).contains(n)));
        let (hours, minutes, seconds) = (parts.next()??, parts.next()??, parts.next().unwrap_or(Some(0.0))?);
        days += (hours * 3600.0 + minutes * 60.0 + seconds) / 86_400.0;
    }
    Some(days)
}

/// Returns the address of a cell, such as `B2`, from row and column counted from 0.
fn address(row: u32, column: u32) -> String {
    let mut letters = Vec::new();
    let mut rest = u64::from(column) + 1;
    while rest > 0 {
        let digit = u8::try_from((rest - 1) % 26).unwrap_or_default();
        letters.insert(0, char::from(b'A' + digit));
        rest = (rest - 1) / 26;
    }
    format!("{}{}", letters.into_iter().collect::<String>(), u64::from(row) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{CELLS_FREE, CELLS_MAX, UNPACKED_FREE, UNPACKED_MAX};
    use std::io::Write as _;

    /// The limit of the decompressed size grows with the size of the file.
    #[test]
    fn the_decompressed_size_is_limited_by_the_size_of_the_file() {
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        zip.start_file("xl/worksheets/sheet1.xml", zip::write::SimpleFileOptions::default()).unwrap();
        let row = "<row><c><v>1</v></c></row>".repeat(1000);
        for _ in 0..UNPACKED_FREE / row.len() as u64 + 1 {
            zip.write_all(row.as_bytes()).unwrap();
        }
        let bomb = zip.finish().unwrap().into_inner();
        assert!(bomb.len() < 1 << 20, "{}", bomb.len());
        let error = xlsx(&bomb, None).unwrap_err();
        assert!(error.to_string().contains("unpacks to more than 33554432 bytes"), "{error}");
        let of = |size: usize| unpacked_limits(&vec![0; size]);
        assert_eq!(of(bomb.len()), (UNPACKED_FREE, CELLS_FREE));
        assert_eq!(of(1 << 20), (50 << 20, CELLS_FREE));
        assert_eq!(of(30 << 20), (UNPACKED_MAX, CELLS_MAX));
    }

    #[test]
    fn limits() {
        let log = include_bytes!("../../../tests/golden/formats/log.xlsx");
        assert_eq!(read(log, None, UNPACKED_MAX, 42).unwrap().rows.len(), 7);
        let message = read(log, None, UNPACKED_MAX, 41).unwrap_err().to_string();
        assert_eq!(message, "sheet \"Log\": found 7 rows of 6 columns, expected at most 41 cells; row 9 is the widest");
        assert!(read(log, None, UNPACKED_MAX, 9).unwrap_err().to_string().contains("cell B5 is filled"));
        assert!(read(log, None, 10_000, 42).unwrap_err().to_string().contains("unpacks to more than 10000 bytes"));
    }

    #[test]
    fn addresses_and_dates() {
        assert_eq!(
            [(0, 0), (9, 25), (0, 26), (1_048_575, 16_383)].map(|(r, c)| address(r, c)),
            ["A1", "Z10", "AA1", "XFD1048576"]
        );
        assert_eq!(address(u32::MAX, u32::MAX).len(), 17);
        for (text, days) in [
            ("1900-03-01", Some(61.0)),
            ("2000-02-29", Some(36585.0)),
            ("2024-01-02T12:00:00Z", Some(45293.5)),
            ("06:00", Some(0.25)),
            ("2024-13-01", None),
            ("0000-01-01", None),
            ("12", None),
            ("", None),
            ("25:xx", None),
        ] {
            assert_eq!(iso_days(text), days, "{text}");
        }
    }
}
