//! Work that can be watched and interrupted: it runs on threads of its own, while the caller's looks out for signals and
//! calls back.

use crate::pool;
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyBool;
use pyo3::{PyClass, pyclass_init::PyClassInitializer};
use rayon::Yield;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Interval between looks for signals.
const LOOK: Duration = Duration::from_millis(20);
/// The time in which interrupted work may stop; after that it is left to end by itself.
const PATIENCE: Duration = Duration::from_millis(200);

/// Interval in which work that waits looks for other work.
const PAUSE: Duration = Duration::from_millis(1);

/// Progress of a search.
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

/// A state as an object of Python.
type Told = Box<dyn FnOnce(Python<'_>) -> PyResult<Py<PyAny>> + Send>;
/// Hands a state to the thread that called, and waits for its answer.
type Ask = Box<dyn Fn(Told) -> ControlFlow<()> + Send + Sync>;

/// Messages to the calling thread.
enum Message<T> {
    Told(Told, std::sync::mpsc::SyncSender<ControlFlow<()>>),
    Done(T),
}

/// The observer of work.
pub struct Watch {
    cancelled: Arc<AtomicBool>,
    /// `None` where nobody listens.
    ask: Option<Ask>,
}

impl Watch {
    /// Tells the callback of a generation, unless the work is to end.
    pub fn generation(&self, progress: &motorfit::optimize::Progress) -> ControlFlow<()> {
        let motorfit::optimize::Progress { generation, generations, evaluations, cost } = *progress;
        self.tell(Progress { generation: generation as u64, generations: generations as u64, evaluations, cost })
    }

    /// Returns whether the work may go on.
    pub fn look(&self) -> ControlFlow<()> {
        if self.cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Tells the callback how far the work is, unless it is to end.
    pub fn tell<T: PyClass + Into<PyClassInitializer<T>> + Send + 'static>(&self, state: T) -> ControlFlow<()> {
        self.look()?;
        match &self.ask {
            Some(ask) => ask(Box::new(|py| Ok(Py::new(py, state)?.into_any()))),
            None => ControlFlow::Continue(()),
        }
    }
}

/// Does `work` without the interpreter's lock, on all threads. Ctrl-C ends it, and so do an exception of the callback,
/// which the thread that called calls, and its answer `False`.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send + 'static,
) -> PyResult<T> {
    if callback.as_ref().is_some_and(|callback| !callback.bind(py).is_callable()) {
        return Err(PyTypeError::new_err("progress: give a function of one argument"));
    }
    let cancelled = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let ask = callback.is_some().then(|| ask(sender.clone()));
    let watch = Watch { cancelled: cancelled.clone(), ask };
    let pool = pool::all()?;
    std::thread::Builder::new().name("motorfit".to_owned()).spawn(move || {
        let done = pool.install(|| work(&watch));
        let _ = sender.send(Message::Done(done));
    })?;
    listen(py, callback, &cancelled, receiver)
}

fn ask<T: Send + 'static>(sender: Sender<Message<T>>) -> Ask {
    Box::new(move |told| {
        let (answer, answered) = sync_channel(1);
        // Where nobody listens any more the work is to end.
        if sender.send(Message::Told(told, answer)).is_err() {
            return ControlFlow::Break(());
        }
        // What the callback itself asks of the threads is done meanwhile: this may be the only one.
        loop {
            match answered.recv_timeout(if rayon::yield_now() == Some(Yield::Executed) {
                Duration::ZERO
            } else {
                PAUSE
            }) {
                Ok(flow) => return flow,
                Err(RecvTimeoutError::Disconnected) => return ControlFlow::Break(()),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    })
}

fn listen<T: Send>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    cancelled: &AtomicBool,
    receiver: Receiver<Message<T>>,
) -> PyResult<T> {
    // Receivers cannot be shared as they are.
    let receiver = Mutex::new(receiver);
    let mut raised: Option<(PyErr, Instant)> = None;
    loop {
        let received = py.detach(|| match receiver.lock() {
            Ok(receiver) => receiver.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        let mut failed = None;
        match received {
            Ok(Message::Done(done)) => return raised.map_or(Ok(done), |(error, _)| Err(error)),
            Ok(Message::Told(told, answer)) => {
                let called =
                    callback.as_ref().map_or(Ok(ControlFlow::Continue(())), |callback| called(py, callback, told(py)?));
                let _ = answer.send(*called.as_ref().unwrap_or(&ControlFlow::Break(())));
                failed = called.err();
            }
            Err(RecvTimeoutError::Disconnected) => {
                let message = "the work ended without a result; this is a fault of motorfit: please report it";
                return Err(PyRuntimeError::new_err(message));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        match py.check_signals() {
            Err(error) if raised.is_some() => return Err(error),
            Err(error) => failed = Some(error),
            Ok(()) => {}
        }
        if let Some(error) = failed {
            cancelled.store(true, Ordering::Relaxed);
            raised.get_or_insert((error, Instant::now()));
        }
        if let Some((error, _)) = raised.take_if(|(_, since)| since.elapsed() > PATIENCE) {
            return Err(error);
        }
    }
}

/// Calls the callback; what it answers that is false, of Python or of numpy, ends the work.
fn called(py: Python<'_>, callback: &Py<PyAny>, state: Py<PyAny>) -> PyResult<ControlFlow<()>> {
    let answer = callback.bind(py).call1((state,))?;
    if answer.hasattr("__await__")? {
        let _ = answer.call_method0("close");
        return Err(PyTypeError::new_err("progress: give a plain function, not a coroutine"));
    }
    let is_bool = answer.is_instance_of::<PyBool>() || answer.get_type().name()?.to_str()?.starts_with("bool");
    Ok(if is_bool && !answer.is_truthy()? { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
}
