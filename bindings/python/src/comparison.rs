//! `Comparison` and `ComparisonBlock`: results of a comparison of methods.

use crate::answers::{Answer, ResultData, given, result};
use crate::arrays::{array, rows};
use crate::errors::{codes, warnings};
use crate::figure::Svg;
use motorfit::motor::{Parameter, Parameters};
use motorfit::record::Severity;
use motorfit::report::compare::{compare_document, setting_name};
use motorfit::report::{figures, json};
use motorfit::study::compare::{Block, Comparison as Compared, MethodResult, Outcome};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Comparison in the process that computed it, with its JSON document.
struct Found {
    compared: Arc<Compared>,
    text: String,
}

/// Block `number` of a comparison.
struct FoundBlock {
    compared: Arc<Compared>,
    number: usize,
}

result! {
    /// Result of a comparison of methods, with one block for each setting. It can be pickled.
    Comparison of Found;
    properties {
        /// Blocks, one for each setting.
        blocks = |of, py| given(py, of.blocks());
        /// Reference parameters of the relative errors, in SI units: those of the simulated motor, else the refined estimate;
        /// `None` if there is neither.
        expected = |of, py| motor(py, of.compared.expected().as_ref());
        /// Steiglitz–McBride estimate, in SI units; `None` if it was not requested or failed.
        steiglitz_mcbride = |of, py| motor(py, of.compared.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().ok()));
        /// Device of the evaluation: kind (cpu or gpu), name and precision.
        device = |of, py| given(py, of.compared.device.clone());
        /// Number of candidates evaluated.
        evaluations = |of, py| given(py, of.compared.evaluations);
        /// Wall-clock time of all runs, evaluated as one batch [s].
        seconds = |of, py| given(py, of.compared.batch_seconds);
        /// True if the callback ended the comparison early.
        interrupted = |of, py| given(py, of.compared.interrupted);
        /// Warnings, which the call issued as Python warnings too: a list of `MotorfitWarning`.
        warnings = |of, py| given(py, warnings(py, &of.compared.warnings, Severity::Report)?);
        /// Remarks, which need no action: a list of `MotorfitWarning`.
        remarks = |of, py| given(py, warnings(py, &of.compared.warnings, Severity::Mention)?);
    }
    methods {
        /// Returns the document of `to_dict` as JSON text.
        to_json = |of, py| given(py, of.text.as_str());
        __repr__ = |of, py| given(py, of.repr());
    }
    own {
        /// Returns the complete result, as `motorfit compare --json` prints it.
        fn to_dict<'py>(&self, py: Python<'py>) -> Answer<'py> {
            py.import("json")?.call_method1("loads", (self.answer(py, "to_json")?,))
        }
    }
}

result! {
    /// Runs of all methods under one setting: a criterion, a population size, a number of generations. It can be pickled.
    ///
    /// Attributes that are mappings have the names of the methods as keys.
    ComparisonBlock of FoundBlock;
    properties {
        /// Description of the setting.
        setting = |of, py| given(py, setting_name(&of.block().setting));
        /// Names of the methods, in the order of the call.
        methods = |of, py| given(py, of.block().results.iter().map(|c| c.method.name()).collect::<Vec<_>>());
        /// Names of the methods, by increasing median of the final cost.
        ranking = |of, py| given(py, ranking(of.block()));
        /// Final cost of each run, shape (runs,); inf if every candidate diverged.
        costs = |of, py| of.by_method(py, |result| given(py, array(py, result.costs())));
        /// Estimated parameters of each run, shape (runs, 5): R, L, K, B, J in SI units; nan if every candidate diverged.
        parameters = |of, py| of.by_method(py, |result| parameters(py, result));
        /// Lowest cost after each generation of each run, shape (runs, generations); nan after an early end.
        histories = |of, py| of.by_method(py, |result| histories(py, result));
        /// Number of candidates that each run evaluated, shape (runs,).
        evaluations = |of, py| of.by_method(py, |result| evaluations(py, result));
        /// Wall-clock time of a single run, measured alone [s]; `None` after an early end.
        seconds = |of, py| of.by_method(py, |result| given(py, result.seconds));
    }
    methods {
        /// Draws the lowest cost by generation: median and quartiles over runs.
        plot_convergence = |of, py| given(py, Svg::from(figures::convergence(&of.id(), of.block())));
        /// Draws the relative errors of the parameters over runs; `None` without reference parameters.
        plot_errors = |of, py| given(py, figures::errors(&of.id(), &of.compared, of.block()).map(Svg::from));
        /// Draws the empirical distributions of the final costs, and of the targets reached over evaluations and over time.
        plot_distributions = |of, py| given(py, Svg::from(figures::distributions(&of.id(), &of.compared, of.block())));
        /// Draws the final costs of all runs in increasing order.
        plot_waterfall = |of, py| given(py, Svg::from(figures::waterfall(&of.id(), of.block())));
        __repr__ = |of, py| given(py, of.repr());
    }
    own {}
}

