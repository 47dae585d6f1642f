//! `Sweep`: planning, running and merging studies, and moving shards to other machines.

use crate::answers::TEXT_WIDTH;
use crate::errors::Raise as _;
use crate::pool::on_all;
use crate::progress::{Watch, watched};
use crate::spec;
use crate::throughput_profile::throughput_profile;
use motorfit::device::with_threads;
use motorfit::report::sweep::{motors_csv, status_document, sweep_document, sweep_parts, tally_document};
use motorfit::report::{Part, html_fragment, json, plain_text};
use motorfit::study::sweep::{Limits, Shard, Sweep as Planned, SweepProgress as State, Tally};
use motorfit::{Error, Result};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Minimum interval between calls of the callback, because each call waits for the interpreter's lock.
const PAUSE: Duration = Duration::from_millis(100);

/// Progress of a shard of a sweep.
#[pyclass(frozen, get_all, module = "motorfit")]
pub struct SweepProgress {
    /// Finished runs of the shard, including those of earlier calls.
    done: u64,
    /// Number of runs of the shard.
    total: u64,
    /// Runs that earlier calls had finished.
    before: u64,
    /// Finished runs without a result.
    failed: u64,
    /// Time since the start of the call [s].
    seconds: f64,
    /// Runs per second of this call; `None` until it can be estimated.
    rate: Option<f64>,
    /// Estimated remaining time at this rate [s]; `None` without a rate.
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

/// Planned sweep: a folder with the manifest of a study, results files of its shards, and their merge.
///
/// `Sweep.plan(study, out)` creates the folder and `Sweep.open(folder)` opens it, on this or another machine. Shard (I, N) is
/// the I-th of N disjoint parts of the runs, counted from 1.
#[pyclass(frozen, module = "motorfit")]
pub struct Sweep(Arc<Planned>);

#[pymethods]
impl Sweep {
    /// Plans a study: writes a manifest with the digests of the recordings, the device and the runs.
    ///
    /// Parameters
    /// ----------
    /// study : str or PathLike
    ///     Study file (TOML).
    /// out : str or PathLike
    ///     New folder, or the folder of the same study, which is opened.
    ///
    /// Returns
    /// -------
    /// Sweep
    ///
    /// Raises
    /// ------
    /// UsageError, DataError, DeviceError
    ///     If the study is wrong, a file cannot be read or written, or the device is not available.
    #[staticmethod]
    fn plan(py: Python<'_>, study: PathBuf, out: PathBuf) -> PyResult<Self> {
        let planned = on_all(py, || Planned::plan(&study, &out, throughput_profile()))?.raise(py)?;
        Ok(Self(Arc::new(planned.0)))
    }

    /// Opens the folder of a planned sweep.
    ///
    /// Parameters
    /// ----------
    /// folder : str or PathLike
    ///     Folder with the manifest.
    ///
    /// Returns
    /// -------
    /// Sweep
    ///
    /// Raises
    /// ------
    /// DataError
    ///     If the folder has no readable manifest.
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        Ok(Self(Arc::new(on_all(py, || Planned::open(&folder))?.raise(py)?)))
    }

    /// Name of the study.
    #[getter]
    fn name(&self) -> &str {
        &self.0.manifest().name
    }

    /// Number of runs.
    #[getter]
    fn runs(&self) -> u64 {
        self.0.manifest().runs
    }

    /// Names of the motors, in the order of their runs.
    #[getter]
    fn motors(&self) -> Vec<&str> {
        self.0.manifest().motors.iter().map(|motor| motor.motor.as_str()).collect()
    }

