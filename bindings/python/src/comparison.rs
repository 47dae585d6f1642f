//! What a comparison of methods found.

use crate::answers::{Answer, Held, Reduced, Table, given, reduced};
use crate::arrays::{array, rows};
use crate::figure::Svg;
use motorfit::identify::Warning;
use motorfit::motor::{Parameter, Parameters};
use motorfit::report::compare::{CompareDocument, setting_name};
use motorfit::report::{figures, json};
use motorfit::study::compare::{Block, Comparison as Compared, Contest, Outcome};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Methods that were compared, a block for each setting. It pickles.
#[pyclass(frozen, module = "motorfit")]
pub struct Comparison(Held<Found>);

/// All methods under one setting: a criterion, a population, a number of generations. It pickles.
#[pyclass(frozen, module = "motorfit")]
pub struct ComparisonBlock(Held<FoundBlock>);

/// A comparison where it was made.
struct Found {
    compared: Arc<Compared>,
    text: String,
}

struct FoundBlock {
    compared: Arc<Compared>,
    number: usize,
}

const ANSWERS: Table<Found> = &[
    ("blocks", |of, py| given(py, of.blocks())),
    ("expected", |of, py| motor(py, of.compared.expected().as_ref())),
    ("steiglitz_mcbride", |of, py| motor(py, of.compared.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().ok()))),
    ("device", |of, py| given(py, of.compared.device.clone())),
    ("evaluations", |of, py| given(py, of.compared.evaluations)),
    ("seconds", |of, py| given(py, of.compared.batch_seconds)),
    ("interrupted", |of, py| given(py, of.compared.interrupted)),
    ("warnings", |of, py| given(py, of.compared.warnings.iter().map(Warning::text).collect::<Vec<_>>())),
    ("text", |of, py| given(py, of.text.as_str())),
    ("repr", |of, py| given(py, of.repr())),
];

const OF_BLOCK: Table<FoundBlock> = &[
    ("setting", |of, py| given(py, setting_name(&of.block().setting))),
    ("methods", |of, py| given(py, of.block().contests.iter().map(|c| c.method.name()).collect::<Vec<_>>())),
    ("ranking", |of, py| given(py, ranking(of.block()))),
    ("costs", |of, py| of.by_method(py, |contest| given(py, array(py, contest.costs())))),
    ("parameters", |of, py| of.by_method(py, |contest| parameters(py, contest))),
    ("histories", |of, py| of.by_method(py, |contest| histories(py, contest))),
    ("evaluations", |of, py| {
        let counts = |contest: &Contest| contest.runs.iter().map(|run| run.evaluations).collect();
        of.by_method(py, |contest| given(py, PyArray1::<u64>::from_vec(py, counts(contest))))
    }),
    ("seconds", |of, py| of.by_method(py, |contest| given(py, contest.seconds))),
    ("convergence", |of, py| given(py, Svg::from(figures::convergence(&of.id(), of.block())))),
    ("errors", |of, py| given(py, figures::errors(&of.id(), &of.compared, of.block()).map(Svg::from))),
    ("distributions", |of, py| given(py, Svg::from(figures::distributions(&of.id(), &of.compared, of.block())))),
    ("waterfall", |of, py| given(py, Svg::from(figures::waterfall(&of.id(), of.block())))),
];

#[pymethods]
impl Comparison {
    /// A block for each setting.
    #[getter]
    fn blocks<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "blocks")
    }

    /// What errors are relative to, in SI units: the true parameters of the simulated motor, else the refined estimate;
    /// `None` without either.
    #[getter]
    fn expected<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "expected")
    }

    /// The Steiglitz–McBride estimate beside the searches, in SI units; `None` where it was not asked for or failed.
    #[getter]
    fn steiglitz_mcbride<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "steiglitz_mcbride")
    }

    /// What evaluated: cpu or gpu, its name, its numbers.
    #[getter]
    fn device<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "device")
    }

    /// Candidates evaluated.
    #[getter]
    fn evaluations<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "evaluations")
    }

    /// Seconds that all runs took, as one batch.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "seconds")
    }

    /// Whether the callback ended it early.
    #[getter]
    fn interrupted<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "interrupted")
    }

    /// What the reader should know: texts.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "warnings")
    }

    /// All of it, as `motorfit compare --json` prints it.
    fn to_dict<'py>(&self, py: Python<'py>) -> Answer<'py> {
        py.import("json")?.call_method1("loads", (self.answer(py, "text")?,))
    }

    /// The same as text.
    fn to_json<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "text")
    }

    fn __repr__<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "repr")
    }

    /// The same: nothing can change it.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// The same: nothing can change it.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, Bound<'py, PyDict>> {
        reduced(slf, slf.get().0.answers(slf.py(), ANSWERS)?)
    }

    #[staticmethod]
    fn _restore(answers: &Bound<'_, PyDict>) -> PyResult<Self> {
        Held::sent(answers, ANSWERS).map(Self)
    }
}

