//! The spec of an identification: what is asked for.

use super::method::{Method, Polish};
use crate::criterion::Criterion;
use crate::device::{DeviceSettings, DeviceSpec, PrecisionSpec, ThroughputProfile};
use crate::evaluate::Model;
use crate::motor::{Parameter, Space, With};
use crate::optimize::SearchSettings;

/// Settings of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifySpec {
    /// The method that finds the optimum.
    pub method: Method,
    /// The refinement.
    pub polish: Polish,
    /// Agents.
    pub population: usize,
    /// Generations, the first population included.
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The criterion of a population search.
    pub criterion: Criterion,
    /// The simulation model.
    pub model: Model,
    /// True where `auto` extensions may take another course of the voltage between samples than the model's: a line, or a
    /// value that is held.
    pub auto_discretization: bool,
    /// Free parameters with their bounds, and fixed ones.
    pub space: Space,
    /// Parameters whose bounds become a decade to each side of the Steiglitz–McBride estimate, where there is one.
    pub auto_bounds: Vec<Parameter>,
    /// Extensions of the motor whose parameters the space may lack: they get bounds from the recordings.
    pub with: With,
    /// Parameters that each recording of a joint fit has for itself; a start latency always is one.
    pub per_recording: Vec<Parameter>,
    /// The device that evaluates a population.
    pub device: DeviceSpec,
    /// With which numbers.
    pub precision: PrecisionSpec,
    /// Throughput measured on this machine, for `auto`; `None` takes conservative limits.
    pub paces: Option<ThroughputProfile>,
    /// Threads; `None` takes the rayon pool of the caller.
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
            paces: None,
            threads: None,
        }
    }
}

impl IdentifySpec {
    /// Returns whether more than the linear motor is asked for: extensions, or parameters of single recordings.
    #[must_use]
    pub fn is_extended(&self) -> bool {
        self.with != With::default() || !self.space.features().is_linear() || !self.per_recording.is_empty()
    }

    /// Returns whether the result is refined.
    #[must_use]
    pub fn is_polished(&self) -> bool {
        self.polish == Polish::LevenbergMarquardt
    }

    /// Returns the settings of a population search in a space.
    pub(super) fn search(&self, space: &Space) -> SearchSettings {
        let &Self { population, generations, seed, .. } = self;
        SearchSettings { bounds: space.bounds(), population, generations, seed, run: 0 }
    }

    /// Returns the value that a parameter is fixed at.
    pub(super) fn fixed(&self, parameter: Parameter) -> Option<f64> {
        self.space.fixed().iter().find(|(p, _, _)| *p == parameter).map(|(_, _, value)| *value)
    }
}

impl From<&IdentifySpec> for DeviceSettings {
    fn from(spec: &IdentifySpec) -> Self {
        Self {
            device: spec.device.clone(),
            precision: spec.precision,
            paces: spec.paces.clone(),
            threads: spec.threads,
            population: spec.population,
            generations: spec.generations,
        }
    }
}
