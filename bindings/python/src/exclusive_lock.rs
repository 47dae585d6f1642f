//! One at a time: threads that share an object wait for their turn, and can be interrupted meanwhile.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
use std::time::Duration;

/// Interval between looks for signals while waiting.
const LOOK: Duration = Duration::from_millis(20);

/// A lock that one thread of this process holds.
#[derive(Default)]
pub struct ExclusiveLock {
    owner: Mutex<Option<(u32, ThreadId)>>,
    freed: Condvar,
}

/// The lock while it is held.
pub struct Held<'a>(&'a ExclusiveLock);

impl Drop for Held<'_> {
    fn drop(&mut self) {
        *self.0.owner() = None;
        self.0.freed.notify_one();
    }
}

impl ExclusiveLock {
    fn owner(&self) -> MutexGuard<'_, Option<(u32, ThreadId)>> {
        self.owner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the lock as soon as it is free. A thread that holds it already gets an error: a signal's handler, say.
    pub fn take(&self, py: Python<'_>, what: &str) -> PyResult<Held<'_>> {
        let own = (std::process::id(), std::thread::current().id());
        loop {
            match *self.owner() {
                Some(other) if other == own => {
                    return Err(PyRuntimeError::new_err(format!("{what} is called within its own work")));
                }
                // The thread that held it when this process was forked is not there any more.
                Some((process, _)) if process == own.0 => {}
                ref mut owner => {
                    *owner = Some(own);
                    return Ok(Held(self));
                }
            }
            py.detach(|| {
                let owner = self.owner();
                if owner.is_some() {
                    drop(self.freed.wait_timeout(owner, LOOK));
                }
            });
            py.check_signals()?;
        }
    }
}
