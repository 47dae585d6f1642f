//! The file of a suite, and the problems that it defines.

use motorfit_core::named::{Named as _, named};
use motorfit_core::numeric::{count, median, sorted};
use motorfit_core::{Error, Result};
use motorfit_estimate::descend;
use motorfit_evaluate::criterion::{Criterion, Noise};
use motorfit_evaluate::experiment::{Excitation, Shape, noise_of, simulated, with_noise};
use motorfit_evaluate::{Initial, Model, Problem, Scalar};
use motorfit_motor::{Axis, Discretization, Extended, Parameter, Parameters, Scope, Space};
use motorfit_optimize::{Sample, Sampling};
use motorfit_record::{Record, Samples};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::Arc;

named! {
    /// A suite of problems with known optima.
    pub enum Suite (default Motors) {
        /// 33 problems of six motors: excitations, noise, channels, extensions, boxes of one to four decades.
        Motors = "motors",
    }
}

/// A problem of a suite.
#[derive(Debug, Clone)]
pub struct SuiteProblem {
    /// Name.
    pub name: String,
    /// Recording, space and criterion.
    pub problem: Arc<Problem>,
    /// True values of the free parameters.
    pub truth: Vec<f64>,
    /// Values at the known optimum: those of a refinement that begins at the truth.
    pub optimum: Vec<f64>,
    /// Cost at the known optimum.
    pub optimum_cost: f64,
    /// Median cost of random candidates in the box.
    pub random_cost: f64,
}

impl SuiteProblem {
    /// Returns the relative gap of a cost: its excess over that of the known optimum, relative to that of random candidates; 0 at the
    /// optimum, about 1 for a random candidate.
    #[must_use]
    pub fn gap(&self, cost: f64) -> f64 {
        (cost - self.optimum_cost) / (self.random_cost - self.optimum_cost)
    }

    /// Returns the cost at a relative gap.
    #[must_use]
    pub fn cost(&self, gap: f64) -> f64 {
        self.optimum_cost + gap * (self.random_cost - self.optimum_cost)
    }
}

/// Number of random candidates whose median cost is the unit of gaps.
const RANDOM: u64 = 1001;
/// Evaluations of the refinement that finds the optimum.
const EVALUATIONS: u64 = 20_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    version: u32,
    motors: BTreeMap<String, BTreeMap<String, f64>>,
    problem: Vec<Definition>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Drive {
    shape: String,
    volts: f64,
    hold: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Definition {
    name: String,
    motor: String,
    input: Drive,
    samples: usize,
    period_s: f64,
    noise_db: Option<f64>,
    #[serde(default)]
    seed: u64,
    channels: Vec<String>,
    criterion: Option<String>,
    #[serde(default)]
    with: BTreeMap<String, f64>,
    bounds: BTreeMap<String, [f64; 2]>,
}

impl Suite {
    /// Returns the text of the file that defines the suite.
    #[must_use]
    pub fn definition(self) -> &'static str {
        match self {
            Self::Motors => include_str!("motors.toml"),
        }
    }

    fn file(self) -> Result<File> {
        let parsed = toml::from_str(self.definition());
        parsed.map_err(|error| invalid(&format!("the suite {} is not valid: {error}", self.name())))
    }

    /// Returns the version of the suite.
    ///
    /// # Errors
    /// Returns a `Data` error if the file of the suite is not valid.
    pub fn version(self) -> Result<u32> {
        Ok(self.file()?.version)
    }

    /// Simulates the recordings of the suite, and computes the optimum of each problem.
    ///
    /// # Errors
    /// Returns a `Data` or `Usage` error if the file of the suite is not valid.
    pub fn problems(self) -> Result<Vec<SuiteProblem>> {
        let file = self.file()?;
        if file.name != self.name() {
            return Err(invalid(&format!("found the suite {}, expected {}", file.name, self.name())));
        }
        let problem = |definition: &Definition| {
            let motor = file.motors.get(&definition.motor);
            let motor = motor.ok_or_else(|| invalid(&format!("{}: there is no such motor", definition.name)))?;
            definition.problem(motor)
        };
        file.problem.iter().map(problem).collect()
    }
}

