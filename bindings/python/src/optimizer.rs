//! Population searches that are driven from outside.

use crate::arrays::{array, rows, signal};
use crate::errors::Raise as _;
use crate::spec;
use motorfit::optimize::Setup;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard};

/// A population search in a box: `gwo`, `jaya`, `ga` or `random`.
///
/// `ask()` gives the candidates to be evaluated, shape (n, p); `tell(costs)` takes their costs, shape (n,); nan and inf
/// for those that failed. The same seed and run give the same search.
#[pyclass(frozen, module = "motorfit")]
pub struct Optimizer {
    search: Mutex<Box<dyn motorfit::optimize::Optimizer>>,
    width: usize,
    /// Its method.
    #[pyo3(get)]
    method: String,
}

impl Optimizer {
    fn search(&self) -> PyResult<MutexGuard<'_, Box<dyn motorfit::optimize::Optimizer>>> {
        self.search.lock().map_err(|_| PyRuntimeError::new_err("the search ended in a fault; make a new Optimizer"))
    }
}

#[pymethods]
impl Optimizer {
    #[new]
    #[pyo3(signature = (method, bounds, *, population=100, generations=100, seed=1, run=0, set=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        py: Python<'_>,
        method: &str,
        bounds: Vec<(f64, f64)>,
        population: usize,
        generations: usize,
        seed: u64,
        run: u64,
        set: Vec<String>,
    ) -> PyResult<Self> {
        let width = bounds.len();
        let setup = Setup { bounds, population, generations, seed, run };
        let search = spec::method(py, method, &set)?.optimizer(setup).raise(py)?;
        Ok(Self { search: Mutex::new(search), width, method: method.to_owned() })
    }

    /// The candidates to be evaluated next, shape (n, p); the same ones until `tell`.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let values = self.search()?.ask().values().to_vec();
        rows(py, values, self.width)
    }

    /// Takes the costs of what was asked last, shape (n,).
    fn tell(&self, costs: &Bound<'_, PyAny>) -> PyResult<()> {
        let costs = signal(costs, "costs")?;
        let mut search = self.search()?;
        let expected = search.ask().count();
        if costs.len() != expected {
            let message = format!("{} costs for {expected} candidates", costs.len());
            return Err(PyValueError::new_err(message));
        }
        search.tell(&costs);
        Ok(())
    }

    /// The best so far: its values, shape (p,), and its cost; `None` before the first `tell`.
    fn best<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyArray1<f64>>, f64)>> {
        let search = self.search()?;
        Ok(search.best().map(|best| (array(py, best.values.to_vec()), best.cost)))
    }
}
