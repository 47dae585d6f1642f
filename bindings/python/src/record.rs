//! `Record` and `read`: recordings.

use crate::answers::{Reduced, reduced};
use crate::arrays::{array, signal};
use crate::errors::Raise as _;
use crate::frame::Frame;
use crate::pool::on_all;
use crate::spec::{Keywords, keywords};
use motorfit::record::{Reading, Samples, write_csv};
use motorfit::setting::Setting;
use motorfit::settings::{self, READING};
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};
use std::path::PathBuf;

/// Validated recording of one motor, immutable.
///
/// Parameters
/// ----------
/// time : array_like, shape (n,)
///     Time of each sample [s], strictly increasing.
/// voltage : array_like, shape (n,), optional
///     Voltage [V]. Without it current and speed are needed, and the current is the input.
/// current : array_like, shape (n,), optional
///     Current [A].
/// speed : array_like, shape (n,), optional
///     Speed [rad/s].
/// load_torque : array_like, shape (n,), optional
///     Load torque [N·m], a second input.
///
/// Raises
/// ------
/// DataError
///     If the signals are not a recording: lengths that differ, values that are not finite, a time that does not increase.
///
/// Notes
/// -----
/// Records are equal if their samples and their sources are equal. They can be pickled.
#[pyclass(frozen, module = "motorfit")]
#[derive(Clone)]
pub struct Record(pub motorfit::record::Record);

/// Signal of a recording; `None` if it was not measured.
type Signal<'py> = Option<Bound<'py, PyArray1<f64>>>;

