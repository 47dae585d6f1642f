//! Columns from Python as a file would hold them: mappings, pandas and polars frames. Headings are then understood as in
//! files, with their units.

use crate::arrays;
use numpy::PyUntypedArrayMethods as _;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::fmt::Write as _;

/// A column.
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

/// A frame as the text of a CSV file. Numbers are written so that they are read back as they are.
pub fn text(frame: &Bound<'_, PyAny>) -> PyResult<String> {
    let labels = match frame.getattr("columns") {
        Ok(columns) => columns,
        Err(_) => frame.clone(),
    };
    let mut columns = Vec::new();
    for label in labels.try_iter().map_err(|_| PyTypeError::new_err("give a mapping of columns, or a frame"))? {
        let label = label?;
        let cells = cells(&frame.get_item(&label)?)?;
        columns.push((label.str()?.to_string(), cells));
    }
    let rows = columns.first().map_or(0, |(_, cells)| cells.len());
    if let Some((name, cells)) = columns.iter().find(|(_, cells)| cells.len() != rows) {
        let message = format!("column {name:?} has {} rows, the first one {rows}", cells.len());
        return Err(PyValueError::new_err(message));
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

fn cells(column: &Bound<'_, PyAny>) -> PyResult<Cells> {
    let array = column.py().import("numpy")?.call_method1("asarray", (column,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if matches!(kind.as_str(), "f" | "i" | "u") {
        return arrays::signal(column, "a column").map(Cells::Numbers);
    }
    if array.cast::<numpy::PyUntypedArray>()?.ndim() != 1 {
        return Err(PyValueError::new_err("a column has more than one axis; give a value per row"));
    }
    let words = array.call_method0("tolist")?.try_iter()?.map(|cell| Ok(cell?.str()?.to_string()));
    words.collect::<PyResult<_>>().map(Cells::Words)
}

fn quoted(word: &str) -> String {
    let plain = !word.contains([',', '"', '\n', '\r', ';', '\t']);
    if plain { word.to_owned() } else { format!("\"{}\"", word.replace('"', "\"\"")) }
}
