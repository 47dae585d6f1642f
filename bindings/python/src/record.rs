//! Recordings.

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

/// A recording of one motor, checked: time in s, voltage in V, current in A, speed in rad/s, load torque in N·m.
///
/// `Record(time, voltage=…, current=…, speed=…, load_torque=…)` takes arrays of one length in these units. `voltage` may
/// be left out where current and speed are there: the current then is the input. Records are equal when their samples and
/// their sources are; they pickle.
#[pyclass(frozen, module = "motorfit")]
#[derive(Clone)]
pub struct Record(pub motorfit::record::Record);

/// A signal of a recording, or nothing.
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

    /// The one recording of a file; `read` takes files of several. Keywords as for `read`.
    #[staticmethod]
    #[pyo3(signature = (path, **options))]
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

    /// A recording from columns as a file has them: a mapping of headings to arrays, a structured array, a pandas or polars
    /// frame.
    ///
    /// Headings name quantity and unit ("Current (mA)", "speed_rpm"), or `columns` does ("time=t:s,current=I:mA"). Other
    /// keywords as for `read`.
    #[staticmethod]
    #[pyo3(signature = (frame, **options))]
    fn from_columns(py: Python<'_>, frame: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let reading = reading(py, options)?;
        let frame = Frame::new(frame)?;
        let read = on_all(py, || reading.records_of(frame.text.as_bytes()))?;
        let mut records = read.map_err(|error| frame.error(py, &error))?;
        match (records.pop(), records.len()) {
            (Some(record), 0) => Ok(Self(record)),
            (_, others) => {
                let message = format!("the columns hold {} recordings", others + 1);
                let remedy = "Give each by itself; gaps=\"keep\" makes one of those that a gap parts.";
                Err(motorfit::Error::data(message, remedy)).raise(py)
            }
        }
    }

    /// Time, s: a read-only copy, as all signals.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        frozen(py, &self.0.samples().time_s)
    }

    /// Voltage, V; `None` where the current is the input.
    #[getter]
    fn voltage<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        let voltage = Some(&self.0.samples().voltage).filter(|voltage| !voltage.is_empty());
        voltage.map(|values| frozen(py, values)).transpose()
    }

    /// Current, A; `None` where it was not measured.
    #[getter]
    fn current<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        self.0.samples().current.as_ref().map(|values| frozen(py, values)).transpose()
    }

    /// Speed, rad/s; `None` where it was not measured.
    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        self.0.samples().speed.as_ref().map(|values| frozen(py, values)).transpose()
    }

    /// Load torque, N·m; `None` where there was none.
    #[getter]
    fn load_torque<'py>(&self, py: Python<'py>) -> PyResult<Signal<'py>> {
        self.0.samples().torque.as_ref().map(|values| frozen(py, values)).transpose()
    }

    /// Mean time between samples, s.
    #[getter]
    fn period(&self) -> f64 {
        self.0.period_s()
    }

    /// The file, if there is one.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        self.0.source().path.clone()
    }

    /// SHA-256 of the file, in hexadecimal.
    #[getter]
    fn sha256(&self) -> Option<String> {
        self.0.source().sha256.clone()
    }

    /// Returns notes on what was left out, joined or prepared.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.source().notes.clone()
    }

    /// The first part of the samples, and the rest of them.
    fn split(&self, py: Python<'_>, fraction: f64) -> PyResult<(Self, Self)> {
        let [first, rest] = self.0.split(fraction).raise(py)?;
        Ok((Self(first), Self(rest)))
    }

    /// Its signals as a mapping of headings with units to arrays: what `from_columns` and `pandas.DataFrame` take.
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

    /// Its signals as the text of a CSV file.
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

    /// The same: nothing can change it.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// The same: nothing can change it.
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

/// A copy that cannot be written to: it would change nothing.
fn frozen<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let array = array(py, values.to_vec());
    array.getattr("flags")?.setattr("writeable", false)?;
    Ok(array)
}

/// The recordings of a file: CSV, XLSX, MAT or JSON; "A+B" makes one recording of two files.
///
/// Parameters
/// ----------
/// path : str or PathLike
/// columns : str, sequence or mapping
///     What columns hold, "time=t:s,current=I:mA"; quantities: time, voltage, current, speed, load_torque, position.
/// rate : float
///     Samples a second: of a recording without a time column; any other is brought to it.
/// sheet : str
///     Sheet of a workbook, the first with numbers by default; the list of a JSON file.
/// bad_rows : {"error", "skip"}
///     Rows that cannot be read: bad data, or left out and counted.
/// gaps : {"error", "keep", "split"}
///     Gaps in time: bad data, a long step, or a recording for each stretch, also where time starts again.
/// drop_repeats : bool, default False
///     Leave out rows whose time repeats that of the row before.
/// crop : str
///     "FROM:TO" in s; either may be left out.
/// offset : str
///     Offsets of sensors that are subtracted: "auto", or "current=0.02,speed=-1" in SI units.
/// mask : str or sequence
///     What does not count: "auto", "FROM:TO", "current@FROM:TO" in s.
/// decimate : int
///     Keep every Nth sample, behind an anti-alias filter.
/// filter : str
///     A low-pass on all signals, "butterworth:HZ[:ORDER]" or "chebyshev:HZ[:ORDER[:RIPPLE_DB]]".
/// discretization : {"zoh", "foh", "rk4", "euler"}
///     What is going to simulate: whether inputs are held between samples.
///
/// Returns
/// -------
/// list of Record
#[pyfunction]
#[pyo3(signature = (path, **options))]
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

/// One recording.
pub fn single(given: &Bound<'_, PyAny>) -> PyResult<motorfit::record::Record> {
    given.cast::<Record>().map(|record| record.get().0.clone()).map_err(|_| no_record(given, "a Record"))
}

/// One recording, or a sequence of them.
pub fn several(given: &Bound<'_, PyAny>) -> PyResult<Vec<motorfit::record::Record>> {
    const WANTED: &str = "a Record or a sequence of them";
    if let Ok(record) = given.cast::<Record>() {
        return Ok(vec![record.get().0.clone()]);
    }
    // Their items are no recordings, but words.
    let items = if made_of(given).is_some() { None } else { given.try_iter().ok() };
    let Some(items) = items else { return Err(no_record(given, WANTED)) };
    let mut records = Vec::new();
    for one in items {
        let one = one?;
        records.push(one.cast::<Record>().map_err(|_| no_record(&one, WANTED))?.get().0.clone());
    }
    if records.is_empty() { Err(no_record(given, WANTED)) } else { Ok(records) }
}

fn no_record(given: &Bound<'_, PyAny>, wanted: &str) -> PyErr {
    let how = made_of(given).map_or(String::new(), |how| format!(": {how}"));
    PyTypeError::new_err(format!("give {wanted}{how}"))
}

/// Returns the name of the function that made a recording of a file or a frame.
fn made_of(given: &Bound<'_, PyAny>) -> Option<&'static str> {
    // Of the type: a property that is asked for may do work.
    let has = |name: &str| given.get_type().hasattr(name).unwrap_or(false);
    if given.is_instance_of::<PyString>() || has("__fspath__") {
        Some("Record.from_file(path), or read(path) where a file holds several")
    } else if has("columns") || has("keys") {
        Some("Record.from_columns(columns) makes one of columns")
    } else {
        None
    }
}
