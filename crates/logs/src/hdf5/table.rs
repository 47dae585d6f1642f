//! Choice of the datasets of an HDF5 file that form a table.

use super::super::cells::{number, shortened};
use super::datatype::parts;
use super::limits::CHANNELS_MAX;
use super::variable::Variable;
use super::walk::Contents;
use hdf5_reader::Hdf5File;
use hdf5_reader::io::Cursor;
use motorfit_core::text::{counted, excerpt};
use motorfit_core::{Error, Result};
use std::collections::BTreeMap;

/// Largest number of notes of one kind.
const NOTES_MAX: usize = 20;

/// Datasets of equal length.
pub(super) struct Table {
    pub variables: Vec<Variable>,
    /// Number of rows that are read, which is less than that of the datasets if the file is cut off.
    pub rows: usize,
    pub constants: Vec<(String, f64)>,
    pub notes: Vec<String>,
    /// True if the end of the file is lost.
    pub is_cut: bool,
}

/// Chooses the columns of the most frequent length. Scalars become constants; they and all other datasets are named in
/// notes. `length` is the size of the file \[bytes\].
///
/// # Errors
/// Returns a `Data` error if there are no vectors or too many columns.
pub(super) fn table(file: &Hdf5File, mut contents: Contents, length: u64) -> Result<Table> {
    let block = file.superblock();
    let (end, mut notes) = (block.eof_address, Vec::new());
    let is_cut = end > length && !Cursor::is_undefined_offset(end, block.offset_size);
    if is_cut {
        contents = without_lost(file, contents);
    }
    let (scalars, vectors): (Vec<_>, Vec<_>) = contents.variables.into_iter().partition(|v| v.table.rows() == 1);
    contents.variables = vectors;
    let mut counts = BTreeMap::new();
    for variable in &contents.variables {
        *counts.entry(variable.table.rows()).or_insert(0) += variable.columns.len();
    }
    // `max_by_key` returns the last maximum: of equally frequent lengths the longest one.
    let Some((&length_of_most, &width)) = counts.iter().max_by_key(|(_, columns)| **columns) else {
        return Err(no_vectors(&contents, &scalars));
    };
    if width > CHANNELS_MAX {
        let message = format!("found {width} columns of {length_of_most} values, expected at most {CHANNELS_MAX}");
        return Err(Error::data(message, "Save the vectors of one recording alone."));
    }
    let (variables, others): (Vec<_>, Vec<_>) =
        contents.variables.into_iter().partition(|variable| variable.table.rows() == length_of_most);
    let rows = variables.iter().map(|variable| variable.complete).min().unwrap_or(0);
    if is_cut {
        let lost = length_of_most - rows.min(length_of_most);
        let lost = if lost == 0 { String::new() } else { format!("; {} after {rows} lost", counted(lost, "row")) };
        notes.push(format!("the file is cut off after {length} of {end} bytes{lost}"));
    }
    if block.version >= 2 && block.consistency_flags & 1 != 0 {
        notes.push("the file was not closed by the program that wrote it; its last rows may be missing".to_owned());
    }
    let other = |other: &Variable| {
        let columns = if other.columns.len() == 1 { String::new() } else { format!("{} × ", other.columns.len()) };
        format!("{}: {columns}{} values, others have {length_of_most}", excerpt(&other.name), other.table.rows())
    };
    notes.extend(shortened(others.iter().map(other).collect(), NOTES_MAX));
    let (constants, of_constants) = constants(file, &scalars);
    notes.extend(shortened(of_constants, NOTES_MAX));
    notes.extend(shortened(contents.ignored, NOTES_MAX));
    Ok(Table { variables, rows, constants, notes, is_cut })
}

/// Counts the complete rows of the datasets of a file that is cut off, and leaves out those without.
fn without_lost(file: &Hdf5File, mut contents: Contents) -> Contents {
    for variable in &mut contents.variables {
        variable.complete = variable.table.complete_rows(file);
    }
    let (kept, lost): (Vec<_>, Vec<_>) = contents.variables.into_iter().partition(|variable| variable.complete > 0);
    contents.variables = kept;
    let lost = lost.iter().map(|variable| format!("{}: lost, the file is cut off", excerpt(&variable.name)));
    contents.ignored.extend(lost);
    contents
}

/// Returns the values of scalars and of numeric attributes of the file, and notes on them.
fn constants(file: &Hdf5File, scalars: &[Variable]) -> (Vec<(String, f64)>, Vec<String>) {
    let (mut constants, mut notes) = (Vec::new(), Vec::new());
    for scalar in scalars {
        let of_columns: Vec<_> = scalar.columns.iter().map(|column| column.part).collect();
        match scalar.table.read(file, &of_columns, 1, false) {
            Ok(values) => {
                let values = values.into_iter().filter_map(|column| column.first().copied());
                constants.extend(scalar.columns.iter().map(|column| column.name.clone()).zip(values));
            }
            Err(error) => notes.push(format!("{}: not readable: {error}", excerpt(&scalar.name))),
        }
    }
    let attributes = file.root_group().and_then(|root| root.raw_attributes()).unwrap_or_default();
    for attribute in attributes {
        let message = attribute.message();
        let number = parts(attribute.raw_datatype(), "/").and_then(|parts| match &parts.leaves[..] {
            [leaf] if parts.others.is_empty() && message.dataspace.num_elements().is_ok_and(|count| count == 1) => {
                leaf.number.value(message.raw_data.get(leaf.offset..)?)
            }
            _ => None,
        });
        constants.extend(number.map(|number| (message.name.clone(), number)));
    }
    notes.extend(constants.iter().map(|(name, value)| format!("{}: 1 value, {}", excerpt(name), number(*value))));
    (constants, notes)
}

/// Returns the error for a file without vectors, with its contents.
fn no_vectors(contents: &Contents, scalars: &[Variable]) -> Error {
    let scalars = scalars.iter().map(|scalar| format!("{}: 1 value", excerpt(&scalar.name)));
    let found: Vec<String> = scalars.chain(contents.ignored.iter().cloned()).collect();
    let found = if found.is_empty() { "nothing".to_owned() } else { shortened(found, 5).join("; ") };
    let remedy = if contents.objects {
        "Save the data of objects as vectors, for a timeseries ts: t = ts.Time; v = ts.Data; \
         save('file.mat','t','v','-v7'), for a timetable or table tt: v = tt.v, and so on."
    } else {
        "Save time, voltage, current and speed as vectors of equal length, with h5py: file['speed'] = speed, \
         in MATLAB: save('file.mat','t','v','i','w','-v7')."
    };
    Error::data(format!("no vector of at least 2 numbers; found {found}"), remedy)
}
