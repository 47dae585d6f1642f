//! Population searches that are driven from outside.

use crate::arrays::{Table, array, rows, signal, table};
use crate::errors::Raise as _;
use crate::spec;
use motorfit::optimize::SearchSettings;
use motorfit::settings;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard};

/// A population search in a box, driven from outside.
///
/// `ask()` gives the candidates to be evaluated, shape (n, p); `tell(costs)` takes their costs, shape (n,). The same seed
/// and run give the same search.
///
/// Parameters
/// ----------
#[doc = include_str!("docs/search.txt")]
/// bounds : array_like, shape (p, 2)
///     The box, (min, max) a row: `Evaluator.bounds`, say.
/// population : int, default 100
///     Agents.
/// generations : int, default 100
///     How many there will be: what GWO narrows its search by.
/// seed, run : int, default 1 and 0
///     Runs of one seed are independent; runs of the same number begin with the same population whatever the method.
/// set : str or sequence or mapping
///     Settings of the method, {"mutation": 0.1}.
#[pyclass(frozen, module = "motorfit")]
pub struct Optimizer {
    search: Mutex<Search>,
    width: usize,
    /// Its method.
    #[pyo3(get)]
    method: String,
}

struct Search {
    optimizer: Box<dyn motorfit::optimize::Optimizer>,
    /// True if candidates were asked for that are not told of.
    is_asked: bool,
}

impl Optimizer {
    fn search(&self) -> PyResult<MutexGuard<'_, Search>> {
        self.search.lock().map_err(|_| PyRuntimeError::new_err("the search ended in a fault; make a new Optimizer"))
    }
}

#[pymethods]
impl Optimizer {
    #[new]
    #[pyo3(signature = (method, bounds, *, population=100, generations=100, seed=1, run=0, set=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        py: Python<'_>,
        method: &str,
        bounds: &Bound<'_, PyAny>,
        population: usize,
        generations: usize,
        seed: u64,
        run: u64,
        set: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let Table { values, shape } = table(bounds, "bounds")?;
        let [width, 2] = *shape.as_slice() else {
            return Err(PyValueError::new_err(format!(
                "bounds have the shape {shape:?}; give (p, 2): (min, max) a row"
            )));
        };
        let bounds = values.chunks(2).map(|pair| (pair[0], pair[1])).collect();
        let setup = SearchSettings { bounds, population, generations, seed, run };
        let set = set.map_or_else(|| Ok(Vec::new()), |set| spec::items(set, "set"))?;
        let optimizer = settings::method(method, &set).and_then(|method| method.optimizer(setup)).raise(py)?;
        let search = Mutex::new(Search { optimizer, is_asked: false });
        Ok(Self { search, width, method: method.to_owned() })
    }

    /// The candidates to be evaluated next, shape (n, p); the same ones until `tell`.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut search = self.search()?;
        let values = search.optimizer.ask().values().to_vec();
        search.is_asked = true;
        drop(search);
        rows(py, values, self.width)
    }

    /// Takes the costs of what was asked last, shape (n,); nan and inf for candidates that failed.
    fn tell(&self, costs: &Bound<'_, PyAny>) -> PyResult<()> {
        let costs = signal(costs, "costs")?;
        let mut search = self.search()?;
        if !search.is_asked {
            return Err(PyRuntimeError::new_err("nothing was asked that costs could be of; ask() first"));
        }
        let expected = search.optimizer.ask().count();
        if costs.len() != expected {
            let message = format!("{} costs for {expected} candidates", costs.len());
            return Err(PyValueError::new_err(message));
        }
        search.optimizer.tell(&costs);
        search.is_asked = false;
        Ok(())
    }

    /// The best so far: its values, shape (p,), and its cost; `None` before any that is finite.
    fn best<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyArray1<f64>>, f64)>> {
        let search = self.search()?;
        Ok(search.optimizer.best().map(|best| (array(py, best.values.to_vec()), best.cost)))
    }

    fn __repr__(&self) -> PyResult<String> {
        let best =
            self.search()?.optimizer.best().map_or("nothing told".to_owned(), |best| format!("cost {}", best.cost));
        Ok(format!("<Optimizer {} of {} values: {best}>", self.method, self.width))
    }
}
