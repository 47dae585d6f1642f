//! Columns of the numeric datasets of HDF5 files.

use super::data::{Part, Table};
use super::datatype::{Leaf, parts};
use super::filter::supported;
use hdf5_reader::messages::HdfMessage;
use hdf5_reader::object_header::ObjectHeader;
use hdf5_reader::{Attribute, Dataset};

/// Largest number of columns of a matrix.
pub(super) const MATRIX_MAX: u64 = 64;
/// Length of the longest unit \[bytes\].
const UNIT_MAX: usize = 64;

/// Largest sizes of a dataset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub values_max: u64,
    pub bytes_max: u64,
}

/// A numeric dataset.
pub(super) struct Variable {
    pub name: String,
    pub table: Table,
    pub columns: Vec<Column>,
    /// Factor and offset of packed numbers, after the conventions of netCDF: the value is the factor times the number, plus the offset.
    pub packing: Option<[f64; 2]>,
    /// Number of rows before the first that is lost.
    pub complete: usize,
}

/// A column of numbers.
pub(super) struct Column {
    pub name: String,
    pub unit: Option<String>,
    pub part: Part,
}

/// A variable if there are numbers, and paths and descriptions of what is not numeric.
pub(super) type Found = (Option<Variable>, Vec<(String, &'static str)>);

/// Returns the columns of a dataset, whose header is `header`. `matlab` is true for a MAT-file.
///
/// # Errors
/// Returns a description of a dataset that has no columns.
pub(super) fn variable(
    dataset: Dataset,
    header: &ObjectHeader,
    name: &str,
    attributes: &[Attribute],
    (matlab, limits): (bool, Limits),
) -> Result<Found, String> {
    let message = dataset.raw_datatype().map_err(|error| format!("not readable: {error}"))?;
    let parts = parts(&message, if matlab { "." } else { "/" }).ok_or("a damaged type")?;
    let mut others: Vec<_> = parts.others.into_iter().map(|(path, what)| (format!("{name}{path}"), what)).collect();
    if parts.leaves.is_empty() {
        return Ok((None, others));
    }
    for message in &header.messages {
        match message {
            HdfMessage::ExternalFiles(_) => return Err("its values are in another file".to_owned()),
            HdfMessage::FilterPipeline(pipeline) => supported(pipeline)?,
            _ => {}
        }
    }
    let count = dataset.num_elements().map_err(|error| format!("not readable: {error}"))?;
    if count == 0 {
        return Err("empty".to_owned());
    }
    let (row, column) = dimensions(dataset.shape(), matlab)?;
    if count > limits.values_max {
        return Err(format!("{count} values, expected at most {}", limits.values_max));
    }
    if count.saturating_mul(parts.size as u64) > limits.bytes_max {
        return Err(format!("{count} values, more than a file of this size is expected to hold"));
    }
    if column.is_some() && parts.leaves.iter().any(|leaf| !leaf.path.is_empty()) {
        return Err(format!("a matrix of {} numbers each", parts.leaves.len()));
    }
    let is_integer = parts.leaves.iter().all(|leaf| leaf.number.is_integer());
    let packing = packing(attributes, is_integer)?;
    if packing.is_none() && attributes.iter().any(|attribute| is_scale(attribute) || is_unclear(attribute)) {
        others.push((name.to_owned(), "read as stored: its attribute of a scale has no agreed meaning"));
    }
    if parts.leaves.iter().any(|leaf| leaf.path.starts_with("/values_block_")) {
        others.push((name.to_owned(), "pandas hides the names of the columns: save it with data_columns=True"));
    }
    let units = units(attributes);
    let table = Table { dataset, row, column, size: parts.size };
    let columns = columns(name, &table, &parts.leaves, (matlab, &units));
    let complete = table.rows();
    Ok((Some(Variable { name: name.to_owned(), table, columns, packing, complete }), others))
}

fn columns(name: &str, table: &Table, leaves: &[Leaf], (matlab, units): (bool, &[String])) -> Vec<Column> {
    let width = table.columns();
    let total = width * leaves.len();
    let mut columns = Vec::new();
    for column in 0..width {
        for Leaf { path, offset, number } in leaves {
            let name = match table.column {
                None => format!("{name}{path}"),
                Some(_) if matlab => format!("{name}(:,{})", column + 1),
                Some(_) => format!("{name}[{column}]"),
            };
            let unit = match units {
                [unit] => Some(unit),
                units if units.len() == total => units.get(columns.len()),
                _ => None,
            };
            let unit = unit.filter(|unit| !unit.is_empty()).cloned();
            columns.push(Column { name, unit, part: Part { column, offset: *offset, number: *number } });
        }
    }
    columns
}

/// Returns the dimensions of a dataset that count rows and columns.
///
/// # Errors
/// Returns a description of a shape that is neither a vector nor a matrix of few columns.
fn dimensions(shape: &[u64], matlab: bool) -> Result<(Option<usize>, Option<usize>), String> {
    let shown = || {
        let shown = shape.iter().map(u64::to_string);
        let shown: Vec<String> = if matlab { shown.rev().collect() } else { shown.collect() };
        shown.join(" × ")
    };
    // Dimensions of 1 are ignored: 1 × 1 × N values are a vector.
    let long: Vec<(usize, u64)> = shape.iter().copied().enumerate().filter(|&(_, size)| size > 1).collect();
    let (row, column, width) = match long[..] {
        [] => return Ok((None, None)),
        [(row, _)] => return Ok((Some(row), None)),
        [(column, width), (row, _)] if matlab => (row, column, width),
        [(row, _), (column, width)] => (row, column, width),
        _ => return Err(format!("{} values, expected a vector or a matrix", shown())),
    };
    if width > MATRIX_MAX {
        return Err(format!("{} values, expected at most {MATRIX_MAX} columns; transpose it to use it", shown()));
    }
    Ok((Some(row), Some(column)))
}

/// Names of attributes by which integers are multiplied, and of others whose meaning is not clear, in lower case.
const SCALES: [&str; 5] = ["scale", "scaling", "factor", "multiplier", "lsb"];
const UNCLEAR: [&str; 3] = ["gain", "calibration", "sensitivity"];

fn is_scale(attribute: &Attribute) -> bool {
    SCALES.contains(&attribute.name.to_ascii_lowercase().as_str())
}

fn is_unclear(attribute: &Attribute) -> bool {
    UNCLEAR.contains(&attribute.name.to_ascii_lowercase().as_str())
}

/// Returns factor and offset of packed numbers, after the conventions of netCDF or, of integers, by another name of a scale; `None` for
/// numbers that are not packed.
///
/// # Errors
/// Returns a description of an attribute of netCDF that is no number.
fn packing(attributes: &[Attribute], is_integer: bool) -> Result<Option<[f64; 2]>, String> {
    let number = |attribute: &Attribute| attribute.read_as_f64().ok().filter(|value| value.is_finite());
    let of = |name: &str| {
        let attribute = attributes.iter().find(|attribute| attribute.name == name);
        attribute.map(|attribute| number(attribute).ok_or_else(|| format!("its {name} is no number"))).transpose()
    };
    let (factor, offset) = (of("scale_factor")?, of("add_offset")?);
    if factor.is_some() || offset.is_some() {
        return Ok(Some([factor.unwrap_or(1.0), offset.unwrap_or(0.0)]));
    }
    let scale = attributes.iter().find(|attribute| is_integer && is_scale(attribute)).and_then(number);
    Ok(scale.map(|factor| [factor, 0.0]))
}

/// Returns the units in the attributes of a dataset: one, or one for each column.
fn units(attributes: &[Attribute]) -> Vec<String> {
    let unit = |attribute: &&Attribute| ["unit", "units"].contains(&attribute.name.to_ascii_lowercase().as_str());
    let texts = attributes.iter().find(unit).and_then(|attribute| attribute.read_strings().ok()).unwrap_or_default();
    let usable = |text: String| if text.len() > UNIT_MAX { String::new() } else { text.trim().to_owned() };
    texts.into_iter().map(usable).collect()
}

/// Returns the text of an attribute.
pub(super) fn text(attributes: &[Attribute], name: &str) -> Option<String> {
    let attribute = attributes.iter().find(|attribute| attribute.name == name)?;
    attribute.read_strings().ok()?.into_iter().next()
}
