//! Methods side by side.

use crate::comparison::Comparison;
use crate::errors::Raise as _;
use crate::progress::{Watch, watched};
use crate::record::several;
use crate::spec::{self, Keywords};
use motorfit::device::with_threads;
use motorfit::evaluate::{Initial, Model};
use motorfit::identify::Method;
use motorfit::named::Named as _;
use motorfit::study::compare::{CompareSettings, CompareSpec, Comparison as Compared, Preset, Subject};
use motorfit::{Error, Result};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The settings of a comparison.
const COMPARE: [&str; 16] = [
    "preset",
    "methods",
    "runs",
    "criteria",
    "population",
    "generations",
    "set",
    "seed",
    "noise_records",
    "target",
    "bounds",
    "fix",
    "discretization",
    "device",
    "precision",
    "threads",
];
/// Keywords that the paper's set-up fixes.
const OF_PRESET: [&str; 7] = ["methods", "criteria", "population", "generations", "set", "bounds", "fix"];

/// Compares methods on recordings of one motor: the same number of runs of each under every setting, paired by their first
/// populations. Without recordings on the paper's experiment, simulated.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
/// progress : callable
///     Called with a `Progress`, by the thread that calls this; its answer False ends the comparison.
/// preset : {"paper"}
///     The set-up of the paper, without the settings that it has already.
#[doc = include_str!("docs/methods.txt")]
/// runs : int, default 50
///     Runs of each method.
/// criteria : str or sequence, default "nrmse:std"
///     What is minimized, CRITERION:SCALE; several are compared one by one.
/// population, generations : int or sequence of int, default 100
///     Agents, and generations with the first population; several are compared one by one.
/// set : str, sequence or mapping
///     Settings of methods, {"ga.mutation": 0.1}; several values as "0.1/0.2" are compared one by one.
/// seed : int, default 1
///     Seed of all runs.
/// noise_records : int, default 200
///     Records with new noise for Steiglitz-McBride, which has no seeds.
/// target : float
///     The cost that runs are to reach; a range of targets by default.
/// bounds : str, sequence or mapping
///     As of `identify`; default "table2" without a recording, else "auto".
/// fix : str, sequence or mapping
///     Parameters that are held, {"R": 0.92} in SI units.
/// discretization, device, precision, threads
///     As of `identify`.
///
/// Returns
/// -------
/// Comparison
#[pyfunction]
#[pyo3(signature = (records=None, *, progress=None, **settings))]
pub fn compare(
    py: Python<'_>,
    records: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Comparison> {
    let keys = Keywords::new(py, settings, &COMPARE)?;
    let subject = match records {
        Some(records) => Subject { records: several(records)?, truth: None },
        None => Subject::m2().raise(py)?,
    };
    let paper = keys.choice::<Preset>("preset")?.is_some();
    let twice =
        OF_PRESET.into_iter().find(|key| paper && keys.has(key)).or((paper && records.is_some()).then_some("records"));
    if let Some(key) = twice {
        let message = format!("preset=\"paper\" is without {key}");
        return Err(Error::usage(message, "Leave one of the two out.")).raise(py);
    }
    let (asked, spec) = (asked(py, &keys)?, spec(&keys, paper)?);
    let settings = if paper { CompareSpec::paper().settings } else { asked.settings().raise(py)? };
    let steiglitz_mcbride = asked.methods.contains(&Method::SteiglitzMcBride);
    let (threads, spec) = (spec.0, CompareSpec { settings, steiglitz_mcbride, ..spec.1 });
    let compared = watched(py, progress, move |watch| run(subject, &asked, spec, (threads, watch)))?.raise(py)?;
    Ok(Comparison::new(compared, paper))
}

fn run(subject: Subject, asked: &CompareSettings, spec: CompareSpec, on: (Option<usize>, &Watch)) -> Result<Compared> {
    let (threads, watch) = on;
    with_threads(threads, || {
        let spec = CompareSpec { space: asked.space(&subject, spec.model)?, ..spec };
        motorfit::study::compare::compare(subject, &spec, &mut |progress| watch.generation(progress))
    })
}

fn asked(py: Python<'_>, keys: &Keywords<'_, '_>) -> PyResult<CompareSettings> {
    let usual = |items: Vec<String>, usual: &[&str]| {
        if items.is_empty() { usual.iter().map(|&name| name.to_owned()).collect() } else { items }
    };
    let names = usual(keys.items("methods")?, &["gwo", "jaya", "ga", "sm"]);
    let method = |name: &String| Method::named("methods", name.trim()).raise(py);
    Ok(CompareSettings {
        methods: names.iter().map(method).collect::<PyResult<_>>()?,
        criteria: usual(keys.items("criteria")?, &["nrmse:std"]),
        population: keys.sizes("population", 100)?,
        generations: keys.sizes("generations", 100)?,
        set: keys.items("set")?,
        bounds: keys.items("bounds")?,
        fix: keys.items("fix")?,
    })
}

/// Threads, and what does not depend on the factors.
fn spec(keys: &Keywords<'_, '_>, paper: bool) -> PyResult<(Option<usize>, CompareSpec)> {
    let device = spec::device(keys)?;
    let usual = if paper { CompareSpec::paper() } else { CompareSpec::default() };
    let discretization = keys.choice("discretization")?.unwrap_or_default();
    let spec = CompareSpec {
        runs: keys.value("runs")?.unwrap_or(usual.runs),
        seed: keys.value("seed")?.unwrap_or(usual.seed),
        model: Model { discretization, initial: Initial::Auto },
        noise_records: keys.value("noise_records")?.unwrap_or(usual.noise_records),
        target: keys.value("target")?,
        device: device.device,
        precision: device.precision,
        paces: device.paces,
        ..usual
    };
    Ok((device.threads, spec))
}