#[pymethods]
impl Record {
    #[new]
    #[pyo3(signature = (time, *, voltage=None, current=None, speed=None, load_torque=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        py: Python<'_>,
        time: &Bound<'_, PyAny>,
        voltage: Option<&Bound<'_, PyAny>>,
        current: Option<&Bound<'_, PyAny>>,
        speed: Option<&Bound<'_, PyAny>>,
        load_torque: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let of =
            |numbers: Option<&Bound<'_, PyAny>>, what: &str| numbers.map(|numbers| signal(numbers, what)).transpose();
        let samples = Samples {
            time_s: signal(time, "time")?,
            voltage: of(voltage, "voltage")?.unwrap_or_default(),
            torque: of(load_torque, "load_torque")?,
            current: of(current, "current")?,
            speed: of(speed, "speed")?,
        };
        motorfit::record::Record::new(samples).map(Self).raise(py)
    }

    #[doc = concat!("from_file(path, *, ", include_str!("signatures/reading.txt"), ")\n--\n")]
    /// Reads a file that holds one recording.
    ///
    /// Parameters
    /// ----------
    /// path : str or PathLike
    ///     Recording file.
    /// columns, rate, sheet, bad_rows, gaps, drop_repeats, crop, offset, mask, decimate, filter, discretization
    ///     As for `read`.
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// UsageError, DataError
    ///     If an option is wrong, or the file cannot be read or holds several recordings.
    #[staticmethod]
    #[pyo3(signature = (path, **options), text_signature = None)]
    fn from_file(py: Python<'_>, path: PathBuf, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut records = read(py, path.clone(), options)?;
        match (records.pop(), records.len()) {
            (Some(record), 0) => Ok(record),
            (_, others) => {
                let message = format!("holds {} recordings", others + 1);
                Err(motorfit::Error::data(message, "Read them all: motorfit.read(path).").in_file(&path)).raise(py)
            }
        }
    }

    #[doc = concat!("from_columns(frame, *, ", include_str!("signatures/reading.txt"), ")\n--\n")]
    /// Converts a table of columns to a recording, by the rules for files.
    ///
    /// Parameters
    /// ----------
    /// frame : mapping, structured array, pandas or polars frame
    ///     Columns of one length. Headings name quantity and unit, "Current (mA)" or "speed_rpm", unless `columns` does.
    /// columns, rate, sheet, bad_rows, gaps, drop_repeats, crop, offset, mask, decimate, filter, discretization
    ///     As for `read`, such as columns="time=t:s,current=I:mA".
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If `frame` is not a table of columns of one length.
    /// UsageError, DataError
    ///     If an option is wrong, or the columns are not one recording.
    #[staticmethod]
    #[pyo3(signature = (frame, **options), text_signature = None)]
    fn from_columns(py: Python<'_>, frame: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let reading = reading(py, options)?;
        let frame = Frame::new(frame)?;
        let read = on_all(py, || reading.records_from_bytes(frame.text.as_bytes()))?;
        let mut records = read.map_err(|error| frame.error(py, &error))?;
        match (records.pop(), records.len()) {
            (Some(record), 0) => Ok(Self(record)),
            (_, others) => {
                let message = format!("the columns hold {} recordings", others + 1);
                let remedy = "Pass them one by one; gaps=\"keep\" joins recordings that are separated by a gap.";
                Err(motorfit::Error::data(message, remedy)).raise(py)
            }
        }
    }

    /// Time [s], shape (n,); a read-only copy.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        frozen(py, &self.0.samples().time_s)
    }

    /// Voltage [V], shape (n,), a read-only copy; `None` if the current is the input.
    #[getter]
    fn voltage<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        let voltage = Some(&self.0.samples().voltage).filter(|voltage| !voltage.is_empty());
        voltage.map(|values| frozen(py, values)).transpose()
    }

    /// Current [A], shape (n,), a read-only copy; `None` if it was not measured.
    #[getter]
    fn current<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        self.0.samples().current.as_ref().map(|values| frozen(py, values)).transpose()
    }

    /// Speed [rad/s], shape (n,), a read-only copy; `None` if it was not measured.
    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        self.0.samples().speed.as_ref().map(|values| frozen(py, values)).transpose()
    }

    /// Load torque [N·m], shape (n,), a read-only copy; `None` if there was none.
    #[getter]
    fn load_torque<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        self.0.samples().torque.as_ref().map(|values| frozen(py, values)).transpose()
    }

    /// Sampling period [s]: the median step in time.
    #[getter]
    fn period(&self) -> f64 {
        self.0.period_s()
    }

    /// Path of the file; `None` for a recording from arrays.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        self.0.source().path.clone()
    }

    /// SHA-256 of the file, in hexadecimal; `None` for a recording from arrays.
    #[getter]
    fn sha256(&self) -> Option<String> {
        self.0.source().sha256.clone()
    }

    /// Notes on samples that were left out, files that were joined, and preparation.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.source().notes.clone()
    }

    /// Splits the recording in time, for example into estimation and validation data.
    ///
    /// Parameters
    /// ----------
    /// fraction : float
    ///     Fraction of the samples in the first recording, between 0 and 1.
    ///
    /// Returns
    /// -------
    /// (Record, Record)
    ///
    /// Raises
    /// ------
    /// UsageError
    ///     If either would have fewer than two samples.
    fn split(&self, py: Python<'_>, fraction: f64) -> PyResult<(Self, Self)> {
        let [first, rest] = self.0.split(fraction).raise(py)?;
        Ok((Self(first), Self(rest)))
    }

    /// Returns the signals as a mapping of headings with units to arrays, for `from_columns` or `pandas.DataFrame`.
    fn to_columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        let samples = self.0.samples();
        let signals = [
            ("time_s", Some(&samples.time_s)),
            ("voltage_V", Some(&samples.voltage).filter(|voltage| !voltage.is_empty())),
            ("load_torque_Nm", samples.torque.as_ref()),
            ("current_A", samples.current.as_ref()),
            ("speed_rad_s", samples.speed.as_ref()),
        ];
        for (heading, values) in signals {
            if let Some(values) = values {
                columns.set_item(heading, array(py, values.clone()))?;
            }
        }
        Ok(columns)
    }

    /// Returns the signals as CSV text.
    fn to_csv(&self) -> String {
        write_csv(&self.0)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.0 == other.get().0)
    }

    fn __repr__(&self) -> String {
        let source = self.0.source();
        let path = source.path.as_ref().map_or(String::new(), |path| format!("{}: ", path.display()));
        let samples = self.0.samples();
        let there = [
            ("voltage", !samples.voltage.is_empty()),
            ("load torque", samples.torque.is_some()),
            ("current", samples.current.is_some()),
            ("speed", samples.speed.is_some()),
        ];
        let signals: Vec<&str> = there.into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect();
        format!("<Record {path}{} samples every {:.6} s: {}>", self.0.len(), self.0.period_s(), signals.join(", "))
    }

    /// Returns the object itself, which is immutable.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Returns the object itself, which is immutable.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, Bound<'py, PyBytes>> {
        let stored = slf.get().0.to_stored().raise(slf.py())?;
        reduced(slf, PyBytes::new(slf.py(), &stored))
    }

    #[staticmethod]
    fn _restore(py: Python<'_>, stored: &[u8]) -> PyResult<Self> {
        motorfit::record::Record::from_stored(stored).map(Self).raise(py)
    }
}

