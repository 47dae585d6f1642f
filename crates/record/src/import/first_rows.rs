//! Preview of a file: the headings of its tables, what is understood of them, and the first rows, before any column is chosen.

use super::cell_lines::CellLines;
use super::columns::one;
use super::headings::Heading;
use super::input::Input;
use super::layout::{comment, find};
use super::log_columns::columns;
use super::options::ReadOptions;
use super::request::divided;
use super::routines::Scope;
use super::serial::{Monitor, SerialLines};
use super::spec::{Need, TableSpec};
use super::text::{Lines, TextLines};
use crate::heading::{Quantity, is_time};
use motorfit_core::{Error, Result};
use motorfit_logs::{Cells, Format, HEAD, Log, Reader};
use std::path::Path;

/// Number of rows of a preview.
const ROWS: usize = 5;

/// A table of a file.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TablePreview {
    /// Name of the sheet or of the test; `None` if the file has only one table.
    pub part: Option<String>,
    /// Columns in their order.
    pub columns: Vec<ColumnPreview>,
    /// Names of the quantities that are computed by an expression of columns.
    pub expressions: Vec<&'static str>,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ColumnPreview {
    /// Heading; the number of the column if the table has no headings.
    pub heading: String,
    /// Name of the quantity that the heading names.
    pub quantity: Option<&'static str>,
    /// Unit from the heading or the row of units below it.
    pub unit: Option<String>,
    /// First cells as they are written.
    pub cells: Vec<String>,
    /// Quantity as which the column is read, by its heading or by the request of the user; `None` if it is not read.
    pub used: Option<ColumnUse>,
}

/// Quantity as which a column is read.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ColumnUse {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Operations of the request on the cells, such as `*12/255`, or the two values of a flag, `0..12`; empty without any.
    pub scaling: String,
    /// Unit after the operations; `None` if none is named, so that it is the SI unit.
    pub unit: Option<String>,
}

/// Returns the tables in the bytes of a file; `path` is named in errors.
///
/// # Errors
/// Returns a `Data` error if the file is not a table of text, a workbook, a MAT-file or JSON, or has no rows.
pub fn preview(bytes: &[u8], path: Option<&Path>, options: &ReadOptions) -> Result<Vec<TablePreview>> {
    tables(bytes, options).map_err(|error| path.iter().fold(error, |error, path| error.in_file(path)))
}

fn tables(bytes: &[u8], options: &ReadOptions) -> Result<Vec<TablePreview>> {
    let spec = TableSpec::of(options, Need::Recording);
    let head = &bytes[..bytes.len().min(HEAD)];
    let format = Format::of(head)?.map(|format| format.read);
    if let Some(Reader::Log(open)) = format {
        let log = open(Input::bytes(bytes).medium(Vec::new())?, is_time)?;
        return Ok(vec![log_table(log.as_ref(), options, &spec)?]);
    }
    let Some(Reader::Tables { tables, .. }) = format else {
        let lines = TextLines::new(bytes)?;
        let table = match Monitor::of(head) {
            None => table(lines, &spec),
            Some(monitor) => {
                let spec = TableSpec { separator: monitor.separator(), ..spec };
                table(SerialLines::new(lines, &monitor), &spec)
            }
        };
        return Ok(vec![table?]);
    };
    let read = |cells: &Cells| {
        let part = Some(cells.name.clone()).filter(|name| !name.is_empty());
        let spec = TableSpec { separator: Some(CellLines::SEPARATOR), constants: &cells.constants, ..spec };
        let table = table(CellLines::new(cells), &spec)
            .map_err(|error| part.iter().fold(error, |error, part| Error::in_part(error, part)))?;
        Ok(TablePreview { part, ..table })
    };
    tables(bytes, options.sheet.as_deref())?.iter().map(read).collect()
}

/// Returns the fields of a log as columns, without values.
fn log_table(log: &dyn Log, options: &ReadOptions, spec: &TableSpec<'_>) -> Result<TablePreview> {
    let scope = Scope::of(log, options.sheet.as_deref())?;
    let headings = columns(log, &|channel, path| scope.takes(channel, path)).headings;
    let mut columns: Vec<ColumnPreview> = headings.iter().map(|heading| column(heading, Vec::new())).collect();
    let expressions = use_columns(&headings, spec, &mut columns);
    Ok(TablePreview { part: None, columns, expressions })
}

/// Returns the preview of a column with its first cells.
fn column(heading: &Heading, cells: Vec<String>) -> ColumnPreview {
    let understood = heading.understood();
    ColumnPreview {
        heading: heading.name.clone(),
        quantity: understood.as_ref().map(|(quantity, _): &(Quantity, _)| quantity.key()),
        unit: understood.and_then(|(_, unit)| unit).or_else(|| heading.unit.clone()),
        cells,
        used: None,
    }
}

