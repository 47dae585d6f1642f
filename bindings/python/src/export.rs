//! Files for simulators.

use motorfit::report::{ExportFormat, Exported};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Returns the texts of the files by format, those that can be written.
pub fn written<'py>(py: Python<'py>, of: Option<&Exported>) -> PyResult<Bound<'py, PyDict>> {
    let files = PyDict::new(py);
    for format in of.iter().flat_map(|of| ExportFormat::ALL.map(|format| (format, format.write(of)))) {
        if let (format, Ok(text)) = format {
            files.set_item(format.name(), text)?;
        }
    }
    Ok(files)
}
