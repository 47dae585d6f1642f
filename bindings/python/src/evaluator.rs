//! Costs of tables of candidates.

use crate::arrays::{array, read};
use crate::errors::Raise as _;
use crate::exclusive_lock::ExclusiveLock;
use crate::pool::{Pool, on_all};
use crate::record::several;
use crate::spec::{self, Keywords};
use motorfit::device::with_threads;
use motorfit::evaluate::Simd;
use motorfit::identify::{BatchCosts, IdentifySpec};
use motorfit::settings::{DEVICE, PROBLEM};
use numpy::PyArray1;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::sync::Mutex;

/// Costs of candidates on a recording, or on several together.
///
/// `costs = Evaluator(records, ...)(candidates)`: candidates of shape (n, p), a row a candidate, in SI units, its columns in
/// the order of `names`, or a frame with these columns; costs of shape (n,), inf where a cost is not finite.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
///     What candidates are held against; several count together.
/// population : int, default 100000
///     How many candidates a call will bring, about: what device="auto" chooses by.
#[doc = include_str!("docs/with.txt")]
#[doc = include_str!("docs/problem.txt")]
///
/// One evaluator does one table at a time; threads that share it take turns. It pickles with its recordings.
#[pyclass(frozen, module = "motorfit")]
pub struct Evaluator {
    costs: Mutex<BatchCosts>,
    lock: ExclusiveLock,
    /// Room for candidates, kept from one call to the next.
    room: Mutex<Vec<f64>>,
    /// The number of threads; one is the caller's.
    threads: Option<usize>,
    pool: Pool,
    process: u32,
    names: Vec<String>,
    bounds: Vec<(f64, f64)>,
    /// Candidate-steps of a candidate.
    steps: usize,
    device: (String, String, String),
    /// The recordings and keywords that it was made of.
    made_of: (Py<PyTuple>, Py<PyDict>),
}

/// Candidate-steps between two looks for signals: some tenths of a second on one slow core.
const LOOK: usize = 200_000_000;

#[pymethods]
impl Evaluator {
    #[new]
    #[pyo3(signature = (records, *, population=100_000, **settings))]
    fn new(
        py: Python<'_>,
        records: &Bound<'_, PyAny>,
        population: usize,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let keys = Keywords::new(py, settings, &spec::keywords(&[&PROBLEM, &DEVICE]))?;
        let records = several(records)?;
        let spec = IdentifySpec { population, generations: 1, ..spec::problem(&keys, spec::input_of(&records))? };
        let costs = on_all(py, || with_threads(spec.threads, || BatchCosts::new(&records, &spec)))?.raise(py)?;
        let free = costs.problem().space().free();
        let (kind, device, precision) = costs.device();
        let of = PyTuple::new(py, records.iter().cloned().map(crate::record::Record))?;
        let keywords = settings.map_or_else(|| Ok(PyDict::new(py)), |settings| settings.copy())?;
        keywords.set_item("population", population)?;
        Ok(Self {
            names: free.iter().map(|axis| axis.scope.name(axis.parameter)).collect(),
            bounds: free.iter().map(|axis| (axis.min, axis.max)).collect(),
            steps: costs.problem().active().max(1),
            device: (kind.to_owned(), device, precision.to_owned()),
            costs: Mutex::new(costs),
            lock: ExclusiveLock::default(),
            room: Mutex::new(Vec::new()),
            threads: spec.threads,
            pool: Pool::new(spec.threads),
            process: std::process::id(),
            made_of: (of.unbind(), keywords.unbind()),
        })
    }

    /// The free parameters: the columns of a table of candidates.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// (min, max) of each free parameter, in SI units: what `scipy.optimize` takes as `bounds`.
    #[getter]
    fn bounds(&self) -> Vec<(f64, f64)> {
        self.bounds.clone()
    }

    /// Returns the device that evaluates: its kind (cpu or gpu), its name, its precision.
    #[getter]
    fn device(&self) -> (String, String, String) {
        self.device.clone()
    }

    /// Costs of `candidates` of shape (n, p), or (p,) for one, or of a frame with the columns `names`: an array of shape
    /// (n,).
    fn __call__<'py>(&self, py: Python<'py>, candidates: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut values = self.room.lock().map(|mut room| std::mem::take(&mut *room)).unwrap_or_default();
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
        if let Ok(mut room) = self.room.lock() {
            *room = values;
        }
        Ok(array(py, found))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, (records, keywords)) = (slf.py(), &slf.get().made_of);
        let partial = py.import("functools")?.getattr("partial")?;
        let make = partial.call((slf.get_type(),), Some(keywords.bind(py)))?;
        Ok((make, PyTuple::new(py, [records.bind(py)])?))
    }

    fn __repr__(&self) -> String {
        let (kind, name, precision) = &self.device;
        format!("<Evaluator of {} on {kind} {name}, {precision}>", self.names.join(", "))
    }
}

impl Evaluator {
    fn evaluate(&self, py: Python<'_>, values: &[f64], count: usize) -> PyResult<Vec<f64>> {
        if self.process != std::process::id() && self.device.0 == "gpu" {
            let message = "a GPU cannot be used by a process that was forked; make the Evaluator there, or use spawn";
            return Err(PyRuntimeError::new_err(message));
        }
        let _held = self.lock.take(py, "the evaluator")?;
        let broken = "an evaluation ended in a fault; make a new Evaluator";
        let mut costs = self.costs.try_lock().map_err(|_| PyRuntimeError::new_err(broken))?;
        let costs = &mut *costs;
        let mut found = vec![f64::INFINITY; count];
        let piece = (LOOK / self.steps).max(1024);
        for (values, found) in values.chunks(piece * self.names.len()).zip(found.chunks_mut(piece)) {
            let is_small = Simd::is_small(costs.problem(), found.len());
            match self.threads {
                Some(1) => py.detach(|| costs.evaluate(values, found)),
                _ if is_small => py.detach(|| costs.evaluate(values, found)),
                None => on_all(py, || costs.evaluate(values, found))?,
                Some(_) => self.pool.run(py, || costs.evaluate(values, found))?,
            }
            .raise(py)?;
            py.check_signals()?;
        }
        Ok(found)
    }

    /// The columns of a frame in our order; `None` where the columns have none of our names.
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
            // Columns that may lack values are numbers only by request.
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
