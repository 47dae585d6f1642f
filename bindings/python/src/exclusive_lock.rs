//! A lock for objects that several Python threads share. Waiting for it can be interrupted by Ctrl-C.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
use std::time::Duration;

/// Interval between checks for signals while waiting.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(20);

/// Lock that is owned by a thread of a process.
#[derive(Default)]
pub struct ExclusiveLock {
    owner: Mutex<Option<(u32, ThreadId)>>,
    freed: Condvar,
}

/// Guard that releases the lock when dropped.
pub struct Guard<'a>(&'a ExclusiveLock);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        *self.0.owner() = None;
        self.0.freed.notify_one();
    }
}

impl ExclusiveLock {
    fn owner(&self) -> MutexGuard<'_, Option<(u32, ThreadId)>> {
        self.owner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Acquires the lock, waiting until it is free.
    ///
    /// # Errors
    /// Returns `RuntimeError` if this thread owns it already, as in a signal handler; the exception of a signal while
    /// waiting.
    pub fn take(&self, py: Python<'_>, what: &str) -> PyResult<Guard<'_>> {
        let own = (std::process::id(), std::thread::current().id());
        loop {
            match *self.owner() {
                Some(other) if other == own => {
                    return Err(PyRuntimeError::new_err(format!("{what} was called from within one of its own calls")));
                }
                Some((process, _)) if process == own.0 => {}
                // Free, or owned by a thread of the parent process, which does not exist after a fork.
                ref mut owner => {
                    *owner = Some(own);
                    return Ok(Guard(self));
                }
            }
            py.detach(|| {
                let owner = self.owner();
                if owner.is_some() {
                    drop(self.freed.wait_timeout(owner, SIGNAL_INTERVAL));
                }
            });
            py.check_signals()?;
        }
    }
}
