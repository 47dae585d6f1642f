//! `Comparison` and `ComparisonBlock`: results of a comparison of methods.

use crate::answers::{Answer, ResultData, TEXT_WIDTH, given, result};
use crate::arrays::{array, rows};
use crate::errors::{codes, keyword, warnings};
use crate::figure::Svg;
use motorfit::record::Severity;
use motorfit::report::compare::{compare_document, setting_name};
use motorfit::report::{compare_parts, figures, html_fragment, json, plain_text};
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
        expected = |of, py| by_name(py, &of.compared, of.compared.expected());
        /// Steiglitz–McBride estimate, in SI units; `None` if it was not requested or failed.
        steiglitz_mcbride = |of, py| by_name(py, &of.compared, of.steiglitz());
        /// Device of the evaluation: kind (cpu or gpu), name and precision.
        device = |of, py| {
            let of = &of.compared.device;
            given(py, (of.kind, of.name.clone(), of.precision))
        };
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
        /// Returns the answer, the warnings and the costs of each block as text.
        summary = |of, py| given(py, plain_text(&compare_parts(&of.compared, keyword), TEXT_WIDTH));
        /// Returns all runs as columns of equal length: "setting", "method", "run" (from 0), "cost", "evaluations", and R, L, K,
        /// B, J in SI units.
        to_columns = |of, py| given(py, run_columns(py, &of.compared)?);
        /// Returns the answer, the warnings, the costs and the convergence of each block as HTML for notebooks.
        _repr_html_ = |of, py| given(py, html_fragment(&compare_parts(&of.compared, keyword)));
        __repr__ = |of, py| given(py, of.repr());
    }
    documented {
        /// Version of motorfit.
        version = "motorfit";
        /// Sources of the recordings: a list of mappings.
        records = "records";
        /// Parameters of the simulated motor, in SI units; `None` for recordings.
        truth = "truth";
        /// Tables of the paper beside these results; `None` without the preset "paper".
        paper = "paper";
        /// Discretization of the model.
        discretization = "discretization";
        /// Fixed parameters, in SI units.
        fixed = "fixed";
        /// Cost that counts as success; `None` if success rates are given over a range.
        target = "target";
        /// Noise of the simulated recording [dB]; `None` for recordings.
        noise_db = "noise_db";
        /// Runs of each method.
        runs = "runs";
        /// Seed of all runs.
        seed = "seed";
        /// Bounds [min, max] of each free parameter, in SI units.
        bounds = "bounds";
        /// Tests of the invariance to the coordinates of the search.
        invariance = "invariance";
        /// Refined estimate, in SI units; `None` if there is none.
        refined = "refined";
        /// Level of trust in the refined estimate and the codes of the reasons; `None` if there is none.
        refined_trust = "refined_trust";
        /// Reason for which there is no refined estimate; else `None`.
        refined_failure = "refined_failure";
        /// Reason for which the comparison ended.
        stop = "stop";
    }
    framed {
        /// Returns all runs as a frame, with the columns of `to_columns`.
    }
    own {
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
        parameters = |of, py| of.by_method(py, |result| parameters(py, &of.compared, result));
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

    fn steiglitz(&self) -> Option<Vec<f64>> {
        let found = self.compared.steiglitz.as_ref()?.estimate.as_ref().ok()?;
        Some(found.to_array().to_vec())
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

/// Returns all runs of a comparison as columns.
fn run_columns<'py>(py: Python<'py>, compared: &Compared) -> PyResult<Bound<'py, PyDict>> {
    let runs = || {
        compared.blocks.iter().flat_map(|block| {
            let of = move |result| (block, result);
            block.results.iter().map(of).flat_map(|(block, result)| {
                result
                    .runs
                    .iter()
                    .zip(result.costs())
                    .enumerate()
                    .map(move |(n, (run, cost))| (block, result, n, run, cost))
            })
        })
    };
    let columns = PyDict::new(py);
    columns.set_item("setting", runs().map(|(block, ..)| setting_name(&block.setting)).collect::<Vec<_>>())?;
    columns.set_item("method", runs().map(|(_, result, ..)| result.method.name()).collect::<Vec<_>>())?;
    columns.set_item("run", runs().map(|(_, _, n, ..)| n).collect::<Vec<_>>())?;
    columns.set_item("cost", array(py, runs().map(|(.., cost)| cost).collect()))?;
    columns.set_item("evaluations", runs().map(|(.., run, _)| run.evaluations).collect::<Vec<_>>())?;
    for (n, parameter) in compared.parameters.iter().enumerate() {
        let value = |run: &Outcome| run.parameters.as_ref().and_then(|found| found.get(n)).copied().unwrap_or(f64::NAN);
        columns.set_item(&parameter.name, array(py, runs().map(|(.., run, _)| value(run)).collect()))?;
    }
    Ok(columns)
}

fn ranking(block: &Block) -> Vec<&'static str> {
    block.ranking().order.into_iter().map(|n| block.results[n].method.name()).collect()
}

fn parameters<'py>(py: Python<'py>, compared: &Compared, result: &MethodResult) -> Answer<'py> {
    let width = compared.parameters.len();
    let of = |run: &Outcome| run.parameters.clone().unwrap_or_else(|| vec![f64::NAN; width]);
    given(py, rows(py, result.runs.iter().flat_map(of).collect(), width)?)
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

/// Returns a mapping of the names of parameters to values, or `None`.
fn by_name<'py>(py: Python<'py>, compared: &Compared, values: Option<Vec<f64>>) -> Answer<'py> {
    let Some(values) = values else { return given(py, py.None()) };
    let all = PyDict::new(py);
    for (parameter, value) in compared.parameters.iter().zip(values) {
        all.set_item(&parameter.name, value)?;
    }
    Ok(all.into_any())
}
