//! `read` and the arguments that are recordings: `Record` objects, paths, open files and tables of columns.

use crate::errors::Raise as _;
use crate::frame::Frame;
use crate::pool::on_all;
use crate::record::Record;
use crate::spec::{Keywords, keywords};
use motorfit::Error;
use motorfit::record::{Reading, Record as Recording};
use motorfit::setting::Setting;
use motorfit::settings::{self, Given, READING};
use numpy::{PyArrayDescrMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;

#[doc = concat!("read(path, *, ", include_str!("signatures/reading.txt"), ")\n--\n")]
/// Reads the recordings of a file: CSV, XLSX, MAT or JSON.
///
/// Parameters
/// ----------
/// path : str, PathLike or open file
///     Recording file; "A+B" joins two files to one recording. An open file is read to its end.
/// columns : str, sequence or mapping
///     Columns of the quantities time, voltage, current, speed, load_torque and position: "time=t:s,current=I:mA". By
///     default the headings are interpreted.
/// rate : float
///     Sampling rate [Hz] of a recording without a time column; other recordings are resampled to it.
/// sheet : str
///     Sheet of a workbook, by default the first with numbers; or list of a JSON file.
/// bad_rows : {"error", "skip"}
///     Treatment of rows that cannot be read: reported as bad data, or left out and counted.
/// gaps : {"error", "keep", "split"}
///     Treatment of gaps in time: reported as bad data, kept as one long step, or split into one recording per segment,
///     also where time starts again.
/// drop_repeats : bool, default False
///     Leaves out rows with the same time as the row before.
/// crop : str
///     Time range to use, "FROM:TO" [s]; either end may be left out.
/// offset : str
///     Sensor offsets to subtract: "auto" (the means at rest before the voltage changes), or "current=0.02,speed=-1" in SI
///     units.
/// mask : str or sequence
///     Samples excluded from the fit: "auto", or time ranges "FROM:TO", "current@FROM:TO" [s].
/// decimate : int
///     Keeps every Nth sample, after an anti-alias filter.
/// filter : str
///     Low-pass filter on all signals, "butterworth:HZ[:ORDER]" or "chebyshev:HZ[:ORDER[:RIPPLE_DB]]".
/// discretization : {"zoh", "foh", "rk4", "euler"}
///     Discretization of the fit that follows; it decides the intersample behaviour of the input when resampling.
///
/// Returns
/// -------
/// list of Record
///
/// Raises
/// ------
/// UsageError
///     If an option is wrong.
/// DataError
///     If the file cannot be read, with its line and column.
#[pyfunction]
#[pyo3(signature = (path, **options), text_signature = None)]
pub fn read(py: Python<'_>, path: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Record>> {
    let reading = reading(py, options)?;
    let records = match Source::of(path)? {
        Some(source @ (Source::Path(_) | Source::File(_))) => source.records(py, &reading)?,
        _ => {
            let message = "give a path or an open file; Record.from_columns(columns) makes a recording of columns";
            return Err(PyTypeError::new_err(message));
        }
    };
    Ok(records.into_iter().map(Record).collect())
}

/// Reads the options of a recording file.
pub fn reading(py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Reading> {
    let known: [&[Setting]; 2] = [&READING, &[Setting::Discretization]];
    let keys = Keywords::new(py, options, &keywords(&known))?;
    settings::reading(&keys.given(&known)?).map_err(motorfit::Error::from).raise(py)
}

/// Object that recordings are made of.
pub enum Source<'a, 'py> {
    Record(&'a Bound<'py, Record>),
    Path(PathBuf),
    File(&'a Bound<'py, PyAny>),
    Columns(&'a Bound<'py, PyAny>),
}

impl<'a, 'py> Source<'a, 'py> {
    /// Returns the kind of an argument; `None` if it is no source of recordings.
    ///
    /// # Errors
    /// Returns `TypeError` for a path that is not text, and for a frame that is not evaluated yet.
    pub fn of(given: &'a Bound<'py, PyAny>) -> PyResult<Option<Self>> {
        if let Ok(record) = given.cast::<Record>() {
            return Ok(Some(Self::Record(record)));
        }
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

    /// Returns the recordings of the source, read with the options of `reading`.
    ///
    /// # Errors
    /// Returns the exceptions of reading.
    pub fn records(self, py: Python<'_>, reading: &Reading) -> PyResult<Vec<Recording>> {
        match self {
            Self::Record(record) => Ok(vec![record.get().0.clone()]),
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
const EXPECTED: &str = "give a Record, a path, an open file or a frame, or a sequence of them";

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
pub fn of_columns(columns: &Bound<'_, PyAny>, reading: &Reading) -> PyResult<Recording> {
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

/// Converts an argument to one recording.
pub fn single(given: &Bound<'_, PyAny>) -> PyResult<Recording> {
    let mut records = several(given)?;
    match (records.pop(), records.len()) {
        (Some(record), 0) => Ok(record),
        (_, others) => {
            let message = format!("{} recordings were given where one is expected", others + 1);
            Err(Error::usage(message, "Pass one of them.")).raise(given.py())
        }
    }
}

/// Converts an argument to a non-empty list of recordings: a source, or a sequence of them.
pub fn several(given: &Bound<'_, PyAny>) -> PyResult<Vec<Recording>> {
    let reading = settings::reading(&Given::default()).map_err(Error::from).raise(given.py())?;
    several_with(given, &reading)
}

/// Converts an argument to a non-empty list of recordings, which are read with the given options.
pub fn several_with(given: &Bound<'_, PyAny>, reading: &Reading) -> PyResult<Vec<Recording>> {
    let py = given.py();
    if let Some(source) = Source::of(given)? {
        return source.records(py, reading);
    }
    let unexpected = || PyTypeError::new_err(EXPECTED);
    let mut records = Vec::new();
    for one in given.try_iter().map_err(|_| unexpected())? {
        records.extend(Source::of(&one?)?.ok_or_else(unexpected)?.records(py, reading)?);
    }
    if records.is_empty() { Err(unexpected()) } else { Ok(records) }
}