#[pymethods]
impl ComparisonBlock {
    /// The setting in words.
    #[getter]
    fn setting<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "setting")
    }

    /// The methods, in the order that they were named in.
    #[getter]
    fn methods<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "methods")
    }

    /// The methods, the lowest median cost first.
    #[getter]
    fn ranking<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "ranking")
    }

    /// By method the final cost of each run, shape (runs,); inf where every candidate diverged.
    #[getter]
    fn costs<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "costs")
    }

    /// By method what each run found, shape (runs, 5): R, L, K, B, J in SI units; nan where every candidate diverged.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "parameters")
    }

    /// By method the lowest cost after each generation of each run, shape (runs, generations); nan after an early end.
    #[getter]
    fn histories<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "histories")
    }

    /// By method the candidates that each run evaluated, shape (runs,).
    #[getter]
    fn evaluations<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "evaluations")
    }

    /// By method the seconds of one run by itself; `None` after an early end.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "seconds")
    }

    /// Lowest cost by generation: median and quartiles over runs.
    fn plot_convergence<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "convergence")
    }

    /// Relative errors of the parameters over runs; `None` where nothing is known that they could be errors of.
    fn plot_errors<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "errors")
    }

    /// Distributions of final costs, and of targets reached by evaluations and by time.
    fn plot_distributions<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "distributions")
    }

    /// Final costs of all runs in order.
    fn plot_waterfall<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "waterfall")
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let ranking: Vec<String> = self.answer(py, "ranking")?.extract()?;
        Ok(format!("<ComparisonBlock {}: {}>", self.answer(py, "setting")?, ranking.join(" < ")))
    }

    /// The same: nothing can change it.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// The same: nothing can change it.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, Bound<'py, PyDict>> {
        reduced(slf, slf.get().0.answers(slf.py(), OF_BLOCK)?)
    }

    #[staticmethod]
    fn _restore(answers: &Bound<'_, PyDict>) -> PyResult<Self> {
        Held::sent(answers, OF_BLOCK).map(Self)
    }
}

impl Comparison {
    /// A comparison that was made here.
    pub fn new(compared: Compared, paper: bool) -> Self {
        let text = json(&CompareDocument::of(&compared, paper));
        Self(Held::Here(Found { compared: Arc::new(compared), text }))
    }

    fn answer<'py>(&self, py: Python<'py>, name: &str) -> Answer<'py> {
        self.0.answer(py, ANSWERS, name)
    }
}

impl ComparisonBlock {
    fn answer<'py>(&self, py: Python<'py>, name: &str) -> Answer<'py> {
        self.0.answer(py, OF_BLOCK, name)
    }
}

impl Found {
    fn blocks(&self) -> Vec<ComparisonBlock> {
        let block = |number| FoundBlock { compared: self.compared.clone(), number };
        (0..self.compared.blocks.len()).map(|n| ComparisonBlock(Held::Here(block(n)))).collect()
    }

    fn repr(&self) -> String {
        let answer = |block: &Block| format!("{}: {}", setting_name(&block.setting), ranking(block).join(" < "));
        let blocks: Vec<String> = self.compared.blocks.iter().map(answer).collect();
        format!("<Comparison {}>", blocks.join("; "))
    }
}

impl FoundBlock {
    fn block(&self) -> &Block {
        &self.compared.blocks[self.number]
    }

    fn by_method<'py>(&self, py: Python<'py>, of: impl Fn(&Contest) -> Answer<'py>) -> Answer<'py> {
        let all = PyDict::new(py);
        for contest in &self.block().contests {
            all.set_item(contest.method.name(), of(contest)?)?;
        }
        Ok(all.into_any())
    }

    fn id(&self) -> String {
        format!("block{}", self.number + 1)
    }
}

fn ranking(block: &Block) -> Vec<&'static str> {
    block.ranking().order.into_iter().map(|n| block.contests[n].method.name()).collect()
}

fn parameters<'py>(py: Python<'py>, contest: &Contest) -> Answer<'py> {
    let of = |run: &Outcome| run.parameters.map_or([f64::NAN; 5], |p| p.to_array());
    given(py, rows(py, contest.runs.iter().flat_map(of).collect(), 5)?)
}

fn histories<'py>(py: Python<'py>, contest: &Contest) -> Answer<'py> {
    let longest = contest.runs.iter().map(|run| run.history.len()).max().unwrap_or(0);
    let padded = |run: &Outcome| {
        let missing = longest - run.history.len();
        run.history.iter().copied().chain(std::iter::repeat_n(f64::NAN, missing)).collect::<Vec<f64>>()
    };
    given(py, rows(py, contest.runs.iter().flat_map(padded).collect(), longest)?)
}

/// A motor by the symbols of its parameters.
fn motor<'py>(py: Python<'py>, motor: Option<&Parameters>) -> Answer<'py> {
    let Some(motor) = motor else { return given(py, py.None()) };
    let all = PyDict::new(py);
    for parameter in Parameter::ALL {
        all.set_item(parameter.symbol(), motor.get(parameter))?;
    }
    Ok(all.into_any())
}
