//! Subjects of a comparison.

use crate::Result;
use crate::criterion::{Criterion, Norm, Scale};
use crate::device::{DeviceSpec, PrecisionSpec, ThroughputProfile};
use crate::evaluate::{Initial, Model};
use crate::experiment::{Excitation, simulated};
use crate::identify::{IdentifySpec, Method};
use crate::motor::{Discretization, Parameters, Space};
use crate::named::named;
use crate::optimize::{GeneticOptions, GwoOptions, JayaOptions};
use crate::record::Record;

/// A setting that all methods are compared under.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The criterion.
    pub criterion: Criterion,
    /// Agents of a run.
    pub population: usize,
    /// Generations of a run, the first population included.
    pub generations: usize,
    /// The searches, with their own settings.
    pub methods: Vec<Method>,
}

impl Setting {
    /// The paper's: Tables 2 and 3, Eq. 13 over channels divided by `scale`.
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
        }
    }
}

named! {
    /// A set-up that is complete.
    pub enum Preset (default Paper) {
        /// Tables 2 and 3, 100 agents × 100 generations; euclidean with scale peak, and with scale none as printed.
        Paper = "paper",
    }
}

/// The motor that methods are compared on.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Its recordings.
    pub records: Vec<Record>,
    /// Its parameters, where they are known: of a simulated motor.
    pub truth: Option<Parameters>,
}

impl Subject {
    /// The paper's experiment: the M2 motor at rest, 10.5 V from 1 s on, 3 s in steps of 1 ms, without noise.
    ///
    /// # Errors
    /// Never in fact.
    pub fn m2() -> Result<Self> {
        let step = Excitation::step(10.5, 1.0, 3.0, 0.001)?;
        let record = simulated(&Parameters::M2, &step, Discretization::Zoh)?;
        Ok(Self { records: vec![record], truth: Some(Parameters::M2) })
    }
}

/// Settings of a comparison of methods.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareSpec {
    /// One block of results each.
    pub settings: Vec<Setting>,
    /// Runs of each method.
    pub runs: usize,
    /// Seed of all of them.
    pub seed: u64,
    /// The simulation model.
    pub model: Model,
    /// The space of free parameters with their bounds.
    pub space: Space,
    /// True if Steiglitz–McBride stands beside the searches.
    pub steiglitz_mcbride: bool,
    /// Records with new noise that it, which has no seeds, is run on for its spread.
    pub noise_records: usize,
    /// Their noise, where the motor is simulated \[dB\]; else it is that of the residuals.
    pub noise_db: f64,
    /// A cost that a run is to reach; `None` takes a range of targets between the first generations and the best.
    pub target: Option<f64>,
    /// The device that evaluates.
    pub device: DeviceSpec,
    /// With which numbers.
    pub precision: PrecisionSpec,
    /// Throughput measured on this machine, for `auto`.
    pub paces: Option<ThroughputProfile>,
}

impl Default for CompareSpec {
    fn default() -> Self {
        let criterion = Criterion::default();
        Self {
            settings: vec![Setting { criterion, ..Setting::paper(Scale::Std) }],
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
            paces: None,
        }
    }
}

impl CompareSpec {
    /// The paper's set-up: channels divided by their peaks, which is what its tables show, and Eq. 13 as it is printed.
    #[must_use]
    pub fn paper() -> Self {
        Self { settings: vec![Setting::paper(Scale::Peak), Setting::paper(Scale::None)], ..Self::default() }
    }

    /// Returns the settings by which the device is chosen: so many candidates a generation.
    pub(super) fn search(&self, population: usize, generations: usize) -> IdentifySpec {
        IdentifySpec {
            population,
            generations,
            device: self.device.clone(),
            precision: self.precision,
            paces: self.paces.clone(),
            ..IdentifySpec::default()
        }
    }
}
