//! Candidates from a CSV file or stdin.

use super::source::{Source, column_indices, open};
use motorfit::text::printable;
use motorfit::{Error, Result};
use std::io::Read;
use std::path::Path;

pub(super) struct Table {
    reader: csv::Reader<Capped>,
    name: String,
    indices: Vec<(String, usize)>,
}

impl Table {
    pub(super) fn open(path: &Path, names: &[String]) -> Result<Self> {
        let name = path.display().to_string();
        let input: Box<dyn Read + Send> = if name == "-" { Box::new(std::io::stdin()) } else { Box::new(open(path)?) };
        let input = Capped { input, line: 0 };
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(input);
        let heading = reader.headers().map_err(|e| broken(&name, &e))?;
        let columns: Vec<&str> = heading.iter().map(|cell| cell.trim_start_matches('\u{feff}')).collect();
        let indices = column_indices(&format!("{name}, line 1"), &columns, names)?;
        Ok(Self { reader, name, indices })
    }
}

impl Source for Table {
    fn count(&self) -> Option<u64> {
        None
    }

    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()> {
        let Self { reader, name, indices } = self;
        let mut row = csv::StringRecord::new();
        while values.len() < most * width && reader.read_record(&mut row).map_err(|e| broken(name, &e))? {
            let line = row.position().map_or(0, csv::Position::line);
            for (column, index) in indices.iter() {
                let cell = row.get(*index).unwrap_or_default();
                values.push(motorfit::record::parse_number(cell, false).map_err(|found| {
                    let message = format!("{name}, line {line}, column {column}: {found}");
                    Error::data(message, "Give a number in SI units.")
                })?);
            }
        }
        Ok(())
    }
}

fn broken(name: &str, error: &csv::Error) -> Error {
    Error::data(format!("{name}: {}", printable(&error.to_string())), "Give a CSV with a heading and numbers.")
}

/// Largest length of a line \[bytes\]. The CSV reader keeps a line in memory.
const LINE_MAX: usize = 64 << 10;

/// A reader that fails on lines longer than [`LINE_MAX`].
struct Capped {
    input: Box<dyn Read + Send>,
    /// Length of the current line up to now \[bytes\].
    line: usize,
}

impl Read for Capped {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let count = self.input.read(bytes)?;
        self.line = match bytes[..count].iter().rposition(|b| matches!(b, b'\n' | b'\r')) {
            Some(end) => count - end - 1,
            None => self.line + count,
        };
        if self.line > LINE_MAX {
            return Err(std::io::Error::other(format!("a line of more than {LINE_MAX} bytes")));
        }
        Ok(count)
    }
}
