//! `Evaluator`: costs of many candidates in one call.

use crate::arrays::{array, read};
use crate::errors::Raise as _;
use crate::exclusive_lock::ExclusiveLock;
use crate::model::Model;
use crate::pool::{Pool, on_all};
use crate::reading::several;
use crate::spec::{self, Keywords};
use motorfit::device::{DeviceUsed, with_threads};
use motorfit::identify::{BatchCosts, IdentifySpec};
use motorfit::setting::Setting;
use motorfit::settings::{DEVICE, PROBLEM};
use numpy::PyArray1;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::sync::Mutex;

#[doc = concat!("Evaluator(records, *, model=None, population=100000, ", include_str!("signatures/problem.txt"), ")\n--\n")]
/// Evaluates the cost of candidates on a recording, or on several recordings jointly.
///
/// `costs = Evaluator(records, ...)(candidates)` takes candidates of shape (n, p) in SI units, with columns in the order of
/// `names`, or a frame with these columns. It returns costs of shape (n,), inf for a candidate whose simulation diverges.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
///     Recordings; the cost is over the samples of all of them.
/// model : Model, optional
///     Equations of another machine in place of the DC motor; candidates and bounds are in the units of its parameters.
/// population : int, default 100000
///     Expected number of candidates per call; device="auto" chooses the device by it. evaluator="auto" is the kernel here;
///     "tables" takes the same time per candidate whatever the length of the recording, with errors of the costs up to 1e-9.
#[doc = include_str!("docs/with.txt")]
#[doc = include_str!("docs/problem.txt")]
///
/// Raises
/// ------
/// UsageError, DataError, DeviceError
///     If a setting is wrong, a recording cannot be used, or the device is not available.
///
/// Notes
/// -----
/// Calls from several threads are serialized. An evaluator can be pickled, with its recordings.
#[pyclass(frozen, module = "motorfit")]
pub struct Evaluator {
    costs: Mutex<BatchCosts>,
    lock: ExclusiveLock,
    /// Buffer of the candidates, reused by the next call.
    buffer: Mutex<Vec<f64>>,
    /// Number of threads; 1 is the calling thread.
    threads: Option<usize>,
    pool: Pool,
    process: u32,
    names: Vec<String>,
    bounds: Vec<(f64, f64)>,
    /// Work of a candidate by which batches are sized, in steps of the kernel on the CPU.
    steps: usize,
    device: DeviceUsed,
    /// Recordings and keyword arguments of the constructor, for pickle.
    arguments: (Py<PyTuple>, Py<PyDict>),
}

/// Candidates × samples between two checks for signals: some tenths of a second on one slow core.
const SIGNAL_INTERVAL: usize = 200_000_000;

#[pymethods]
impl Evaluator {
    #[new]
    #[pyo3(signature = (records, *, model=None, population=100_000, **settings), text_signature = None)]
    fn new(
        py: Python<'_>,
        records: &Bound<'_, PyAny>,
        model: Option<&Bound<'_, Model>>,
        population: usize,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let keys = Keywords::new(py, settings, &spec::keywords(&[&PROBLEM, &DEVICE]))?;
        let keywords = settings.map_or_else(|| Ok(PyDict::new(py)), |settings| settings.copy())?;
        let (records, costs, threads) = match model {
            Some(model) => {
                let given = keys.given(&[&PROBLEM, &DEVICE])?;
                let spec = motorfit::settings::model_spec(&given).map_err(motorfit::Error::from).raise(py)?;
                let threads = given.count(Setting::Threads);
                let (records, recordings) = model.get().recordings(records)?;
                let own = &model.get().0;
                keywords.set_item("model", model)?;
                (
                    records,
                    on_all(py, || with_threads(threads, || BatchCosts::of_model(own, recordings, &spec)))?,
                    threads,
                )
            }
            None => {
                let records = several(records)?;
                let spec = spec::problem(&keys, &records)?;
                // A caller's optimizer may take differences of costs, which tables do not compute to the last digits.
                let spec = IdentifySpec { population, generations: 1, ..spec.by_kernel() };
                keywords.set_item("population", population)?;
                let costs = on_all(py, || with_threads(spec.threads, || BatchCosts::new(&records, &spec)))?;
                (records, costs, spec.threads)
            }
        };
        let costs = costs.raise(py)?;
        let of = PyTuple::new(py, records.into_iter().map(crate::record::Record))?;
        Ok(Self {
            names: costs.problem().names(),
            bounds: costs.problem().bounds(),
            steps: costs.steps(),
            device: costs.device(),
            costs: Mutex::new(costs),
            lock: ExclusiveLock::default(),
            buffer: Mutex::new(Vec::new()),
            threads,
            pool: Pool::new(threads),
            process: std::process::id(),
            arguments: (of.unbind(), keywords.unbind()),
        })
    }

    /// Names of the free parameters: the columns of the candidates.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// Bounds (min, max) of each free parameter in SI units, as `scipy.optimize` takes them.
    #[getter]
    fn bounds(&self) -> Vec<(f64, f64)> {
        self.bounds.clone()
    }

