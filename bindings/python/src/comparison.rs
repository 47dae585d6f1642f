//! Results of a comparison of methods.

use crate::answers::{Answer, Held, given, result};
use crate::arrays::{array, rows};
use crate::errors::keyword;
use crate::figure::Svg;
use motorfit::motor::{Parameter, Parameters};
use motorfit::report::compare::{compare_document, setting_name};
use motorfit::report::{figures, json};
use motorfit::study::compare::{Block, Comparison as Compared, MethodResult, Outcome};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// A comparison where it was made.
struct Found {
    compared: Arc<Compared>,
    text: String,
}

struct FoundBlock {
    compared: Arc<Compared>,
    number: usize,
}

result! {
    /// Methods that were compared, a block for each setting. It pickles.
    Comparison of Found;
    properties {
        /// A block for each setting.
        blocks = |of, py| given(py, of.blocks());
        /// Returns parameters to which errors are relative, in SI units: those of the simulated motor, else the refined estimate;
        /// `None` without either.
        expected = |of, py| motor(py, of.compared.expected().as_ref());
        /// The Steiglitz–McBride estimate beside the searches, in SI units; `None` where it was not asked for or failed.
        steiglitz_mcbride = |of, py| motor(py, of.compared.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().ok()));
        /// Returns the device that evaluated: its kind (cpu or gpu), its name, its precision.
        device = |of, py| given(py, of.compared.device.clone());
        /// Candidates evaluated.
        evaluations = |of, py| given(py, of.compared.evaluations);
        /// Seconds that all runs took, as one batch.
        seconds = |of, py| given(py, of.compared.batch_seconds);
        /// Returns whether the callback ended it early.
        interrupted = |of, py| given(py, of.compared.interrupted);
        /// Returns warnings for the reader, as texts.
        warnings = |of, py| given(py, of.compared.warnings.iter().map(|warning| warning.spelled(keyword)).collect::<Vec<_>>());
    }
    methods {
        /// The same as text.
        to_json = |of, py| given(py, of.text.as_str());
        __repr__ = |of, py| given(py, of.repr());
    }
    own {
        /// All of it, as `motorfit compare --json` prints it.
        fn to_dict<'py>(&self, py: Python<'py>) -> Answer<'py> {
            py.import("json")?.call_method1("loads", (self.answer(py, "to_json")?,))
        }
    }
}

result! {
    /// All methods under one setting: a criterion, a population, a number of generations. It pickles.
    ComparisonBlock of FoundBlock;
    properties {
        /// The setting in words.
        setting = |of, py| given(py, setting_name(&of.block().setting));
        /// The methods, in the order that they were named in.
        methods = |of, py| given(py, of.block().results.iter().map(|c| c.method.name()).collect::<Vec<_>>());
        /// The methods, the lowest median cost first.
        ranking = |of, py| given(py, ranking(of.block()));
        /// By method the final cost of each run, shape (runs,); inf where every candidate diverged.
        costs = |of, py| of.by_method(py, |result| given(py, array(py, result.costs())));
        /// By method what each run found, shape (runs, 5): R, L, K, B, J in SI units; nan where every candidate diverged.
        parameters = |of, py| of.by_method(py, |result| parameters(py, result));
        /// By method the lowest cost after each generation of each run, shape (runs, generations); nan after an early end.
        histories = |of, py| of.by_method(py, |result| histories(py, result));
        /// By method the candidates that each run evaluated, shape (runs,).
        evaluations = |of, py| of.by_method(py, |result| evaluations(py, result));
        /// By method the seconds of one run by itself; `None` after an early end.
        seconds = |of, py| of.by_method(py, |result| given(py, result.seconds));
    }
    methods {
        /// Lowest cost by generation: median and quartiles over runs.
        plot_convergence = |of, py| given(py, Svg::from(figures::convergence(&of.id(), of.block())));
        /// Relative errors of the parameters over runs; `None` where nothing is known that they could be errors of.
        plot_errors = |of, py| given(py, figures::errors(&of.id(), &of.compared, of.block()).map(Svg::from));
        /// Distributions of final costs, and of targets reached by evaluations and by time.
        plot_distributions = |of, py| given(py, Svg::from(figures::distributions(&of.id(), &of.compared, of.block())));
        /// Final costs of all runs in order.
        plot_waterfall = |of, py| given(py, Svg::from(figures::waterfall(&of.id(), of.block())));
        __repr__ = |of, py| given(py, of.repr());
    }
    own {}
}

impl Comparison {
    /// A comparison that was made here.
    pub fn new(compared: Compared, paper: bool) -> Self {
        let text = json(&compare_document(&compared, paper));
        Self(Held::Here(Found { compared: Arc::new(compared), text }))
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

/// A motor by the symbols of its parameters.
fn motor<'py>(py: Python<'py>, motor: Option<&Parameters>) -> Answer<'py> {
    let Some(motor) = motor else { return given(py, py.None()) };
    let all = PyDict::new(py);
    for parameter in Parameter::ALL {
        all.set_item(parameter.symbol(), motor.get(parameter))?;
    }
    Ok(all.into_any())
}
