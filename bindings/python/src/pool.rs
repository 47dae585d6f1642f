//! Thread pools that survive a fork. A forked process has none of its parent's threads, and work given to them would never
//! run, so each process starts its own.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// Thread pool that is started at its first use in each process.
pub struct Pool {
    /// Number of threads; `None` for one per core.
    threads: Option<usize>,
    /// Running pool, with the id of its process.
    started: Mutex<Option<(u32, Arc<ThreadPool>)>>,
}

/// Pool with one thread per core.
static ALL: Pool = Pool::new(None);

impl Pool {
    /// Creates a pool of `threads` threads, or of one per core.
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
        // The threads of the parent's pool do not exist in this process, so the pool must not be dropped.
        if let Some(parents) = started.replace((process, pool.clone())) {
            std::mem::forget(parents);
        }
        Ok(pool)
    }

    /// Runs `work` on this pool, without the interpreter's lock.
    pub fn run<T: Send>(&self, py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        let pool = self.started()?;
        Ok(py.detach(|| pool.install(work)))
    }
}

/// Runs `work` on the pool with one thread per core, without the interpreter's lock.
pub fn on_all<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    ALL.run(py, work)
}

/// Returns the pool with one thread per core, for work on another thread.
pub fn all() -> PyResult<Arc<ThreadPool>> {
    ALL.started()
}
