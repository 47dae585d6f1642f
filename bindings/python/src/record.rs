//! `Record`: recordings.

use crate::answers::{Reduced, reduced};
use crate::arrays::{array, signal};
use crate::errors::{Raise as _, warnings};
use crate::figure::Svg;
use crate::frame::framed;
use crate::pool::on_all;
use crate::source::{file, of_columns, reading};
use motorfit::identify::Inspection;
use motorfit::record::{Samples, Severity, write_csv};
use motorfit::report::record_figure;
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PySlice};
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
/// Records are equal if their samples and their sources are equal. They can be pickled. `record[100:500]` is the recording of
/// these samples.
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
            ..Samples::default()
        };
        motorfit::record::Record::new(samples).map(Self).raise(py)
    }

    #[doc = concat!("from_file(path, *, ", include_str!("signatures/reading.txt"), ")\n--\n")]
    /// Reads a file that holds one recording.
    ///
    /// Parameters
    /// ----------
    /// path : str, PathLike or open file
    ///     Recording file; an open file is read to its end.
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
    fn from_file(py: Python<'_>, path: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut records = file(py, path, options)?;
        match (records.pop(), records.len()) {
            (Some(record), 0) => Ok(Self(record)),
            (_, others) => {
                let message = format!("{path} holds {} recordings", others + 1);
                Err(motorfit::Error::data(message, "Read them all: motorfit.read(path).")).raise(py)
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
        of_columns(frame, &reading(py, options)?).map(Self)
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

    /// Returns the signals as a frame, with the columns of `to_columns`.
    ///
    /// Parameters
    /// ----------
    /// library : {"pandas", "polars"}, optional
    ///     Library of the frame; by default pandas, or polars if pandas is not installed.
    #[pyo3(signature = (library=None))]
    fn to_frame<'py>(&self, py: Python<'py>, library: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
        framed(self.to_columns(py)?.as_any(), library)
    }

    /// Draws the signals over time.
    ///
    /// Returns
    /// -------
    /// Svg
    fn plot(&self) -> Svg {
        record_figure(&self.0).into()
    }

    /// Returns the findings about the signals, as `motorfit inspect` prints them.
    ///
    /// Returns
    /// -------
    /// list of MotorfitWarning
    ///     Faults first, then remarks, each with its code; empty if nothing was found.
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let found = on_all(py, || Inspection::of(&self.0).warnings)?;
        let of = |severity| warnings(py, &found, severity);
        Ok([of(Severity::Report)?, of(Severity::Mention)?].concat())
    }

    /// Returns the signals as CSV text.
    fn to_csv(&self) -> String {
        write_csv(&self.0)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __getitem__(&self, py: Python<'_>, samples: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok(slice) = samples.cast::<PySlice>() else {
            let message = "a recording is sliced by samples, record[100:500]; record.speed[7] is one value of a signal";
            return Err(PyTypeError::new_err(message));
        };
        let range = slice.indices(self.0.len().cast_signed())?;
        if range.step != 1 {
            let message = format!("record[::{}] has a step", range.step);
            let remedy = "read(path, decimate=N) keeps every Nth sample, after an anti-alias filter.";
            return Err(motorfit::Error::usage(message, remedy)).raise(py);
        }
        let of = |end: isize| usize::try_from(end).unwrap_or(0);
        self.0.slice(of(range.start)..of(range.stop)).map(Self).raise(py)
    }

    fn _repr_html_(&self) -> String {
        self.plot().html()
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
