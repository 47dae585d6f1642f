//! One at a time: threads that share an object wait for their turn, and can be interrupted meanwhile.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
use std::time::Duration;

/// How often one that waits looks for signals.
const LOOK: Duration = Duration::from_millis(20);

/// A seat for one thread of this process.
#[derive(Default)]
pub struct Seat {
    taken: Mutex<Option<(u32, ThreadId)>>,
    left: Condvar,
}

/// The seat while it is taken.
pub struct Taken<'a>(&'a Seat);

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        *self.0.taken() = None;
        self.0.left.notify_one();
    }
}

impl Seat {
    fn taken(&self) -> MutexGuard<'_, Option<(u32, ThreadId)>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the seat, as soon as it is left. One who sits there already is told so: a signal's handler, say.
    pub fn take(&self, py: Python<'_>, what: &str) -> PyResult<Taken<'_>> {
        let own = (std::process::id(), std::thread::current().id());
        loop {
            match *self.taken() {
                Some(other) if other == own => {
                    return Err(PyRuntimeError::new_err(format!("{what} is called within its own work")));
                }
                // Who sat there when this process was forked is not there any more.
                Some((process, _)) if process == own.0 => {}
                ref mut taken => {
                    *taken = Some(own);
                    return Ok(Taken(self));
                }
            }
            py.detach(|| {
                let taken = self.taken();
                if taken.is_some() {
                    drop(self.left.wait_timeout(taken, LOOK));
                }
            });
            py.check_signals()?;
        }
    }
}