/// Returns a read-only copy, because writing to a copy would not change the recording.
fn frozen<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let array = array(py, values.to_vec());
    array.getattr("flags")?.setattr("writeable", false)?;
    Ok(array)
}

#[doc = concat!("read(path, *, ", include_str!("signatures/reading.txt"), ")\n--\n")]
/// Reads the recordings of a file: CSV, XLSX, MAT or JSON.
///
/// Parameters
/// ----------
/// path : str or PathLike
///     Recording file; "A+B" joins two files to one recording.
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
pub fn read(py: Python<'_>, path: PathBuf, options: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Record>> {
    let reading = reading(py, options)?;
    let records = on_all(py, || reading.records(&path))?.raise(py)?;
    Ok(records.into_iter().map(Record).collect())
}

fn reading(py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Reading> {
    let known: [&[Setting]; 2] = [&READING, &[Setting::Discretization]];
    let keys = Keywords::new(py, options, &keywords(&known))?;
    settings::reading(&keys.given(&known)?).map_err(motorfit::Error::from).raise(py)
}

/// Converts an argument to one recording.
pub fn single(given: &Bound<'_, PyAny>) -> PyResult<motorfit::record::Record> {
    given.cast::<Record>().map(|record| record.get().0.clone()).map_err(|_| no_record(given, "a Record"))
}

/// Converts an argument to a non-empty list of recordings.
pub fn several(given: &Bound<'_, PyAny>) -> PyResult<Vec<motorfit::record::Record>> {
    const EXPECTED: &str = "a Record or a sequence of them";
    if let Ok(record) = given.cast::<Record>() {
        return Ok(vec![record.get().0.clone()]);
    }
    // Iterating over a path, a mapping or a frame would yield characters or labels.
    let items = if made_of(given).is_some() { None } else { given.try_iter().ok() };
    let Some(items) = items else { return Err(no_record(given, EXPECTED)) };
    let mut records = Vec::new();
    for one in items {
        let one = one?;
        records.push(one.cast::<Record>().map_err(|_| no_record(&one, EXPECTED))?.get().0.clone());
    }
    if records.is_empty() { Err(no_record(given, EXPECTED)) } else { Ok(records) }
}

fn no_record(given: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    let how = made_of(given).map_or(String::new(), |how| format!(": {how}"));
    PyTypeError::new_err(format!("give {expected}{how}"))
}

/// Returns advice for a path or a table of columns: the function that makes a recording from it.
fn made_of(given: &Bound<'_, PyAny>) -> Option<&'static str> {
    // Attributes are looked up on the type, because a property of the object might do work.
    let has = |name: &str| given.get_type().hasattr(name).unwrap_or(false);
    if given.is_instance_of::<PyString>() || has("__fspath__") {
        Some("Record.from_file(path) reads one from a file, read(path) several")
    } else if has("columns") || has("keys") {
        Some("Record.from_columns(columns) makes one from columns")
    } else {
        None
    }
}
