//! Candidates from a Parquet file, read page by page.

use super::source::{Source, column_indices, open};
use motorfit::text::excerpt;
use motorfit::{Error, Result};
use motorfit_logs::Table as Reader;
use std::path::Path;

pub(super) struct Table {
    reader: Reader,
    name: String,
    parameters: Vec<String>,
    /// Rows read before.
    rows: u64,
}

impl Table {
    pub(super) fn open(path: &Path, names: &[String]) -> Result<Self> {
        let name = path.display().to_string();
        let mut reader = Reader::open(Box::new(open(path)?)).map_err(|e| broken(&name, &e))?;
        let columns = reader.columns();
        let paths: Vec<&str> = columns.iter().map(|column| column.path.as_str()).collect();
        let indices = column_indices(&name, &paths, names)?;
        for (parameter, index) in &indices {
            let column = &columns[*index];
            if !column.is_of_numbers() {
                let message = format!("{name}, column {parameter}: is {}, expected numbers", excerpt(&column.kind));
                return Err(Error::data(message, "Write the column as DOUBLE or FLOAT, in SI units."));
            }
        }
        let (parameters, indices): (Vec<_>, Vec<_>) = indices.into_iter().unzip();
        reader.choose(&indices).map_err(|e| broken(&name, &e))?;
        Ok(Self { reader, name, parameters, rows: 0 })
    }
}

impl Source for Table {
    fn count(&self) -> Option<u64> {
        Some(self.reader.rows())
    }

    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()> {
        let first = values.len();
        let count = self.reader.next(most).map_err(|e| broken(&self.name, &e))?;
        values.resize(first + count * width, 0.0);
        for (n, parameter) in self.parameters.iter().enumerate() {
            let column = self.reader.values(n);
            if let Some(row) = column.iter().position(|value| !value.is_finite()) {
                let row = self.rows + row as u64 + 1;
                let message = format!("{}, row {row}, column {parameter}: null or not finite", self.name);
                return Err(Error::data(message, "Give a number in SI units."));
            }
            let own = values[first..].iter_mut().skip(n).step_by(width);
            own.zip(column).for_each(|(value, read)| *value = *read);
        }
        self.rows += count as u64;
        Ok(())
    }
}

fn broken(name: &str, error: &Error) -> Error {
    let message = format!("{name}: cannot be read as Parquet: {error}");
    Error::data(message, "Write the file again, uncompressed or with Snappy or Zstandard.")
}
