//! Sweeps: planned, run, watched, merged; and what a shard needs on another machine.

use crate::errors::Raise as _;
use crate::paces::paces;
use crate::pool::on_all;
use crate::progress::{Watch, watched};
use crate::spec;
use motorfit::device::with_threads;
use motorfit::report::json;
use motorfit::report::sweep::{status_document, sweep_document, tally_document};
use motorfit::setting::Setting;
use motorfit::settings::values;
use motorfit::study::sweep::{Limits, Shard, Sweep as Planned, SweepProgress as State, Tally};
use motorfit::{Error, Result};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two calls of a callback: threads of the interpreter that are busy must not hold the work up.
const PAUSE: Duration = Duration::from_millis(100);

/// Progress of a shard.
#[pyclass(frozen, get_all, module = "motorfit")]
pub struct SweepProgress {
    /// Runs of the shard that are finished, those of earlier times included.
    done: u64,
    /// Runs of the shard.
    total: u64,
    /// Runs that were finished before.
    before: u64,
    /// Runs without a result.
    failed: u64,
    /// Seconds since it began.
    seconds: f64,
    /// Runs a second; `None` before there is any.
    rate: Option<f64>,
    /// Seconds that are left at this rate.
    remaining: Option<f64>,
}

#[pymethods]
impl SweepProgress {
    fn __repr__(&self) -> String {
        let Self { done, total, failed, seconds, .. } = self;
        format!("SweepProgress(done={done}, total={total}, failed={failed}, seconds={seconds:.1})")
    }
}

impl From<&State> for SweepProgress {
    fn from(state: &State) -> Self {
        let State { done, total, before, failed, seconds, .. } = *state;
        Self { done, total, before, failed, seconds, rate: state.rate(), remaining: state.remaining() }
    }
}

/// A planned sweep: a folder with its manifest, results files of its shards, and the merge of them.
///
/// `Sweep.plan(study, out)` makes one, `Sweep.open(folder)` opens it, here or on another machine. A shard is a pair
/// (I, N), the first (1, N): any N shards together are the sweep.
#[pyclass(frozen, module = "motorfit")]
pub struct Sweep(Arc<Planned>);

#[pymethods]
impl Sweep {
    /// Pins a study (TOML) in a folder: recordings with their digests, device, runs. A folder that the same study was
    /// planned in is opened.
    #[staticmethod]
    fn plan(py: Python<'_>, study: PathBuf, out: PathBuf) -> PyResult<Self> {
        let planned = on_all(py, || Planned::plan(&study, &out, paces()))?.raise(py)?;
        Ok(Self(Arc::new(planned.0)))
    }

