//! `compare`: comparison of methods by repeated runs.

use crate::comparison::Comparison;
use crate::errors::{Raise as _, warn};
use crate::progress::{Watch, watched};
use crate::reading::several;
use crate::spec::{self, Keywords};
use motorfit::device::with_threads;
use motorfit::evaluate::{Initial, Model};
use motorfit::identify::Method;
use motorfit::named::Named as _;
use motorfit::setting::Setting;
use motorfit::settings::{self, DEVICE};
use motorfit::study::compare::{CompareSettings, CompareSpec, Comparison as Compared, ComparisonSubject, Preset};
use motorfit::{Error, Result};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Keyword arguments of `compare`.
const COMPARE: [&str; 18] = [
    "preset",
    "methods",
    "runs",
    "criteria",
    "population",
    "generations",
    "set",
    "transform",
    "seed",
    "noise_records",
    "target",
    "bounds",
    "fix",
    "discretization",
    "device",
    "precision",
    "evaluator",
    "threads",
];
/// Keyword arguments of `compare` that `Model.compare` does not have.
const OF_MOTOR: [&str; 3] = ["preset", "noise_records", "evaluator"];
/// Methods that are compared by default, for the DC motor and for a model.
const METHODS: [&str; 4] = ["gwo", "jaya", "ga", "sm"];
const METHODS_OF_MODEL: [&str; 3] = ["gwo", "jaya", "ga"];
/// Keyword arguments that the preset `paper` fixes.
const OF_PRESET: [&str; 8] = ["methods", "criteria", "population", "generations", "set", "transform", "bounds", "fix"];

