//! `Optimizer`: population searches with an ask/tell interface.

use crate::arrays::{Table, array, rows, signal, table};
use crate::errors::Raise as _;
use crate::spec;
use motorfit::Error;
use motorfit::optimize::SearchSettings;
use motorfit::settings;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard};

/// Population search in a box with an ask/tell interface.
///
/// `ask()` returns the candidates to evaluate, shape (n, p); `tell(costs)` takes their costs, shape (n,). The search depends
/// only on the arguments and the costs: the same seed and run reproduce it.
///
/// Parameters
/// ----------
#[doc = include_str!("docs/search.txt")]
/// bounds : array_like, shape (p, 2)
///     Lower and upper bound of each parameter, such as `Evaluator.bounds`.
/// population : int, default 100
///     Candidates per generation.
/// generations : int, default 100
///     Planned number of generations; GWO decreases its coefficient a over them. Searches whose populations differ in size (lshade,
///     cmaes) spend population times generations evaluations, after which `ask` returns no candidates.
/// seed, run : int, default 1 and 0
///     Seed and number of the run. Runs of one seed are independent; all methods but cmaes start run k of a seed
///     from the same population.
/// set : str, sequence or mapping
///     Settings of the method, {"mutation": 0.1}.
///
/// Raises
/// ------
/// UsageError, ValueError
///     If a setting is wrong, or the bounds have another shape.
#[pyclass(frozen, module = "motorfit")]
pub struct Optimizer {
    search: Mutex<Search>,
    width: usize,
    /// Name of the method.
    #[pyo3(get)]
    method: String,
}

struct Search {
    optimizer: Box<dyn motorfit::optimize::Optimizer>,
    /// True if `ask` has been called since the last `tell`.
    is_asked: bool,
}

impl Optimizer {
    fn search(&self) -> PyResult<MutexGuard<'_, Search>> {
        self.search
            .lock()
            .map_err(|_| PyRuntimeError::new_err("the search failed with an internal error; create a new Optimizer"))
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
        let setup = SearchSettings { bounds, population, generations, seed, run, ..SearchSettings::default() };
        let set = set.map_or_else(|| Ok(Vec::new()), |set| spec::items(set, "set"))?;
        let optimizer = settings::method(method, &set).and_then(|method| method.optimizer(setup)).raise(py)?;
        if optimizer.needs_local_search() {
            let message = format!("{method} descends along the residuals of recordings, which costs do not give");
            return Err(Error::usage(message, "Choose another method, or use identify.")).raise(py);
        }
        let search = Mutex::new(Search { optimizer, is_asked: false });
        Ok(Self { search, width, method: method.to_owned() })
    }

    /// Returns the candidates to evaluate next.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, p)
    ///     One candidate per row; repeated calls before `tell` return the same.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut search = self.search()?;
        let values = search.optimizer.ask().values().to_vec();
        search.is_asked = true;
        drop(search);
        rows(py, values, self.width)
    }

    /// Takes the costs of the candidates that the last `ask` returned.
    ///
    /// Parameters
    /// ----------
    /// costs : array_like, shape (n,)
    ///     Costs; nan or inf for candidates that could not be evaluated.
    ///
    /// Raises
    /// ------
    /// RuntimeError
    ///     If `ask` has not been called since the last `tell`.
    /// ValueError
    ///     If the number of costs is not the number of candidates.
    fn tell(&self, costs: &Bound<'_, PyAny>) -> PyResult<()> {
        let costs = signal(costs, "costs")?;
        let mut search = self.search()?;
        if !search.is_asked {
            return Err(PyRuntimeError::new_err("no candidates are waiting for costs; call ask() first"));
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

    /// Returns the best candidate found.
    ///
    /// Returns
    /// -------
    /// (ndarray of shape (p,), float) or None
    ///     Candidate of the lowest cost, and this cost; None before the first finite cost.
    fn best<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyArray1<f64>>, f64)>> {
        let search = self.search()?;
        Ok(search.optimizer.best().map(|best| (array(py, best.values.to_vec()), best.cost)))
    }

    fn __repr__(&self) -> PyResult<String> {
        let best = self
            .search()?
            .optimizer
            .best()
            .map_or("no finite cost yet".to_owned(), |best| format!("cost {}", best.cost));
        Ok(format!("<Optimizer {} of {} parameters: {best}>", self.method, self.width))
    }
}