impl Comparison {
    /// Wraps a comparison; `paper` is true if it has the set-up of the paper.
    pub fn new(compared: Compared, paper: bool) -> Self {
        let text = json(&compare_document(&compared, paper));
        Self(ResultData::Native(Found { compared: Arc::new(compared), text }))
    }
}

impl Found {
    fn blocks(&self) -> Vec<ComparisonBlock> {
        let block = |number| FoundBlock { compared: self.compared.clone(), number };
        (0..self.compared.blocks.len()).map(|n| ComparisonBlock(ResultData::Native(block(n)))).collect()
    }

    fn repr(&self) -> String {
        let answer = |block: &Block| format!("{}: {}", setting_name(&block.setting), ranking(block).join(" < "));
        let blocks: Vec<String> = self.compared.blocks.iter().map(answer).collect();
        format!("<Comparison {}{}>", blocks.join("; "), codes(&self.compared.warnings))
    }
}

impl FoundBlock {
    fn block(&self) -> &Block {
        &self.compared.blocks[self.number]
    }

    fn by_method<'py>(&self, py: Python<'py>, of: impl Fn(&MethodResult) -> Answer<'py>) -> Answer<'py> {
        let all = PyDict::new(py);
        for result in &self.block().results {
            all.set_item(result.method.name(), of(result)?)?;
        }
        Ok(all.into_any())
    }

    fn repr(&self) -> String {
        format!("<ComparisonBlock {}: {}>", setting_name(&self.block().setting), ranking(self.block()).join(" < "))
    }

    fn id(&self) -> String {
        format!("block{}", self.number + 1)
    }
}

fn ranking(block: &Block) -> Vec<&'static str> {
    block.ranking().order.into_iter().map(|n| block.results[n].method.name()).collect()
}

fn parameters<'py>(py: Python<'py>, result: &MethodResult) -> Answer<'py> {
    let of = |run: &Outcome| run.parameters.map_or([f64::NAN; 5], |p| p.to_array());
    given(py, rows(py, result.runs.iter().flat_map(of).collect(), 5)?)
}

fn evaluations<'py>(py: Python<'py>, result: &MethodResult) -> Answer<'py> {
    given(py, PyArray1::from_vec(py, result.runs.iter().map(|run| run.evaluations).collect()))
}

fn histories<'py>(py: Python<'py>, result: &MethodResult) -> Answer<'py> {
    let longest = result.runs.iter().map(|run| run.history.len()).max().unwrap_or(0);
    let padded = |run: &Outcome| {
        let missing = longest - run.history.len();
        run.history.iter().copied().chain(std::iter::repeat_n(f64::NAN, missing)).collect::<Vec<f64>>()
    };
    given(py, rows(py, result.runs.iter().flat_map(padded).collect(), longest)?)
}

/// Returns a mapping of symbols to values, or `None`.
fn motor<'py>(py: Python<'py>, motor: Option<&Parameters>) -> Answer<'py> {
    let Some(motor) = motor else { return given(py, py.None()) };
    let all = PyDict::new(py);
    for parameter in Parameter::ALL {
        all.set_item(parameter.symbol(), motor.get(parameter))?;
    }
    Ok(all.into_any())
}