/// Compares methods on recordings of one motor.
///
/// Each method has the same number of runs under every setting; runs of the same number start from the same initial population.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record, optional
///     Recordings of one motor; by default the paper's experiment, simulated.
/// progress : callable, optional
///     Called with a `Progress` after each generation, in the calling thread. The comparison ends when it returns False.
/// preset : {"paper"}
///     Set-up of the paper. It fixes methods, criteria, population, generations, set, transform, bounds and fix.
#[doc = include_str!("docs/methods.txt")]
/// runs : int, default 50
///     Runs of each method.
/// criteria : str or sequence, default "nrmse:std"
///     Criterion and scale, "CRITERION:SCALE"; each of several gives a block of the comparison.
/// population, generations : int or sequence of int, default 100
///     Candidates per generation, and generations including the initial population; each of several values gives a block.
/// set : str, sequence or mapping
///     Settings of the methods, {"ga.mutation": 0.1}; several values, as in "0.1/0.2", give a block each.
/// transform : str or sequence, default "none"
///     Coordinates in which each setting is searched too: "mirror", "shift:SHARE" of the range as in "shift:0.1", "log". The tests
///     of invariance are `to_dict()["invariance"]`.
/// seed : int, default 1
///     Seed of all runs.
/// noise_records : int, default 200
///     Noise realizations for Steiglitz-McBride, which is deterministic.
/// target : float
///     Cost that counts as success; by default success rates are given over a range of targets.
/// bounds : str, sequence or mapping
///     As for `identify`; by default "table2" without recordings, else "auto".
/// fix : str, sequence or mapping
///     Fixed parameters in SI units, {"R": 0.92}.
/// discretization, device, precision, evaluator, threads
///     As for `identify`.
///
/// Returns
/// -------
/// Comparison
///     One block for each setting.
///
/// Raises
/// ------
/// UsageError
///     If a setting is wrong, or is fixed by the preset.
/// DataError
///     If the recordings cannot be used, such as recordings without a voltage.
///
/// Warns
/// -----
/// MotorfitWarning
///     For each entry of `warnings` of the result.
#[pyfunction]
#[pyo3(signature = (records=None, *, progress=None, **settings))]
#[pyo3(
    text_signature = "(records=None, *, progress=None, preset=None, methods='gwo,jaya,ga,sm', runs=50, criteria='nrmse:std', \
    population=100, generations=100, set=None, transform=None, seed=1, noise_records=200, target=None, bounds=None, fix=None, \
    discretization=None, device='auto', precision='auto', evaluator='auto', threads=None)"
)]
pub fn compare(
    py: Python<'_>,
    records: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Comparison> {
    let keys = Keywords::new(py, settings, &COMPARE)?;
    let subject = match records {
        Some(records) => ComparisonSubject::of_motor(several(records)?, None),
        None => ComparisonSubject::m2().raise(py)?,
    };
    let paper = keys.choice::<Preset>("preset")?.is_some();
    let conflicting =
        OF_PRESET.into_iter().find(|key| paper && keys.has(key)).or((paper && records.is_some()).then_some("records"));
    if let Some(key) = conflicting {
        let message = format!("preset=\"paper\" cannot be combined with {key}");
        return Err(Error::usage(message, "Leave one of the two out.")).raise(py);
    }
    let (factors, spec) = (factors(py, &keys, &METHODS)?, spec(&keys, paper)?);
    let settings = if paper { CompareSpec::paper().settings } else { factors.settings().raise(py)? };
    compared(py, progress, (subject, factors), (spec.0, CompareSpec { settings, ..spec.1 }))
        .map(|compared| Comparison::new(compared, paper))
}

/// Compares searches on recordings of a model.
pub fn compare_model(
    model: &crate::model::Model,
    records: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Comparison> {
    let py = records.py();
    let known: Vec<&str> = COMPARE.into_iter().filter(|key| !OF_MOTOR.contains(key)).collect();
    let keys = Keywords::new(py, settings, &known)?;
    let of_model: [&[Setting]; 2] = [&DEVICE, &[Setting::Bounds, Setting::Fix, Setting::Discretization]];
    let model_spec = settings::model_spec(&keys.given(&of_model)?).map_err(Error::from).raise(py)?;
    let (records, _) = model.recordings(records)?;
    let subject = ComparisonSubject::of_model(model.0.clone(), records, model_spec).raise(py)?;
    let (factors, spec) = (factors(py, &keys, &METHODS_OF_MODEL)?, spec(&keys, false)?);
    let settings = factors.settings().raise(py)?;
    compared(py, progress, (subject, factors), (spec.0, CompareSpec { settings, ..spec.1 }))
        .map(|compared| Comparison::new(compared, false))
}

/// Runs a comparison and issues its warnings.
fn compared(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    (subject, factors): (ComparisonSubject, CompareSettings),
    (threads, spec): (Option<usize>, CompareSpec),
) -> PyResult<Compared> {
    let steiglitz_mcbride = factors.methods.contains(&Method::SteiglitzMcBride);
    let spec = CompareSpec { steiglitz_mcbride, ..spec };
    let compared = watched(py, progress, move |watch| run(subject, &factors, spec, (threads, watch)))?.raise(py)?;
    warn(py, &compared.warnings)?;
    Ok(compared)
}

fn run(
    subject: ComparisonSubject,
    factors: &CompareSettings,
    spec: CompareSpec,
    on: (Option<usize>, &Watch),
) -> Result<Compared> {
    let (threads, watch) = on;
    with_threads(threads, || {
        let spec = CompareSpec { space: factors.space(&subject, spec.model)?, ..spec };
        motorfit::study::compare::compare(subject, &spec, &mut |progress| watch.generation(progress))
    })
}

fn factors(py: Python<'_>, keys: &Keywords<'_, '_>, methods: &[&str]) -> PyResult<CompareSettings> {
    let or = |items: Vec<String>, default: &[&str]| {
        if items.is_empty() { default.iter().map(|&name| name.to_owned()).collect() } else { items }
    };
    let names = or(keys.items("methods")?, methods);
    let method = |name: &String| Method::named("methods", name.trim()).raise(py);
    Ok(CompareSettings {
        methods: names.iter().map(method).collect::<PyResult<_>>()?,
        criteria: or(keys.items("criteria")?, &["nrmse:std"]),
        population: keys.sizes("population", 100)?,
        generations: keys.sizes("generations", 100)?,
        set: keys.items("set")?,
        transforms: keys.items("transform")?,
        bounds: keys.items("bounds")?,
        fix: keys.items("fix")?,
    })
}

/// Returns the number of threads and the part of the specification that is common to all blocks.
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
        evaluator: device.evaluator,
        throughput_profile: device.throughput_profile,
        ..usual
    };
    Ok((device.threads, spec))
}
