//! Candidates from a Parquet file, read page by page.

use super::source::{Source, column_indices, open};
use motorfit::numeric;
use motorfit::text::excerpt;
use motorfit::{Error, Result};
use parquet::basic::{ConvertedType, LogicalType, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub(super) struct Table {
    reader: SerializedFileReader<File>,
    name: String,
    indices: Vec<(String, usize)>,
    /// Column readers of the current row group.
    columns: Vec<ColumnReader>,
    /// Unread rows of the current row group.
    left: usize,
    /// Index of the next row group.
    group: usize,
    /// Rows read before.
    rows: u64,
}

impl Table {
    pub(super) fn open(path: &Path, names: &[String]) -> Result<Self> {
        let name = path.display().to_string();
        guarded(&name, || Self::open_as(path, name.clone(), names))
    }

    fn open_as(path: &Path, name: String, names: &[String]) -> Result<Self> {
        let reader = SerializedFileReader::new(open(path)?).map_err(|e| broken(&name, &e))?;
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        let paths: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
        let columns: Vec<&str> = paths.iter().map(String::as_str).collect();
        let indices = column_indices(&name, &columns, names)?;
        for (parameter, index) in &indices {
            let column = schema.column(*index);
            // Old files give the meaning of integers as a converted type only.
            let means_numbers = match column.logical_type_ref() {
                None => matches!(
                    column.converted_type(),
                    ConvertedType::NONE
                        | ConvertedType::INT_8
                        | ConvertedType::INT_16
                        | ConvertedType::INT_32
                        | ConvertedType::INT_64
                ),
                Some(LogicalType::Integer(int)) => int.is_signed,
                Some(_) => false,
            };
            let numbers = matches!(column.physical_type(), Type::DOUBLE | Type::FLOAT | Type::INT32 | Type::INT64);
            if !(numbers && means_numbers) || column.max_rep_level() > 0 {
                let kind = column.converted_type();
                let found = format!("{} {kind}", column.physical_type());
                let message = format!("{name}, column {parameter}: is {}, expected numbers", excerpt(&found));
                return Err(Error::data(message, "Write the column as DOUBLE or FLOAT, in SI units."));
            }
        }
        Ok(Self { reader, name, indices, columns: Vec::new(), left: 0, group: 0, rows: 0 })
    }

    fn append(&mut self, most: usize, values: &mut Vec<f64>) -> Result<()> {
        while self.left == 0 {
            if self.group == self.reader.num_row_groups() {
                return Ok(());
            }
            let group = self.reader.get_row_group(self.group).map_err(|e| broken(&self.name, &e))?;
            let columns = self.indices.iter().map(|(_, index)| group.get_column_reader(*index));
            self.columns = columns.collect::<std::result::Result<_, _>>().map_err(|e| broken(&self.name, &e))?;
            self.left = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            self.group += 1;
        }
        let (count, width) = (most.min(self.left), self.indices.len());
        let first = values.len();
        values.resize(first + count * width, 0.0);
        for (n, (parameter, _)) in self.indices.iter().enumerate() {
            let column = read(&mut self.columns[n], count).map_err(|e| broken(&self.name, &e))?;
            if let Some(row) = column.iter().position(|value| !value.is_finite()) {
                let row = self.rows + row as u64 + 1;
                let message = format!("{}, row {row}, column {parameter}: null or not finite", self.name);
                return Err(Error::data(message, "Give a number in SI units."));
            }
            let own = values[first..].iter_mut().skip(n).step_by(width);
            own.zip(column).for_each(|(value, read)| *value = read);
        }
        self.left -= count;
        self.rows += count as u64;
        Ok(())
    }
}

impl Source for Table {
    fn count(&self) -> Option<u64> {
        Some(u64::try_from(self.reader.metadata().file_metadata().num_rows()).unwrap_or(0))
    }

    fn next(&mut self, most: usize, _: usize, values: &mut Vec<f64>) -> Result<()> {
        let name = self.name.clone();
        guarded(&name, || self.append(most, values))
    }
}

/// Reads the next `count` numbers of a column, NaN for a null.
fn read(column: &mut ColumnReader, count: usize) -> std::result::Result<Vec<f64>, ParquetError> {
    match column {
        ColumnReader::DoubleColumnReader(reader) => numbers(reader, count, |v| v),
        ColumnReader::FloatColumnReader(reader) => numbers(reader, count, f64::from),
        ColumnReader::Int32ColumnReader(reader) => numbers(reader, count, f64::from),
        ColumnReader::Int64ColumnReader(reader) => numbers(reader, count, numeric::real),
        _ => Ok(vec![f64::NAN; count]),
    }
}

fn numbers<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    count: usize,
    number: impl Fn(T::T) -> f64,
) -> std::result::Result<Vec<f64>, ParquetError> {
    let (mut values, mut levels) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let (records, _, _) = reader.read_records(count, Some(&mut levels), None, &mut values)?;
    if records < count {
        return Err(ParquetError::EOF(format!("{records} rows, expected {count}")));
    }
    if values.len() == count {
        return Ok(values.into_iter().map(number).collect());
    }
    let present = levels.iter().copied().max().unwrap_or(0).max(1);
    let mut numbers = values.into_iter().map(number);
    let next = |level| if level == present { numbers.next().unwrap_or(f64::NAN) } else { f64::NAN };
    Ok(levels.into_iter().map(next).collect())
}

/// Runs `work` and returns a panic in it as an error, without a message on stderr: the reader panics on some damaged files.
fn guarded<T>(name: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let done = catch_unwind(AssertUnwindSafe(work));
    std::panic::set_hook(hook);
    done.unwrap_or_else(|_| Err(broken(name, &"its contents are inconsistent")))
}

fn broken(name: &str, error: &dyn std::fmt::Display) -> Error {
    let message = format!("{name}: cannot be read as Parquet: {}", excerpt(&error.to_string()));
    Error::data(message, "Write the file again, uncompressed or with Snappy or Zstandard.")
}
