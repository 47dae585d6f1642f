//! Methods side by side.

use crate::arrays::{array, rows};
use crate::errors::Raise as _;
use crate::figure::Svg;
use crate::progress::{Watch, watched};
use crate::record::several;
use crate::spec::{self, Keywords};
use motorfit::evaluate::{Initial, Model};
use motorfit::identify::{Method, with_threads};
use motorfit::motor::Parameter;
use motorfit::report::compare::{CompareDocument, setting_name};
use motorfit::report::{figures, json};
use motorfit::study::compare::{Asked, CompareSpec, Comparison as Compared, Contest, Subject};
use motorfit::{Error, Result};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Methods that were compared, a block for each setting.
#[pyclass(frozen, module = "motorfit")]
pub struct Comparison {
    compared: Arc<Compared>,
    text: String,
}

/// All methods under one setting: a criterion, a population, a number of generations.
#[pyclass(frozen, module = "motorfit")]
pub struct ComparisonBlock {
    compared: Arc<Compared>,
    number: usize,
}

#[pymethods]
impl Comparison {
    /// A block for each setting.
    #[getter]
    fn blocks(&self) -> Vec<ComparisonBlock> {
        let block = |number| ComparisonBlock { compared: self.compared.clone(), number };
        (0..self.compared.blocks.len()).map(block).collect()
    }

    /// What errors are relative to, in SI units: the true parameters of the simulated motor, else the refined estimate;
    /// `None` without either.
    #[getter]
    fn expected<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let expected = self.compared.expected();
        expected.map(|motor| by_parameter(py, |p| motor.get(p))).transpose()
    }

    /// The Steiglitz–McBride estimate beside the searches, in SI units; `None` where it was not asked for or failed.
    #[getter]
    fn steiglitz_mcbride<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let found = self.compared.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().ok());
        found.map(|motor| by_parameter(py, |p| motor.get(p))).transpose()
    }

    /// What evaluated: cpu or gpu, its name, its numbers.
    #[getter]
    fn device(&self) -> (&str, &str, &str) {
        let (kind, name, precision) = &self.compared.device;
        (kind, name, precision)
    }

    /// Candidates evaluated.
    #[getter]
    fn evaluations(&self) -> u64 {
        self.compared.evaluations
    }

    /// Seconds that all runs took, as one batch.
    #[getter]
    fn seconds(&self) -> f64 {
        self.compared.batch_seconds
    }

    /// Whether the callback ended it early.
    #[getter]
    fn interrupted(&self) -> bool {
        self.compared.interrupted
    }

    /// What the reader should know: texts.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.compared.warnings.iter().map(motorfit::identify::Warning::text).collect()
    }

    /// All of it, as `motorfit compare --json` prints it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.text,))
    }

    /// The same as text.
    fn to_json(&self) -> &str {
        &self.text
    }

    fn __reduce__(&self) -> PyResult<()> {
        let message = "a Comparison does not leave its process; send what is needed of it: to_dict(), costs, ...";
        Err(pyo3::exceptions::PyTypeError::new_err(message))
    }

    fn __repr__(&self) -> String {
        let answer = |block: &motorfit::study::compare::Block| {
            let order = block.ranking().order.into_iter().map(|n| block.contests[n].method.name());
            format!("{}: {}", setting_name(&block.setting), order.collect::<Vec<_>>().join(" < "))
        };
        let blocks: Vec<String> = self.compared.blocks.iter().map(answer).collect();
        format!("<Comparison {}>", blocks.join("; "))
    }
}

impl ComparisonBlock {
    fn block(&self) -> &motorfit::study::compare::Block {
        &self.compared.blocks[self.number]
    }

    fn by_method<'py, T: IntoPyObject<'py>>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Contest) -> PyResult<T>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for contest in &self.block().contests {
            all.set_item(contest.method.name(), of(contest)?)?;
        }
        Ok(all)
    }

    fn id(&self) -> String {
        format!("block{}", self.number + 1)
    }
}

#[pymethods]
impl ComparisonBlock {
    /// The setting in words.
    #[getter]
    fn setting(&self) -> String {
        setting_name(&self.block().setting)
    }

    /// The methods, in the order that they were named in.
    #[getter]
    fn methods(&self) -> Vec<&str> {
        self.block().contests.iter().map(|contest| contest.method.name()).collect()
    }

    /// The methods, the lowest median cost first.
    #[getter]
    fn ranking(&self) -> Vec<&str> {
        let contests = &self.block().contests;
        self.block().ranking().order.into_iter().map(|n| contests[n].method.name()).collect()
    }

