//! HDF5 files, as h5py, PyTables and pandas write them, and MAT-files of level 7.3.
//!
//! A dataset that is a vector is a column; a matrix of at most 64 columns gives several: `name[0]` and so on, in a MAT-file
//! `name(:,1)`. Members of compound elements are columns, too. The path of a dataset is its name: `group/name`, in a
//! MAT-file `structure.field`. The table has the columns of the most frequent length.

mod data;
mod datatype;
mod filter;
mod limits;
mod links;
mod matlab;
mod number;
mod storage;
mod table;
#[cfg(test)]
mod tests;
mod variable;
mod walk;

use super::log::{Channel, Field, Log, Medium, Series};
use data::Part;
use filter::filters;
use hdf5_reader::{Hdf5File, OpenOptions};
use limits::{CHUNK_MAX, UNPACKED_FREE, UNPACKED_RATIO, VALUES_MAX};
use motorfit_core::text::quoted;
use motorfit_core::{Error, Result};
use std::sync::Arc;
use storage::Storage;
use table::{Table, table};
use variable::Limits;
use walk::{contents, damaged};

/// Largest size of the header of a dataset or group \[bytes\].
const HEADER_MAX: usize = 16 << 20;
/// Number of bytes at the start of a file in which the signature is searched.
const START: u64 = 1 << 20;
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
const MATLAB: &[u8] = b"MATLAB 7.3";

/// Returns true if the start of a file is that of an HDF5 file: the signature is at byte 0, 512, 1024, 2048 and so on.
pub(crate) fn is_hdf5(start: &[u8]) -> bool {
    let places = std::iter::once(0).chain(std::iter::successors(Some(512), |at: &usize| at.checked_mul(2)));
    places.map_while(|at| start.get(at..)).any(|bytes| bytes.starts_with(SIGNATURE))
}

/// Opens an HDF5 file or a MAT-file of level 7.3.
///
/// # Errors
/// Returns a `Data` error if the file is damaged, of another format, too large, or has no vectors.
pub(crate) fn open(medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    let storage = Storage::new(medium).map_err(damaged)?;
    let length = hdf5_reader::Storage::len(&storage);
    let start = storage.start(START).map_err(damaged)?;
    let matlab = start.starts_with(MATLAB);
    if !is_hdf5(&start) {
        let what = if matlab { "is a MAT-file that is cut off" } else { "is not an HDF5 file" };
        let hint = "Copy the file again, or save the recording in another format, such as CSV.";
        return Err(Error::data(format!("{what}: found no signature of HDF5"), hint));
    }
    let bytes_max = length.saturating_mul(UNPACKED_RATIO).max(UNPACKED_FREE);
    let chunk_max = usize::try_from(bytes_max).unwrap_or(CHUNK_MAX).min(CHUNK_MAX);
    let options = OpenOptions::default()
        .with_chunk_cache_bytes(0)
        .with_filter_registry(filters(chunk_max))
        .with_max_chunk_bytes(chunk_max)
        .with_max_read_bytes(chunk_max)
        .with_max_object_header_bytes(HEADER_MAX);
    let file = Hdf5File::from_storage_with_options(Arc::new(storage), options).map_err(damaged)?;
    let contents = contents(&file, matlab, Limits { values_max: VALUES_MAX as u64, bytes_max })?;
    let table = table(&file, contents, length)?;
    let columns = (0..).zip(&table.variables);
    let columns = columns.flat_map(|(at, variable)| variable.columns.iter().map(move |column| (at, column)));
    let (places, fields) = columns
        .map(|(at, column)| ((at, column.part), Field { path: column.name.clone(), unit: column.unit.clone() }))
        .unzip();
    let channels = vec![Channel { name: String::new(), fields, count: table.rows as u64, span_s: None }];
    Ok(Box::new(Recording { file, table, places, channels }))
}

/// A table of columns of equal length.
struct Recording {
    file: Hdf5File,
    table: Table,
    /// Dataset and part of its elements for each column.
    places: Vec<(usize, Part)>,
    channels: Vec<Channel>,
}

impl Log for Recording {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let count: usize = requests.iter().map(|(_, fields)| fields.len()).sum();
        if count.saturating_mul(self.table.rows) > VALUES_MAX {
            let message =
                format!("{count} columns of {} values, expected at most {VALUES_MAX} values", self.table.rows);
            return Err(Error::data(message, "Choose fewer columns, or cut the recording."));
        }
        let series = requests.iter().map(|(channel, fields)| match channel {
            0 => Ok(Series { time_s: Vec::new(), columns: self.columns(fields)? }),
            _ => Err(Error::data(format!("no channel {channel}, the file has one table"), "Choose channel 0.")),
        });
        series.collect()
    }

    fn constants(&self) -> &[(String, f64)] {
        &self.table.constants
    }

    fn notes(&self) -> &[String] {
        &self.table.notes
    }
}

impl Recording {
    /// Reads columns, each dataset once.
    fn columns(&self, fields: &[usize]) -> Result<Vec<Vec<f64>>> {
        let place = |field: &usize| {
            let message = || format!("no column {field}, the table has {}", self.places.len());
            self.places.get(*field).ok_or_else(|| Error::data(message(), "Choose one of the columns of the table."))
        };
        let places = fields.iter().map(place).collect::<Result<Vec<_>>>()?;
        let mut columns = vec![Vec::new(); fields.len()];
        for (at, variable) in self.table.variables.iter().enumerate() {
            let wanted = || (0..).zip(&places).filter(|(_, place)| place.0 == at);
            let parts: Vec<Part> = wanted().map(|(_, place)| place.1).collect();
            if parts.is_empty() {
                continue;
            }
            let read = variable.table.read(&self.file, &parts, self.table.rows, self.table.is_cut);
            let read = read.map_err(|error| damaged(format!("dataset {}: {error}", quoted(&variable.name))))?;
            for ((index, _), mut values) in wanted().zip(read) {
                if let Some([factor, offset]) = variable.packing {
                    values.iter_mut().for_each(|value| *value = *value * factor + offset);
                }
                if let Some(column) = columns.get_mut::<usize>(index) {
                    *column = values;
                }
            }
        }
        Ok(columns)
    }
}
