//! Computations with progress callbacks and interruption: the work runs on other threads, while the calling thread checks for
//! signals and calls the callback.

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

/// Interval between checks for signals.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(20);
/// Time that interrupted work has to stop; after it the caller returns and the work ends in the background.
const PATIENCE: Duration = Duration::from_millis(200);

/// Interval at which a thread that waits for the callback looks for other work of the pool.
const PAUSE: Duration = Duration::from_millis(1);

/// Progress of a population search.
#[pyclass(frozen, get_all, module = "motorfit")]
pub struct Progress {
    /// Number of finished generations.
    generation: u64,
    /// Number of planned generations.
    generations: u64,
    /// Number of candidates evaluated.
    evaluations: u64,
    /// Lowest cost found.
    cost: f64,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        let Self { generation, generations, evaluations, cost } = self;
        format!("Progress(generation={generation}, generations={generations}, evaluations={evaluations}, cost={cost})")
    }
}

/// Function that creates the callback's argument.
type MakeState = Box<dyn FnOnce(Python<'_>) -> PyResult<Py<PyAny>> + Send>;
/// Function that passes a state to the calling thread and waits for the callback's decision.
type Ask = Box<dyn Fn(MakeState) -> ControlFlow<()> + Send + Sync>;

/// Messages to the calling thread.
enum Message<T> {
    Progress(MakeState, std::sync::mpsc::SyncSender<ControlFlow<()>>),
    Done(T),
}

/// Observer that the work reports its progress to.
pub struct Watch {
    cancelled: Arc<AtomicBool>,
    /// `None` without a callback.
    ask: Option<Ask>,
}

impl Watch {
    /// Reports a generation to the callback. Returns `Break` if the work is to end.
    pub fn generation(&self, progress: &motorfit::optimize::Progress) -> ControlFlow<()> {
        let motorfit::optimize::Progress { generation, generations, evaluations, cost } = *progress;
        self.report(Progress { generation: generation as u64, generations: generations as u64, evaluations, cost })
    }

    /// Returns `Break` if the work was cancelled.
    pub fn check(&self) -> ControlFlow<()> {
        if self.cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Reports a state to the callback. Returns `Break` if the work is to end.
    pub fn report<T: PyClass + Into<PyClassInitializer<T>> + Send + 'static>(&self, state: T) -> ControlFlow<()> {
        self.check()?;
        match &self.ask {
            Some(ask) => ask(Box::new(|py| Ok(Py::new(py, state)?.into_any()))),
            None => ControlFlow::Continue(()),
        }
    }
}

/// Runs `work` on all threads without the interpreter's lock. Ctrl-C, an exception in the callback and its return value
/// `False` end the work; the callback runs in the calling thread.
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
    Box::new(move |state| {
        let (answer, answered) = sync_channel(1);
        // The caller has returned.
        if sender.send(Message::Progress(state, answer)).is_err() {
            return ControlFlow::Break(());
        }
        // The callback may use the same pool, of which this may be the only thread: its work is done meanwhile.
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
    // `Receiver` is not `Sync`, which `detach` requires.
    let receiver = Mutex::new(receiver);
    let mut raised: Option<(PyErr, Instant)> = None;
    loop {
        let received = py.detach(|| match receiver.lock() {
            Ok(receiver) => receiver.recv_timeout(SIGNAL_INTERVAL),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        let mut failed = None;
        match received {
            Ok(Message::Done(done)) => return raised.map_or(Ok(done), |(error, _)| Err(error)),
            Ok(Message::Progress(state, answer)) => {
                let called = callback
                    .as_ref()
                    .map_or(Ok(ControlFlow::Continue(())), |callback| called(py, callback, state(py)?));
                let _ = answer.send(*called.as_ref().unwrap_or(&ControlFlow::Break(())));
                failed = called.err();
            }
            Err(RecvTimeoutError::Disconnected) => {
                let message = "the computation ended without a result; this is a bug of motorfit, please report it";
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

/// Calls the callback. Returns `Break` if it returns a false `bool` of Python or numpy; other values continue the work.
fn called(py: Python<'_>, callback: &Py<PyAny>, state: Py<PyAny>) -> PyResult<ControlFlow<()>> {
    let answer = callback.bind(py).call1((state,))?;
    if answer.hasattr("__await__")? {
        let _ = answer.call_method0("close");
        return Err(PyTypeError::new_err("progress: give a plain function, not a coroutine"));
    }
    let is_bool = answer.is_instance_of::<PyBool>() || answer.get_type().name()?.to_str()?.starts_with("bool");
    Ok(if is_bool && !answer.is_truthy()? { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
}