    /// Device of the evaluation: kind (cpu or gpu), name and precision.
    #[getter]
    fn device(&self) -> (&'static str, String, &'static str) {
        (self.device.kind, self.device.name.clone(), self.device.precision)
    }

    /// Evaluator: kernel or tables on the CPU, shader on a GPU.
    #[getter]
    fn evaluator(&self) -> &'static str {
        self.device.evaluator
    }

    /// Returns the costs of candidates.
    ///
    /// Parameters
    /// ----------
    /// candidates : array_like, shape (n, p) or (p,), or frame
    ///     Candidates in SI units, with columns in the order of `names`, or a frame with these columns in any order.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Costs in the chosen criterion; inf for a candidate whose simulation diverges.
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     If the shape, the columns or the dtype do not fit.
    fn __call__<'py>(&self, py: Python<'py>, candidates: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut values = self.buffer.lock().map(|mut buffer| std::mem::take(&mut *buffer)).unwrap_or_default();
        let shape = match self.of_frame(candidates)? {
            Some(ordered) => read(&ordered, "candidates", &mut values)?,
            None => read(candidates, "candidates", &mut values)?,
        };
        let width = self.names.len();
        let count = match *shape.as_slice() {
            [count, columns] if columns == width => count,
            [columns] if columns == width => 1,
            _ => {
                let names = self.names.join(", ");
                let message =
                    format!("candidates have the shape {shape:?}; give (n, {width}): a column for each of {names}");
                return Err(PyValueError::new_err(message));
            }
        };
        let found = self.evaluate(py, &values, count)?;
        if let Ok(mut buffer) = self.buffer.lock() {
            *buffer = values;
        }
        Ok(array(py, found))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, (records, keywords)) = (slf.py(), &slf.get().arguments);
        let partial = py.import("functools")?.getattr("partial")?;
        let make = partial.call((slf.get_type(),), Some(keywords.bind(py)))?;
        Ok((make, PyTuple::new(py, [records.bind(py)])?))
    }

    fn __repr__(&self) -> String {
        format!("<Evaluator of {} on {} {}>", self.names.join(", "), self.device.kind, self.device)
    }
}

impl Evaluator {
    fn evaluate(&self, py: Python<'_>, values: &[f64], count: usize) -> PyResult<Vec<f64>> {
        if self.process != std::process::id() && self.device.kind == "gpu" {
            let message =
                "a GPU cannot be used in a forked process; create the Evaluator in that process, or use spawn";
            return Err(PyRuntimeError::new_err(message));
        }
        let _guard = self.lock.take(py, "the evaluator")?;
        let broken = "an earlier evaluation failed with an internal error; create a new Evaluator";
        let mut costs = self.costs.try_lock().map_err(|_| PyRuntimeError::new_err(broken))?;
        let costs = &mut *costs;
        let mut found = vec![f64::INFINITY; count];
        let piece = (SIGNAL_INTERVAL / self.steps).clamp(1024, 1 << 20);
        for (values, found) in values.chunks(piece * self.names.len()).zip(found.chunks_mut(piece)) {
            // The kernel of a model takes its threads from a pool.
            let (is_small, is_motor) = (costs.problem().is_small(found.len()), costs.problem().user_model().is_none());
            match self.threads {
                Some(1) if is_motor => py.detach(|| costs.evaluate(values, found)),
                _ if is_small => py.detach(|| costs.evaluate(values, found)),
                None => on_all(py, || costs.evaluate(values, found))?,
                Some(_) => self.pool.run(py, || costs.evaluate(values, found))?,
            }
            .raise(py)?;
            py.check_signals()?;
        }
        Ok(found)
    }

    /// Returns the columns of a frame in the order of `names`; `None` if none of its columns has such a name.
    fn of_frame<'py>(&self, candidates: &Bound<'py, PyAny>) -> PyResult<Option<Bound<'py, PyAny>>> {
        if candidates.is_instance_of::<numpy::PyUntypedArray>() || !candidates.hasattr("columns")? {
            return Ok(None);
        }
        let labels: Vec<String> = candidates
            .getattr("columns")?
            .try_iter()?
            .map(|label| Ok(label?.str()?.to_string()))
            .collect::<PyResult<_>>()?;
        let missing: Vec<&str> = self.names.iter().filter(|name| !labels.contains(name)).map(String::as_str).collect();
        if missing.is_empty() {
            let ordered = candidates.get_item(self.names.clone())?;
            // Nullable columns become float64 only on request.
            let real = PyDict::new(candidates.py());
            real.set_item("dtype", "float64")?;
            return Ok(Some(ordered.call_method("to_numpy", (), Some(&real)).unwrap_or(ordered)));
        }
        if missing.len() < self.names.len() {
            let message = format!("candidates lack the column {}; they have {}", missing.join(", "), labels.join(", "));
            return Err(PyValueError::new_err(message));
        }
        Ok(None)
    }
}
