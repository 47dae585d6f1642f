//! The main job: recordings in, R, L, K, B, J out.
//!
//! A population search minimizes the criterion over the space, every generation evaluated at once. The winner is
//! evaluated again by the scalar oracle, and its simulation gives the fit to each channel.

mod device;
mod warnings;

pub use device::{DeviceSpec, PrecisionSpec};
pub use warnings::{Warning, record_warnings};

use crate::candidates::Candidates;
use crate::criterion::{Criterion, mean};
use crate::evaluate::{Model, Problem, Scalar};
use crate::motor::{Parameter, Parameters, Scope, Space, simulate};
use crate::optimize::{
    Budget, Genetic, GeneticOptions, Gwo, GwoOptions, Jaya, JayaOptions, Optimizer, Progress, Random, Run, Setup, Stop,
    minimize,
};
use crate::record::Record;
use crate::{Error, ErrorKind, Result};
use device::Evaluation;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;
use warnings::{poor_fit, warnings_of};

/// How the optimum is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// Grey Wolf Optimizer.
    Gwo(GwoOptions),
    /// Jaya.
    Jaya(JayaOptions),
    /// Genetic algorithm.
    Genetic(GeneticOptions),
    /// Random search.
    Random,
}

impl Method {
    /// Its name in flags and results.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Gwo(_) => "gwo",
            Self::Jaya(_) => "jaya",
            Self::Genetic(_) => "ga",
            Self::Random => "random",
        }
    }

    /// A new run of it.
    ///
    /// # Errors
    /// `Usage` for settings that cannot be.
    pub fn optimizer(&self, setup: Setup) -> Result<Box<dyn Optimizer>> {
        Ok(match *self {
            Self::Gwo(options) => Box::new(Gwo::new(setup, options)?),
            Self::Jaya(options) => Box::new(Jaya::new(setup, options)?),
            Self::Genetic(options) => Box::new(Genetic::new(setup, options)?),
            Self::Random => Box::new(Random::new(setup)?),
        })
    }
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifySpec {
    /// How the optimum is searched.
    pub method: Method,
    /// Agents.
    pub population: usize,
    /// Generations, the first population included.
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// What is minimized.
    pub criterion: Criterion,
    /// How the motor is simulated.
    pub model: Model,
    /// What is free within which bounds, and what is held.
    pub space: Space,
    /// What evaluates.
    pub device: DeviceSpec,
    /// With which numbers.
    pub precision: PrecisionSpec,
    /// Threads; `None` takes the rayon pool of the caller.
    pub threads: Option<usize>,
}

impl Default for IdentifySpec {
    fn default() -> Self {
        Self {
            method: Method::Gwo(GwoOptions::default()),
            population: 100,
            generations: 100,
            seed: 1,
            criterion: Criterion::default(),
            model: Model::default(),
            space: Space::table2(),
            device: DeviceSpec::default(),
            precision: PrecisionSpec::default(),
            threads: None,
        }
    }
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The parameters, those held included.
    pub parameters: Parameters,
    /// Their cost in the chosen criterion, by the scalar oracle.
    pub cost: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed over all recordings; `None` for a channel not measured.
    pub fit_percent: [Option<f64>; 2],
    /// What the reader should know.
    pub warnings: Vec<Warning>,
    /// Why the search ended.
    pub stop: Stop,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Lowest cost after each generation.
    pub history: Vec<f64>,
    /// What evaluated: cpu or gpu.
    pub device_kind: &'static str,
    /// Its name.
    pub device: String,
    /// The numbers of the evaluation.
    pub precision: &'static str,
    /// The winner's cost by the device less that by the oracle; `None` where the CPU evaluated.
    pub cost_difference: Option<f64>,
    /// Seconds of the estimation alone.
    pub seconds: f64,
}

/// Identifies one motor from one or more recordings (several: one joint fit).
///
/// # Errors
/// As [`identify_with`].
pub fn identify(records: &[Record], spec: &IdentifySpec) -> Result<Identification> {
    identify_with(records, spec, &mut |_| ControlFlow::Continue(()))
}

/// Like [`identify`], watched: `observe` sees every generation and may end the search, whose best is then returned.
///
/// # Errors
/// `Usage` for a spec that cannot be; `NotIdentified` when a signal is constant, nothing drives the motor, nothing
/// counts in the criterion, there are fewer measured values than parameters, or every candidate diverges.
pub fn identify_with(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
) -> Result<Identification> {
    let pool = spec.threads.map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build()).transpose();
    let pool = pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), "Give fewer --threads."))?;
    // The whole search runs inside the pool: its threads then need no waking between generations.
    match pool {
        Some(pool) => pool.install(|| search(records, spec, observe)),
        None => rayon::scope(|_| search(records, spec, observe)),
    }
}

