//! Workbooks written by openpyxl, and some modified by hand.

use super::super::xlsx::xlsx;
use std::io::{Cursor, Read as _, Write as _};
use zip::write::SimpleFileOptions;

const LOG: &[u8] = include_bytes!("../../../../tests/golden/formats/log.xlsx");
const FAR: &[u8] = include_bytes!("../../../../tests/golden/formats/far.xlsx");
const ISO: &[u8] = include_bytes!("../../../../tests/golden/formats/iso.xlsx");

fn refused(bytes: &[u8], sheet: Option<&str>) -> String {
    xlsx(bytes, sheet).unwrap_err().to_string()
}

#[test]
fn the_first_sheet_with_rows_of_numbers() {
    let cells = xlsx(LOG, None).unwrap();
    assert_eq!(cells.name, "Log");
    let expected: [(u64, &[&str]); 7] = [
        (1, &["", "Recording", "", "", "", ""]),
        (3, &["", "time_s", "voltage_V", "on", "when", "took"]),
        (5, &["", "0", "0.3333333333333333", "0", "3913326245.5", "108000"]),
        (6, &["", "0.1", "-1e-7", "1", "3913326245.51", "108001"]),
        (8, &["", "0.2", "12", "0", "3913326245.52", "108002"]),
        (9, &["", "0.3", "1e20", "1", "3913326245.53", "108003"]),
        (10, &["", "", "#N/A", "", "", ""]),
    ];
    for ((number, row), (expected_number, expected)) in cells.rows.iter().zip(expected) {
        assert_eq!((*number, row.iter().map(String::as_str).collect()), (expected_number, expected.to_vec()));
    }
    assert_eq!(cells.rows.len(), expected.len());
    let notes = [
        "read sheet \"Log\"; sheets \"More\", \"Hidden\" hold numbers too",
        "8 date or time cells, the first in E5, given in seconds (days times 86400)",
    ];
    assert_eq!(cells.notes, notes);
}

#[test]
fn a_sheet_by_name() {
    let more = xlsx(LOG, Some("More")).unwrap();
    let rows: Vec<_> = more.rows.iter().map(|(n, row)| (*n, row.join(" "))).collect();
    assert_eq!(rows, [(1, "0 0".to_owned()), (2, "1 1".to_owned()), (3, "2 4".to_owned())]);
    assert_eq!(xlsx(LOG, Some("hidden ")).unwrap().name, "Hidden");
    assert_eq!(xlsx(LOG, Some("Info")).unwrap().rows[1], (2, vec!["Serial".to_owned(), "4711".to_owned()]));
    let message = refused(LOG, Some("Sheet9"));
    assert_eq!(message, "no sheet \"Sheet9\"; the workbook has \"Info\", \"Log\", \"More\", \"Hidden\"");
}

#[test]
fn dates_as_text_become_seconds_too() {
    let cells = xlsx(ISO, None).unwrap();
    assert_eq!(cells.rows[1].1, ["3913326245", "3160944000", "45000"]);
    assert_eq!(cells.rows[2].1, ["3913326246", "5270400", "1"]);
}

#[test]
fn a_filled_cell_at_the_far_end_is_named() {
    let message = refused(FAR, None);
    assert_eq!(message, "sheet \"Sheet\": cell XFD1048576 is filled, expected at most 1000 columns");
}

/// Returns the workbook `FAR` with some files of the archive replaced, or removed for `None`.
fn with(parts: &[(&str, Option<&str>)]) -> Vec<u8> {
    with_bytes(&parts.iter().map(|(name, text)| (*name, text.map(str::as_bytes))).collect::<Vec<_>>())
}

fn with_bytes(parts: &[(&str, Option<&[u8]>)]) -> Vec<u8> {
    let mut from = zip::ZipArchive::new(Cursor::new(FAR)).unwrap();
    let mut to = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let mut all: Vec<(String, Option<Vec<u8>>)> = Vec::new();
    for index in 0..from.len() {
        let mut part = from.by_index(index).unwrap();
        let mut text = Vec::new();
        part.read_to_end(&mut text).unwrap();
        all.push((part.name().unwrap().into_owned(), Some(text)));
    }
    for (name, text) in parts {
        all.retain(|(other, _)| other != name);
        all.push(((*name).to_owned(), text.map(<[u8]>::to_vec)));
    }
    for (name, text) in all {
        if let Some(text) = text {
            to.start_file(name, SimpleFileOptions::default()).unwrap();
            to.write_all(&text).unwrap();
        }
    }
    to.finish().unwrap().into_inner()
}

fn sheet(dimension: &str, rows: &str) -> Vec<u8> {
    let text = format!("<worksheet><dimension ref=\"{dimension}\"/><sheetData>{rows}</sheetData></worksheet>");
    with(&[("xl/worksheets/sheet1.xml", Some(&text))])
}

const TWO_ROWS: &str = "<row r=\"1\"><c r=\"A1\"><v>1</v></c></row><row r=\"2\"><c r=\"A2\"><v>2</v></c></row>";

