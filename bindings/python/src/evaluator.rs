//! Costs of tables of candidates.

use crate::arrays::{array, read};
use crate::errors::Raise as _;
use crate::record::several;
use crate::spec::{self, Keywords};
use motorfit::evaluate::Simd;
use motorfit::identify::{Costs, IdentifySpec, with_threads};
use numpy::PyArray1;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt as _;
use pyo3::types::PyDict;
use std::sync::Mutex;

/// Costs of candidates on a recording, or on several together.
///
/// `Evaluator(records, criterion="nrmse", scale="std", device="auto", …)(candidates)` takes an array of shape (n, p), a
/// row a candidate, in SI units and in the order of `names`, and gives an array of shape (n,). A cost that is not finite
/// is inf. One evaluator does one table at a time; threads that share it take turns.
#[pyclass(frozen, module = "motorfit")]
pub struct Evaluator {
    work: Mutex<Work>,
    /// Threads of its own, started once; those of all where nothing is said.
    pool: Option<rayon::ThreadPool>,
    names: Vec<String>,
    bounds: Vec<(f64, f64)>,
    /// Candidate-steps of a candidate.
    steps: usize,
    device: (String, String, String),
}

struct Work {
    costs: Costs,
    values: Vec<f64>,
}

/// Candidates that a device is chosen for where nothing is said.
const EXPECTED: usize = 100_000;
/// Candidate-steps between two looks for signals: some tenths of a second on one slow core.
const LOOK: usize = 200_000_000;

#[pymethods]
impl Evaluator {
    #[new]
    #[pyo3(signature = (records, *, population=EXPECTED, **settings))]
    fn new(
        py: Python<'_>,
        records: &Bound<'_, PyAny>,
        population: usize,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let keys = Keywords::new(py, settings, &spec::PROBLEM)?;
        let records = several(records)?;
        let spec = IdentifySpec { population, generations: 1, ..spec::problem(&keys, spec::input_of(&records))? };
        let costs = py.detach(|| with_threads(spec.threads, || Costs::new(&records, &spec))).raise(py)?;
        let start = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        // One thread is that of the caller.
        let pool = spec
            .threads
            .filter(|threads| *threads > 1)
            .map(start)
            .transpose()
            .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        let free = costs.problem().space().free();
        let (kind, name, precision) = costs.device();
        Ok(Self {
            names: free.iter().map(|axis| axis.parameter.symbol().to_owned()).collect(),
            bounds: free.iter().map(|axis| (axis.min, axis.max)).collect(),
            steps: costs.problem().active().max(1),
            device: (kind.to_owned(), name, precision.to_owned()),
            work: Mutex::new(Work { costs, values: Vec::new() }),
            pool,
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

    /// What evaluates: cpu or gpu, its name, its numbers.
    #[getter]
    fn device(&self) -> (String, String, String) {
        self.device.clone()
    }

    /// Costs of `candidates` of shape (n, p), or (p,) for one: an array of shape (n,).
    fn __call__<'py>(&self, py: Python<'py>, candidates: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut work = self.work.lock_py_attached(py).map_err(|_| broken())?;
        let Work { costs, values } = &mut *work;
        let shape = read(candidates, "candidates", values)?;
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
        let mut found = vec![f64::INFINITY; count];
        let piece = (LOOK / self.steps).max(1024);
        let pieces = values.chunks(piece * width).zip(found.chunks_mut(piece));
        for (values, found) in pieces {
            let pool = self.pool.as_ref().filter(|_| !Simd::is_small(costs.problem(), found.len()));
            py.detach(|| match pool {
                None => costs.evaluate(values, found),
                Some(pool) => pool.install(|| costs.evaluate(values, found)),
            })
            .raise(py)?;
            py.check_signals()?;
        }
        Ok(array(py, found))
    }

    fn __repr__(&self) -> String {
        let (kind, name, precision) = &self.device;
        format!("<Evaluator of {} on {kind} {name}, {precision}>", self.names.join(", "))
    }
}

fn broken() -> PyErr {
    PyRuntimeError::new_err("an evaluation ended in a fault; make a new Evaluator")
}