    /// Folder of the sweep.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.0.folder().to_path_buf()
    }

    /// Folder of the study, to which the paths of the recordings are relative.
    #[getter]
    fn origin(&self) -> PathBuf {
        PathBuf::from(&self.0.manifest().folder)
    }

    /// SHA-256 of the manifest, in hexadecimal.
    #[getter]
    fn digest(&self) -> &str {
        self.0.digest()
    }

    /// Runs the unfinished runs of a shard.
    ///
    /// Each finished run is stored at once. After Ctrl-C, an exception in the callback or its return value False, the same
    /// call resumes the shard.
    ///
    /// Parameters
    /// ----------
    /// shard : (int, int), default (1, 1)
    ///     Shard (I, N) with I from 1 to N.
    /// threads : int, optional
    ///     Number of threads; all by default.
    /// progress : callable, optional
    ///     Called with a `SweepProgress` at most ten times a second, in the calling thread. The shard ends when it returns
    ///     False.
    /// recordings : str or PathLike, optional
    ///     Folder to which the paths of the recordings are relative, instead of `origin`.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Numbers of runs, as `motorfit sweep run --json` prints them.
    ///
    /// Raises
    /// ------
    /// UsageError, DataError, DeviceError
    ///     If an argument is wrong, a file cannot be read or written, another process runs this shard, or the device is not
    ///     available.
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

    /// Returns the progress of the sweep and its shards, as `motorfit sweep status --json` prints it.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let status = on_all(py, || self.0.status())?.raise(py)?;
        loaded(py, &json(&status_document(&status)))
    }

    /// Merges the results of all shards into results.jsonl, sorted by run, and summarizes them. Runs may be missing.
    ///
    /// Parameters
    /// ----------
    /// limits : str, sequence or mapping, optional
    ///     Tolerance limits of the parameters in SI units, {"R": (0.8, 1.0)}, by default those of the study; motors
    ///     outside of them are listed.
    ///
    /// Returns
    /// -------
    /// SweepSummary
    ///     A dict as `motorfit sweep merge --json` prints it, with counts by level of trust as "trust", and the path of
    ///     results.jsonl as "results"; `to_frame()` has a row for each motor.
    ///
    /// Raises
    /// ------
    /// UsageError, DataError
    ///     If the limits are wrong, or a file cannot be read or written.
    #[pyo3(signature = (*, limits=None))]
    fn merge<'py>(&self, py: Python<'py>, limits: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        let limits = self.0.limits_or_own(limits_of(limits, py)?).raise(py)?;
        let merged = on_all(py, || self.0.merge())?.raise(py)?;
        let document = loaded(py, &json(&sweep_document(&merged.summary, &limits)))?;
        document.set_item("results", merged.results)?;
        let parts = sweep_parts(&merged.summary, &limits);
        let class = py.import("motorfit._summary")?.getattr("SweepSummary")?;
        let motors = motors_csv(&merged.summary, &limits);
        class.call1((document, plain_text(&parts, TEXT_WIDTH), html_fragment(&parts), motors))
    }

    /// Checks limits before the runs instead of after them.
    #[staticmethod]
    fn _check_limits(py: Python<'_>, limits: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        limits_of(limits, py).map(drop)
    }

    /// Returns the number of unfinished runs of each of `count` shards, a list of length `count`.
    fn left(&self, py: Python<'_>, count: u64) -> PyResult<Vec<u64>> {
        shard_of((1, count)).raise(py)?;
        on_all(py, || self.0.left(count))?.raise(py)
    }

    /// Returns the paths of the recordings that a shard reads, as the study names them.
    fn recordings(&self, py: Python<'_>, shard: (u64, u64)) -> PyResult<Vec<String>> {
        let shard = shard_of(shard).raise(py)?;
        on_all(py, || self.0.recordings(shard))
    }

    /// Returns results files by name, reduced to the finished runs of a shard, so that another machine need not repeat them.
    fn finished<'py>(&self, py: Python<'py>, shard: (u64, u64)) -> PyResult<Bound<'py, PyDict>> {
        let shard = shard_of(shard).raise(py)?;
        let files = PyDict::new(py);
        for (name, lines) in on_all(py, || self.0.finished(shard))?.raise(py)? {
            files.set_item(name, PyBytes::new(py, &lines))?;
        }
        Ok(files)
    }

    /// Adds the results file of a shard that was run on another machine.
    ///
    /// Parameters
    /// ----------
    /// shard : (int, int)
    ///     Shard (I, N) with I from 1 to N.
    /// results : bytes
    ///     Contents of the results file.
    ///
    /// Returns
    /// -------
    /// int
    ///     Number of new runs.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     If the file is damaged or belongs to another study or shard, or the folder cannot be written.
    fn take(&self, py: Python<'_>, shard: (u64, u64), results: &[u8]) -> PyResult<u64> {
        let shard = shard_of(shard).raise(py)?;
        on_all(py, || self.0.take(shard, results))?.raise(py)
    }

    /// Returns the progress as HTML for notebooks.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let status = on_all(py, || self.0.status())?.raise(py)?;
        let (done, failed, missing) = (status.done, status.failed, status.missing);
        let merged = if status.merged { "; merged" } else { "" };
        let mut parts = vec![Part::Text(self.__repr__())];
        parts.push(Part::Text(format!(
            "{done} runs finished, {failed} of them without a result, {missing} missing{merged}."
        )));
        Ok(html_fragment(&parts))
    }

    fn __repr__(&self) -> String {
        let manifest = self.0.manifest();
        format!("<Sweep {}: {} runs of {} motors>", manifest.name, manifest.runs, manifest.motors.len())
    }
}

/// Runs a shard and reports its progress at most once per [`PAUSE`].
fn run(sweep: &Planned, shard: Shard, threads: Option<usize>, watch: &Watch) -> Result<Tally> {
    let mut reported: Option<Instant> = None;
    let mut observe = |state: &State| {
        if state.done < state.total && reported.is_some_and(|reported| reported.elapsed() < PAUSE) {
            return watch.check();
        }
        let flow: ControlFlow<()> = watch.report(SweepProgress::from(state));
        reported = Some(Instant::now());
        flow
    };
    with_threads(threads, || sweep.run(shard, &mut observe))
}

fn shard_of((index, count): (u64, u64)) -> Result<Shard> {
    Shard::new(index, count).ok_or_else(|| {
        let message = format!("shard: ({index}, {count}) is not a shard");
        Error::usage(message, "Give (I, N) with I from 1 to N, as in shard=(2, 7).")
    })
}

fn limits_of(limits: Option<&Bound<'_, PyAny>>, py: Python<'_>) -> PyResult<Limits> {
    let items = limits.map(|limits| spec::items(limits, "limits")).transpose()?.unwrap_or_default();
    Limits::parse(&items).raise(py)
}

/// Parses a JSON document to Python objects.
fn loaded<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
