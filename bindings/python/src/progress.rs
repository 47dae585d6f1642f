//! Work that can be watched and interrupted: it runs in a thread of its own, while the caller's looks out for signals.

use pyo3::prelude::*;
use pyo3::types::PyBool;
use pyo3::{PyClass, pyclass_init::PyClassInitializer};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How often signals are looked for.
const LOOK: Duration = Duration::from_millis(20);
/// How long work may take to stop once it was interrupted; after that it is left to end by itself.
const PATIENCE: Duration = Duration::from_secs(2);

/// How far a search is.
#[pyclass(frozen, get_all, module = "motorfit")]
pub struct Progress {
    /// Generations that are done.
    generation: u64,
    /// Generations in all.
    generations: u64,
    /// Candidates evaluated.
    evaluations: u64,
    /// The lowest cost so far.
    cost: f64,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        let Self { generation, generations, evaluations, cost } = self;
        format!("Progress(generation={generation}, generations={generations}, evaluations={evaluations}, cost={cost})")
    }
}

/// What work is watched by.
pub struct Watch {
    cancelled: Arc<AtomicBool>,
    callback: Option<Py<PyAny>>,
    raised: Arc<Mutex<Option<PyErr>>>,
}

impl Watch {
    /// Tells the callback of a generation, unless the work is to end.
    pub fn generation(&self, progress: &motorfit::optimize::Progress) -> ControlFlow<()> {
        let motorfit::optimize::Progress { generation, generations, evaluations, cost } = *progress;
        self.tell(Progress { generation: generation as u64, generations: generations as u64, evaluations, cost })
    }

    /// Whether the work may go on.
    pub fn look(&self) -> ControlFlow<()> {
        if self.cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Tells the callback how far the work is, unless it is to end.
    pub fn tell<T: PyClass + Into<PyClassInitializer<T>>>(&self, state: T) -> ControlFlow<()> {
        self.look()?;
        let Some(callback) = &self.callback else { return ControlFlow::Continue(()) };
        let stop = Python::attach(|py| match Py::new(py, state).and_then(|state| callback.call1(py, (state,))) {
            Ok(answer) => answer.bind(py).is(PyBool::new(py, false)),
            Err(error) => {
                if let Ok(mut raised) = self.raised.lock() {
                    raised.get_or_insert(error);
                }
                true
            }
        });
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Does `work` without the interpreter's lock. Ctrl-C ends it, and so do an exception of the callback and its answer
/// `False`.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send + 'static,
) -> PyResult<T> {
    let (cancelled, raised) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(None)));
    let watch = Watch { cancelled: cancelled.clone(), callback, raised: raised.clone() };
    let (sender, receiver) = channel();
    std::thread::Builder::new().name("motorfit".to_owned()).spawn(move || {
        let _ = sender.send(work(&watch));
    })?;
    // Receivers cannot be shared as they are.
    let receiver = Mutex::new(receiver);
    let mut interrupted: Option<(PyErr, Instant)> = None;
    loop {
        let received = py.detach(|| match receiver.lock() {
            Ok(receiver) => receiver.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match received {
            Ok(done) => {
                let own = raised.lock().ok().and_then(|mut raised| raised.take());
                return match own.or(interrupted.map(|(error, _)| error)) {
                    Some(error) => Err(error),
                    None => Ok(done),
                };
            }
            Err(RecvTimeoutError::Disconnected) => {
                let message = "the work ended without a result; this is a fault of motorfit: please report it";
                return Err(pyo3::exceptions::PyRuntimeError::new_err(message));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        match (py.check_signals(), &interrupted) {
            (Err(error), None) => {
                cancelled.store(true, Ordering::Relaxed);
                interrupted = Some((error, Instant::now()));
            }
            (Err(error), Some(_)) => return Err(error),
            (Ok(()), _) => {}
        }
        if interrupted.as_ref().is_some_and(|(_, since)| since.elapsed() > PATIENCE)
            && let Some((error, _)) = interrupted.take()
        {
            return Err(error);
        }
    }
}
