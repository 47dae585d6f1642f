//! The specification of an identification: method, criterion, model, search space and device.

use super::method::{Method, Polish};
use crate::device::{DeviceSettings, DeviceSpec, EvaluatorSpec, PrecisionSpec, ThroughputProfile};
use motorfit_evaluate::Model;
use motorfit_evaluate::criterion::Criterion;
use motorfit_motor::{Parameter, Space, With};
use motorfit_optimize::SearchSettings;

/// Settings of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifySpec {
    /// Method that finds the first optimum.
    pub method: Method,
    /// Refinement of the first optimum.
    pub polish: Polish,
    /// Number of candidates in the population.
    pub population: usize,
    /// Number of generations, the initial population included.
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Criterion that a population search minimizes.
    pub criterion: Criterion,
    /// Simulation model.
    pub model: Model,
    /// True if [`With::Auto`] may replace the intersample behaviour of the model: a zero-order hold by a first-order hold,
    /// or the reverse.
    pub auto_discretization: bool,
    /// Free parameters with their bounds, and fixed ones.
    pub space: Space,
    /// Parameters whose bounds are set to one decade on each side of the Steiglitz–McBride estimate if there is one.
    pub auto_bounds: Vec<Parameter>,
    /// Extensions of the motor model. Parameters of theirs that the space lacks get bounds from the recordings.
    pub with: With,
    /// Parameters with one value per recording in a joint fit. The start latency always has one value per recording.
    pub per_recording: Vec<Parameter>,
    /// Device that evaluates a population.
    pub device: DeviceSpec,
    /// Floating-point precision of the evaluation.
    pub precision: PrecisionSpec,
    /// Evaluator of costs on the CPU.
    pub evaluator: EvaluatorSpec,
    /// Throughput measured on this machine, used to select a device automatically; `None` uses conservative limits.
    pub throughput_profile: Option<ThroughputProfile>,
    /// Number of threads; `None` uses the rayon pool of the caller.
    pub threads: Option<usize>,
}

impl Default for IdentifySpec {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            polish: Polish::LevenbergMarquardt,
            population: 100,
            generations: 100,
            seed: 1,
            criterion: Criterion::default(),
            model: Model::default(),
            auto_discretization: true,
            space: Space::table2(),
            auto_bounds: Parameter::ALL.to_vec(),
            with: With::default(),
            per_recording: Vec::new(),
            device: DeviceSpec::default(),
            precision: PrecisionSpec::default(),
            evaluator: EvaluatorSpec::default(),
            throughput_profile: None,
            threads: None,
        }
    }
}

impl IdentifySpec {
    /// Returns true if the spec goes beyond the linear motor: with extensions, or with parameters of single recordings.
    #[must_use]
    pub fn is_extended(&self) -> bool {
        self.with != With::default() || !self.space.features().is_linear() || !self.per_recording.is_empty()
    }

    /// Returns true if the result is refined.
    #[must_use]
    pub fn is_polished(&self) -> bool {
        self.polish == Polish::LevenbergMarquardt
    }

    /// Returns the spec with the kernel in place of an automatic choice of the evaluator on the CPU: for few candidates at a time, or
    /// where the last digits of costs count.
    #[must_use]
    pub fn by_kernel(self) -> Self {
        let is_on_cpu = matches!(self.device, DeviceSpec::Auto | DeviceSpec::Cpu);
        match self.evaluator {
            EvaluatorSpec::Auto if is_on_cpu => Self { evaluator: EvaluatorSpec::Kernel, ..self },
            _ => self,
        }
    }

    /// Returns the settings of a population search over `space`.
    pub(super) fn search(&self, space: &Space) -> SearchSettings {
        let &Self { population, generations, seed, .. } = self;
        let (bounds, coordinates) = (space.bounds(), self.method.coordinates());
        SearchSettings { bounds, population, generations, seed, coordinates, ..SearchSettings::default() }
    }

    /// Returns the value at which a parameter is fixed; `None` if it is free.
    pub(super) fn fixed(&self, parameter: Parameter) -> Option<f64> {
        self.space.fixed().iter().find(|(p, _, _)| *p == parameter).map(|(_, _, value)| *value)
    }
}

impl From<&IdentifySpec> for DeviceSettings {
    fn from(spec: &IdentifySpec) -> Self {
        Self {
            device: spec.device.clone(),
            precision: spec.precision,
            evaluator: spec.evaluator,
            throughput_profile: spec.throughput_profile.clone(),
            threads: spec.threads,
            population: spec.population,
            generations: spec.generations,
            needs_all_costs: false,
        }
    }
}
