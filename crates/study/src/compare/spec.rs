//! Settings and subjects of a comparison.

use motorfit_core::named::named;
use motorfit_evaluate::criterion::{Criterion, Norm, Scale};
use motorfit_evaluate::{Initial, Model};
use motorfit_identify::device::{DeviceSpec, EvaluatorSpec, PrecisionSpec, ThroughputProfile};
use motorfit_identify::{IdentifySpec, Method};
use motorfit_motor::{Discretization, Space};
use motorfit_optimize::{Coordinates, GeneticOptions, GwoOptions, JayaOptions};

/// A setting under which all methods are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparisonSetting {
    /// Criterion that the searches minimize.
    pub criterion: Criterion,
    /// Candidates per generation.
    pub population: usize,
    /// Number of generations, the initial population included.
    pub generations: usize,
    /// Search methods with their hyperparameters.
    pub methods: Vec<Method>,
    /// Coordinates in which the searches move their candidates.
    pub coordinates: Coordinates,
}

impl ComparisonSetting {
    /// Returns the paper's setting: bounds of Table 2, hyperparameters of Table 3, and Eq. 13 over channels divided by
    /// `scale`.
    #[must_use]
    pub fn paper(scale: Scale) -> Self {
        Self {
            criterion: Criterion { norm: Norm::Euclidean, scale, ..Criterion::default() },
            population: 100,
            generations: 100,
            methods: vec![
                GwoOptions::default().into(),
                JayaOptions::default().into(),
                GeneticOptions::default().into(),
            ],
            coordinates: Coordinates::None,
        }
    }
}

named! {
    /// A complete set of settings.
    pub enum Preset (default Paper) {
        /// Tables 2 and 3, 100 agents × 100 generations; euclidean with scale peak, and with scale none as printed.
        Paper = "paper",
    }
}

/// Settings of a comparison of methods.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareSpec {
    /// Settings to compare under, each of which gives a block of results.
    pub settings: Vec<ComparisonSetting>,
    /// Number of runs of each method.
    pub runs: usize,
    /// Seed of the random numbers; those of a run depend on the seed and the number of the run.
    pub seed: u64,
    /// Simulation of the DC motor; a user's model has its own.
    pub model: Model,
    /// Space of the free parameters of the DC motor with their bounds, and the fixed values; a user's model has its own.
    pub space: Space,
    /// True if Steiglitz–McBride, a method of the DC motor, is compared too.
    pub steiglitz_mcbride: bool,
    /// Number of records with new noise over which the spread of Steiglitz–McBride, which has no seeds, is computed.
    pub noise_records: usize,
    /// Signal-to-noise ratio of these records if the motor is simulated \[dB\]; otherwise their noise is that of the
    /// residuals.
    pub noise_db: f64,
    /// Target cost of a run; `None` for a range of targets from the first generations down to the lowest cost.
    pub target: Option<f64>,
    /// Device that evaluates; `auto` is the CPU for a user's model.
    pub device: DeviceSpec,
    /// Floating-point precision of the evaluation.
    pub precision: PrecisionSpec,
    /// Evaluator of costs on the CPU.
    pub evaluator: EvaluatorSpec,
    /// Throughput measured on this machine, by which `auto` chooses the device.
    pub throughput_profile: Option<ThroughputProfile>,
}

impl Default for CompareSpec {
    fn default() -> Self {
        let criterion = Criterion::default();
        Self {
            settings: vec![ComparisonSetting { criterion, ..ComparisonSetting::paper(Scale::Std) }],
            runs: 50,
            seed: 1,
            model: Model { discretization: Discretization::Zoh, initial: Initial::Auto },
            space: Space::table2(),
            steiglitz_mcbride: true,
            noise_records: 200,
            noise_db: 60.0,
            target: None,
            device: DeviceSpec::default(),
            precision: PrecisionSpec::default(),
            evaluator: EvaluatorSpec::default(),
            throughput_profile: None,
        }
    }
}

impl CompareSpec {
    /// Returns the paper's settings: channels divided by their peaks, which reproduces its tables, and Eq. 13 as
    /// printed.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            settings: vec![ComparisonSetting::paper(Scale::Peak), ComparisonSetting::paper(Scale::None)],
            ..Self::default()
        }
    }

    /// Returns the settings by which the device is chosen, with `population` candidates per generation.
    pub(super) fn search(&self, population: usize, generations: usize) -> IdentifySpec {
        IdentifySpec {
            population,
            generations,
            device: self.device.clone(),
            precision: self.precision,
            evaluator: self.evaluator,
            throughput_profile: self.throughput_profile.clone(),
            ..IdentifySpec::default()
        }
    }
}