    /// By method the final cost of each run, shape (runs,); inf where every candidate diverged.
    #[getter]
    fn costs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_method(py, |contest| Ok(array(py, contest.costs())))
    }

    /// By method what each run found, shape (runs, 5): R, L, K, B, J in SI units; nan where every candidate diverged.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_method(py, |contest| {
            let of = |run: &motorfit::study::compare::Outcome| run.parameters.map_or([f64::NAN; 5], |p| p.to_array());
            let values: Vec<f64> = contest.runs.iter().flat_map(of).collect();
            rows(py, values, 5)
        })
    }

    /// By method the lowest cost after each generation of each run, shape (runs, generations); nan after an early end.
    #[getter]
    fn histories<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_method(py, |contest| -> PyResult<Bound<'py, PyArray2<f64>>> {
            let longest = contest.runs.iter().map(|run| run.history.len()).max().unwrap_or(0);
            let padded = |run: &motorfit::study::compare::Outcome| {
                let missing = longest - run.history.len();
                run.history.iter().copied().chain(std::iter::repeat_n(f64::NAN, missing)).collect::<Vec<f64>>()
            };
            rows(py, contest.runs.iter().flat_map(padded).collect(), longest)
        })
    }

    /// By method the candidates that each run evaluated, shape (runs,).
    #[getter]
    fn evaluations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_method(py, |contest| {
            let counts: Vec<u64> = contest.runs.iter().map(|run| run.evaluations).collect();
            Ok(PyArray1::from_vec(py, counts))
        })
    }

    /// By method the seconds of one run by itself; `None` after an early end.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_method(py, |contest| Ok(contest.seconds))
    }

    /// Lowest cost by generation: median and quartiles over runs.
    fn plot_convergence(&self) -> Svg {
        figures::convergence(&self.id(), self.block()).into()
    }

    /// Relative errors of the parameters over runs; `None` where nothing is known that they could be errors of.
    fn plot_errors(&self) -> Option<Svg> {
        figures::errors(&self.id(), &self.compared, self.block()).map(Svg::from)
    }

    /// Distributions of final costs, and of targets reached by evaluations and by time.
    fn plot_distributions(&self) -> Svg {
        figures::distributions(&self.id(), &self.compared, self.block()).into()
    }

    /// Final costs of all runs in order.
    fn plot_waterfall(&self) -> Svg {
        figures::waterfall(&self.id(), self.block()).into()
    }

    fn __repr__(&self) -> String {
        format!("<ComparisonBlock {}: {}>", self.setting(), self.ranking().join(" < "))
    }
}

fn by_parameter<'py>(py: Python<'py>, of: impl Fn(Parameter) -> f64) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for parameter in Parameter::ALL {
        all.set_item(parameter.symbol(), of(parameter))?;
    }
    Ok(all)
}

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
/// What the paper's set-up says already.
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
/// methods : str or sequence, default "gwo,jaya,ga,sm"
///     Of gwo, jaya, ga, random, and sm, which stands beside them.
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
    let paper = keys.choice("preset", &["paper"], |name| name)?.is_some();
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
    let text = json(&CompareDocument::of(&compared, paper));
    Ok(Comparison { compared: Arc::new(compared), text })
}

fn run(subject: Subject, asked: &Asked, spec: CompareSpec, on: (Option<usize>, &Watch)) -> Result<Compared> {
    let (threads, watch) = on;
    with_threads(threads, || {
        let spec = CompareSpec { space: asked.space(&subject, spec.model)?, ..spec };
        motorfit::study::compare::compare(subject, &spec, &mut |progress| watch.generation(progress))
    })
}

fn asked(py: Python<'_>, keys: &Keywords<'_, '_>) -> PyResult<Asked> {
    let usual = |items: Vec<String>, usual: &[&str]| {
        if items.is_empty() { usual.iter().map(|&name| name.to_owned()).collect() } else { items }
    };
    let names = usual(keys.items("methods")?, &["gwo", "jaya", "ga", "sm"]);
    let method = |name: &String| spec::choice("methods", name.trim(), &Method::all(), Method::name).raise(py);
    Ok(Asked {
        methods: names.iter().map(method).collect::<PyResult<_>>()?,
        criteria: usual(keys.items("criteria")?, &["nrmse:std"]),
        population: keys.sizes("population", 100)?,
        generations: keys.sizes("generations", 100)?,
        set: keys.items("set")?,
        bounds: keys.items("bounds")?,
        fix: keys.items("fix")?,
        dashes: "",
    })
}

/// Threads, and what does not depend on the factors.
fn spec(keys: &Keywords<'_, '_>, paper: bool) -> PyResult<(Option<usize>, CompareSpec)> {
    let device = spec::device(keys)?;
    let usual = if paper { CompareSpec::paper() } else { CompareSpec::default() };
    let discretization = keys.discretization()?.unwrap_or_default();
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
