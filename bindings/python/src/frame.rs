//! Conversion of mappings, structured arrays, pandas and polars frames to CSV text, so that their headings are read by the
//! rules for files, and of columns to frames.

use crate::arrays;
use crate::errors::exception;
use numpy::PyUntypedArrayMethods as _;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::fmt::Write as _;

/// Cells of a column.
enum Cells {
    Numbers(Vec<f64>),
    Words(Vec<String>),
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Words(words) => words.len(),
        }
    }
}

/// Frame converted to CSV.
pub struct Frame {
    /// CSV text; numbers are written with all digits and are read back without error.
    pub text: String,
    /// Hints for errors: columns of timestamps or durations, and a named index.
    hints: Vec<String>,
}

impl Frame {
    /// Converts a frame or a mapping of columns.
    ///
    /// # Errors
    /// Returns `TypeError` for another object; `ValueError` for columns of different lengths or more than one dimension.
    pub fn new(frame: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut hints = Vec::new();
        let mut columns = Vec::new();
        for label in labels(frame)? {
            let name = plain(&label.str()?.to_string());
            let located = |error: PyErr| {
                PyErr::from_type(error.get_type(frame.py()), format!("column {name:?}: {}", error.value(frame.py())))
            };
            let column = frame.get_item(&label)?;
            let array = frame.py().import("numpy")?.call_method1("asarray", (&column,)).map_err(located)?;
            let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
            if matches!(kind.as_str(), "m" | "M") {
                let what = if kind == "m" { "durations" } else { "timestamps" };
                hints.push(format!("{name:?} holds {what}; (t - t[0]) / numpy.timedelta64(1, \"s\") gives seconds"));
            }
            columns.push((name.clone(), cells(&column, &array, &kind).map_err(located)?));
        }
        let index = frame.getattr("index").and_then(|index| index.getattr("name")).ok().filter(|name| !name.is_none());
        hints.extend(index.map(|name| format!("The index {name} is not a column; frame.reset_index() makes it one")));
        // Numeric columns go first, because a line that begins with text could be read as a comment.
        columns.sort_by_key(|(_, cells)| matches!(cells, Cells::Words(_)));
        Ok(Self { text: text(&columns)?, hints })
    }

    /// Converts an error of reading the CSV text: line numbers become row numbers, and the hints are added.
    pub fn error(&self, py: Python<'_>, error: &motorfit::Error) -> PyErr {
        let hint = self.hints.iter().fold(error.hint().clone(), |all, hint| all.and(format!(" {hint}.")));
        let mut of_frame = motorfit::Error::new(error.kind(), error.message(), hint);
        if let Some(line) = error.line() {
            of_frame = of_frame.in_part(&format!("row {}", line.saturating_sub(2)));
        }
        if let Some(column) = error.column() {
            of_frame = of_frame.in_column(column);
        }
        exception(py, &of_frame)
    }
}

/// Makes a frame of columns; without a `library` of pandas, or of polars if pandas is not installed.
///
/// # Errors
/// Returns `ImportError` if the library is not installed, `ValueError` for another one.
pub fn framed<'py>(columns: &Bound<'py, PyAny>, library: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
    columns.py().import("motorfit._frames")?.call_method1("frame", (columns, library))
}

/// Returns the labels of the columns.
fn labels<'py>(frame: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let is_mapping = || frame.is_instance(&frame.py().import("collections.abc")?.getattr("Mapping")?);
    let names =
        || frame.getattr("dtype").and_then(|dtype| dtype.getattr("names")).ok().filter(|names| !names.is_none());
    let labels = match frame.getattr("columns").ok().or_else(names) {
        Some(labels) => labels,
        None if is_mapping()? => frame.call_method0("keys")?,
        None => {
            let kind = frame.get_type().name()?;
            return Err(PyTypeError::new_err(format!("give a mapping of columns or a frame, not a {kind}")));
        }
    };
    labels.try_iter()?.collect()
}

fn text(columns: &[(String, Cells)]) -> PyResult<String> {
    let rows = columns.first().map_or(0, |(_, cells)| cells.len());
    if let Some((name, cells)) = columns.iter().find(|(_, cells)| cells.len() != rows) {
        let (first, count) = (&columns[0].0, cells.len());
        return Err(PyValueError::new_err(format!("column {name:?} has {count} rows, {first:?} has {rows}")));
    }
    let mut text = columns.iter().map(|(name, _)| quoted(name)).collect::<Vec<_>>().join(",") + "\n";
    for row in 0..rows {
        for (place, (_, cells)) in columns.iter().enumerate() {
            if place > 0 {
                text.push(',');
            }
            match cells {
                Cells::Numbers(values) => {
                    let _ = write!(text, "{}", values[row]);
                }
                Cells::Words(words) => text.push_str(&quoted(&words[row])),
            }
        }
        text.push('\n');
    }
    Ok(text)
}

fn cells(column: &Bound<'_, PyAny>, array: &Bound<'_, PyAny>, kind: &str) -> PyResult<Cells> {
    if matches!(kind, "f" | "i" | "u") {
        return arrays::signal(column, "it").map(Cells::Numbers);
    }
    if array.cast::<numpy::PyUntypedArray>()?.ndim() != 1 {
        return Err(PyValueError::new_err("it has more than one dimension; give one value per row"));
    }
    let listed = if matches!(kind, "m" | "M") { array.call_method1("astype", ("str",))? } else { array.clone() };
    let words = listed.call_method0("tolist")?.try_iter()?.map(|cell| Ok(plain(&cell?.str()?.to_string())));
    words.collect::<PyResult<_>>().map(Cells::Words)
}

/// Returns a text on one line, without leading characters that would begin a comment.
fn plain(word: &str) -> String {
    word.replace(['\n', '\r'], " ").trim_start_matches(['#', '%', ' ']).to_owned()
}

fn quoted(word: &str) -> String {
    let plain = !word.contains([',', '"', '\n', '\r', ';', '\t']);
    if plain { word.to_owned() } else { format!("\"{}\"", word.replace('"', "\"\"")) }
}