fn table(mut lines: impl Lines, spec: &TableSpec<'_>) -> Result<TablePreview> {
    let layout = find(&mut lines, spec)?;
    let mut rows: Vec<String> = layout.pending.into_iter().map(|(_, text)| text).collect();
    while rows.len() < ROWS
        && let Some(line) = lines.next_line()?
    {
        rows.push(String::from_utf8_lossy(line.bytes).into_owned());
    }
    rows.retain(|row| comment(row).is_none() && !row.trim().is_empty());
    rows.truncate(ROWS);
    let rows: Vec<Vec<&str>> = rows.iter().map(|row| layout.separator.row(row)).collect();
    let cells = |at: usize| rows.iter().map(move |row| row.get(at).map_or_else(String::new, |cell| (*cell).to_owned()));
    let column = |(at, heading): (usize, &Heading)| column(heading, cells(at).collect());
    let mut columns: Vec<ColumnPreview> = layout.headings.iter().enumerate().map(column).collect();
    let expressions = use_columns(&layout.headings, spec, &mut columns);
    Ok(TablePreview { part: None, columns, expressions })
}

/// Notes for each column as which quantity it is read. Returns the names of the quantities that are computed by expressions.
fn use_columns(headings: &[Heading], spec: &TableSpec<'_>, columns: &mut [ColumnPreview]) -> Vec<&'static str> {
    let mut expressions = Vec::new();
    for quantity in Quantity::COLUMNS {
        // A position serves as the speed, and is not read beside one.
        let has_speed = columns.iter().any(|column| column.used.as_ref().is_some_and(|of| of.quantity == "speed"));
        let found = if quantity == Quantity::Position && has_speed { Ok(None) } else { one(headings, spec, quantity) };
        let Ok(Some(used)) = found else { continue };
        let Some(at) = used.at else {
            expressions.push(quantity.key());
            continue;
        };
        let rest =
            spec.request(quantity).and_then(|request| divided(headings, &request.name)).map_or("", |(_, rest)| rest);
        let (operations, last) = rest.rsplit_once(':').unwrap_or((rest, ""));
        let is_flag = last.contains("..");
        let scaling = if is_flag { last } else { operations }.trim().to_owned();
        let unit = (used.column.unit_named && !is_flag).then_some(used.column.unit);
        columns[at].used = Some(ColumnUse { quantity: quantity.key(), scaling, unit });
    }
    expressions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Vec<ColumnPreview> {
        let [table] =
            <[TablePreview; 1]>::try_from(preview(text.as_bytes(), None, &ReadOptions::default()).unwrap()).unwrap();
        table.columns
    }

    #[test]
    fn headings_units_and_first_cells_are_returned_as_written() {
        let columns = of(
            "# a comment\nt;Duty;I;Drehzahl\n[ms];;[mA];[rpm]\n0;0,5;1,25;10\n# note\n1;0,6;2;11\n\n2;0,7;3;12\n3;;;\n4;1;1;1\n5;2;2;2\n",
        );
        let shown: Vec<_> = columns.iter().map(|c| (c.heading.as_str(), c.quantity, c.unit.as_deref())).collect();
        let wanted = [
            ("t", Some("time"), Some("ms")),
            ("Duty", None, None),
            ("I", Some("current"), Some("mA")),
            ("Drehzahl", Some("speed"), Some("rpm")),
        ];
        assert_eq!(shown, wanted);
        assert_eq!(columns[1].cells, ["0,5", "0,6", "0,7", "", "1"]);
    }

    #[test]
    fn the_use_of_columns_follows_headings_and_requests() {
        let text = "ms,PWM,I,rpm,flag,angle [deg]\n[ms],,[mA],,,[deg]\n0,1,2,3,1,5\n1,1,2,3,0,5\n";
        let used = |columns: &str| -> (Vec<String>, Vec<&str>) {
            let columns = crate::parse_columns(columns).unwrap();
            let options = ReadOptions { columns, ..ReadOptions::default() };
            let table = preview(text.as_bytes(), None, &options).unwrap().remove(0);
            let shown = |of: ColumnUse| format!("{}{}:{}", of.quantity, of.scaling, of.unit.unwrap_or_default());
            (
                table.columns.into_iter().map(|column| column.used.map_or_else(String::new, shown)).collect(),
                table.expressions,
            )
        };
        let (by_heading, none) = used("");
        assert_eq!(by_heading, ["", "", "current:mA", "speed:rpm", "", ""]);
        assert!(none.is_empty());
        let (requested, none) =
            used("time=ms:ms,voltage=#2*12/255:V,current=I*2,speed=-,position=angle [deg]/10:turns");
        assert_eq!(requested, ["time:ms", "voltage*12/255:V", "current*2:A", "", "", "position/10:turns"]);
        assert!(none.is_empty());
        let (flag, sum) = used("voltage=flag:0..12,time=cumsum(PWM):ms");
        assert_eq!(flag, ["", "", "current:mA", "speed:rpm", "voltage0..12:", ""]);
        assert_eq!(sum, ["time"]);
    }

    #[test]
    fn a_table_without_headings_has_numbers() {
        let columns = of("0 1 2 3\n1 1 2 3\n");
        assert_eq!(columns.iter().map(|c| c.heading.as_str()).collect::<Vec<_>>(), ["1", "2", "3", "4"]);
        assert_eq!(columns[3].cells, ["3", "3"]);
    }

    #[test]
    fn a_file_that_cannot_be_recorded_is_shown_all_the_same() {
        assert_eq!(of("a,b\n1,2\n").len(), 2);
        assert!(preview(b"# only a comment\n", None, &ReadOptions::default()).is_err());
    }
}