fn invalid(message: &str) -> Error {
    Error::data(message, "This is a fault of this program: please report it.")
}

impl Definition {
    fn problem(&self, motor: &BTreeMap<String, f64>) -> Result<SuiteProblem> {
        let truth: BTreeMap<&String, f64> = motor.iter().chain(&self.with).map(|(symbol, v)| (symbol, *v)).collect();
        let mut extended = Extended::from(&Parameters::M2);
        let mut free = Vec::new();
        let mut values = Vec::new();
        for parameter in Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS) {
            let symbol = parameter.symbol().to_owned();
            let (value, bounds) = match (truth.get(&symbol), self.bounds.get(&symbol)) {
                (Some(value), Some(bounds)) => (*value, *bounds),
                (None, None) if parameter.is_extension() => continue,
                _ => return Err(invalid(&format!("{}: {symbol} needs a value and bounds", self.name))),
            };
            extended.set(parameter, value);
            values.push(value);
            free.push(Axis { parameter, scope: Scope::Shared, min: bounds[0], max: bounds[1] });
        }
        let criterion = self.criterion.as_deref().map_or(Ok(Criterion::default()), str::parse)?;
        let model = Model { discretization: Discretization::Zoh, initial: Initial::Zero };
        let space = Space::new(free, Vec::new())?;
        let problem = Problem::new(&[self.record(extended)?], model, space, criterion)?;
        of(self.name.clone(), problem, values)
    }

    fn record(&self, motor: Extended) -> Result<Record> {
        let Drive { shape, volts, hold } = &self.input;
        let excitation = Excitation {
            time_s: (0..self.samples).map(|n| count(n) * self.period_s).collect(),
            voltage: Shape::named("shape", shape)?.voltage(*volts, *hold, self.samples),
            torque: None,
        };
        let clean = simulated(motor, &excitation, Discretization::Zoh)?;
        let noisy = match self.noise_db {
            None => clean,
            Some(decibels) => with_noise(&clean, noise_of(&clean, Noise::Decibels(decibels)), self.seed)?,
        };
        let Samples { time_s, voltage, torque, current, speed, .. } = noisy.samples().clone();
        let measured =
            |name: &str, signal: Option<Vec<f64>>| signal.filter(|_| self.channels.iter().any(|c| c == name));
        let (current, speed) = (measured("current", current), measured("speed", speed));
        Record::new(Samples { time_s, voltage, torque, current, speed, ..Samples::default() })
    }
}

/// Returns a problem with its optimum and the cost of random candidates.
fn of(name: String, problem: Problem, truth: Vec<f64>) -> Result<SuiteProblem> {
    let at_truth = Scalar::cost(&problem, &truth);
    let (values, cost, _) = descend(&problem, &truth, EVALUATIONS);
    let (optimum, optimum_cost) = if cost < at_truth { (values, cost) } else { (truth.clone(), at_truth) };
    let sample = Sample::new(Sampling::Uniform, RANDOM, problem.space().bounds(), 1)?;
    let mut points = vec![0.0; motorfit_core::numeric::index(RANDOM) * truth.len()];
    sample.fill(0, &mut points);
    let costs: Vec<f64> = points.chunks(truth.len()).map(|point| Scalar::cost(&problem, point)).collect();
    let random_cost = median(&sorted(&costs));
    if !(optimum_cost.is_finite() && random_cost > optimum_cost && random_cost.is_finite()) {
        return Err(invalid(&format!("{name}: the optimum or random candidates have no cost")));
    }
    Ok(SuiteProblem { name, problem: Arc::new(problem), truth, optimum, optimum_cost, random_cost })
}