#[test]
fn dimensions_and_empty_cells_cost_nothing() {
    for dimension in ["A1", "A1:B2", "A1:XFD1048576", "C5:D6"] {
        assert_eq!(xlsx(&sheet(dimension, TWO_ROWS), None).unwrap().rows.len(), 2, "{dimension}");
    }
    let far = format!("{TWO_ROWS}<row r=\"1048576\"><c r=\"XFD1048576\" s=\"0\"/></row>");
    assert_eq!(xlsx(&sheet("A1", &far), None).unwrap().rows.len(), 2);
    let wide: String = (1..3).map(|n| format!("<row r=\"{n}\"><c r=\"ALL{n}\"><v>1</v></c></row>")).collect();
    let cells = xlsx(&sheet("A1", &wide), None).unwrap();
    assert!(cells.rows.iter().all(|(_, row)| row.len() == 1000));
    let too_wide = wide.replace("ALL", "ALM");
    assert!(refused(&sheet("A1", &too_wide), None).contains("cell ALM1 is filled, expected at most 1000 columns"));
    assert!(refused(&sheet("B2:A1", TWO_ROWS), None).contains("has ref=\"B2:A1\", which is impossible"));
}

#[test]
fn impossible_positions_are_refused() {
    let row = |cells: &str| sheet("A1", &format!("{TWO_ROWS}<row r=\"3\">{cells}</row>"));
    let cell = |at: &str| format!("<c r=\"{at}\"><v>1</v></c>");
    assert!(refused(&row(&(cell("A3") + &cell("A3"))), None).contains("cell A3 is repeated or out of order"));
    assert!(refused(&row(&(cell("B3") + &cell("A3"))), None).contains("cell A3 is repeated or out of order"));
    assert!(refused(&row(&cell("A1")), None).contains("cell A1 is repeated or out of order"));
    for at in ["AAAAAAA1", "A99999999999", "ZZZZ1", "A00000001"] {
        assert!(refused(&row(&cell(at)), None).contains("which is impossible"), "{at}");
    }
    for at in ["A0", "1", "A", "A-1", ""] {
        assert!(refused(&row(&cell(at)), None).contains("cannot be read"), "{at}");
    }
    // Without declared positions, cells and rows are consecutive.
    let plain = sheet("A1", "<row><c><v>1</v></c><c><v>2</v></c></row><row/><row><c><v>3</v></c></row>");
    let rows = xlsx(&plain, None).unwrap().rows;
    assert_eq!(rows, [(1, vec!["1".to_owned(), "2".to_owned()]), (3, vec!["3".to_owned(), String::new()])]);
}

#[test]
fn wrong_or_missing_files_of_the_archive_are_refused() {
    assert!(refused(&with(&[("xl/worksheets/sheet1.xml", None)]), None).contains("\"Sheet\" cannot be read"));
    assert!(refused(&with(&[("xl/worksheets/sheet1.xml", Some("<worksheet>"))]), None).contains("cannot be read"));
    assert!(refused(&with(&[("xl/workbook.xml", None)]), None).contains("no sheet holds two rows"));
    assert!(refused(&sheet("A1", ""), Some("Sheet")).contains("is empty"));
    let strings = |sst: &str| with(&[("xl/sharedStrings.xml", Some(sst))]);
    let wrong = strings("<sst uniqueCount=\"900000000000000\"><si><t>a</t></si></sst>");
    assert!(refused(&wrong, None).contains("has uniqueCount=\"900000000000000\", which is impossible"));
    let missing = with(&[
        ("xl/sharedStrings.xml", Some("<sst uniqueCount=\"1\"><si><t>a</t></si></sst>")),
        (
            "xl/worksheets/sheet1.xml",
            Some("<worksheet><sheetData><row r=\"1\"><c t=\"s\"><v>5</v></c></row></sheetData></worksheet>"),
        ),
    ]);
    assert!(refused(&missing, None).contains("cannot be read"));
    // The long font name is copied for each of many styles.
    let font = format!("<fonts><font><name val=\"{}\"/></font></fonts>", "x".repeat(1 << 20));
    let styles = format!("<styleSheet>{font}<cellXfs>{}</cellXfs></styleSheet>", "<xf fontId=\"0\"/>".repeat(1000));
    let copied = with(&[("xl/styles.xml", Some(&styles))]);
    assert!(refused(&copied, None).contains("styles and sheets with names of"));
    let utf_16: Vec<u8> =
        "\u{feff}<sst uniqueCount=\"900000000000000\"/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(
        refused(&with_bytes(&[("xl/sharedStrings.xml", Some(&utf_16))]), None).contains("is not a readable workbook")
    );
    assert!(refused(b"PK\x03\x04", None).contains("the workbook is damaged"));
    assert!(refused(b"", None).contains("found no ZIP archive"));
    assert!(refused(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", None).contains("with a password or of the old .xls"));
}

#[test]
fn an_encrypted_part_is_refused() {
    // Sets the flag for encryption in the headers of all files of the archive.
    let mut bytes = LOG.to_vec();
    for at in 0..bytes.len() - 8 {
        match &bytes[at..at + 4] {
            b"PK\x03\x04" => bytes[at + 6] |= 1,
            b"PK\x01\x02" => bytes[at + 8] |= 1,
            _ => (),
        }
    }
    let message = refused(&bytes, None);
    assert!(message.contains("damaged") && message.to_lowercase().contains("password"), "{message}");
}

#[test]
fn a_workbook_cut_off_anywhere_is_refused() {
    for at in 0..FAR.len() {
        assert!(xlsx(&FAR[..at], None).is_err(), "cut at {at}");
    }
}
