//! Sources of recordings: paths, open files and tables of columns.

use crate::errors::Raise as _;
use crate::frame::Frame;
use crate::pool::on_all;
use crate::spec::{Keywords, keywords};
use motorfit::Error;
use motorfit::record::{Reading, Record};
use motorfit::setting::Setting;
use motorfit::settings::{self, READING};
use numpy::{PyArrayDescrMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;

/// Reads the options of a recording file.
pub fn reading(py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Reading> {
    let known: [&[Setting]; 2] = [&READING, &[Setting::Discretization]];
    let keys = Keywords::new(py, options, &keywords(&known))?;
    settings::reading(&keys.given(&known)?).map_err(motorfit::Error::from).raise(py)
}

/// Reads the recordings of a path or an open file.
///
/// # Errors
/// Returns `TypeError` for another argument, and the exceptions of reading.
pub fn file(py: Python<'_>, path: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Record>> {
    let reading = reading(py, options)?;
    match Source::of(path)? {
        Some(source @ (Source::Path(_) | Source::File(_))) => source.records(py, &reading),
        _ => {
            let message = "give a path or an open file; Record.from_columns(columns) makes a recording of columns";
            Err(PyTypeError::new_err(message))
        }
    }
}

/// A source of recordings.
pub enum Source<'a, 'py> {
    Path(PathBuf),
    File(&'a Bound<'py, PyAny>),
    Columns(&'a Bound<'py, PyAny>),
}

impl<'a, 'py> Source<'a, 'py> {
    /// Returns the kind of an argument; `None` if no recordings are read from it.
    ///
    /// # Errors
    /// Returns `TypeError` for a path that is not text, and for a frame that is not evaluated yet.
    pub fn of(given: &'a Bound<'py, PyAny>) -> PyResult<Option<Self>> {
        // Attributes are looked up on the type, because a property of the object might do work.
        let has = |name: &str| given.get_type().hasattr(name).unwrap_or(false);
        if given.is_instance_of::<PyString>() || has("__fspath__") {
            return Ok(Some(Self::Path(given.extract()?)));
        }
        if has("read") {
            return Ok(Some(Self::File(given)));
        }
        if has("columns") && has("collect") {
            return Err(PyTypeError::new_err(format!("{EXPECTED}: frame.collect() evaluates a lazy frame")));
        }
        let is_structured = given.cast::<PyUntypedArray>().is_ok_and(|array| array.dtype().has_fields());
        Ok((has("columns") || has("keys") || is_structured).then_some(Self::Columns(given)))
    }

    /// Reads the recordings of the source with the options of `reading`.
    ///
    /// # Errors
    /// Returns the exceptions of reading.
    pub fn records(self, py: Python<'_>, reading: &Reading) -> PyResult<Vec<Record>> {
        match self {
            Self::Path(path) => on_all(py, || reading.records(&path))?.raise(py),
            Self::File(file) => {
                let (bytes, name) = content(file)?;
                let located = |error: Error| name.iter().fold(error, |error, name| error.in_part(name));
                on_all(py, || reading.records_from_bytes(&bytes, None))?.map_err(located).raise(py)
            }
            Self::Columns(columns) => of_columns(columns, reading).map(|record| vec![record]),
        }
    }
}

/// Message for an argument that is no recording.
pub const EXPECTED: &str = "give a Record, a path, an open file or a frame, or a sequence of them";

/// Reads an open file of bytes or text to its end; returns its name too, if it has one.
fn content(file: &Bound<'_, PyAny>) -> PyResult<(Vec<u8>, Option<String>)> {
    let read = file.call_method0("read")?;
    let name = file.getattr("name").and_then(|name| name.extract()).ok();
    if let Ok(text) = read.extract::<String>() {
        return Ok((text.into_bytes(), name));
    }
    let wrong = |_| PyTypeError::new_err("the open file returns neither bytes nor text");
    Ok((read.extract::<Vec<u8>>().map_err(wrong)?, name))
}

/// Converts a table of columns to a recording.
///
/// # Errors
/// Returns `TypeError` or `ValueError` if it is no table of columns of one length, `DataError` if it is not one recording.
pub fn of_columns(columns: &Bound<'_, PyAny>, reading: &Reading) -> PyResult<Record> {
    let py = columns.py();
    let frame = Frame::new(columns)?;
    let read = on_all(py, || reading.records_from_bytes(frame.text.as_bytes(), None))?;
    let mut records = read.map_err(|error| frame.error(py, &error))?;
    match (records.pop(), records.len()) {
        (Some(record), 0) => Ok(record),
        (_, others) => {
            let message = format!("the columns hold {} recordings", others + 1);
            let remedy = "Pass them one by one; gaps=\"keep\" joins recordings that are separated by a gap.";
            Err(Error::data(message, remedy)).raise(py)
        }
    }
}