fn search(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Identification> {
    let started = Instant::now();
    let problem = Arc::new(Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?);
    check_determined(records, &problem)?;
    let &IdentifySpec { population, generations, seed, .. } = spec;
    let setup = Setup { bounds: spec.space.bounds(), population, generations, seed, run: 0 };
    let mut runs = [Run::new(spec.method.optimizer(setup)?)];
    let mut evaluation = Evaluation::new(spec, &problem)?;
    let slice = (evaluation.slice_steps() / problem.active().max(1)).max(1);
    let mut evaluate =
        |populations: &[Candidates<'_>], costs: &mut [f64]| evaluation.evaluate(&problem, populations, costs);
    let budget = Budget { generations, slice };
    let stop = minimize(&mut runs, budget, &mut evaluate, observe)?;
    let [run] = runs;
    let best = run.optimizer.best().filter(|best| Scalar::cost(&problem, best.values).is_finite());
    let Some(best) = best else {
        return Err(not_identified(
            format!("all {} candidates diverge", run.evaluations),
            "Check the units of the recording and --bounds; --discretization zoh cannot diverge by itself.",
        ));
    };
    let parameters = problem.parameters(best.values, 0);
    let cost = Scalar::cost(&problem, best.values);
    let fit_percent = fit_percent(records, &problem, best.values);
    let mut warnings = warnings_of(records, spec);
    let cost_difference = evaluation.cost_difference(&problem, best.values);
    warnings.append(&mut evaluation.warnings);
    warnings.extend(spec.space.free().iter().filter_map(|axis| at_bound(spec, axis.parameter, &parameters)).map(
        |(parameter, side)| Warning {
            code: "at_bound",
            message: format!("{} ended at its {side} bound; widen it with --bounds", parameter.symbol()),
        },
    ));
    warnings.extend(poor_fit(fit_percent));
    Ok(Identification {
        parameters,
        cost,
        fit_percent,
        warnings,
        stop,
        evaluations: run.evaluations,
        history: run.history,
        device_kind: evaluation.kind(),
        device: evaluation.name(),
        precision: evaluation.precision(),
        cost_difference,
        seconds: started.elapsed().as_secs_f64(),
    })
}

fn not_identified(message: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::NotIdentified, message, remedy)
}

/// Whether the recordings and the criterion leave anything to be found at all.
fn check_determined(records: &[Record], problem: &Problem) -> Result<()> {
    let values: usize =
        records.iter().zip(problem.signals()).map(|(r, s)| s.active() * r.measured().iter().flatten().count()).sum();
    let free = problem.space().free().len();
    if values == 0 {
        return Err(not_identified(
            "nothing drives the motor: voltage and load torque are zero throughout and it starts at rest",
            "Record while the voltage changes.",
        ));
    }
    if values <= free {
        return Err(not_identified(
            format!("{values} measured values under voltage for {free} free parameters"),
            "Record longer or faster, or hold parameters with --fix.",
        ));
    }
    if !problem.has_weight() {
        return Err(not_identified(
            "no sample counts: --time-origin is at or after the end of the recording",
            "Give --time-origin in seconds from the start of the recording.",
        ));
    }
    Ok(())
}

/// The bound, `min` or `max`, that a free parameter ended at: nearer to it than 1e-4 of the range and 1 % of itself.
#[must_use]
pub fn at_bound(spec: &IdentifySpec, parameter: Parameter, found: &Parameters) -> Option<(Parameter, &'static str)> {
    let axis = spec.space.free().iter().find(|axis| axis.parameter == parameter && axis.scope == Scope::Shared)?;
    let (value, near) = (found.get(parameter), 1e-4 * (axis.max - axis.min));
    let side = if value - axis.min <= near && value <= 1.01 * axis.min {
        "min"
    } else if axis.max - value <= near {
        "max"
    } else {
        return None;
    };
    Some((parameter, side))
}

/// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) per channel, norms over all recordings.
fn fit_percent(records: &[Record], problem: &Problem, candidate: &[f64]) -> [Option<f64>; 2] {
    let mut squares = [[0.0; 2]; 2];
    let mut seen = [false; 2];
    for (recording, (record, signals)) in records.iter().zip(problem.signals()).enumerate() {
        let parameters = problem.parameters(candidate, recording);
        let model = simulate(&parameters, &signals.drive(), signals.initial(), problem.model().discretization);
        for (channel, (measured, simulated)) in
            record.measured().into_iter().zip([model.current, model.speed]).enumerate()
        {
            let Some(measured) = measured else { continue };
            seen[channel] = true;
            let mean = mean(measured);
            for (y, y_hat) in measured.iter().zip(simulated) {
                squares[channel][0] += (y - y_hat) * (y - y_hat);
                squares[channel][1] += (y - mean) * (y - mean);
            }
        }
    }
    [0, 1].map(|channel| {
        let [error, total] = squares[channel];
        let percent = 100.0 * (1.0 - (error / total).sqrt());
        (seen[channel] && percent.is_finite()).then_some(percent)
    })
}
