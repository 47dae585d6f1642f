//! Threads that work for this process. A process that was forked has none of its parent's threads, and work that is
//! handed to them is never done; so there threads are started anew.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// Threads that are started at the first work in each process; `None` for all that there are.
pub struct Pool {
    threads: Option<usize>,
    /// With the process that they are of.
    started: Mutex<Option<(u32, Arc<ThreadPool>)>>,
}

/// All threads.
static ALL: Pool = Pool::new(None);

impl Pool {
    /// So many.
    pub const fn new(threads: Option<usize>) -> Self {
        Self { threads, started: Mutex::new(None) }
    }

    fn started(&self) -> PyResult<Arc<ThreadPool>> {
        let mut started = self.started.lock().unwrap_or_else(PoisonError::into_inner);
        let process = std::process::id();
        if let Some((of, pool)) = &*started
            && *of == process
        {
            return Ok(pool.clone());
        }
        let failed =
            |e: rayon::ThreadPoolBuildError| PyRuntimeError::new_err(format!("threads cannot be started: {e}"));
        let pool =
            ThreadPoolBuilder::new().num_threads(self.threads.unwrap_or(0)).build().map(Arc::new).map_err(failed)?;
        // Those of the parent are not there to be told to end.
        if let Some(parents) = started.replace((process, pool.clone())) {
            std::mem::forget(parents);
        }
        Ok(pool)
    }

    /// Does `work` on these threads, without the interpreter's lock.
    pub fn run<T: Send>(&self, py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        let pool = self.started()?;
        Ok(py.detach(|| pool.install(work)))
    }
}

/// Does `work` on all threads, without the interpreter's lock.
pub fn on_all<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    ALL.run(py, work)
}

/// The threads that work which a thread of its own does may use.
pub fn all() -> PyResult<Arc<ThreadPool>> {
    ALL.started()
}
