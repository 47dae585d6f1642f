//! `read` and the arguments that are recordings: `Record` objects, paths, open files and tables of columns.

use crate::errors::Raise as _;
use crate::record::Record;
use crate::source::{EXPECTED, Source, file};
use motorfit::Error;
use motorfit::record::{Reading, Record as Recording};
use motorfit::settings::{self, Given};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

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
    Ok(file(py, path, options)?.into_iter().map(Record).collect())
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
    if let Some(records) = records_of(given, reading)? {
        return Ok(records);
    }
    let unexpected = || PyTypeError::new_err(EXPECTED);
    let mut records = Vec::new();
    for one in given.try_iter().map_err(|_| unexpected())? {
        records.extend(records_of(&one?, reading)?.ok_or_else(unexpected)?);
    }
    if records.is_empty() { Err(unexpected()) } else { Ok(records) }
}

/// Converts an argument to recordings; `None` if it is neither a `Record` nor a source of recordings.
pub fn records_of(given: &Bound<'_, PyAny>, reading: &Reading) -> PyResult<Option<Vec<Recording>>> {
    if let Ok(record) = given.cast::<Record>() {
        return Ok(Some(vec![record.get().0.clone()]));
    }
    Source::of(given)?.map(|source| source.records(given.py(), reading)).transpose()
}