    /// Opens the folder of a planned sweep.
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        Ok(Self(Arc::new(on_all(py, || Planned::open(&folder))?.raise(py)?)))
    }

    /// The study's name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.manifest().name
    }

    /// Returns the number of runs.
    #[getter]
    fn runs(&self) -> u64 {
        self.0.manifest().runs
    }

    /// The names of its motors, in the order of their runs.
    #[getter]
    fn motors(&self) -> Vec<&str> {
        self.0.manifest().motors.iter().map(|motor| motor.motor.as_str()).collect()
    }

    /// The folder of the sweep.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.0.folder().to_path_buf()
    }

    /// The folder that paths of recordings start at: that of the study.
    #[getter]
    fn origin(&self) -> PathBuf {
        PathBuf::from(&self.0.manifest().folder)
    }

    /// SHA-256 of the manifest.
    #[getter]
    fn digest(&self) -> &str {
        self.0.digest()
    }

    /// Runs what is left of a shard, and tells what was done as `motorfit sweep run --json` does.
    ///
    /// Finished runs are kept at once: after Ctrl-C, an exception of the callback or its answer `False` the same call goes
    /// on where it was. `recordings` is a folder that stands for the study's.
    #[pyo3(signature = (*, shard=(1, 1), threads=None, progress=None, recordings=None))]
    #[pyo3(text_signature = "($self, *, shard=(1, 1), threads=None, progress=None, recordings=None)")]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn run<'py>(
        &self,
        py: Python<'py>,
        shard: (u64, u64),
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
        recordings: Option<PathBuf>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let shard = shard_of(shard).raise(py)?;
        motorfit::device::check_threads(threads).raise(py)?;
        let sweep = match recordings {
            Some(folder) => Arc::new(Planned::clone(&self.0).with_recordings(&folder)),
            None => self.0.clone(),
        };
        let tally = watched(py, progress, move |watch| run(&sweep, shard, threads, watch))?.raise(py)?;
        if let Some(fault) = &tally.fault {
            return Err(crate::errors::exception(py, fault));
        }
        loaded(py, &json(&tally_document(shard, &tally)))
    }

    /// Returns the progress, as `motorfit sweep status --json` prints it.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let status = on_all(py, || self.0.status())?.raise(py)?;
        loaded(py, &json(&status_document(&status)))
    }

    /// Puts the results of all shards in order, in results.jsonl, and sums them up as `motorfit sweep merge --json` does,
    /// with the path of the file as "results" and the results by level of trust as "trust". Runs may be missing. `limits`
    /// are those that parameters of a motor must keep, in SI units.
    #[pyo3(signature = (*, limits=None))]
    fn merge<'py>(&self, py: Python<'py>, limits: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        let limits = limits_of(limits, py)?;
        let merged = on_all(py, || self.0.merge())?.raise(py)?;
        let document = loaded(py, &json(&sweep_document(&merged.summary, &limits)))?;
        document.set_item("results", merged.results)?;
        Ok(document)
    }

    /// Limits that are none are an error before the work, not after it.
    #[staticmethod]
    fn _check_limits(py: Python<'_>, limits: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        limits_of(limits, py).map(drop)
    }

    /// Returns the number of runs that each of `count` shards has left.
    fn left(&self, py: Python<'_>, count: u64) -> PyResult<Vec<u64>> {
        shard_of((1, count)).raise(py)?;
        on_all(py, || self.0.left(count))?.raise(py)
    }

    /// The files of the recordings that a shard reads, as the study names them.
    fn recordings(&self, py: Python<'_>, shard: (u64, u64)) -> PyResult<Vec<String>> {
        let shard = shard_of(shard).raise(py)?;
        on_all(py, || self.0.recordings(shard))
    }

    /// Returns results files by name, with the finished runs of a shard alone: another machine need not do them again.
    fn finished<'py>(&self, py: Python<'py>, shard: (u64, u64)) -> PyResult<Bound<'py, PyDict>> {
        let shard = shard_of(shard).raise(py)?;
        let files = PyDict::new(py);
        for (name, lines) in on_all(py, || self.0.finished(shard))?.raise(py)? {
            files.set_item(name, PyBytes::new(py, &lines))?;
        }
        Ok(files)
    }

    /// Keeps the results file of a shard that was run on another machine; tells how many of its runs are new.
    fn take(&self, py: Python<'_>, shard: (u64, u64), results: &[u8]) -> PyResult<u64> {
        let shard = shard_of(shard).raise(py)?;
        on_all(py, || self.0.take(shard, results))?.raise(py)
    }

    fn __repr__(&self) -> String {
        let manifest = self.0.manifest();
        format!("<Sweep {}: {} runs of {} motors>", manifest.name, manifest.runs, manifest.motors.len())
    }
}

/// Runs a shard, watched.
fn run(sweep: &Planned, shard: Shard, threads: Option<usize>, watch: &Watch) -> Result<Tally> {
    let mut told: Option<Instant> = None;
    let mut observe = |state: &State| {
        if state.done < state.total && told.is_some_and(|told| told.elapsed() < PAUSE) {
            return watch.look();
        }
        let flow: ControlFlow<()> = watch.tell(SweepProgress::from(state));
        told = Some(Instant::now());
        flow
    };
    with_threads(threads, || sweep.run(shard, &mut observe))
}

fn shard_of((index, count): (u64, u64)) -> Result<Shard> {
    Shard::new(index, count).ok_or_else(|| {
        let message = format!("shard: ({index}, {count}) is no shard");
        Error::usage(message, "Give (I, N) with I from 1 to N, as in shard=(2, 7).")
    })
}

fn limits_of(limits: Option<&Bound<'_, PyAny>>, py: Python<'_>) -> PyResult<Limits> {
    let items = limits.map(|limits| spec::items(limits, "limits")).transpose()?.unwrap_or_default();
    values::ranges(&items, Setting::Limits).and_then(Limits::new).raise(py)
}

/// A document as Python's values.
fn loaded<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
